//! `orthant world fly`: the frame loop without a window.

use crate::args::values::WorldPoint;
use crate::args::{Common, FlyArgs, ScenarioArg, ShadeArg, WorldViewArgs};
use crate::failure::Failure;
use crate::fly::live_failure;
use crate::fly::{Camera, Flight, Scenario, Script, line::line};
use crate::image_io::Display;
use crate::job::backend::{Asked, backend_failure, open};
use crate::job::world::warn_of_unknown_blocks;
use crate::job::world_view::{WorldShot, build_options, world_failure};
use crate::job::{Progress, load_world};
use crate::output::{check_outputs, print, write_atomically};
use orthant_render::sky::{DEFAULT_SUN, clear_sky};
use orthant_render::world::live::{Budget, Diagnostics, LiveOptions, LiveWorld};
use orthant_render::world::view::position;
use orthant_resident::tonemap::ToneMapper;
use orthant_resident::{Environment, Film};
use orthant_world::{Aabb4, Fixed, Point4, World};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

/// Flies: a line of diagnostics and, where they are asked for, a picture a frame; a summary on stdout.
///
/// # Errors
/// A bad world (bad input), options that do not go together (usage), a device that is missing or gone (missing), a difference that
/// `--validate` found (check failed).
pub fn run(args: &FlyArgs, common: &Common) -> Result<(), Failure> {
    check_outputs(&[("--diagnostics", &args.diagnostics)], &[("the world", &args.world)])?;
    if args.threads > 0 {
        // Deriving keeps to the number too. A pool that exists already (in tests) is as good.
        let _exists = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global();
    }
    let loaded = load_world(&args.world, false, common.max_memory())?;
    if !common.quiet {
        loaded.print_warnings();
        warn_of_unknown_blocks(&loaded.path, &loaded.world);
    }
    let (mut flight, mut script) = prepare(args, common, loaded.world)?;
    if let Some(folder) = &args.images {
        std::fs::create_dir_all(folder).map_err(|e| Failure::io(folder, "make the folder", &e))?;
    }
    let mut progress = Progress::new(common.quiet);
    let mut summary = Summary::default();
    write_atomically(&args.diagnostics, |w| {
        for number in 1..=args.frames {
            let has_picture = args.images.is_some() && number % args.every == 0;
            let (frame, film) = flight.frame(&mut script, has_picture)?;
            let mut entry = line(&frame);
            entry["stages"] = flight.backend.stage_times().map_err(backend_failure)?;
            writeln!(w, "{entry}").map_err(|e| Failure::io(&args.diagnostics, "write the diagnostics", &e))?;
            if let (Some(folder), Some(film)) = (&args.images, film) {
                write_image(&folder.join(format!("frame-{number:06}.png")), &film)?;
            }
            summary.add(&frame);
            progress.step("flying", u64::from(number), u64::from(args.frames));
        }
        Ok(())
    })?;
    progress.finish();
    print(&summary.text())
}

fn prepare(args: &FlyArgs, common: &Common, world: World) -> Result<(Flight, Script), Failure> {
    let scenario = match args.scenario {
        ScenarioArg::Look => Scenario::Look,
        ScenarioArg::Fly => Scenario::Fly,
        ScenarioArg::Churn => Scenario::Churn,
        ScenarioArg::Stream => Scenario::Stream,
    };
    let half_extent = f64::from(args.half_extent);
    let environment = clear_sky(DEFAULT_SUN);
    let camera = camera(args, &world, &environment)?;
    let clip = match scenario {
        // What is resident is what the stream sends.
        Scenario::Stream => Aabb4::SPACE,
        _ => about(camera.shot.camera.position, half_extent)?,
    };
    let mut backend = open(&Asked {
        watched: args.validate,
        quiet: common.quiet,
        ..Asked::new(args.backend, args.device.as_deref())
    })?;
    backend.measure_stages();
    backend.set_environment(environment).map_err(backend_failure)?;
    let (world, source) = Script::worlds(scenario, world);
    let build = build_options(clip, common.max_memory());
    let mut live = LiveWorld::new(world, LiveOptions { build, ..LiveOptions::default() }).map_err(world_failure)?;
    live.load(&mut *backend).map_err(live_failure)?;
    let script = Script::new(scenario, args.frames, half_extent, args.seed.into(), &live, source);
    let budget = Budget {
        ms: args.budget_ms.map_or(Budget::default().ms, f64::from),
        bytes: args.budget_bytes.map_or(Budget::default().bytes, |bytes| bytes.0),
        operations: args.budget_ops.unwrap_or(Budget::default().operations),
    };
    Ok((Flight { live, backend, camera, budget, validate: args.validate }, script))
}

/// Who looks: as `render` does, but for shading, which is the preview's unless something else is asked for, and for the position, which
/// is on the ground in the middle of the world.
fn camera(args: &FlyArgs, world: &World, environment: &Environment) -> Result<Camera, Failure> {
    let view = WorldViewArgs {
        pos: args.view.pos.or_else(|| Some(WorldPoint(ground(world)))),
        shade: args.view.shade.or(Some(ShadeArg::Preview)),
        ..args.view.clone()
    };
    let (width, height) = (args.size.width, args.size.height);
    let shot = WorldShot::select(world, &view, None, f64::from(width) / f64::from(height))?;
    let shade = Camera::shade(&shot, environment);
    Ok(Camera { shot, shade, width, height, spp: args.spp, seed: args.seed, threads: args.threads })
}

