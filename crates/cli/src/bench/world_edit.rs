//! `bench world-edit`: edits of a live world that is resident on a backend: plan and apply, full build, compaction.

use super::world::{Platforms, Rig, internal, on_pool};
use super::{Measured, Settings};
use crate::failure::Failure;
use crate::fly::edits::Random;
use crate::job::backend::{Asked, open};
use orthant_render::world::live::{Budget, CompactionOptions, Diagnostics, LiveOptions, LiveWorld};
use orthant_render::world::{BuildOptions, DerivedWorld, Quality};
use orthant_world::edit::fill_box;
use orthant_world::{Aabb4, Block, Fixed, Point4};
use std::time::{Duration, Instant};

/// Half extents of the worlds, in units, with about 27, 256, 1,050, 14,500 and a million platforms.
const HALF_EXTENTS: [i32; 5] = [352, 704, 1040, 2080, 6000];
/// Edits that are timed in a run: enough for a percentile.
const EDITS: usize = 2_000;
/// Edits after which the quality of the tree is looked at.
const RANDOM_EDITS: usize = 10_000;
/// Patches that change nothing, in a run.
const NOOPS: usize = 500;

/// Measures worlds of the suite's own sizes, or the one with about `settings.size` platforms.
pub fn run(asked: &Asked<'_>, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let sizes = settings.size.map_or(HALF_EXTENTS.to_vec(), |leaves| vec![Platforms::half_extent_of(leaves)]);
    let mut results = Vec::new();
    for half_extent in sizes {
        measure(half_extent, asked, settings, &mut results)?;
    }
    Ok(results)
}

fn measure(
    half_extent: i32,
    asked: &Asked<'_>,
    settings: Settings,
    results: &mut Vec<Measured>,
) -> Result<(), Failure> {
    let world = Platforms::world(half_extent)?;
    let n = world.region_count() as u64;
    let targets = Targets::of(&world.regions().map(|(_, region)| region.bounds).collect::<Vec<_>>());

    let one = if settings.threads == 0 { 1 } else { settings.threads };
    for (name, quality) in [("full_build", Quality::Fast), ("full_build_best", Quality::Best)] {
        let mut build = Measured::new(name, n).with("half_extent", half_extent);
        let options = BuildOptions { quality, ..BuildOptions::default() };
        let mut cost = 0.0;
        for _ in 0..settings.runs {
            let derived = on_pool(one, || build.time(|| DerivedWorld::build(&world, &options)))?;
            cost = derived.map_err(internal)?.sah_cost();
        }
        let rate = n as f64 / build.median_s().max(1e-12);
        results.push(build.with("threads", one).with("leaves_per_s", rate).with("sah_cost", cost));
    }

    let options = LiveOptions { compaction: CompactionOptions::ON_DEMAND, ..LiveOptions::default() };
    let live = LiveWorld::new(world, options).map_err(internal)?;
    let mut rig = Rig::new(live, open(asked)?)?;
    results.push(voxel_edits(&mut rig, &targets, n, settings)?);
    results.push(noop_patches(&mut rig, &targets, n, settings)?);
    quality(&mut rig, &targets, n, settings, results)
}

/// Boxes to break voxels of.
struct Targets(Vec<Aabb4>);

impl Targets {
    fn of(boxes: &[Aabb4]) -> Self {
        Self(boxes.to_vec())
    }

    /// A voxel of unit scale in one of the boxes.
    fn voxel(&self, random: &mut Random) -> Aabb4 {
        let target = &self.0[random.below(self.0.len() as u64) as usize];
        let (min, max) = (target.min_raw(), target.max_raw());
        let low: [i64; 4] = std::array::from_fn(|a| {
            (min[a] + random.below((max[a] - min[a]) as u64) as i64) >> Fixed::FRACTION_BITS << Fixed::FRACTION_BITS
        });
        let high = low.map(|c| c + Fixed::ONE.raw());
        Aabb4::from_raw(low, high).unwrap_or(*target)
    }
}

