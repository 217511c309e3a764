//! Frames without light transport.

use crate::arenas::{Recipe, UNIT};
use crate::{Mode, Turns, aov, assert_silent, both, device, frame, render};
use orthant_resident::frame::Aov;
use orthant_resident::world::view::EXHAUSTED_COLOR;
use orthant_resident::{Film, Frame};

const SIZE: (u32, u32) = (48, 36);
pub const ORIGIN: [i64; 4] = [0; 4];
/// A million units away, on every axis another way.
const FAR: [i64; 4] = [1_000_000 * UNIT, -1_000_000 * UNIT, 1_000_000 * UNIT, -1_000_000 * UNIT];

pub const WORLD: Recipe =
    Recipe { seed: 1, about: ORIGIN, reach: [4, 3, 4, 2], hollow: 1, percent: 12, has_media: false, is_flat: false };
pub const GLASS: Recipe = Recipe { seed: 2, has_media: true, ..WORLD };
const FLAT: Recipe = Recipe { seed: 3, reach: [6, 2, 6, 0], percent: 35, is_flat: true, ..WORLD };
pub const INTEGRAL: Mode = Mode::Integral { layers: 24, mix: 8.0 };
pub const THICK: Mode = Mode::Thick { each_side: 3, degrees: 2.0 };

pub fn turns(seed: u32) -> Turns {
    let degrees = |k: u32| f64::from((seed * 7919 + k * 104_729) % 360);
    Turns { yaw: degrees(1), xw: degrees(2), zw: degrees(3), pitch: degrees(4) % 60.0 - 30.0 }
}

/// Pixels whose centres meet other blocks, faces or cells; the largest relative difference of the depths of the others.
pub fn differing_hits(reference: &Film, test: &Film) -> (usize, f32) {
    let [r, t] = [reference, test].map(|film| [Aov::Block, Aov::Face, Aov::Cell].map(|wanted| aov(film, wanted)));
    let pixels = aov(reference, Aov::Depth).len();
    let (mut differ, mut depth) = (0, 0.0_f32);
    for i in 0..pixels {
        let same = r[0][i] == t[0][i] && r[1][i] == t[1][i] && r[2][4 * i..4 * i + 4] == t[2][4 * i..4 * i + 4];
        let [a, b] = [reference, test].map(|film| aov(film, Aov::Depth)[i]);
        if !same {
            differ += 1;
        } else if a.is_finite() || b.is_finite() {
            depth = depth.max((a - b).abs() / a.abs());
        }
    }
    (differ, depth)
}

/// Pixels that differ by more than rounding, in any channel.
pub fn differing_colors(reference: &[[f32; 3]], test: &[[f32; 3]]) -> usize {
    let far = |(r, t): (&[f32; 3], &[f32; 3])| (0..3).any(|c| (r[c] - t[c]).abs() > 1e-4 * (1.0 + r[c].abs()));
    reference.iter().zip(test).filter(|&pair| far(pair)).count()
}

pub fn averaged(film: &Film, wanted: Aov) -> Vec<[f32; 3]> {
    aov(film, wanted).chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
}

