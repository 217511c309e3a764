//! Rendering of worlds from the command line.

mod common;

use common::{bytes, fail, json, orthant, succeed};
use orthant::image_io::{Picture, read};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Small pictures in the preview, from the CPU.
const SMALL: [&str; 10] = ["--size", "24x16", "--spp", "1", "--env", "white", "--shade", "preview", "--backend", "cpu"];

/// A folder with `flat.orw`: ground of blocks 1 within 32 units, `-8 <= y < 0`.
fn folder() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().to_owned();
    succeed(&path, &["world", "new", "--generator", "flat", "--half-extent", "32", "-o", "flat.orw"]);
    (folder, path)
}

fn render(folder: &Path, file: &str, output: &str, rest: &[&str]) {
    succeed(folder, &[&["render", file, "-o", output], &SMALL[..], rest].concat());
}

fn picture(folder: &Path, name: &str) -> Picture {
    read(&folder.join(name), 1 << 30).unwrap_or_else(|e| panic!("{e}"))
}

/// The first channel of an AOV.
fn ids(folder: &Path, name: &str) -> Vec<f32> {
    picture(folder, name).pixels.iter().map(|p| p[0]).collect()
}

#[test]
fn straight_down_every_pixel_sees_the_upper_face_of_the_block_below_it() {
    let (_guard, f) = folder();
    let aovs = ["--aov", "block,face,cell,depth,normal,position"];
    let view = ["--pos", "2.5,5,-3.25,0.5", "--pitch", "-90", "--mode", "slice", "--fov", "60"];
    render(&f, "flat.orw", "down.exr", &[&aovs[..], &view].concat());
    assert!(ids(&f, "down.block.exr").iter().all(|&id| id == 1.0));
    assert!(ids(&f, "down.face.exr").iter().all(|&face| face == 3.0), "the face towards +Y");
    let (depth, normal) = (ids(&f, "down.depth.exr"), picture(&f, "down.normal.exr"));
    assert!(depth.iter().all(|&d| (d - 5.0).abs() < 1e-4), "{depth:?}");
    assert!(normal.pixels.iter().all(|n| (n[1] - 1.0).abs() < 1e-6 && n[0].abs() < 1e-6));
    let (cell, position) = (picture(&f, "down.cell.exr"), picture(&f, "down.position.exr"));
    for (i, (cell, at)) in cell.pixels.iter().zip(&position.pixels).enumerate() {
        // Looking down with the top of the image towards -Z: right is +X, and down in the image +Z.
        let (px, py) = ((i % 24) as f32 + 0.5, (i / 24) as f32 + 0.5);
        let half = 5.0 * 30.0_f32.to_radians().tan();
        let x = 2.5 + (2.0 * px / 24.0 - 1.0) * 1.5 * half;
        let z = -3.25 + (2.0 * py / 16.0 - 1.0) * half;
        assert!((at[0] - x).abs() < 1e-3 && at[1].abs() < 1e-4 && (at[2] - z).abs() < 1e-3, "{at:?} {x} {z}");
        // Less the camera's own cell, (2, 5, -4).
        assert_eq!(*cell, [x.floor() - 2.0, -1.0 - 5.0, z.floor() + 4.0]);
    }
}

#[test]
fn a_world_a_million_units_away_looks_the_same() {
    let (_guard, f) = folder();
    // A wall and a block on it, long enough in w for a view that is turned into it.
    let boxes = [([-4, 0, -9, -4], [5, 3, -6, 5], 1), ([1, 3, -8, -4], [3, 5, -7, 5], 9)];
    for (name, to) in [("here", [0, 0, 0, 0]), ("there", [1_000_000, 2_000_000, -1_000_000, 3_000_000])] {
        let moved = |at: [i64; 4]| -> [i64; 4] { std::array::from_fn(|a| at[a] + to[a]) };
        let fill = |(min, max, block)| json!({ "fill": { "min": moved(min), "max": moved(max) }, "block": block });
        let script = boxes.map(|each| format!("{}\n", fill(each))).concat();
        std::fs::write(f.join(format!("{name}.jsonl")), script).expect("script");
    }
    succeed(&f, &["world", "new", "--generator", "empty", "-o", "empty.orw"]);
    let mut images = Vec::new();
    for (name, pos) in [("here", "0.3,2.1,0.7,0.5"), ("there", "1000000.3,2000002.1,-999999.3,3000000.5")] {
        let (patches, world, image) = (format!("{name}.jsonl"), format!("{name}.orw"), format!("{name}.exr"));
        succeed(&f, &["world", "apply", "empty.orw", "--patches", &patches, "-o", &world, "--quiet"]);
        let view = [
            "--pos", pos, "--yaw", "12", "--pitch", "-7", "--xw", "5", "--zw", "-9", "--mode", "thick", "--edges",
            "0.05",
        ];
        render(
            &f,
            &world,
            &image,
            &[&view[..], &["--layers", "5", "--thickness", "2", "--distance", "100", "--quiet"]].concat(),
        );
        images.push(picture(&f, &image));
    }
    let magenta = |p: &[f32; 3]| p[0] > 0.5 && p[1] < 0.2 && p[2] > 0.5;
    assert!(images[0].pixels.iter().any(magenta), "block 9 has no material");
    assert_eq!(images[0].pixels, images[1].pixels);
}

