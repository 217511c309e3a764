//! `orthant bench`: figures, measured beside peers.

use crate::args::{BenchArgs, BenchSuite, Common, RendererArg};
use crate::bench::{self, Settings, Suite};
use crate::failure::Failure;
use crate::job::backend::Asked;
use crate::output::{print, print_json};
use std::path::Path;

/// Measures and prints.
///
/// # Errors
/// A scene that cannot be loaded; stdout that cannot be written.
pub fn run(args: &BenchArgs, common: &Common) -> Result<(), Failure> {
    let file = || args.file.as_deref().ok_or_else(|| Failure::usage("this suite needs a scene file"));
    let asked = Asked { tracer: args.tracer, quiet: common.quiet, ..Asked::new(args.backend, args.device.as_deref()) };
    let suite = match args.suite {
        BenchSuite::Load => Suite::Load(file()?),
        BenchSuite::Derive => own(args, Suite::Derive)?,
        BenchSuite::Resident => Suite::Resident(args.file.as_deref(), asked),
        BenchSuite::Edit => own(args, Suite::Edit(asked))?,
        BenchSuite::Bvh => own(args, Suite::Bvh)?,
        BenchSuite::WorldEdit => own(args, Suite::WorldEdit(asked))?,
        BenchSuite::WorldFrame => own(args, Suite::WorldFrame(asked))?,
        BenchSuite::Trace => Suite::Trace(file()?),
        BenchSuite::Render if args.renderer == RendererArg::Raster => Suite::Raster(file()?, asked),
        BenchSuite::Render => Suite::Render(file()?, asked),
    };
    if args.renderer == RendererArg::Raster && args.suite != BenchSuite::Render {
        return Err(Failure::usage("--renderer: only the suite render has one to choose").remedy("leave it out"));
    }
    let takes_size = match args.suite {
        BenchSuite::Edit | BenchSuite::Bvh | BenchSuite::WorldEdit | BenchSuite::WorldFrame => true,
        BenchSuite::Resident => args.file.is_none(),
        _ => false,
    };
    if args.size.is_some() && !takes_size {
        return Err(Failure::usage("--size: this suite has no size to choose").remedy("leave it out"));
    }
    let settings =
        Settings { runs: args.runs.into(), threads: args.threads, max_memory: common.max_memory(), size: args.size };
    let document = bench::run(suite, settings)?;
    if args.json { print_json(&document) } else { print(&bench::table(&document)) }
}

/// A suite that makes its own scenes, and takes no file.
fn own<'a>(args: &BenchArgs, suite: Suite<'a>) -> Result<Suite<'a>, Failure> {
    match &args.file {
        None => Ok(suite),
        Some(file) => {
            let what = format!("the suite makes what it measures itself: leave {} out", Path::display(file));
            Err(Failure::usage(what))
        }
    }
}
