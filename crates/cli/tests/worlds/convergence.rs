//! Any sequence of patches gives the hits of a fresh build and those of the judge.

use super::Random;
use super::patches::{HALF, UNIT, empty_world, patch};
use super::walk::{Tie, Walk};
use orthant_cpu::world::{RayEnd, Transit, WorldRay, WorldScene, trace_ray};
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits};
use orthant_resident::world::{WorldArenas, WorldCounts};
use orthant_world::{Aabb4, Applied, Point4, World};
use rayon::prelude::*;

const T_MAX: f32 = 80.0;

/// What was compared.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    rays: u64,
    hits: u64,
    inside: u64,
    attenuated: u64,
    ties: u64,
    leaves: usize,
}

impl Seen {
    fn add(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            hits: self.hits + other.hits,
            inside: self.inside + other.inside,
            attenuated: self.attenuated + other.attenuated,
            ties: self.ties + other.ties,
            leaves: self.leaves.max(other.leaves),
        }
    }
}

/// Where the derived world has to look again.
fn dirty(world: &World, applied: &Applied) -> Vec<Aabb4> {
    let regions = applied.added.iter().filter_map(|&id| world.region(id)).map(|region| region.bounds);
    let old = applied.removed.iter().chain(&applied.updated).map(|(_, region)| region.bounds);
    applied.changed.iter().copied().chain(regions).chain(old).collect()
}

/// Plans and commits boxes until none is left; those with cuts are not done again.
fn follow(derived: &mut DerivedWorld, world: &World, boxes: Vec<Aabb4>, limits: &OpLimits) {
    let mut queue = boxes;
    while let Some(bounds) = queue.pop() {
        let plan = derived.plan(world, &bounds, limits).expect("a plan");
        if !plan.batch.is_empty() {
            derived.commit(&plan.batch).expect("the next batch");
        }
        queue.extend(plan.deferred);
    }
}

fn trace(arenas: &WorldArenas, anchor: [i64; 4], o: [f32; 4], d: [f32; 4]) -> Transit {
    let scene = WorldScene::new(arenas, anchor, 1 << 16);
    trace_ray(&scene, &WorldRay::new(&scene, o, d, 0.0, T_MAX), &mut WorldCounts::default())
}

/// Compares rays through both sets with the judge.
fn compare(
    world: &World,
    sets: [&WorldArenas; 2],
    base: [i64; 4],
    random: &mut Random,
    rays: u64,
    label: &str,
) -> Seen {
    let mut seen = Seen { leaves: sets[1].leaves.len(), ..Seen::default() };
    let anchor = base.map(|c| c + random.between(-HALF * UNIT, HALF * UNIT));
    let walk = Walk::new(world, anchor);
    let solids: Vec<Aabb4> = world.regions().filter_map(|(_, region)| region.solid_bounds()).collect();
    for _ in 0..rays {
        // Rays lead through a place in or near a region: from within it, from near it, or from far outside of it all.
        let Some(solid) = (!solids.is_empty()).then(|| solids[random.below(solids.len() as u64) as usize]) else {
            break;
        };
        let d = random.direction();
        let back = [0.0, 6.0 * random.unit(), 40.0][random.below(3) as usize];
        let o = std::array::from_fn(|a| {
            let (low, high) = (solid.min_raw()[a] - anchor[a], solid.max_raw()[a] - anchor[a]);
            let place = low as f32 + (high - low) as f32 * (1.2 * random.unit() - 0.1);
            place / UNIT as f32 - back * d[a]
        });
        let truth = match walk.trace(o, d, f64::from(T_MAX)) {
            Ok(truth) => truth,
            Err(Tie) => {
                seen.ties += 1;
                continue;
            }
        };
        seen.rays += 1;
        let [edited, fresh] = sets.map(|arenas| trace(arenas, anchor, o, d));
        let context = || format!("{label}: anchor {anchor:?}, origin {o:?}, direction {d:?}");
        assert_eq!(edited, fresh, "{}", context());
        match (truth.surface, fresh.end) {
            (Some(surface), RayEnd::Hit(hit)) => {
                seen.hits += 1;
                let positive = d[surface.axis] < 0.0;
                let expected = (surface.axis, positive, surface.block.to_bits(), surface.plane);
                assert_eq!((hit.axis, hit.positive, hit.block, hit.plane), expected, "{}", context());
                let off = (f64::from(hit.t) - surface.t).abs();
                assert!(off <= surface.error, "{}: {} instead of {}", context(), hit.t, surface.t);
            }
            (None, RayEnd::Sky) => {}
            (surface, end) => panic!("{}: {end:?} instead of {surface:?}", context()),
        }
        seen.inside += u64::from(truth.inside);
        seen.attenuated += u64::from(truth.depth != [0.0; 3]);
        for c in 0..3 {
            let (passes, glow) = ((-truth.depth[c]).exp(), truth.glow[c]);
            let (found, shown) = (f64::from(fresh.transmittance[c]), f64::from(fresh.glow[c]));
            assert!((found - passes).abs() <= 2e-5 * passes, "{}: {found} of {passes} passes", context());
            assert!((shown - glow).abs() <= 2e-5 * glow + 1e-5, "{}: {shown} of {glow} glows", context());
        }
    }
    seen
}

