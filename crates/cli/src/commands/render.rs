//! `orthant render`: a scene to an image, or to a share of one.

use crate::args::{AovArg, BackendArg, Common, EnvArg, FilterArg, RenderArgs, RendererArg, ViewArg};
use crate::failure::{Exit, Failure};
use crate::image_io::{Display, Format};
use crate::job::backend::{AnyBackend, Asked, backend_failure, cannot_rasterize, open};
use crate::job::{LoadOptions, Moment, Progress, Rendering, aov, camera, environment, load, settings};
use crate::output::{Named, check_not_read, check_outputs, write_atomically, write_bytes};
use crate::share::{Header, ShareWriter};
use orthant_resident::Frame;
use orthant_resident::film::BLOCK;
use orthant_resident::frame::{PixelFilter, Tile};
use orthant_resident::tonemap::ToneMapper;
use orthant_vulkan::raster::RasterOptions;
use serde_json::json;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Path vertices before Russian roulette may end a path.
const ROULETTE_DEPTH: u32 = 4;
/// Blocks of a share that are held at a time, in bytes.
const SHARE_BUFFER: u64 = 256 << 20;

/// Renders.
///
/// # Errors
/// Options that contradict each other or the scene (usage), a bad scene or environment (bad input), what is not built
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
    let options = LoadOptions {
        scene: args.scene,
        variant: args.variant.as_deref(),
        moment: moment(args),
        allow_external_files: args.allow_external_files,
        max_memory: common.max_memory(),
    };
    let mut loaded = load(&args.file, &options)?;
    check_not_read(&outputs, &loaded.files, &args.file)?;
    if !common.quiet {
        loaded.print_warnings();
        if loaded.derived.bounds().is_none() {
            eprintln!("warning: {}: the scene shows nothing", args.file.display());
        }
    }
    let view = camera::select(&loaded, args)?;
    let environment_start = Instant::now();
    let environment = environment::select(&loaded, args, common.max_memory() / 2)?;
    let environment_time = environment_start.elapsed();
    let frame = plan.frame(args, view.to_camera(loaded.derived.origin));

    let asked = Asked::new(args.backend, args.device.as_deref());
    let backend = open(&Asked { tracer: args.tracer, watched: args.validate, quiet: common.quiet, ..asked })?;
    if plan.raster.is_some() && matches!(backend, AnyBackend::Cpu(_)) {
        return Err(cannot_rasterize());
    }
    let mut work = Rendering::new(backend, &mut loaded, &environment, Progress::new(common.quiet));
    work.raster = plan.raster;
    // Whoever asks for a device gets it, or hears of it; a share is of one backend; and nothing else rasterizes.
    let has_asked = args.backend != BackendArg::Auto || args.device.is_some();
    work.may_fall_back = !(has_asked || plan.share || plan.raster.is_some());
    if args.stats.is_some() {
        work.backend.measure_stages();
    }
    work.load()?;
    if args.validate {
        work.backend.validate(&work.loaded.derived)?;
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
        aov::write(&args.output, &film, work.loaded.derived.origin)?;
    }
    work.progress.finish();
    if args.validate {
        // Rendering, too, may have given the validation layers something to say.
        work.backend.quiet().map_err(|what| Failure::new(Exit::CheckFailed, format!("--validate: {what}")))?;
    }
    if let Some(path) = &args.stats {
        let times = Times { environment: environment_time, total: start.elapsed() };
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
    let mut inputs = vec![("the scene", args.file.as_path())];
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
        refuse_what_is_not_built(args)?;
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

    fn frame(&self, args: &RenderArgs, camera: orthant_resident::Camera) -> Frame {
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
            world: None,
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

fn refuse_what_is_not_built(args: &RenderArgs) -> Result<(), Failure> {
    if args.world.is_some() {
        return Err(Failure::missing("worlds are not built yet: leave --world out"));
    }
    if args.renderer == RendererArg::Raster && args.backend == BackendArg::Cpu {
        return Err(cannot_rasterize());
    }
    Ok(())
}

/// Renders a share in runs of whole blocks, so that no more than [`SHARE_BUFFER`] bytes of them are held.
fn render_share(args: &RenderArgs, plan: &Plan, frame: &Frame, work: &mut Rendering<'_>) -> Result<(), Failure> {
    let Tile { x, y, width, height } = plan.tile;
    let choices = format!("{:?}", (args.scene, args.variant.as_deref(), moment(args)));
    let settings = settings::hash(&args.file, &work.loaded.scene, &choices, work.environment, frame)
        .map_err(|e| Failure::io(&args.file, "read the file", &e))?;
    // Which processor it is does not matter: the program names its kind. Each device and driver rounds in its own way.
    let backend = match work.backend.name() {
        "cpu" => "cpu".to_owned(),
        name => format!("{name} on {}", work.backend.device()),
    };
    let header = Header {
        program: settings::program(),
        backend,
        width: plan.width,
        height: plan.height,
        tile: [x, y, width, height],
        samples: [plan.samples.start, plan.samples.end],
        spp: args.spp,
        seed: args.seed,
        settings,
        tonemap: ToneMapper::from(args.tonemap).name().into(),
        exposure: args.exposure,
    };
    let blocks_at_once = (SHARE_BUFFER / (12 * plan.pixels())).clamp(1, 1 << 20) as u32;
    write_atomically(&args.output, |file| {
        let io = |e: std::io::Error| Failure::io(&args.output, "write the file", &e);
        let mut writer = ShareWriter::new(file, header).map_err(io)?;
        let mut at = plan.samples.start;
        while at < plan.samples.end {
            let end = at.saturating_add(blocks_at_once * BLOCK).min(plan.samples.end);
            let part = Frame { samples: at..end, ..frame.clone() };
            let done = plan.pixels() * u64::from(at - plan.samples.start);
            for block in &work.render(&part, done, plan.total_samples())?.blocks {
                writer.block(block).map_err(io)?;
            }
            at = end;
        }
        writer.finish();
        Ok(())
    })
}

struct Times {
    environment: Duration,
    total: Duration,
}

fn write_stats(path: &Path, plan: &Plan, work: &mut Rendering<'_>, times: &Times) -> Result<(), Failure> {
    let gpu = work.backend.stage_times().map_err(backend_failure)?;
    let Rendering { backend, loaded, spent, applied, upload, .. } = work;
    let bytes = backend.resident_bytes();
    let seconds = spent.time.as_secs_f64();
    let structures = applied.blas_time + applied.tlas_time;
    let rate = |count: u64| if seconds > 0.0 { count as f64 / seconds * 1e-6 } else { 0.0 };
    let mut stats = json!({
        "backend": backend.name(),
        "device": backend.device(),
        "width": plan.width,
        "height": plan.height,
        "samples": spent.samples,
        "load_s": loaded.load_time.as_secs_f64(),
        "derive_s": loaded.derive_time.as_secs_f64(),
        "environment_s": times.environment.as_secs_f64(),
        "upload_s": upload.saturating_sub(structures).as_secs_f64(),
        "blas_s": applied.blas_time.as_secs_f64(),
        "tlas_s": applied.tlas_time.as_secs_f64(),
        "render_s": seconds,
        "total_s": times.total.as_secs_f64(),
        "rays": {
            "camera": spent.rays.camera,
            "bounce": spent.rays.bounce,
            "shadow": spent.rays.shadow,
            "total": spent.rays.total(),
        },
        "mrays_s": rate(spent.rays.total()),
        "msamples_s": rate(spent.samples),
        "blas_built": applied.blas_built,
        "upload_bytes": applied.bytes,
        "memory": {
            "geometry": bytes.geometry,
            "acceleration": bytes.acceleration,
            "images": bytes.images,
            "rows": bytes.rows,
            "total": bytes.geometry + bytes.acceleration + bytes.images + bytes.rows,
        },
        "discarded_contributions": backend.discarded_contributions(),
        "gpu": gpu,
    });
    if let Some((report, bytes)) = plan.raster.and_then(|_| backend.raster_report()) {
        stats["raster"] = json!({
            "passes": report.passes,
            "drawn": report.drawn,
            "pass_s": report.pass_time.map(|time| time.as_secs_f64()),
            "cull_s": report.cull_time.map(|time| time.as_secs_f64()),
            "bytes": bytes,
        });
    }
    write_bytes(path, format!("{stats:#}\n").as_bytes())
}