#[test]
fn shares_tiles_and_threads_give_the_bytes_of_one_run() {
    let (_guard, f) = folder();
    let view = ["--mode", "integral", "--layers", "3", "--spp", "32", "--pos", "0,4,0,0", "--pitch", "-20"];
    let run = |output: &str, rest: &[&str]| {
        let args = ["render", "flat.orw", "-o", output, "--size", "20x12", "--shade", "preview", "--env", "0.5,1,2"];
        succeed(&f, &[&args[..], &view, &["--backend", "cpu"], rest].concat());
    };
    run("whole.exr", &[]);
    run("threads.exr", &["--threads", "1"]);
    assert_eq!(bytes(&f, "threads.exr"), bytes(&f, "whole.exr"));
    run("a.share", &["--samples", "0..16"]);
    run("b.share", &["--samples", "16..32", "--tile", "0,0,7,12"]);
    run("c.share", &["--samples", "16..32", "--tile", "7,0,13,12"]);
    succeed(&f, &["merge", "c.share", "a.share", "b.share", "-o", "merged.exr"]);
    assert_eq!(bytes(&f, "merged.exr"), bytes(&f, "whole.exr"));
    // Another view is another rendering.
    run("d.share", &["--samples", "16..32", "--tile", "7,0,13,12", "--edges", "0.1"]);
    fail(&f, &["merge", "d.share", "a.share", "b.share", "-o", "x.exr"], 3, &["share"]);
}

#[test]
fn what_is_resident_is_validated_and_counted() {
    let (_guard, f) = folder();
    succeed(&f, &["world", "new", "--generator", "terrain", "--half-extent", "32", "-o", "terrain.orw"]);
    render(&f, "terrain.orw", "t.png", &["--validate", "--stats", "s.json"]);
    let stats = json(&String::from_utf8(bytes(&f, "s.json")).expect("UTF-8"));
    let world = &stats["world"];
    let info = json(&succeed(&f, &["info", "terrain.orw", "--json"]));
    assert_eq!(world["leaves"]["chunk_array"], info["leaves"]["chunk_array"]);
    assert_eq!(world["leaves"]["uniform"], info["leaves"]["uniform"]);
    assert_eq!((&world["rays"], &stats["rays"]["camera"]), (&json!(24 * 16), &json!(24 * 16)));
    assert_eq!(world["exhausted"], 0);
    assert!(world["node_visits_per_ray"].as_f64() > Some(0.0) && world["memory"]["payload"].as_u64() > Some(0));
}

#[test]
fn the_sky_of_an_empty_world_and_of_a_black_environment_is_all_that_is_seen() {
    let (_guard, f) = folder();
    succeed(&f, &["world", "new", "--generator", "empty", "-o", "empty.orw"]);
    for shade in ["preview", "path"] {
        for (env, radiance) in [("none", [0.0; 3]), ("0.25,0.5,1", [0.25, 0.5, 1.0])] {
            let args =
                ["render", "empty.orw", "-o", "e.exr", "--size", "6x4", "--spp", "4", "--shade", shade, "--env", env];
            let output = orthant(&f, &[&args[..], &["--backend", "cpu"]].concat());
            assert!(output.status.success() && String::from_utf8_lossy(&output.stderr).contains("the world is empty"));
            let close = |p: &[f32; 3]| (0..3).all(|c| (p[c] - radiance[c]).abs() < 1e-3);
            assert!(picture(&f, "e.exr").pixels.iter().all(close), "{shade} {env}");
        }
    }
}

