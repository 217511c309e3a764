//! `cargo xtask shaders`: compiles the shaders of the Vulkan backend, from `crates/vulkan/shaders/*.slang` to
//! `spirv/*.spv` beside them, and says in `manifest.json` from what and with what.
//!
//! The compiled modules are committed, so that a build needs no shader compiler. The same sources and the same compiler
//! give the same bytes on every machine.

mod compile;
mod hit_objects;
mod manifest;
mod strip;

use manifest::{Manifest, Module};
use std::path::{Path, PathBuf};

/// The version of `slangc` that the committed modules are made with.
const VERSION: &str = "2026.14.1";

/// What every module is compiled with. No multiplication and addition is fused (`precise`), and the output is not optimised:
/// drivers do that, and the optimiser would be one more program to pin.
const ARGUMENTS: [&str; 13] = [
    "-target",
    "spirv",
    "-profile",
    "spirv_1_5",
    "-fp-mode",
    "precise",
    "-O0",
    "-fvk-use-entrypoint-name",
    "-I",
    ".",
    // The profile says nothing of the capabilities that entry points add to it.
    "-Wno-41012",
    "-warnings-as-errors",
    "all",
];

/// The modules by the name of their source, with what they are compiled with besides. Optional capabilities are in modules
/// of their own: a device takes no module with one that it has not.
const MODULES: [(&str, &[&str]); 14] = [
    ("path", &[]),
    ("path_stages", &[]),
    ("path_query", &[]),
    ("path_reorder", &["-capability", "spvShaderInvocationReorderNV"]),
    ("instances", &[]),
    ("raster/cull", &[]),
    ("raster/draw", &[]),
    ("raster/environment", &[]),
    ("raster/resolve", &[]),
    ("world/path", &[]),
    ("world/path_query", &[]),
    ("world/path_scene", &[]),
    ("world/preview", &[]),
    ("world/scatter", &[]),
];

/// A file and what it is to hold.
type File = (PathBuf, Vec<u8>);

fn folder() -> PathBuf {
    crate::root().join("crates/vulkan/shaders")
}

/// Compiles all modules and writes them and the manifest; with `check` compares them with those that are there instead.
/// Problems, one a line.
pub fn run(check: bool) -> Vec<String> {
    let folder = folder();
    let made = compile::find_compiler().and_then(|compiler| build(&compiler, &folder));
    let (manifest, outputs) = match made {
        Ok(made) => made,
        Err(problem) => return vec![problem],
    };
    let mut files = outputs;
    files.push((folder.join("manifest.json"), manifest.to_json().into_bytes()));
    files.into_iter().filter_map(|(path, bytes)| settle(&path, &bytes, check).err()).collect()
}

/// Writes a file, or compares it.
fn settle(path: &Path, bytes: &[u8], check: bool) -> Result<(), String> {
    let at = path.display();
    if !check {
        let folder = path.parent().expect("files of the shaders lie in a folder");
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        return std::fs::write(path, bytes).map_err(|e| format!("{at}: {e}"));
    }
    match std::fs::read(path) {
        Ok(there) if there == bytes => Ok(()),
        Ok(_) => Err(format!("{at} is not what the sources compile to; run `cargo xtask shaders`")),
        Err(e) => Err(format!("{at}: {e}; run `cargo xtask shaders`")),
    }
}

/// The manifest, and the modules with their paths.
fn build(compiler: &Path, folder: &Path) -> Result<(Manifest, Vec<File>), String> {
    let mut manifest = Manifest::new(folder)?;
    let mut outputs = Vec::new();
    for (name, more) in MODULES {
        let source = format!("{name}.slang");
        let arguments = [&ARGUMENTS, more].concat();
        let compiled = compile::compile(compiler, folder, &source, &arguments)?;
        let words = strip::strip(&compiled)
            .and_then(|words| hit_objects::alias(&words))
            .map_err(|problem| format!("{source}: {problem}"))?;
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        let output = format!("spirv/{name}.spv");
        let hash = manifest::hash(&bytes);
        manifest.modules.push(Module { source, arguments, output: output.clone(), hash });
        outputs.push((folder.join(output), bytes));
    }
    Ok((manifest, outputs))
}

#[cfg(test)]
mod tests {
    /// Where a compiler is named, or one is demanded.
    #[test]
    fn the_committed_modules_are_what_the_sources_compile_to() {
        let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        if !set("ORTHANT_SLANGC") && !set("ORTHANT_REQUIRE_SLANGC") {
            eprintln!("skipped: ORTHANT_SLANGC is not set");
            return;
        }
        assert_eq!(super::run(true), Vec::<String>::new());
    }
}
