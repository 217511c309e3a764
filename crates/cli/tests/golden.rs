//! Small images of the repository's own scenes, compared by tolerance with those in `tests/golden`.
//!
//! `ORTHANT_RENEW_GOLDEN=1 cargo test -p orthant --test golden` renews them: look at them before committing.

mod common;

use common::{json, succeed};
use std::path::Path;

/// Mean FLIP that another machine's mathematics and a change of the random numbers may make; a wrong light or material
/// makes several times as much.
const TOLERANCE: f64 = 0.06;

fn golden(name: &str, generate: &[&str], render: &[&str]) {
    let folder = tempfile::tempdir().expect("folder");
    let f = folder.path();
    let scene: Vec<&str> =
        ["generate", name].into_iter().chain(generate.iter().copied()).chain(["-o", "s.glb"]).collect();
    succeed(f, &scene);
    let image: Vec<&str> = ["render", "s.glb", "-o", "new.png", "--size", "160x90", "--spp", "64", "--validate"]
        .into_iter()
        .chain(render.iter().copied())
        .collect();
    succeed(f, &image);
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{name}.png"));
    if std::env::var_os("ORTHANT_RENEW_GOLDEN").is_some() {
        std::fs::copy(f.join("new.png"), &reference).expect("renewed");
        return;
    }
    let reference = reference.to_str().expect("the repository's path is UTF-8");
    let result = json(&succeed(f, &["compare", "new.png", reference, "--json"]));
    let flip = result["flip"].as_f64().expect("a number");
    assert!(flip <= TOLERANCE, "{name}: FLIP {flip}, above {TOLERANCE}");
}

#[test]
fn cornell() {
    golden("cornell", &[], &[]);
}

#[test]
fn material_grid() {
    golden("material-grid", &[], &[]);
}

#[test]
fn forest() {
    golden("forest", &["--trees", "40"], &[]);
}

#[test]
fn city() {
    golden("city", &["--nodes", "2000"], &[]);
}

#[test]
fn chain() {
    golden("chain", &[], &[]);
}

#[test]
fn instances() {
    golden("instances", &["--count", "500"], &[]);
}

#[test]
fn animated_crowd() {
    golden("animated-crowd", &["--count", "12"], &["--aperture", "0.05", "--focus-distance", "6"]);
}
