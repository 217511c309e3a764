use super::*;
use std::fmt::Write;
use std::time::{Duration, Instant};

/// Something of everything.
const RICH: &str = "\u{feff}# comment\nmtllib a.mtl\no x\nv 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .2 0\nvt 0 0\n\
    vt 1e0 .5\nvn 0 0 1\ng a b\ns 1\nusemtl m\nf 1/1/1 2/2/1 3//1 \\\n 4\nf 5 1 2 3 4\ns off\nf -1 -2 -3\nl 1 2 3\np 1 2\n\
    usemtl n\nf 1/1 2/2 3/1\n";

#[test]
fn no_cut_and_no_changed_byte_makes_it_panic() {
    let bytes = RICH.as_bytes();
    assert!(try_import(bytes).is_ok());
    for end in 0..bytes.len() {
        let _ = try_import(&bytes[..end]);
    }
    let mut changed = bytes.to_vec();
    for i in 0..bytes.len() {
        for value in [0, b'\n', b'\r', b' ', b'\\', b'/', b'-', b'0', b'9', b'#', b'f', b'v', 0x80, 0xff, bytes[i] ^ 1]
        {
            changed[i] = value;
            let _ = try_import(&changed);
        }
        changed[i] = bytes[i];
    }
}

#[test]
fn materials_survive_any_cut_and_changed_byte() {
    use crate::import::budget::Budget;
    use crate::import::files::Files;
    use crate::import::obj::mtl;
    use crate::import::warning::Warnings;
    let text = b"newmtl a b\nKd 1 0.5 .25\nKs spectral f.rfl 1\nNs 1e3\nTr .5\nd -halo 0.1\nillum 7\nNi 1.5\nTf 1 1 1\n\
        map_Kd -s 1 2 3 -o 1 -clamp on \"a b.png\" -bm 2\nnorm -bm x n\\ m.png\nmap_Pr r.png\nmap_Pm r.png\nPc 1\naniso 1\n";
    let run = |text: &[u8]| {
        let (budget, mut warnings) = (Budget::new(1 << 20), Warnings::default());
        let files = Files::new(None, false, &budget);
        let mut scene = Scene::default();
        for definition in mtl::parse(text, "m.mtl", &budget, &mut warnings).unwrap() {
            mtl::Converter::new(&mut scene, &files, &mut warnings).add(definition, "m.mtl").unwrap();
        }
        for (_, m) in scene.materials().iter() {
            let in_range = |v: f64| (0.0..=1.0).contains(&v);
            assert!(m.base_color.into_iter().chain(m.emissive).chain([m.metallic, m.roughness]).all(in_range), "{m:?}");
        }
    };
    let mut changed = text.to_vec();
    for i in 0..text.len() {
        run(&text[..i]);
        for value in [0, b'\n', b' ', b'\\', b'"', b'-', b'9', b'#', b'e', 0xff] {
            changed[i] = value;
            run(&changed);
        }
        changed[i] = text[i];
    }
}

/// Files made to be slow are not.
fn in_time(what: &str, text: &str) {
    let start = Instant::now();
    let _ = try_import(text);
    assert!(start.elapsed() < Duration::from_secs(20), "{what} took {:?}", start.elapsed());
}

#[test]
fn files_made_to_be_slow_are_not() {
    let mut one_position = String::from("v 0 0 0\n");
    for i in 0..50_000 {
        writeln!(one_position, "vn 1 {i} 0\nf 1//-1 1//-1 1//-1").unwrap();
    }
    in_time("one position with many normals", &one_position);

    let mut spiral = String::new();
    let (mut x, mut y) = (0.0f64, 0.0f64);
    for i in 0..20_000 {
        let step = f64::from(i / 2 + 1);
        match i % 4 {
            0 => x += step,
            1 => y += step,
            2 => x -= step,
            _ => y -= step,
        }
        writeln!(spiral, "v {x} {y} 0").unwrap();
    }
    let face: String = (1..=20_000).map(|i| format!(" {i}")).collect();
    in_time("a spiral", &format!("{spiral}f{face}\n"));

    let mut random = String::new();
    let mut state = 1u32;
    for _ in 0..20_000 {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        writeln!(random, "v {} {} 0", state >> 16, state & 0xffff).unwrap();
    }
    in_time("a polygon that crosses itself everywhere", &format!("{random}f{face}\n"));

    let materials: String = (0..20_000).map(|i| format!("usemtl {i}\nf 1 2 3\n")).collect();
    in_time("many materials over many positions", &format!("{}{materials}", "v 0 0 0\n".repeat(100_000)));
    in_time("a long line", &format!("{TRIANGLE}# {}\nf {}", "x".repeat(1 << 20), "1 2 3 ".repeat(1 << 18)));
    in_time("many groups", &"g a\ns 3\no b\n".repeat(100_000));
}