/// A sequence of patches, compared now and then.
fn sequence(seed: u64, patches: usize, rays: u64) -> Seen {
    let mut random = Random(seed);
    let million = 1_000_000 * UNIT;
    let base = match seed % 4 {
        0 => [0; 4],
        1 => [-1920 * UNIT, 640 * UNIT, -64 * UNIT, 0],
        2 => [million, -million, million, -million],
        _ => [-million, million, 64 * UNIT, 0],
    };
    let mut world = empty_world();
    let clip = Aabb4::from_raw(base.map(|c| c - 64 * UNIT), base.map(|c| c + 64 * UNIT)).expect("a box");
    let options = BuildOptions { origin: Some(Point4::from_raw(base)), clip, ..BuildOptions::default() };
    let mut derived = DerivedWorld::build(&world, &options).expect("an empty world");
    // Small limits make cuts and halves of boxes.
    let limits = match seed % 3 {
        0 => OpLimits::default(),
        1 => OpLimits { chunks: 4, leaves: 12, focus: None },
        _ => OpLimits { chunks: 16, leaves: 48, focus: Some(Point4::from_raw(base)) },
    };
    let mut seen = Seen::default();
    for done in 1..=patches {
        for patch in patch(&mut random, &world, base) {
            let applied = world.apply(&patch).expect("a patch");
            let boxes = dirty(&world, &applied);
            follow(&mut derived, &world, boxes, &limits);
        }
        if done % (patches / 4) == 0 {
            derived.validate().unwrap_or_else(|fault| panic!("sequence {seed}, patch {done}: {fault}"));
            let fresh =
                DerivedWorld::build(&world, &BuildOptions { clip, ..BuildOptions::default() }).expect("a world");
            let sets = [derived.mirror(), fresh.mirror()];
            let label = format!("sequence {seed}, patch {done}");
            seen = seen.add(compare(&world, sets, base, &mut random, rays, &label));
        }
    }
    seen
}

#[test]
fn edited_worlds_are_seen_as_fresh_ones_and_as_the_judge_sees_them() {
    let total = (0..50_u64).into_par_iter().map(|seed| sequence(seed, 80, 5_200)).reduce(Seen::default, Seen::add);
    println!("{total:?}");
    assert!(total.rays > 1_000_000, "{total:?}");
    assert!(total.hits > 300_000 && total.inside > 50_000 && total.attenuated > 50_000, "{total:?}");
    // Rays for which rounding decides which face of an edge is met, or whether a corner is.
    assert!(total.ties < total.rays / 1000, "{total:?}");
}