/// Two units above the highest block in the middle of the world, at `w = 0.5` or as near to that as anything is.
fn ground(world: &World) -> Point4 {
    const EYES: i64 = 2 << Fixed::FRACTION_BITS;
    let above_nothing = position([0.0, 2.0, 0.0, 0.5]).unwrap_or_default();
    let Some(solid) = world.solid_bounds() else { return above_nothing };
    let (min, max) = (solid.min_raw(), solid.max_raw());
    let mut at: [i64; 4] = std::array::from_fn(|a| (min[a] + max[a]) >> 1);
    at[3] = (1_i64 << (Fixed::FRACTION_BITS - 1)).clamp(min[3], max[3] - 1);
    let (mut low, mut high) = (at, at.map(|c| c + 1));
    (low[1], high[1]) = (min[1], max[1]);
    let mut top = None;
    if let Ok(column) = Aabb4::from_raw(low, high) {
        let _all: ControlFlow<()> = world.query(&column, |_, region| {
            top = top.max(region.solid_bounds().map(|solid| solid.max_raw()[1]));
            ControlFlow::Continue(())
        });
    }
    at[1] = (top.unwrap_or(at[1]) + EYES).min(Aabb4::SPACE.max_raw()[1] - 1);
    Point4::from_raw(at)
}

/// The cube of a half extent about a point, as far as space reaches.
fn about(at: Point4, half_extent: f64) -> Result<Aabb4, Failure> {
    let half = Fixed::from_f64(half_extent).map_err(|e| Failure::usage(format!("--half-extent: {e}")))?.raw();
    let (low, high) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
    let at = at.raw();
    let min = std::array::from_fn(|a| at[a].saturating_sub(half).max(low[a]));
    let max = std::array::from_fn(|a| at[a].saturating_add(half).min(high[a]));
    Aabb4::from_raw(min, max).map_err(|e| Failure::usage(format!("--pos: {e}")))
}

fn write_image(path: &Path, film: &Film) -> Result<(), Failure> {
    let display = Display { tonemap: ToneMapper::KhronosNeutral, exposure: 0.0 };
    crate::image_io::write(path, film.tile.width, film.tile.height, &film.resolve(), display)
}

/// What all frames did together.
#[derive(Default)]
struct Summary {
    frame_ms: Vec<f64>,
    mutation_ms: Vec<f64>,
    upload_bytes: u64,
    staged_bytes: u64,
    edits: u64,
    patches: u64,
    swaps: u64,
    given_up: u64,
    rebuilds: u64,
    queue: u64,
    exhausted: u64,
}

impl Summary {
    fn add(&mut self, frame: &Diagnostics) {
        self.frame_ms.push(frame.frame_ms);
        self.mutation_ms.push(frame.mutation_ms);
        self.upload_bytes += frame.upload_bytes;
        self.staged_bytes += frame.compaction.upload_bytes;
        self.edits += frame.edits_applied;
        self.patches += frame.patches;
        self.swaps = frame.compaction.finished_total;
        self.given_up = frame.compaction.discarded_total;
        self.rebuilds = frame.rebuilds_total;
        self.queue = frame.queue_length;
        self.exhausted += frame.rays.exhausted;
    }

    fn text(&mut self) -> String {
        let quantiles = |times: &mut Vec<f64>| {
            times.sort_by(f64::total_cmp);
            let at = |q: f64| times.get(((times.len() - 1) as f64 * q) as usize).copied().unwrap_or(0.0);
            format!("median {:.3} ms, p99 {:.3} ms, largest {:.3} ms", at(0.5), at(0.99), at(1.0))
        };
        let frames = self.frame_ms.len();
        format!(
            "frames     {frames}\nframe      {}\nmutation   {}\npatches    {}\noperations {}\nuploads    {} bytes, {} of \
             compactions\nqueue      {} at the end\ncompaction {} finished, {} given up\nrebuilds   {}\nexhausted  {} rays\n",
            quantiles(&mut self.frame_ms),
            quantiles(&mut self.mutation_ms),
            self.patches,
            self.edits,
            self.upload_bytes,
            self.staged_bytes,
            self.queue,
            self.swaps,
            self.given_up,
            self.rebuilds,
            self.exhausted,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_world::{Block, BlockId, RegionTree, Scale, WorldPatch};

    #[test]
    fn a_flight_begins_above_the_highest_block_in_the_middle() {
        let mut world = World::new();
        for (min, max) in
            [([0; 4], [100, 10, 60, 1]), ([40, 20, 20, 0], [60, 30, 40, 1]), ([0, 90, 0, 0], [1, 99, 1, 1])]
        {
            let bounds = Aabb4::from_ints(min, max).expect("a box");
            let tree = RegionTree::uniform(bounds, Block::of(BlockId(1), Scale::UNIT));
            world.apply(&WorldPatch::of_tree(tree)).expect("applied");
        }
        assert_eq!(ground(&world).0.map(Fixed::to_f64), [50.0, 32.0, 30.0, 0.5]);
        assert_eq!(ground(&World::new()).0.map(Fixed::to_f64), [0.0, 2.0, 0.0, 0.5]);
    }

    #[test]
    fn what_is_resident_ends_at_the_end_of_space() {
        let box_about = |c: i64| about(Point4::from_raw([c; 4]), 16.0).expect("a box");
        assert_eq!(box_about(0), Aabb4::from_ints([-16; 4], [16; 4]).expect("a box"));
        assert_eq!(box_about((1 << 61) - 1).max_raw(), [1 << 61; 4]);
    }
}
