//! `orthant render`: a scene or a world to an image, or to a share of one.

mod content;
mod share;
mod stats;

use crate::args::{AovArg, BackendArg, Common, EnvArg, FilterArg, RenderArgs, RendererArg, ViewArg};
use crate::failure::{Exit, Failure};
use crate::image_io::{Display, Format};
use crate::job::backend::{AnyBackend, Asked, cannot_rasterize, open};
use crate::job::rendering::Subject;
use crate::job::{Moment, Progress, Rendering, WorldFormat, aov, environment};
use crate::output::{Named, check_outputs};
use content::Content;
use orthant_resident::film::BLOCK;
use orthant_resident::frame::{PixelFilter, Tile};
use orthant_resident::tonemap::ToneMapper;
use orthant_resident::world::WorldView;
use orthant_resident::{Camera, Frame};
use orthant_vulkan::raster::RasterOptions;
use share::render_share;
use stats::{Times, write_stats};
use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;

/// Path vertices before Russian roulette may end a path.
const ROULETTE_DEPTH: u32 = 4;

/// Renders.
///
/// # Errors
/// Options that contradict each other or the scene (usage), a bad scene, world or environment (bad input), what is not built
/// (missing), a difference that `--validate` found (check failed).
pub fn run(args: &RenderArgs, common: &Common) -> Result<(), Failure> {
    let start = Instant::now();
    let plan = Plan::new(args, common)?;
    let aovs: Vec<_> = args.aov.iter().map(|aov| aov::path(&args.output, aov.aov())).collect();
    let outputs = outputs(args, &aovs);
    check_files(args, &outputs)?;
    if args.threads > 0 {
        // Loading keeps to the number too. A pool that exists already (in tests) is as good.
        let _exists = rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global();
    }
    let mut content = Content::load(args, common, &outputs)?;
    let environment_start = Instant::now();
    let lights = content.loaded.as_ref().filter(|_| content.world.is_none());
    let environment = environment::select(lights, args, content.is_preview(args), common.max_memory() / 2)?;
    let mut times = Times { environment: environment_start.elapsed(), ..Times::default() };
    let shown = content.show(args, &environment, common)?;
    let frame = plan.frame(args, shown.camera, shown.view);
    let origin = shown.origin;
    times.load = content.load_time();
    times.derive = content.derive_time() + shown.derive_time;

    let asked = Asked::new(args.backend, args.device.as_deref());
    let backend = open(&Asked { tracer: args.tracer, watched: args.validate, quiet: common.quiet, ..asked })?;
    if plan.raster.is_some() && matches!(backend, AnyBackend::Cpu(_)) {
        return Err(cannot_rasterize());
    }
    let subject = Subject { loaded: content.loaded.as_mut(), world: shown.derived.as_ref() };
    let mut work = Rendering::new(backend, subject, &environment, Progress::new(common.quiet));
    work.raster = plan.raster;
    // Whoever asks for a device gets it, or hears of it; a share is of one backend; and nothing else rasterizes.
    let has_asked = args.backend != BackendArg::Auto || args.device.is_some();
    work.may_fall_back = !(has_asked || plan.share || plan.raster.is_some());
    if args.stats.is_some() {
        work.backend.measure_stages();
    }
    work.load()?;
    if args.validate {
        work.validate()?;
    }

    if plan.share {
        render_share(args, &plan, &frame, &mut work)?;
    } else {
        let film = work.render(&frame, 0, plan.total_samples())?;
        let tile = film.tile;
        let display = match args.view {
            None | Some(ViewArg::Shaded) => Display { tonemap: args.tonemap.into(), exposure: args.exposure },
            // Numbers, not light
            Some(_) => Display { tonemap: ToneMapper::None, exposure: 0.0 },
        };
        crate::image_io::write(&args.output, tile.width, tile.height, &film.resolve(), display)?;
        let origin = work.subject.loaded.as_ref().map_or(origin, |loaded| loaded.derived.origin);
        aov::write(&args.output, &film, origin)?;
    }
    work.progress.finish();
    if work.spent.world.exhausted > 0 && !common.quiet {
        let rays = work.spent.world.exhausted;
        eprintln!("warning: {rays} rays ran out of steps and are drawn in orange: give a smaller --distance");
    }
    if args.validate {
        // Rendering, too, may have given the validation layers something to say.
        work.backend.quiet().map_err(|what| Failure::new(Exit::CheckFailed, format!("--validate: {what}")))?;
    }
    if let Some(path) = &args.stats {
        times.total = start.elapsed();
        write_stats(path, &plan, &mut work, &times)?;
    }
    Ok(())
}

