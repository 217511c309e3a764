//! The shader compiler.

use super::VERSION;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The pinned compiler: the one that `ORTHANT_SLANGC` names, or else that of the search path.
pub fn find_compiler() -> Result<PathBuf, String> {
    let named = std::env::var_os("ORTHANT_SLANGC").filter(|path| !path.is_empty());
    let compiler = PathBuf::from(named.unwrap_or_else(|| "slangc".into()));
    let how = format!(
        "The shaders are compiled with slangc {VERSION}. It comes inside the Python package slangtorch 1.3.22: download \
         the wheel without its dependencies, unzip it, and let ORTHANT_SLANGC name slangtorch/bin/slangc."
    );
    let output = Command::new(&compiler)
        .arg("-v")
        .output()
        .map_err(|e| format!("{} does not run: {e}. {how}", compiler.display()))?;
    // Some builds write it to the one stream and some to the other.
    let text = [output.stdout, output.stderr].concat();
    let version = String::from_utf8_lossy(&text).trim().trim_start_matches('v').to_owned();
    if version != VERSION {
        return Err(format!("{} is version {version}. {how}", compiler.display()));
    }
    Ok(compiler)
}

/// Compiles a source of the folder to SPIR-V.
pub fn compile(compiler: &Path, folder: &Path, source: &str, arguments: &[&str]) -> Result<Vec<u32>, String> {
    let name = source.replace('/', "-");
    let output = std::env::temp_dir().join(format!("orthant-{}-{name}.spv", std::process::id()));
    // The compiler may be named relative to where the caller is.
    let compiler = if compiler.components().count() > 1 {
        std::path::absolute(compiler).map_err(|e| format!("{}: {e}", compiler.display()))?
    } else {
        compiler.to_owned()
    };
    // Relative paths: nothing of the machine comes into the output.
    let run = Command::new(compiler)
        .current_dir(folder)
        .arg(source)
        .args(arguments)
        .arg("-o")
        .arg(&output)
        .output()
        .map_err(|e| format!("slangc does not run: {e}"))?;
    let messages = String::from_utf8_lossy(&run.stderr).into_owned();
    let compiled = std::fs::read(&output);
    // It may not be there: then the compiler has said why.
    let _ = std::fs::remove_file(&output);
    if !run.status.success() {
        return Err(format!("{source} does not compile:\n{messages}"));
    }
    let bytes = compiled.map_err(|e| format!("slangc wrote nothing for {source}: {e}\n{messages}"))?;
    Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
}