/// Breaks a voxel and puts it back, again and again: half of the edits are of either kind.
fn voxel_edits(rig: &mut Rig, targets: &Targets, n: u64, settings: Settings) -> Result<Measured, Failure> {
    let mut random = Random(1);
    let (mut times, mut frames, mut patch): (Vec<f64>, Vec<Diagnostics>, Vec<f64>) = Default::default();
    for run in 0..=settings.runs {
        let mut broken: Option<(Aabb4, Block)> = None;
        for _ in 0..EDITS {
            let (bounds, block) = broken.take().unwrap_or_else(|| (targets.voxel(&mut random), Block::AIR));
            if block.is_air() {
                broken = Some((bounds, rig.live.world().block_at(Point4::from_raw(bounds.min_raw()))));
            }
            let edit = fill_box(bounds, block);
            let start = Instant::now();
            rig.patch(&edit)?;
            let frame = rig.tick(&Budget::UNLIMITED)?;
            let time = start.elapsed();
            // The first run warms caches and grows arenas.
            if run > 0 {
                times.push(time.as_secs_f64());
                patch.push(frame.patch_ms / 1e3);
                frames.push(frame);
            }
        }
        rig.settle()?;
    }
    let most = |of: fn(&Diagnostics) -> u64| frames.iter().map(of).max().unwrap_or(0);
    let mut bytes: Vec<u64> = frames.iter().map(|frame| frame.upload_bytes).collect();
    bytes.sort_unstable();
    let mut measured = Measured::new("voxel_edit", n)
        .with("p99_s", quantile(&mut times.clone(), 0.99))
        .with("world_median_s", quantile(&mut patch, 0.5))
        .with("node_writes_max", most(|frame| frame.writes.nodes))
        .with("leaf_writes_max", most(|frame| frame.writes.leaves))
        .with("depth", most(|frame| frame.depth))
        .with("upload_bytes", bytes[bytes.len() / 2])
        .with("upload_bytes_max", bytes[bytes.len() - 1]);
    measured.runs = times.into_iter().map(Duration::from_secs_f64).collect();
    Ok(measured)
}

/// The value below which this share of the values lies; sorts them.
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * q) as usize]
}

fn noop_patches(rig: &mut Rig, targets: &Targets, n: u64, settings: Settings) -> Result<Measured, Failure> {
    let mut random = Random(2);
    let mut measured = Measured::new("noop_patch", n);
    let (mut bytes, mut noops) = (0, 0);
    for _ in 0..settings.runs * NOOPS {
        let bounds = targets.voxel(&mut random);
        let edit = fill_box(bounds, rig.live.world().block_at(Point4::from_raw(bounds.min_raw())));
        let frame = measured.time(|| rig.patch(&edit).and_then(|()| rig.tick(&Budget::UNLIMITED)))?;
        bytes += frame.upload_bytes;
        noops += frame.noop_patches;
    }
    Ok(measured.with("upload_bytes", bytes).with("noops", noops))
}

/// What random edits do to the tree, and what a compaction makes of that.
fn quality(
    rig: &mut Rig,
    targets: &Targets,
    n: u64,
    settings: Settings,
    results: &mut Vec<Measured>,
) -> Result<(), Failure> {
    let mut random = Random(3);
    let mut broken = std::collections::VecDeque::new();
    for _ in 0..RANDOM_EDITS {
        // A third of the edits takes an earlier one back.
        let earlier = if random.below(3) == 0 { broken.pop_front() } else { None };
        let (bounds, block) = earlier.unwrap_or_else(|| (targets.voxel(&mut random), Block::AIR));
        if block.is_air() {
            broken.push_back((bounds, rig.live.world().block_at(Point4::from_raw(bounds.min_raw()))));
        }
        rig.patch(&fill_box(bounds, block))?;
        rig.tick(&Budget::UNLIMITED)?;
    }
    rig.settle()?;
    let mut ratio = Measured::new("sah_ratio_after_edits", n)
        .with("edits", RANDOM_EDITS)
        .with("leaves", rig.live.derived().leaf_count());
    let fresh = |rig: &Rig, ratio: Option<&mut Measured>| -> Result<f64, Failure> {
        let derived = rig.live.derived();
        let build =
            || DerivedWorld::from_leaves(derived.leaves(), rig.live.world().palette(), &BuildOptions::default());
        let fresh = match ratio {
            Some(measured) => measured.time(build),
            None => build(),
        };
        Ok(derived.sah_cost() / fresh.map_err(internal)?.sah_cost())
    };
    let value = fresh(rig, Some(&mut ratio))?;
    results.push(ratio.with("ratio", value));

    let mut compaction = Measured::new("compaction", n);
    let (mut swap, mut frame_max, mut joined) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..settings.runs {
        rig.live.request_compaction("the benchmark asks");
        while !rig.live.is_settled() {
            // Frames of the default budget go on meanwhile.
            let frame = rig.tick(&Budget::default())?;
            frame_max = frame_max.max(frame.mutation_ms);
            swap = swap.max(frame.compaction.swap_ms.unwrap_or(0.0));
            joined += frame.compaction.joined.unwrap_or(0);
            compaction.runs.extend(frame.compaction.build_ms.map(|ms| Duration::from_secs_f64(ms / 1e3)));
            std::thread::sleep(Duration::from_micros(500));
        }
    }
    let value = fresh(rig, None)?;
    results.push(
        compaction
            .with("leaves", rig.live.derived().leaf_count())
            .with("joined", joined)
            .with("sah_ratio", value)
            .with("swap_s_max", swap / 1e3)
            .with("frame_mutation_s_max", frame_max / 1e3),
    );
    Ok(())
}