/// The image, its AOVs and the statistics are files of their own.
fn outputs<'p>(args: &'p RenderArgs, aovs: &'p [PathBuf]) -> Vec<Named<'p>> {
    let mut outputs = vec![("-o", args.output.as_path())];
    for (i, path) in aovs.iter().enumerate() {
        if !aovs[..i].contains(path) {
            outputs.push(("--aov", path));
        }
    }
    outputs.extend(args.stats.as_deref().map(|path| ("--stats", path)));
    outputs
}

/// None of the outputs is an input.
fn check_files(args: &RenderArgs, outputs: &[Named<'_>]) -> Result<(), Failure> {
    let mut inputs = vec![(if is_world(args) { "the world" } else { "the scene" }, args.file.as_path())];
    inputs.extend(args.world.as_deref().map(|path| ("--world", path)));
    if let Some(EnvArg::File(path)) = &args.env {
        inputs.push(("--env", path));
    }
    check_outputs(outputs, &inputs)
}

/// What is to be done, as far as the options alone say.
struct Plan {
    width: u32,
    height: u32,
    tile: Tile,
    samples: Range<u32>,
    share: bool,
    /// How it is rasterized, if it is.
    raster: Option<RasterOptions>,
}

impl Plan {
    fn new(args: &RenderArgs, common: &Common) -> Result<Self, Failure> {
        refuse_what_does_not_fit(args)?;
        let share = args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("share"));
        if !share {
            Format::of(&args.output).map_err(|_| {
                let what = format!("{}: an image is .png, .exr or .hdr, and a part .share", args.output.display());
                Failure::usage(what)
            })?;
        }
        let (width, height) = (args.size.width, args.size.height);
        let tile = args.tile.unwrap_or(Tile { x: 0, y: 0, width, height });
        let inside = |at: u32, size: u32, end: u32| u64::from(at) + u64::from(size) <= u64::from(end);
        if !inside(tile.x, tile.width, width) || !inside(tile.y, tile.height, height) {
            let Tile { x, y, width: w, height: h } = tile;
            return Err(Failure::usage(format!("--tile {x},{y},{w},{h} leaves the image of {width}x{height} pixels")));
        }
        let samples = args.samples.map_or(0..args.spp, |s| s.start..s.end);
        if args.samples.is_some() && !share {
            return Err(Failure::usage("--samples makes a share of an image: write it as -o NAME.share"));
        }
        if samples.end > args.spp || (!samples.end.is_multiple_of(BLOCK) && samples.end != args.spp) {
            let what = format!(
                "--samples {}..{} of {}: a range ends at a multiple of {BLOCK}, or at --spp",
                samples.start, samples.end, args.spp
            );
            return Err(Failure::usage(what));
        }
        let raster = match args.renderer {
            RendererArg::Path if args.view.is_some() => {
                let what = "--view says what the rasterizer shows";
                return Err(Failure::usage(what).remedy("add --renderer raster, or leave it out"));
            }
            RendererArg::Path => None,
            RendererArg::Raster if share => {
                return Err(Failure::usage("--renderer raster renders whole images: a .share is of the path tracer"));
            }
            RendererArg::Raster => {
                Some(RasterOptions { view: args.view.unwrap_or(ViewArg::Shaded).into(), ..RasterOptions::default() })
            }
        };
        if share && !args.aov.is_empty() {
            return Err(Failure::usage("a share carries no AOVs: render them in a run of their own"));
        }
        // The film's sums, a block, the picture and its bytes, and the AOVs
        let pixels = u64::from(tile.width) * u64::from(tile.height);
        let needed = pixels * (48 + 24 * args.aov.len() as u64);
        if needed > common.max_memory() {
            let what = format!("the image takes {needed} bytes, more than the limit of {}", common.max_memory());
            return Err(Failure::usage(what).remedy("render it by --tile, or raise --max-memory"));
        }
        Ok(Self { width, height, tile, samples, share, raster })
    }

    fn frame(&self, args: &RenderArgs, camera: Camera, world: Option<WorldView>) -> Frame {
        let mut aovs: Vec<AovArg> = Vec::new();
        for &name in &args.aov {
            if !aovs.contains(&name) {
                aovs.push(name);
            }
        }
        Frame {
            camera,
            width: self.width,
            height: self.height,
            tile: self.tile,
            samples: self.samples.clone(),
            keep_blocks: self.share,
            seed: args.seed,
            max_depth: args.max_depth,
            roulette_depth: ROULETTE_DEPTH,
            firefly_clamp: args.firefly_clamp,
            estimator: args.estimator.into(),
            filter: match args.filter {
                FilterArg::Box => PixelFilter::Box,
                FilterArg::Tent => PixelFilter::Tent { radius: 1.0 },
                FilterArg::BlackmanHarris => PixelFilter::BlackmanHarris { radius: 1.5 },
            },
            aovs: aovs.into_iter().map(AovArg::aov).collect(),
            threads: args.threads,
            world,
        }
    }

    fn pixels(&self) -> u64 {
        u64::from(self.tile.width) * u64::from(self.tile.height)
    }

    /// Pixel samples of the whole work.
    fn total_samples(&self) -> u64 {
        self.pixels() * u64::from(self.samples.end - self.samples.start)
    }
}