/// Where `ORTHANT_KEEP_IMAGES` names a folder, images go there to be looked at.
pub fn keep(name: &str, film: &Film) {
    let Some(folder) = std::env::var_os("ORTHANT_KEEP_IMAGES") else { return };
    let byte = |v: f32| (v.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
    let bytes = film.resolve().as_flattened().iter().map(|&v| byte(v)).collect();
    let image = image::RgbImage::from_raw(film.width, film.height, bytes).expect("the film is whole");
    image.save(std::path::Path::new(&folder).join(format!("{name}.png"))).expect("the folder can be written to");
}

#[test]
fn hits_and_images_are_those_of_the_cpu_backend_in_every_mode() {
    let Some(mut vulkan) = device() else { return };
    let (mut pixels, mut other_hits, mut other_colors) = (0, 0, 0);
    for (name, recipe) in [("world", WORLD), ("glass", GLASS), ("flat", FLAT)] {
        for (far, about) in
            [("", ORIGIN), (" far away", if recipe.is_flat { [FAR[0], FAR[1], FAR[2], 0] } else { FAR })]
        {
            let recipe = Recipe { about, ..recipe };
            let mut cpu = both(&mut vulkan, &recipe, about);
            let modes = [("slice", Mode::Slice, 4), ("integral", INTEGRAL, 2), ("thick", THICK, 1)];
            for (k, (mode_name, mode, samples)) in modes.into_iter().enumerate() {
                let mut turns = turns(k as u32 + recipe.seed as u32);
                if recipe.is_flat {
                    (turns.xw, turns.zw) = (0.0, 0.0);
                }
                let frame = frame(about, [0.3, 1.7, -0.4, 0.61], &turns, &mode, SIZE, samples);
                let (reference, expected) = render(&mut cpu, &frame);
                let (film, found) = render(&mut vulkan, &frame);
                let what = format!("{name}{far} {mode_name}");
                keep(&format!("{what} cpu"), &reference);
                keep(&format!("{what} vulkan"), &film);
                let (hits, depth) = differing_hits(&reference, &film);
                let colors = differing_colors(&reference.resolve(), &film.resolve());
                let [albedo, normal] = [Aov::Albedo, Aov::Normal]
                    .map(|wanted| differing_colors(&averaged(&reference, wanted), &averaged(&film, wanted)));
                let shown = aov(&film, Aov::Block).iter().filter(|&&b| b >= 0.0).count();
                eprintln!(
                    "{what}: {hits} hits, {colors} colours, {albedo} albedos, {normal} normals differ of {shown}; depth {depth:.1e}; {:?} {:?}",
                    found.world, expected.world
                );
                assert!(shown > 100, "{what}: {shown} pixels show a block");
                assert!(depth < 1e-4, "{what}: depths differ by {depth}");
                assert_eq!(found.rays.camera, expected.rays.camera, "{what}");
                assert_eq!(found.world.rays, expected.world.rays, "{what}");
                assert_eq!((found.world.exhausted, expected.world.exhausted), (0, 0), "{what}");
                let visits = found.world.node_visits as f64 / expected.world.node_visits as f64;
                // Through glass the CPU backend looks on in the leaf first.
                let most = if recipe.has_media { 1.2 } else { 1.001 };
                assert!((1.0 / most..=most).contains(&visits), "{what}: {visits} times the nodes of the CPU backend");
                (pixels, other_hits) = (pixels + film.sum.len(), other_hits + hits);
                other_colors += colors.max(albedo).max(normal);
            }
        }
    }
    assert_silent(&vulkan);
    assert!(other_hits * 500 <= pixels, "{other_hits} of {pixels} pixels show other blocks, faces or cells");
    assert!(other_colors * 100 <= pixels, "{other_colors} of {pixels} pixels have other colours");
}

#[test]
fn rays_that_begin_in_a_block_are_those_of_the_cpu_backend() {
    let Some(mut vulkan) = device() else { return };
    // Every cell is full: the camera is in something.
    let recipe = Recipe { seed: 4, hollow: -1, percent: 100, reach: [2, 2, 2, 1], ..GLASS };
    let mut cpu = both(&mut vulkan, &recipe, ORIGIN);
    let (mut colors, mut hits) = (0, 0);
    for step in 0..12 {
        let at = [0.7, 1.3, -0.9, 0.2].map(|v: f64| (v + f64::from(step) * 2.9) % 7.0);
        let frame = frame(ORIGIN, at, &turns(step), &Mode::Slice, (24, 18), 1);
        let ((reference, _), (film, _)) = (render(&mut cpu, &frame), render(&mut vulkan, &frame));
        keep(&format!("inside {step} cpu"), &reference);
        keep(&format!("inside {step} vulkan"), &film);
        colors += differing_colors(&reference.resolve(), &film.resolve());
        hits += differing_hits(&reference, &film).0;
    }
    assert_silent(&vulkan);
    assert!(colors <= 12 && hits <= 12, "{colors} colours and {hits} hits of {}", 12 * 24 * 18);
}

#[test]
fn every_number_of_layer_slots_gives_one_image() {
    let Some(mut vulkan) = device() else { return };
    both(&mut vulkan, &GLASS, ORIGIN);
    let frame = frame(ORIGIN, [0.3, 1.7, -0.4, 0.61], &turns(5), &INTEGRAL, SIZE, 1);
    vulkan.set_layer_slots(Some(1));
    let (reference, expected) = render(&mut vulkan, &frame);
    for slots in [2, 4, 16, 128] {
        vulkan.set_layer_slots(Some(slots));
        let (film, found) = render(&mut vulkan, &frame);
        assert_eq!(differing_colors(&reference.resolve(), &film.resolve()), 0, "{slots} slots");
        assert_eq!(differing_hits(&reference, &film), (0, 0.0), "{slots} slots");
        assert_eq!(found.world, expected.world, "{slots} slots");
    }
    assert_silent(&vulkan);
}

#[test]
fn rays_that_run_out_of_steps_are_shown_and_counted() {
    let Some(mut vulkan) = device() else { return };
    both(&mut vulkan, &WORLD, ORIGIN);
    let mut frame = frame(ORIGIN, [0.3, 1.7, -0.4, 0.61], &turns(2), &Mode::Slice, SIZE, 1);
    frame.world.as_mut().expect("it shows one").step_budget = 30;
    frame.aovs.clear();
    let (film, status) = render(&mut vulkan, &frame);
    let shown = film.resolve().iter().filter(|&&color| color == EXHAUSTED_COLOR).count();
    assert!(shown > 50 && shown < film.sum.len(), "{shown} pixels");
    assert_eq!(status.world.exhausted, shown as u64);
    assert_silent(&vulkan);
}

#[test]
fn a_swap_to_an_equal_set_changes_no_bit_and_an_edit_shows() {
    let Some(mut vulkan) = device() else { return };
    let frame = frame(ORIGIN, [0.3, 1.7, -0.4, 0.61], &turns(1), &INTEGRAL, SIZE, 2);
    both(&mut vulkan, &WORLD, ORIGIN);
    let (before, _) = render(&mut vulkan, &frame);
    both(&mut vulkan, &WORLD, ORIGIN);
    let (after, _) = render(&mut vulkan, &frame);
    assert_eq!((&before.sum, &before.aovs), (&after.sum, &after.aovs));
    both(&mut vulkan, &Recipe { seed: 9, ..WORLD }, ORIGIN);
    let (other, _) = render(&mut vulkan, &frame);
    assert_ne!(before.sum, other.sum);
    assert_silent(&vulkan);
}

#[test]
fn frames_in_which_only_the_camera_moves_do_nothing_to_the_arenas() {
    let Some(mut vulkan) = device() else { return };
    both(&mut vulkan, &WORLD, ORIGIN);
    let work = vulkan.world_work();
    for step in 0..20 {
        let at = [0.3 + f64::from(step) * 50.0, 1.7, -0.4, 0.61];
        render(&mut vulkan, &Frame { aovs: Vec::new(), ..frame(ORIGIN, at, &turns(step), &Mode::Slice, (16, 12), 1) });
    }
    assert_eq!(vulkan.world_work(), work);
    assert_silent(&vulkan);
}

#[test]
fn an_empty_world_is_all_sky() {
    let Some(mut vulkan) = device() else { return };
    let mode = Mode::Integral { layers: 5, mix: 0.0 };
    let frame = frame(ORIGIN, [0.0; 4], &turns(1), &mode, SIZE, 1);
    let mut cpu = orthant_cpu::CpuBackend::new();
    let (film, status) = render(&mut vulkan, &frame);
    let (reference, _) = render(&mut cpu, &frame);
    assert_eq!(differing_colors(&reference.resolve(), &film.resolve()), 0);
    assert!(aov(&film, Aov::Block).iter().all(|&block| block == -1.0));
    assert_eq!((status.world.node_visits, status.world.leaf_visits), (0, 0));
    assert_silent(&vulkan);
}
