//! `manifest.json`: from what and with what the modules were compiled.

use super::VERSION;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;

/// A compiled module.
pub struct Module {
    pub source: String,
    pub arguments: Vec<&'static str>,
    pub output: String,
    pub hash: String,
}

/// See the module.
pub struct Manifest {
    /// Hash of each source by its path in the folder, with slashes.
    sources: BTreeMap<String, String>,
    pub modules: Vec<Module>,
}

/// Of bytes as they lie in a file.
pub fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

impl Manifest {
    /// Of all sources in the folder, without modules yet.
    pub fn new(folder: &Path) -> Result<Self, String> {
        let mut sources = BTreeMap::new();
        collect(folder, "", &mut sources).map_err(|e| format!("{}: {e}", folder.display()))?;
        Ok(Self { sources, modules: Vec::new() })
    }

    /// As it lies in the file.
    pub fn to_json(&self) -> String {
        let module = |module: &Module| {
            let Module { source, arguments, output, hash } = module;
            json!({ "source": source, "arguments": arguments.join(" "), "output": output, "blake3": hash })
        };
        let manifest = json!({
            "compiler": { "name": "slangc", "version": VERSION },
            "modules": self.modules.iter().map(module).collect::<Vec<_>>(),
            "sources": self.sources,
        });
        format!("{manifest:#}\n")
    }
}

fn collect(folder: &Path, prefix: &str, sources: &mut BTreeMap<String, String>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            collect(&entry.path(), &format!("{name}/"), sources)?;
        } else if name.ends_with(".slang") {
            sources.insert(name, hash(&std::fs::read(entry.path())?));
        }
    }
    Ok(())
}