/// The time of an animation that is asked for: an animation without a time begins.
fn moment(args: &RenderArgs) -> Option<Moment<'_>> {
    let is_asked = args.time.is_some() || args.animation.is_some();
    is_asked.then(|| Moment { seconds: args.time.unwrap_or(0.0), animation: args.animation.as_deref() })
}

/// Whether FILE is a world.
fn is_world(args: &RenderArgs) -> bool {
    WorldFormat::of(&args.file).is_some()
}

/// Refuses options that are not for what FILE is.
fn refuse_what_does_not_fit(args: &RenderArgs) -> Result<(), Failure> {
    let refuse = |option: &str, why: &str, remedy: &str| {
        Err(Failure::usage(format!("{option} {why}")).in_file(&args.file).remedy(remedy.to_owned()))
    };
    if is_world(args) {
        let of_scenes = [
            ("--world", args.world.is_some()),
            ("--camera", args.camera.is_some()),
            ("--eye", args.eye.is_some()),
            ("--scene", args.scene.is_some()),
            ("--variant", args.variant.is_some()),
            ("--time", args.time.is_some()),
            ("--animation", args.animation.is_some()),
            ("--allow-external-files", args.allow_external_files),
        ];
        if let Some((option, _)) = of_scenes.into_iter().find(|(_, is_given)| *is_given) {
            let remedy = "leave it out; the camera of a world is placed by --pos, --yaw, --pitch, --xw and --zw";
            return refuse(option, "is for scenes, and this is a world", remedy);
        }
        let of_models = [AovArg::Node, AovArg::Primitive, AovArg::Material];
        if args.aov.iter().any(|aov| of_models.contains(aov)) {
            let remedy = "blocks have block, face and cell; all have albedo, normal, depth and position";
            return refuse("--aov node,primitive,material", "is for scenes, and this is a world", remedy);
        }
    } else {
        let given = args.world_view.given();
        if let (None, Some(option)) = (&args.world, given.first()) {
            return refuse(
                option,
                "is for worlds, and this is a scene",
                "leave it out, or add a world by --world W.orw",
            );
        }
        if args.world.is_none() && args.salvage {
            return refuse("--salvage", "is for .orw files, and this is a scene", "leave it out");
        }
        let of_blocks = [AovArg::Block, AovArg::Face, AovArg::Cell];
        if args.world.is_none() && args.aov.iter().any(|aov| of_blocks.contains(aov)) {
            return refuse("--aov block,face,cell", "is for worlds, and this is a scene", "leave it out");
        }
        if args.fov.is_some() && args.eye.is_none() {
            return refuse("--fov", "is of a camera by --eye and --target", "add these, or leave it out");
        }
    }
    if args.renderer == RendererArg::Raster && (is_world(args) || args.world.is_some()) {
        return refuse(
            "--renderer raster",
            "shows scenes alone",
            "leave it out; --shade preview is the fast mode of worlds",
        );
    }
    if args.renderer == RendererArg::Raster && args.backend == BackendArg::Cpu {
        return Err(cannot_rasterize());
    }
    Ok(())
}
