//! What becomes of a failure: a script beside its scene, as short as it gets, and the command that replays it.

use crate::minimise::minimise;
use crate::sequence::{Finding, Source};
use orthant::args::BackendArg;
use orthant_scene::edit::script::Operation;
use std::path::Path;

/// A failure that can be replayed.
pub struct Replay {
    /// What fails.
    pub what: String,
    /// Operations of the shortened script.
    pub operations: usize,
    /// The command.
    pub command: String,
}

/// Writes the script of a failure.
pub fn keep(source: &Source, script: &Path, finding: Finding) -> std::io::Result<Replay> {
    // The whole one first: making it shorter takes a while.
    std::fs::write(script, lines(&finding.script))?;
    let (shorter, what) = minimise(source, finding);
    std::fs::write(script, lines(&shorter))?;
    let command = format!(
        "orthant edit {} --ops {} --verify --keep-going{}",
        source.path.display(),
        script.display(),
        match source.backend {
            None => "",
            Some(BackendArg::Auto) => " --backend auto",
            Some(BackendArg::Cpu) => " --backend cpu",
            Some(BackendArg::Vulkan) => " --backend vulkan",
        }
    );
    Ok(Replay { what, operations: shorter.len(), command })
}

/// A script as it stands in a file.
pub fn lines(script: &[Operation]) -> String {
    script.iter().map(|op| serde_json::to_string(op).map_or_else(|e| e.to_string(), |line| line + "\n")).collect()
}
