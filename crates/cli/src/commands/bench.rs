//! `orthant bench`: figures, measured beside peers.

use crate::args::{BenchArgs, BenchSuite, Common};
use crate::bench::{self, Settings, Suite};
use crate::failure::Failure;
use crate::output::{print, print_json};
use std::path::Path;

/// Measures and prints.
///
/// # Errors
/// A scene that cannot be loaded; stdout that cannot be written.
pub fn run(args: &BenchArgs, common: &Common) -> Result<(), Failure> {
    let file = || args.file.as_deref().ok_or_else(|| Failure::usage("this suite needs a scene file"));
    let suite = match args.suite {
        BenchSuite::Load => Suite::Load(file()?),
        BenchSuite::Derive | BenchSuite::Edit => {
            if let Some(file) = &args.file {
                return Err(Failure::usage(format!(
                    "the suite makes its own scenes: leave {} out",
                    Path::display(file)
                )));
            }
            if args.suite == BenchSuite::Edit { Suite::Edit } else { Suite::Derive }
        }
        BenchSuite::Trace => Suite::Trace(file()?),
        BenchSuite::Render => Suite::Render(file()?),
    };
    let settings = Settings { runs: args.runs.into(), threads: args.threads, max_memory: common.max_memory() };
    let document = bench::run(suite, settings)?;
    if args.json { print_json(&document) } else { print(&bench::table(&document)) }
}
