//! The same bytes: whatever the threads, and for the whole as for its merged shares.

mod common;

use common::{bytes, fail, folder_with_box, succeed};
use std::path::Path;

const RENDER: [&str; 6] = ["render", "box.glb", "--size", "24x17", "--spp", "40"];

fn render(folder: &Path, output: &str, rest: &[&str]) {
    let args: Vec<&str> = RENDER.iter().copied().chain(["-o", output]).chain(rest.iter().copied()).collect();
    succeed(folder, &args);
}

#[test]
fn one_thread_and_eight_give_the_same_files() {
    let (_guard, f) = folder_with_box();
    for (stem, threads) in [("one", "1"), ("eight", "8")] {
        render(&f, &format!("{stem}.png"), &["--threads", threads]);
        render(&f, &format!("{stem}.exr"), &["--threads", threads, "--aov", "albedo,normal,depth,position,node"]);
        render(&f, &format!("{stem}.hdr"), &["--threads", threads]);
    }
    for file in ["png", "exr", "hdr", "albedo.exr", "normal.exr", "depth.exr", "position.exr", "node.exr"] {
        assert_eq!(bytes(&f, &format!("one.{file}")), bytes(&f, &format!("eight.{file}")), "{file}");
    }
    render(&f, "other.png", &["--seed", "6"]);
    assert_ne!(bytes(&f, "other.png"), bytes(&f, "one.png"), "another seed is another image");
}

#[test]
fn merged_shares_give_the_files_of_one_run() {
    let (_guard, f) = folder_with_box();
    let look = ["--tonemap", "agx", "--exposure", "0.5"];
    let with = |rest: &[&'static str]| -> Vec<&'static str> { look.iter().chain(rest).copied().collect() };
    for image in ["png", "exr", "hdr"] {
        render(&f, &format!("whole.{image}"), &look);
    }
    render(&f, "left.share", &with(&["--tile", "0,0,10,17"]));
    render(&f, "right-first.share", &with(&["--tile", "10,0,14,17", "--samples", "0..16"]));
    render(&f, "right-rest.share", &with(&["--tile", "10,0,14,17", "--samples", "16..40"]));
    for image in ["png", "exr", "hdr"] {
        let merged = format!("merged.{image}");
        succeed(&f, &["merge", "right-rest.share", "left.share", "right-first.share", "-o", &merged]);
        assert_eq!(bytes(&f, &merged), bytes(&f, &format!("whole.{image}")), "{image}");
    }

    fail(&f, &["merge", "left.share", "right-rest.share", "-o", "x.png"], 3, &["pixel 10,0", "samples 0..16"]);
    fail(&f, &["merge", "left.share", "left.share", "-o", "x.png"], 3, &["0,0,10,17", "0..40"]);
    render(&f, "foreign.share", &with(&["--tile", "10,0,14,17", "--max-depth", "3"]));
    fail(&f, &["merge", "left.share", "foreign.share", "-o", "x.png"], 3, &["foreign.share", "settings"]);
    assert!(!f.join("x.png").exists());
}

#[test]
fn a_changed_scene_file_is_another_rendering() {
    let (_guard, f) = folder_with_box();
    render(&f, "left.share", &["--tile", "0,0,12,17"]);
    // The name of a material decides no pixel, but nobody can know that of every change.
    let mut glb = bytes(&f, "box.glb");
    let at = glb.windows(7).position(|w| w == b"\"white\"").expect("a material of that name");
    glb[at + 1..at + 6].copy_from_slice(b"beige");
    std::fs::write(f.join("box.glb"), glb).expect("write");
    render(&f, "right.share", &["--tile", "12,0,12,17"]);
    fail(&f, &["merge", "left.share", "right.share", "-o", "x.png"], 3, &["right.share", "hash"]);
}

#[test]
fn a_damaged_share_is_refused_with_the_offset() {
    let (_guard, f) = folder_with_box();
    render(&f, "a.share", &[]);
    let good = bytes(&f, "a.share");
    std::fs::write(f.join("cut.share"), &good[..good.len() - 1]).expect("write");
    let end = format!("byte {}", good.len() - 1);
    fail(&f, &["merge", "cut.share", "-o", "x.png"], 3, &["cut.share", &end]);
    let mut bad = good;
    let last = bad.len() - 100;
    bad[last] ^= 1;
    std::fs::write(f.join("bad.share"), bad).expect("write");
    fail(&f, &["merge", "bad.share", "-o", "x.png"], 3, &["bad.share", "byte", "checksum"]);
}

#[test]
fn a_tile_as_an_image_is_the_crop_of_the_whole() {
    let (_guard, f) = folder_with_box();
    render(&f, "whole.exr", &[]);
    render(&f, "tile.exr", &["--tile", "5,3,7,4"]);
    let read = |name: &str| orthant::image_io::read(&f.join(name), 1 << 20).expect("an image");
    let (whole, tile) = (read("whole.exr"), read("tile.exr"));
    assert_eq!((tile.width, tile.height), (7, 4));
    for y in 0..4 {
        for x in 0..7 {
            assert_eq!(tile.pixels[y * 7 + x], whole.pixels[(y + 3) * 24 + x + 5]);
        }
    }
}

#[test]
fn generated_scenes_are_the_same_every_time_and_other_seeds_give_others() {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let scenes: [&[&str]; 7] = [
        &["cornell"],
        &["material-grid"],
        &["forest", "--trees", "5"],
        &["city", "--nodes", "300"],
        &["chain", "--depth", "20"],
        &["instances", "--count", "50"],
        &["animated-crowd", "--count", "3"],
    ];
    for scene in scenes {
        for output in ["a.glb", "b.glb"] {
            let args: Vec<&str> = ["generate"].into_iter().chain(scene.iter().copied()).chain(["-o", output]).collect();
            succeed(f, &args);
        }
        assert_eq!(bytes(f, "a.glb"), bytes(f, "b.glb"), "{scene:?}");
        succeed(f, &["info", "a.glb", "--json"]);
    }
    succeed(f, &["generate", "forest", "--trees", "5", "--seed", "1", "-o", "c.glb"]);
    succeed(f, &["generate", "forest", "--trees", "5", "--seed", "2", "-o", "d.glb"]);
    assert_ne!(bytes(f, "c.glb"), bytes(f, "d.glb"));
}
