//! `cargo run -p orthant --example soak`: long random edit sequences, followed and compared with full derivations.
//!
//! Each sequence begins with a scene as it was loaded and makes random edits, undos and redos. The derived scene follows
//! each; after every edit (every k-th in a large scene) it is compared with a full derivation, and with `--backend` so
//! are the rows that the backend has, and the hits of random rays. At the end everything is undone, and the export has to
//! be what it was.
//!
//! A failure is a file: a script of as few operations as halving finds, which `orthant edit --verify` replays.

#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../../render/tests/common/mod.rs"]
mod common;
mod finding;
mod minimise;
#[path = "../../../render/tests/sync/scenes.rs"]
mod scenes;
mod sequence;

use clap::Parser;
use orthant::args::BackendArg;
use orthant::failure::{Exit, Failure};
use orthant_scene::Scene;
use orthant_scene::edit::script::Operation;
use orthant_scene::export::{ExportOptions, gltf::to_glb};
use orthant_scene::import::{ImportOptions, import_path};
use sequence::{Finding, Source, Tally};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Random edit sequences, compared with full derivations
#[derive(Parser, Debug)]
#[command(after_help = "\
Exit codes: 0 nothing found; 3 bad input; 5 a difference was found. Its script lies in the folder of findings, and the \
command that replays it is printed.

Examples:
  cargo run -p orthant --example soak -- --minutes 60 --threads 1
  cargo run -p orthant --example soak -- --edits 2000 --seed 7 --scene city.glb --backend cpu")]
struct Args {
    /// Edits of a sequence
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    edits: usize,
    /// Seed of the first sequence; each further one takes the next
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Leave the first N sequences out: what one of them found is found again at once
    #[arg(long, value_name = "N", default_value_t = 0)]
    skip: usize,
    /// Run sequences, over all scenes in turn, for so long [default: one sequence for each scene]
    #[arg(long, value_name = "M")]
    minutes: Option<f64>,
    /// A scene, instead of the six of the tests; may be given several times
    #[arg(long, value_name = "FILE")]
    scene: Vec<PathBuf>,
    /// Keep a backend up to date as well, and compare its rows and the hits of rays
    #[arg(long, value_enum)]
    backend: Option<BackendArg>,
    /// Compare after every N-th edit [default: every one in a small scene, fewer in a large one]
    #[arg(long, value_name = "N")]
    every: Option<usize>,
    /// Threads of derivations; 0 takes all
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    /// Instead of random edits, replay a script over the scenes, and compare after each operation
    #[arg(long, value_name = "FILE.jsonl", conflicts_with = "minutes")]
    replay: Option<PathBuf>,
    /// Write the scene that each sequence leads to into this folder, before everything is undone, as .glb
    #[arg(long, value_name = "FOLDER")]
    export: Option<PathBuf>,
    /// Where scripts of failures go
    #[arg(long, value_name = "FOLDER", default_value = "soak-findings")]
    findings: PathBuf,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.exit as u8)
        }
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    let internal = |e: &dyn std::fmt::Display| Failure::new(Exit::Internal, e.to_string());
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global().map_err(|e| internal(&e))?;
    let sources = sources(args)?;
    for folder in args.export.iter().chain([&args.findings]) {
        std::fs::create_dir_all(folder).map_err(|e| Failure::io(folder, "make the folder", &e))?;
    }
    if let Some(path) = &args.replay {
        return replay(path, &sources);
    }
    let start = Instant::now();
    let limit = args.minutes.map(|minutes| Duration::from_secs_f64(minutes.max(0.0) * 60.0));
    let goes_on = |i: usize| limit.map_or(i < args.skip + sources.len(), |limit| start.elapsed() < limit);
    let mut sum = Tally::default();
    let mut sequences = args.skip;
    while goes_on(sequences) {
        let source = &sources[sequences % sources.len()];
        let seed = args.seed.wrapping_add(sequences as u64);
        let began = Instant::now();
        let (tally, finding) = sequence::run(source, seed, args.edits, args.export.as_deref());
        println!("{}: seed {seed}: {tally}, {:.1} s", source.name, began.elapsed().as_secs_f64());
        sum += tally;
        sequences += 1;
        if let Some(finding) = finding {
            return Err(report(args, source, seed, finding)?);
        }
    }
    println!(
        "{} sequences: {sum}, {:.1} minutes; nothing found",
        sequences - args.skip,
        start.elapsed().as_secs_f64() / 60.0
    );
    Ok(())
}

/// Runs a script over each scene.
fn replay(path: &Path, sources: &[Source]) -> Result<(), Failure> {
    let text = std::fs::read_to_string(path).map_err(|e| Failure::io(path, "read the script", &e))?;
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let parse = |(number, line): (usize, &str)| {
        let bad = |e: orthant_scene::edit::EditError| {
            Failure::bad_input(path, e.to_string()).at(format!("line {}", number + 1))
        };
        Operation::parse(line).map_err(bad)
    };
    let script: Vec<Operation> = lines.map(parse).collect::<Result<_, _>>()?;
    for source in sources {
        if let Some((done, what)) = minimise::failure(source, &script, true) {
            let what = format!("after {done} operations: {what}");
            return Err(Failure::new(Exit::CheckFailed, what).in_file(&source.path));
        }
        println!("{}: {} operations; nothing found", source.name, script.len());
    }
    Ok(())
}

/// The scenes, each as a file: what a script is replayed on is what it was found on.
fn sources(args: &Args) -> Result<Vec<Source>, Failure> {
    let mut files = args.scene.clone();
    if files.is_empty() {
        let folder = args.findings.join("scenes");
        std::fs::create_dir_all(&folder).map_err(|e| Failure::io(&folder, "make the folder", &e))?;
        for (name, scene) in scenes::all() {
            let path = folder.join(format!("{}.glb", name.replace(' ', "-")));
            write(&path, &glb(&scene, &path)?)?;
            files.push(path);
        }
    }
    let all = files.clone();
    let load = |path: PathBuf| -> Result<Source, Failure> {
        let imported = import_path(&path, &ImportOptions::default());
        let scene = imported.map_err(|e| Failure::new(Exit::BadInput, e.to_string()))?.scene;
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let merged = all.iter().filter_map(|path| std::path::absolute(path).ok()).collect();
        let source = Source::new(name, path, scene, merged, args.backend, args.every)?;
        println!("{source}");
        Ok(source)
    };
    files.into_iter().map(load).collect()
}

fn glb(scene: &Scene, path: &Path) -> Result<Vec<u8>, Failure> {
    let document = to_glb(scene, &ExportOptions::default());
    document.map(|files| files.document).map_err(|e| Failure::bad_input(path, e.to_string()))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    std::fs::write(path, bytes).map_err(|e| Failure::io(path, "write the file", &e))
}

/// Writes the script of a failure, as short as it gets, and says how to replay it.
fn report(args: &Args, source: &Source, seed: u64, finding: Finding) -> Result<Failure, Failure> {
    println!("{}: seed {seed}: after {} operations: {}", source.name, finding.script.len(), finding.what);
    let path = args.findings.join(format!("{}-{seed}.jsonl", source.name));
    let replay = finding::keep(source, &path, finding).map_err(|e| Failure::io(&path, "write the file", &e))?;
    println!("{} operations lead to it: {}", replay.operations, replay.what);
    Ok(Failure::new(Exit::CheckFailed, replay.what).remedy(format!("replay it with: {}", replay.command)))
}
