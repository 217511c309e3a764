//! Tasks of the repository: `cargo xtask check` (its checks, which are tests as well) and `cargo xtask shaders`.

mod arrows;
mod shaders;
mod tree;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let problems: Vec<String> = match arguments[..] {
        ["check"] => [arrows::check(), tree::check_asset_size(), tree::check_unsafe_files()].concat(),
        ["shaders"] => shaders::run(false),
        ["shaders", "--check"] => shaders::run(true),
        _ => {
            eprintln!("usage: cargo xtask check | shaders [--check]");
            return ExitCode::from(2);
        }
    };
    for problem in &problems {
        eprintln!("{problem}");
    }
    if problems.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The root of the repository.
fn root() -> &'static std::path::Path {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("xtask lies in the repository's root")
}