#[test]
fn a_scene_and_a_world_hide_shade_and_light_each_other() {
    let (_guard, f) = folder();
    succeed(&f, &["generate", "material-grid", "-o", "grid.glb"]);
    let args = |output: &'static str| {
        ["render", "grid.glb", "--world", "flat.orw", "-o", output, "--size", "48x32", "--spp", "16", "--env", "white"]
    };
    let eye = ["--eye", "0,9,9", "--target", "0,0,0", "--backend", "cpu", "--aov", "node,block,depth"];
    succeed(&f, &[&args("both.exr")[..], &eye, &["--validate"]].concat());
    let (nodes, blocks) = (ids(&f, "both.node.exr"), ids(&f, "both.block.exr"));
    let count = |is: &dyn Fn(f32, f32) -> bool| nodes.iter().zip(&blocks).filter(|&(&n, &b)| is(n, b)).count();
    assert_eq!(count(&|n, b| n >= 0.0 && b >= 0.0), 0, "a pixel's centre sees one thing");
    assert!(count(&|n, _| n >= 0.0) > 20 && count(&|_, b| b == 1.0) > 200);
    // Under one radiance all around, ground in the open is brighter than ground beside what stands on it.
    let image = picture(&f, "both.exr");
    let ground: Vec<f32> = image.pixels.iter().zip(&blocks).filter(|&(_, &b)| b == 1.0).map(|(p, _)| p[1]).collect();
    let (least, most) = ground.iter().fold((f32::MAX, 0.0_f32), |(l, m), &g| (l.min(g), m.max(g)));
    assert!(least < 0.8 * most, "{least} {most}");
    for (rest, word) in [
        (&["--mode", "integral"][..], "--mode"),
        (&["--shade", "preview"], "--shade"),
        (&["--yaw", "3"], "--yaw"),
        (&["--layers", "3"], "--layers"),
    ] {
        fail(&f, &[&args("x.exr")[..], rest].concat(), 2, &[word]);
    }
    // Elsewhere in w there is no ground.
    succeed(&f, &[&args("away.exr")[..], &eye, &["--pos", "0,0,0,500"]].concat());
    assert!(ids(&f, "away.block.exr").iter().all(|&b| b == -1.0));
}

#[test]
fn options_that_do_not_fit_are_refused_by_name() {
    let (_guard, f) = folder();
    succeed(&f, &["generate", "cornell", "-o", "box.glb"]);
    let world = |rest: &[&str], words: &[&str]| {
        fail(&f, &[&["render", "flat.orw", "-o", "x.png", "--size", "8x8", "--spp", "1"], rest].concat(), 2, words);
    };
    world(&["--camera", "0"], &["--camera", "--pos"]);
    world(&["--eye", "0,0,0", "--target", "1,1,1"], &["--eye"]);
    world(&["--variant", "x"], &["--variant"]);
    world(&["--time", "1"], &["--time"]);
    world(&["--world", "flat.orw"], &["--world"]);
    world(&["--renderer", "raster"], &["--renderer", "--shade preview"]);
    world(&["--aov", "node"], &["--aov", "block"]);
    world(&["--mode", "slice", "--layers", "3"], &["--layers", "integral"]);
    world(&["--mode", "thick", "--layers", "4"], &["odd"]);
    world(&["--mode", "thick", "--mix", "4"], &["--mix"]);
    world(&["--aperture", "1"], &["--aperture", "slice"]);
    for bad in [
        &["--pos", "1,2,3"][..],
        &["--pos", "nan,0,0,0"],
        &["--pos", "1e300,0,0,0"],
        &["--yaw", "inf"],
        &["--layers", "0"],
        &["--layers", "5000"],
        &["--hidden-zoom", "0"],
        &["--mix", "-1"],
        &["--thickness", "0"],
        &["--distance", "0"],
        &["--distance", "1e30"],
        &["--edges", "0.6"],
        &["--shade", "toon"],
        &["--mode", "4d"],
    ] {
        world(bad, &[bad[0]]);
    }
    fail(&f, &["render", "box.glb", "-o", "x.png", "--pos", "0,0,0,0"], 2, &["--pos", "--world"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--aov", "cell"], 2, &["--aov"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--fov", "30"], 2, &["--fov", "--eye"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--world", "none.orw"], 3, &["none.orw"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--world", "box.glb"], 3, &["box.glb", ".orw"]);
    std::fs::copy(f.join("flat.orw"), f.join("w.png")).expect("copied");
    fail(&f, &["render", "flat.orw", "-o", "x.png", "--stats", "flat.orw"], 2, &["--stats", "the world"]);
    fail(&f, &["render", "box.glb", "-o", "x.png", "--world", "flat.orw", "--stats", "flat.orw"], 2, &["--world"]);
    assert!(!f.join("x.png").exists());
}

/// A voxel file is rendered as the world that it converts to.
#[test]
fn voxel_files_are_rendered_like_their_worlds() {
    let Some(assets) = std::env::var_os("ORTHANT_ASSETS").map(PathBuf::from) else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return;
    };
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    for name in ["vox/opengametools/chr_knight.vox", "minecraft/prismarine/smallhouse1.schem"] {
        let path = assets.join(name);
        let path = path.to_str().expect("UTF-8");
        succeed(f, &["convert", path, "w.orw", "--quiet"]);
        for (file, image) in [(path, "a.exr"), ("w.orw", "b.exr")] {
            render(f, file, image, &["--aov", "block", "--quiet", "--validate"]);
        }
        assert_eq!(bytes(f, "a.exr"), bytes(f, "b.exr"), "{name}");
        let blocks = ids(f, "a.block.exr");
        let seen = blocks.iter().filter(|&&b| b > 0.0).count();
        // Framed whole: it is neither a speck nor all there is, and no row at the edge is full.
        assert!(seen > blocks.len() / 12 && seen < blocks.len() * 9 / 10, "{name}: {seen}");
        assert!(blocks[..24].contains(&-1.0), "{name}");
    }
}
