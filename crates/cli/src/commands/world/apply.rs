//! `orthant world apply`: a script of patches, applied to a world and to what is derived from it.
//!
//! The world changes at once; what is derived follows by operations of the planner, box by box, until nothing is left to do: each is
//! a batch that is applied to arenas in memory and then to the planner's mirror, as a renderer does it.

mod check;
mod follow;
mod report;

use crate::args::{ApplyArgs, Common};
use crate::failure::{Exit, Failure};
use crate::job::world::{check_extension, warn_of_unknown_blocks, write_world};
use crate::job::{Progress, load_world};
use crate::output::{Named, check_outputs, write_bytes};
use follow::Follower;
use orthant_world::edit::{EditLimits, WorldEdit};
use orthant_world::{Applied, World, WorldPatch};
use report::Entry;
use serde_json::json;
use std::io::Read;
use std::time::Instant;

/// Applies the script, reports, and writes the world.
///
/// # Errors
/// A bad world or script, a refused patch (bad input); a difference that `--verify` found (check failed).
pub fn run(args: &ApplyArgs, common: &Common) -> Result<(), Failure> {
    check_extension("-o", &args.output)?;
    check_files(args)?;
    let max_memory = common.max_memory();
    let loaded = load_world(&args.world, args.salvage, max_memory)?;
    if !common.quiet {
        loaded.print_warnings();
    }
    let script = read_script(args, max_memory)?;
    let mut world = loaded.world;
    // What nobody asks for is not derived.
    let is_followed = args.report.is_some() || args.verify;
    let mut follower = is_followed.then(|| Follower::new(&world, max_memory)).transpose()?;
    if let (true, Some(follower)) = (args.verify, &follower) {
        check::all(&world, follower).map_err(verify_failed)?;
    }

    let mut report = String::new();
    let mut refused = 0_usize;
    let mut progress = Progress::new(common.quiet);
    let bytes = script.len() as u64;
    let mut at_byte = 0;
    for (number, line) in script.lines().enumerate() {
        at_byte += line.len() as u64 + 1;
        progress.step("applying", at_byte.min(bytes), bytes);
        let line = line.strip_prefix('\u{feff}').unwrap_or(line).trim();
        if line.is_empty() {
            continue;
        }
        let at = |failure: Failure| failure.in_file(&args.patches).at(format!("line {}", number + 1));
        match apply(&mut world, line, max_memory) {
            Ok((applied, mut entry)) => {
                if let Some(follower) = &mut follower {
                    entry.planned = follower.follow(&world, &applied).map_err(at)?;
                }
                if let (true, Some(follower)) = (args.verify, &follower) {
                    check::all(&world, follower).map_err(|what| at(verify_failed(what)))?;
                }
                if args.report.is_some() {
                    report.push_str(&format!("{}\n", entry.line()));
                }
            }
            Err(reason) if args.keep_going => {
                refused += 1;
                report.push_str(&format!("{}\n", json!({ "line": number + 1, "refused": reason })));
                if !common.quiet {
                    eprintln!("warning: {}: line {}: {reason}", args.patches.display(), number + 1);
                }
            }
            Err(reason) => {
                let remedy = "mend the line, or leave refused patches out with --keep-going; nothing is written";
                return Err(at(Failure::new(Exit::BadInput, reason).remedy(remedy)));
            }
        }
    }
    progress.finish();
    if !common.quiet {
        warn_of_unknown_blocks(&args.output, &world);
        if refused > 0 {
            eprintln!("warning: {refused} patches were refused and left out");
        }
    }
    if let Some(path) = &args.report {
        write_bytes(path, report.as_bytes())?;
    }
    write_world(&args.output, &world)
}

fn verify_failed(what: String) -> Failure {
    Failure::new(Exit::CheckFailed, format!("--verify: {what}"))
}

/// The world may be written onto itself; nothing else may be an input and an output.
fn check_files(args: &ApplyArgs) -> Result<(), Failure> {
    let (world, script) = (("the world", args.world.as_path()), ("--patches", args.patches.as_path()));
    let output: Named<'_> = ("-o", args.output.as_path());
    let report = args.report.as_deref().map(|path| ("--report", path));
    check_outputs(&[output], &[script])?;
    check_outputs(report.as_slice(), &[world, script])?;
    let both: Vec<_> = std::iter::once(output).chain(report).collect();
    check_outputs(&both, &[])
}

fn read_script(args: &ApplyArgs, max_memory: u64) -> Result<String, Failure> {
    let path = &args.patches;
    let metadata = std::fs::metadata(path).map_err(|e| Failure::io(path, "read the script", &e))?;
    if metadata.is_dir() {
        return Err(Failure::bad_input(path, "is a folder").remedy("name a file with one JSON object a line"));
    }
    // A pipe does not say how much there is.
    let file = std::fs::File::open(path).map_err(|e| Failure::io(path, "read the script", &e))?;
    let mut script = String::new();
    let limit = max_memory.saturating_add(1);
    let read = file.take(limit).read_to_string(&mut script).map_err(|e| Failure::io(path, "read the script", &e))?;
    if read as u64 == limit {
        let what = format!("the script has more bytes than the limit of {max_memory}");
        return Err(Failure::bad_input(path, what).remedy("split it, or raise --max-memory"));
    }
    Ok(script)
}

/// One line of the script: what it did to the world.
///
/// A line whose later patches are refused (a ball is several) leaves the world as it was.
fn apply(world: &mut World, line: &str, max_memory: u64) -> Result<(Vec<Applied>, Entry), String> {
    let start = Instant::now();
    let edit = parse(line)?;
    let patches = edit.patches(world, &EditLimits::default()).map_err(|e| e.to_string())?;
    let limits = orthant_world::Limits { regions: (max_memory / REGION_BYTES).min(1 << 22) as usize };
    let about = patches.iter().map(|patch| patch.authoritative_bounds).reduce(|about, bounds| about.hull(&bounds));
    let before = about.filter(|_| patches.len() > 1).map(|about| world.extract(&about));
    let mut applied = Vec::with_capacity(patches.len());
    for patch in &patches {
        match world.apply_within(patch, &limits) {
            Ok(done) => applied.push(done),
            Err(error) => {
                let taken_back = before.map(|before| world.apply(&WorldPatch::of_tree(before))).transpose();
                return Err(taken_back.map_or_else(|again| again.to_string(), |_| error.to_string()));
            }
        }
    }
    let entry = Entry::new(report::name(&edit), &applied, start.elapsed());
    Ok((applied, entry))
}

/// Memory of a region while a patch is applied, the chunk that it may have included.
const REGION_BYTES: u64 = 8 << 10;

/// An edit from a line. What is wrong is told without the parser's name of its own types, with the column.
fn parse(line: &str) -> Result<WorldEdit, String> {
    if !line.starts_with('{') {
        return Err("this is no JSON object: a line begins with {".into());
    }
    serde_json::from_str(line).map_err(|error| {
        let text = error.to_string();
        let what = text.rsplit_once(" at line ").map_or(text.as_str(), |(what, _)| what);
        let expected = "a line is {\"set\"}, {\"fill\"} or {\"sphere\"} with a \"block\", or {\"patch\"}";
        match error.classify() {
            serde_json::error::Category::Data => format!("{what}; {expected}"),
            _ => format!("column {}: this is no JSON: {what}", error.column()),
        }
    })
}
