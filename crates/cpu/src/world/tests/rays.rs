//! Rays against a walk over all planes in double precision.

use super::super::testing::{Content, Random, UNIT, bits, id, is_close, palette};
use super::super::trace::{RayEnd, Transit, WorldHit, trace_ray};
use super::super::{WorldRay, WorldScene};
use glam::Vec3;
use orthant_resident::world::rows::flags;
use orthant_resident::world::{WorldArenas, WorldCounts};

const BUDGET: u32 = 1 << 16;

fn trace(arenas: &WorldArenas, anchor: [i64; 4], o: [f32; 4], d: [f32; 4]) -> Transit {
    let scene = WorldScene::new(arenas, anchor, BUDGET);
    trace_ray(&scene, &WorldRay::new(&scene, o, d, 0.0, 1e3), &mut WorldCounts::default())
}

fn hit(transit: &Transit) -> WorldHit {
    match transit.end {
        RayEnd::Hit(hit) => hit,
        other => panic!("no hit: {other:?}"),
    }
}

/// What a ray meets.
struct Truth {
    /// Parameter, axis and block of the first surface.
    hit: Option<(f64, usize, u32)>,
    /// Optical depth and glow on the way there.
    depth: Vec3,
    glow: Vec3,
}

/// Blocks of `2^log2` raw steps in a cube of `size` of them about 0, by place from its lower corner.
struct Grid {
    log2: u32,
    size: i64,
    blocks: Vec<u32>,
}

impl Grid {
    /// Lower corner, in blocks.
    fn low(&self) -> i64 {
        -self.size / 2
    }

    fn at(&self, cell: [i64; 4]) -> u32 {
        let place = cell.map(|c| c - self.low());
        if place.iter().any(|&p| p < 0 || p >= self.size) {
            return 0;
        }
        self.blocks[place.iter().rev().fold(0, |index, &p| index * self.size + p) as usize]
    }

    fn random(random: &mut Random, log2: u32, share: u64, part: i64) -> Self {
        let size = 16_i64;
        // Cells of several blocks, so that runs have lengths, and of half a chunk, so that there are empty ones.
        let coarse: Vec<u32> = (0..8_usize.pow(4))
            .map(|_| if random.below(100) < share { bits(1 + random.below(7) as u32, 0) } else { 0 })
            .collect();
        let mut blocks = Vec::new();
        for index in 0..size.pow(4) {
            let place: [i64; 4] = std::array::from_fn(|a| index / size.pow(a as u32) % size);
            let cell = place.iter().rev().fold(0, |at, &p| at * 8 + p / part);
            let own = if random.below(20 * (part as u64 - 1).pow(4)) == 0 {
                bits(random.below(7) as u32, 0)
            } else {
                coarse[cell as usize]
            };
            blocks.push(own);
        }
        let blocks = blocks.into_iter().map(|b| if id(b) == 0 { 0 } else { b }).collect();
        Self { log2, size, blocks }
    }

    fn as_chunks(&self) -> Content {
        let mut content = Content::default();
        for chunk in 0..16 {
            let cell: [i64; 4] = std::array::from_fn(|a| (chunk >> a & 1) - 1);
            content.dense(false, self.log2, cell, |p| self.at(std::array::from_fn(|a| cell[a] * 8 + p[a] as i64)));
        }
        content
    }

    fn as_boxes(&self) -> Content {
        let mut content = Content::default();
        for index in 0..self.size.pow(4) {
            let cell: [i64; 4] = std::array::from_fn(|a| index / self.size.pow(a as u32) % self.size + self.low());
            let block = self.at(cell);
            if block != 0 {
                content.uniform(cell.map(|c| c << self.log2), cell.map(|c| (c + 1) << self.log2), block);
            }
        }
        content
    }

