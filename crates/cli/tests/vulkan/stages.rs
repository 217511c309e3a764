//! What the stages of a device take is measured, and reported.

use crate::{device, frame, open, program, render};
use orthant_resident::{Backend, Environment};
use orthant_vulkan::{Stage, Timings};

#[test]
fn stages_are_measured_where_they_happen_and_nowhere_else() {
    let Some(mut vulkan) = device() else { return };
    let folder = tempfile::tempdir().expect("folder");
    program::succeed(folder.path(), &["generate", "cornell", "-o", "box.glb"]);
    let mut loaded = open(&folder.path().join("box.glb"));
    let frame = frame(&loaded, (64, 48), 32);
    let batch = loaded.derived.load_batch();
    vulkan.apply(batch.clone()).expect("the batch is sound");
    vulkan.read_back().expect("the device works");
    assert_eq!(vulkan.take_timings().expect("the device works"), Timings::default(), "nobody has asked for it");

    assert!(vulkan.set_timed(true), "lavapipe has timestamps");
    vulkan.clear().expect("the device works");
    vulkan.apply(batch).expect("the batch is sound");
    vulkan.set_environment(Environment::constant([1.0; 3])).expect("the environment is sound");
    let start = std::time::Instant::now();
    render(&mut vulkan, &frame);
    let elapsed = start.elapsed().as_secs_f64();
    let timings = vulkan.take_timings().expect("the device works");
    let happens = [Stage::Upload, Stage::Instances, Stage::BlasBuild, Stage::TlasBuild, Stage::Trace, Stage::Readback];
    for stage in happens {
        let time = timings.of(stage);
        assert!(time.count > 0 && time.seconds > 0.0, "{stage:?}: {time:?}");
    }
    for stage in [Stage::BlasUpdate, Stage::TlasUpdate] {
        assert_eq!(timings.of(stage).count, 0, "{stage:?}");
    }
    assert!(timings.of(Stage::Trace).seconds <= elapsed, "{:?} of {elapsed} s", timings.of(Stage::Trace));
    let again = vulkan.take_timings().expect("the device works");
    assert_eq!(again.of(Stage::Trace).count, 0, "they are reported once");
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

#[test]
fn stages_are_reported_by_render_and_bench() {
    if device().is_none() {
        return;
    }
    let (_folder, path) = program::folder_with_box();
    let stats = |backend: &str| {
        let args =
            ["render", "box.glb", "-o", "x.exr", "--size", "16x16", "--spp", "2", "--quiet", "--stats", "s.json"];
        program::succeed(&path, &[&args[..], &["--backend", backend]].concat());
        program::json(&String::from_utf8(program::bytes(&path, "s.json")).expect("UTF-8"))["gpu"].clone()
    };
    assert_eq!(stats("cpu"), serde_json::Value::Null);
    let gpu = stats("vulkan");
    for (_, name) in Stage::ALL {
        assert!(gpu[format!("{name}_s")].is_number(), "{name}: {gpu}");
    }
    assert!(gpu["trace_s"].as_f64() > Some(0.0), "{gpu}");
    let args = ["bench", "edit", "--size", "60", "--runs", "1", "--backend", "vulkan", "--json"];
    let bench = program::json(&program::succeed(&path, &args));
    let results = bench["results"].as_array().expect("results");
    let of = |name: &str| results.iter().find(|r| r["name"] == name && r["depth"] == 1).expect("the figure");
    assert!(of("transform_leaf")["gpu_tlas_update_s"].as_f64() > Some(0.0), "{bench}");
    assert!(of("duplicate_1000")["gpu_tlas_build_s"].as_f64() > Some(0.0), "{bench}");
    assert!(of("scattered_1000")["rows"].as_u64() > Some(50), "{bench}");
}
