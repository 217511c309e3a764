//! The committed shader modules are those that the manifest tells of, and have what the backend counts on. They are not
//! compiled here: `cargo xtask shaders --check` does that.

use rspirv::dr::{Instruction, Module, Operand, load_bytes};
use rspirv::spirv::{Decoration, ExecutionModel, Op};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

fn manifest() -> Value {
    let text = std::fs::read_to_string(folder().join("manifest.json")).expect("the manifest is committed");
    serde_json::from_str(&text).expect("the manifest is JSON")
}

fn hash(path: &Path) -> String {
    blake3::hash(&std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).to_hex().to_string()
}

/// Paths of the files below a folder with an extension, relative to `root`, with slashes.
fn files(root: &Path, below: &Path, extension: &str, found: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(below).expect("the folder is committed") {
        let path = entry.expect("the folder can be read").path();
        if path.is_dir() {
            files(root, &path, extension, found);
        } else if path.extension().is_some_and(|e| e == extension) {
            let relative = path.strip_prefix(root).expect("it lies below");
            let parts: Vec<_> = relative.components().map(|c| c.as_os_str().to_string_lossy()).collect();
            found.insert(parts.join("/"));
        }
    }
}

fn module(name: &str) -> Module {
    let bytes = std::fs::read(folder().join(format!("spirv/{name}.spv"))).expect("the module is committed");
    load_bytes(bytes).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn module_names() -> Vec<String> {
    let mut found = BTreeSet::new();
    files(&folder(), &folder().join("spirv"), "spv", &mut found);
    found.iter().map(|path| path["spirv/".len()..path.len() - ".spv".len()].to_owned()).collect()
}

#[test]
fn every_source_and_module_is_the_one_that_the_manifest_names() {
    let (manifest, folder) = (manifest(), folder());
    let sources = manifest["sources"].as_object().expect("sources by path");
    let mut found = BTreeSet::new();
    files(&folder, &folder, "slang", &mut found);
    assert_eq!(found, sources.keys().cloned().collect(), "run `cargo xtask shaders`");
    for (path, expected) in sources {
        assert_eq!(*expected, hash(&folder.join(path)), "{path} was edited: run `cargo xtask shaders`");
    }
    let modules = manifest["modules"].as_array().expect("a list of modules");
    let outputs: BTreeSet<String> =
        modules.iter().map(|m| m["output"].as_str().expect("a module has a path").to_owned()).collect();
    let mut found = BTreeSet::new();
    files(&folder, &folder, "spv", &mut found);
    assert_eq!(found, outputs);
    for module in modules {
        let output = module["output"].as_str().expect("a module has a path");
        assert_eq!(module["blake3"], hash(&folder.join(output)), "{output}");
    }
}

#[test]
fn modules_have_the_entry_points_that_pipelines_are_made_of() {
    use ExecutionModel as Model;
    let entries = |name: &str| -> BTreeMap<String, Model> {
        let entry = |instruction: &Instruction| match &instruction.operands[..] {
            [Operand::ExecutionModel(model), _, Operand::LiteralString(name), ..] => (name.clone(), *model),
            other => panic!("an entry point of {other:?}"),
        };
        module(name).entry_points.iter().map(entry).collect()
    };
    let path = [
        ("hit_any", Model::AnyHitNV),
        ("hit_closest", Model::ClosestHitNV),
        ("missed", Model::MissNV),
        ("trace_centers", Model::RayGenerationNV),
        ("trace_paths", Model::RayGenerationNV),
    ];
    let stages = [("light_paths", Model::GLCompute), ("shade_paths", Model::GLCompute)];
    let query = [("query_block", Model::GLCompute), ("query_centers", Model::GLCompute)];
    let compute = |name| (name, Model::GLCompute);
    let cull = ["count_rows", "sum_counts", "write_commands"].map(compute);
    let environment = ["begin_pyramid", "filter_map", "reduce_pyramid"].map(compute);
    let draw = [
        ("place_corner", Model::Vertex),
        ("place_backdrop", Model::Vertex),
        ("shade_opaque", Model::Fragment),
        ("shade_mask", Model::Fragment),
        ("shade_blend", Model::Fragment),
        ("shade_backdrop", Model::Fragment),
        ("find_hit", Model::Fragment),
    ];
    let world_path =
        ["light_world_paths", "shade_world_paths", "trace_world_centers", "trace_world_paths"].map(compute);
    let world_query = ["query_scene_centers", "query_scene_paths"].map(compute);
    let world_scene = [("trace_scene_centers", Model::RayGenerationNV), ("trace_scene_paths", Model::RayGenerationNV)];
    let expected = [
        ("path", &path[..]),
        ("path_stages", &stages),
        ("path_query", &query),
        ("path_reorder", &[("trace_block", Model::RayGenerationNV)]),
        ("instances", &[("write_instances", Model::GLCompute)]),
        ("raster/cull", &cull),
        ("raster/draw", &draw),
        ("raster/environment", &environment),
        ("raster/resolve", &[("resolve_hits", Model::GLCompute), ("resolve_samples", Model::GLCompute)]),
        ("world/path", &world_path),
        ("world/path_query", &world_query),
        ("world/path_scene", &world_scene),
        ("world/preview", &[("preview_block", Model::GLCompute), ("preview_centers", Model::GLCompute)]),
        ("world/scatter", &[("scatter_writes", Model::GLCompute)]),
    ];
    let mut known = BTreeSet::new();
    for (name, expected) in expected {
        assert_eq!(entries(name), expected.iter().map(|&(name, model)| (name.to_owned(), model)).collect(), "{name}");
        known.insert(name.to_owned());
    }
    assert_eq!(known, module_names().into_iter().collect());
}

/// Fused, a multiplication and an addition round once: the bits would not be those of the CPU.
#[test]
fn no_arithmetic_may_be_fused() {
    for name in module_names() {
        let module = module(&name);
        let is_exact = |i: &&Instruction| {
            i.class.opcode == Op::Decorate && i.operands[1] == Operand::Decoration(Decoration::NoContraction)
        };
        let exact: BTreeSet<u32> =
            module.annotations.iter().filter(is_exact).map(|i| i.operands[0].unwrap_id_ref()).collect();
        let (mut seen, mut loose) = (0, Vec::new());
        for instruction in module.all_inst_iter() {
            let opcode = instruction.class.opcode;
            match opcode {
                Op::FAdd | Op::FSub | Op::FMul | Op::FDiv | Op::FNegate | Op::VectorTimesScalar => {
                    seen += 1;
                    let id = instruction.result_id.expect("arithmetic has a result");
                    if !exact.contains(&id) {
                        loose.push((opcode, id));
                    }
                }
                Op::Dot | Op::MatrixTimesVector | Op::VectorTimesMatrix | Op::MatrixTimesMatrix => {
                    panic!("{name}: {opcode:?} sums in an order of its own")
                }
                _ => {}
            }
        }
        assert!(loose.is_empty(), "{name}: {loose:?}");
        assert!(seen > 0 || ["instances", "world/scatter"].contains(&name.as_str()), "{name} computes nothing");
    }
}

#[test]
fn modules_say_nothing_of_their_sources() {
    for name in module_names() {
        let module = module(&name);
        assert!(module.debug_string_source.is_empty() && module.debug_module_processed.is_empty(), "{name}");
        assert!(module.all_inst_iter().all(|i| !matches!(i.class.opcode, Op::Line | Op::NoLine)), "{name}");
    }
}