    /// The truth, in double precision; `None` where two planes are so near to each other that rounding decides.
    fn walk(&self, o: [f32; 4], d: [f32; 4]) -> Option<Truth> {
        let (o, d) = (o.map(f64::from), d.map(f64::from));
        let edge = (1_i64 << self.log2) as f64 / UNIT as f64;
        let mut crossings = vec![(0.0, 4)];
        for a in 0..4 {
            for k in self.low()..=self.low() + self.size {
                let t = (k as f64 * edge - o[a]) / d[a];
                if t > 0.0 {
                    crossings.push((t, a));
                }
            }
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let rows = palette();
        let mut runs: Vec<(f64, usize, u32, f64)> = Vec::new();
        for pair in crossings.windows(2) {
            let ((t0, axis), (t1, _)) = (pair[0], pair[1]);
            if t1 - t0 < 1e-5 * (1.0 + t1) {
                return None;
            }
            let middle = (t0 + t1) / 2.0;
            let block = self.at(std::array::from_fn(|a| ((o[a] + middle * d[a]) / edge).floor() as i64));
            match runs.last_mut() {
                Some(run) if run.2 == block => run.3 = t1,
                _ => runs.push((t0, axis, block, t1)),
            }
        }
        let (mut depth, mut glow) = (Vec3::ZERO, Vec3::ZERO);
        for (i, &(t0, axis, block, t1)) in runs.iter().enumerate() {
            let row = &rows[id(block) as usize];
            if block == 0 {
                continue;
            }
            if row.flags & flags::TRANSPARENT == 0 {
                if i > 0 {
                    return Some(Truth { hit: Some((t0, axis, block)), depth, glow });
                }
                continue;
            }
            let through = Vec3::from_array(row.absorption) * (t1 - t0) as f32;
            let passes = |v: Vec3| Vec3::new((-v.x).exp(), (-v.y).exp(), (-v.z).exp());
            glow += passes(depth) * Vec3::from_array(row.emission) * (Vec3::ONE - passes(through));
            depth += through;
        }
        Some(Truth { hit: None, depth, glow })
    }
}

#[test]
fn chunks_and_boxes_are_hit_where_a_walk_over_all_planes_says() {
    let mut random = Random(1);
    let (mut hits, mut skipped, mut inside) = (0, 0, 0);
    for (log2, share, part) in [(13, 30, 2), (16, 60, 2), (19, 10, 2), (15, 30, 4)] {
        let grid = Grid::random(&mut random, log2, share, part);
        let (chunks, boxes) = (grid.as_chunks().arenas([0; 4]), grid.as_boxes().arenas([UNIT * 7; 4]));
        let half = (8 << log2) as f32 / UNIT as f32;
        for _ in 0..4000 {
            let o = std::array::from_fn(|_| (2.0 * random.unit() - 1.0) * 1.5 * half);
            let d = random.direction();
            let Some(Truth { hit: expected, depth, glow }) = grid.walk(o, d) else {
                skipped += 1;
                continue;
            };
            inside += u32::from(o.iter().all(|c| c.abs() < half));
            let found = [&chunks, &boxes].map(|arenas| trace(arenas, [0; 4], o, d));
            assert_eq!(found[0], found[1], "{o:?} {d:?}");
            match (expected, found[0].end) {
                (Some((t, axis, block)), RayEnd::Hit(hit)) => {
                    hits += 1;
                    assert_eq!((hit.axis, hit.block, hit.positive), (axis, block, d[axis] < 0.0), "{o:?} {d:?}");
                    assert!((f64::from(hit.t) - t).abs() <= 4e-7 * t, "{} for {t}", hit.t);
                }
                (None, RayEnd::Sky) => {}
                other => panic!("{o:?} {d:?}: {other:?}"),
            }
            let passes = Vec3::new((-depth.x).exp(), (-depth.y).exp(), (-depth.z).exp());
            assert!(is_close(found[0].transmittance, passes), "{} for {passes}", found[0].transmittance);
            assert!(is_close(found[0].glow, glow));
        }
    }
    assert!(hits > 2500 && inside > 2000 && skipped < 60, "{hits} hits, {inside} inside, {skipped} ties");
}

#[test]
fn a_world_a_million_units_away_is_hit_at_the_same_bits() {
    let mut random = Random(2);
    let grid = Grid::random(&mut random, 13, 30, 2);
    let near = grid.as_chunks().arenas([0; 4]);
    let by = [1_000_000 * UNIT, -999_936 * UNIT, 64 * UNIT, -1_000_000 * UNIT];
    let far = grid.as_chunks().moved(by).arenas([3 * UNIT; 4]);
    for _ in 0..2000 {
        let o = std::array::from_fn(|_| 2.0 * random.unit() - 1.0);
        let d = random.direction();
        let (a, b) = (trace(&near, [0; 4], o, d), trace(&far, by, o, d));
        assert_eq!((a.transmittance, a.glow), (b.transmittance, b.glow));
        match (a.end, b.end) {
            (RayEnd::Hit(a), RayEnd::Hit(b)) => {
                assert_eq!(WorldHit { plane: a.plane + by[a.axis], ..a }, b);
            }
            (a, b) => assert_eq!(a, b),
        }
    }
}

#[test]
fn one_region_in_three_encodings_is_passed_with_the_same_bits() {
    for block in [bits(1, 0), bits(5, 0)] {
        let mut encodings = [Content::default(), Content::default(), Content::default()];
        encodings[0].uniform([-8 * UNIT; 4], [8 * UNIT; 4], block);
        for chunk in 0..16 {
            let cell = std::array::from_fn(|a| (chunk >> a & 1) - 1);
            encodings[1].uniform_chunk(16, cell, block);
            encodings[2].dense(false, 16, cell, |_| block);
        }
        let arenas = encodings.map(|content| content.arenas([0; 4]));
        let mut random = Random(3);
        for _ in 0..2000 {
            let o = std::array::from_fn(|_| (2.0 * random.unit() - 1.0) * 20.0);
            let d = random.direction();
            let [a, b, c] = [0, 1, 2].map(|i| trace(&arenas[i], [0; 4], o, d));
            assert_eq!((a, a), (b, c), "{o:?} {d:?}");
        }
    }
}

#[test]
fn flat_chunks_span_a_unit_of_w() {
    let mut content = Content::default();
    content.dense(true, 13, [-1, 0, 0, 0], |[x, y, z, w]| {
        assert_eq!(w, 0);
        if (x, y, z) == (3, 4, 5) { bits(2, -3) } else { 0 }
    });
    let arenas = content.arenas([0; 4]);
    let x = (-16.0 + 3.0) / 8.0;
    let o = [x - 5.0, 4.5 / 8.0, 5.5 / 8.0, 0.9];
    let found = hit(&trace(&arenas, [0; 4], o, [1.0, 0.0, 0.0, 0.0]));
    assert_eq!((found.t, found.axis, found.positive, found.plane), (5.0, 0, false, -13 * 8192));
    let beside = [o[0], o[1], o[2], 1.01];
    assert_eq!(trace(&arenas, [0; 4], beside, [1.0, 0.0, 0.0, 0.0]).end, RayEnd::Sky);
    let along_w = hit(&trace(&arenas, [0; 4], [x + 0.06, o[1], o[2], -3.0], [0.0, 0.0, 0.0, 1.0]));
    assert_eq!((along_w.t, along_w.axis), (3.0, 3));
}

#[test]
fn the_block_that_a_ray_begins_in_is_no_hit_nor_is_what_continues_it() {
    let mut content = Content::default();
    content.uniform([0; 4], [UNIT; 4], bits(1, 0));
    content.uniform([UNIT, 0, 0, 0], [2 * UNIT, UNIT, UNIT, UNIT], bits(1, 0));
    content.uniform([2 * UNIT, 0, 0, 0], [3 * UNIT, UNIT, UNIT, UNIT], bits(5, 0));
    content.uniform([3 * UNIT, 0, 0, 0], [4 * UNIT, UNIT, UNIT, UNIT], bits(1, 0));
    let arenas = content.arenas([0; 4]);
    let along_x = [1.0, 0.0, 0.0, 0.0];
    let through = trace(&arenas, [0; 4], [0.25, 0.5, 0.5, 0.5], along_x);
    assert_eq!(hit(&through).t, 2.75);
    assert!(is_close(through.transmittance, Vec3::new(-0.1, -0.2, -0.4).map(f32::exp)));
    assert_eq!(hit(&trace(&arenas, [0; 4], [-1.0, 0.5, 0.5, 0.5], along_x)).t, 1.0);
    assert_eq!(hit(&trace(&arenas, [0; 4], [2.5, 0.5, 0.5, 0.5], along_x)).t, 0.5);
}

#[test]
fn a_ray_without_steps_left_is_no_miss() {
    let mut random = Random(4);
    let arenas = Grid::random(&mut random, 16, 20, 2).as_chunks().arenas([0; 4]);
    let mut counts = WorldCounts::default();
    let mut exhausted = 0;
    for _ in 0..500 {
        let scene = WorldScene::new(&arenas, [0; 4], 12);
        let o = std::array::from_fn(|_| (2.0 * random.unit() - 1.0) * 10.0);
        let ray = WorldRay::new(&scene, o, random.direction(), 0.0, 1e3);
        let few = trace_ray(&scene, &ray, &mut counts).end;
        let all = trace(&arenas, [0; 4], o, ray.direction).end;
        exhausted += u64::from(few == RayEnd::Exhausted);
        assert!(few == all || few == RayEnd::Exhausted);
    }
    assert!(exhausted > 50 && exhausted < 500, "{exhausted}");
    assert_eq!((counts.exhausted, counts.rays), (exhausted, 500));
    assert!(counts.node_visits + counts.leaf_visits + counts.dda_steps <= 13 * 500);
}

#[test]
fn an_empty_world_is_all_sky() {
    assert_eq!(trace(&WorldArenas::default(), [5; 4], [0.0; 4], [0.0, 0.0, 1.0, 0.0]).end, RayEnd::Sky);
}
