//! A ray in a dense chunk: a digital differential analyser in four dimensions (Amanatides and Woo 1987, "A Fast Voxel Traversal
//! Algorithm for Ray Tracing"), over the halves that hold nothing and over blocks.
//!
//! Every plane's parameter is computed from its integer coordinate, never from that of the plane before. So the state is a
//! function of the parameter alone: the ray is, on every axis, behind all planes whose parameter is not above it.

use super::leaf::{LeafInterval, Run};
use super::ray::{WorldRay, WorldScene};
use super::walk::Work;
use orthant_resident::world::{LeafRow, payload};

/// The blocks of a chunk along a ray.
struct Lattice<'a> {
    scene: &'a WorldScene<'a>,
    ray: &'a WorldRay,
    /// Lower corner of the chunk, raw.
    min: [i64; 4],
    /// Logarithms of the edges of a block, raw.
    block: [u32; 4],
    /// Logarithms of the blocks along the axes.
    size: [u32; 4],
}

impl Lattice<'_> {
    #[inline]
    fn forward(&self, axis: usize) -> bool {
        self.ray.inverse[axis] > 0.0
    }

    /// Raw coordinate of the plane below block `index`.
    #[inline]
    fn plane(&self, axis: usize, index: i32) -> i64 {
        self.min[axis] + (i64::from(index) << self.block[axis])
    }

    #[inline]
    fn plane_t(&self, axis: usize, index: i32) -> f32 {
        self.scene.plane_t(self.ray, axis, self.plane(axis, index))
    }

    /// The plane by which the ray leaves `cell`, and that by which it enters.
    #[inline]
    fn exit(&self, axis: usize, cell: i32) -> i32 {
        cell + i32::from(self.forward(axis))
    }

    #[inline]
    fn entry(&self, axis: usize, cell: i32) -> i32 {
        cell + i32::from(!self.forward(axis))
    }

    /// The block in which the ray is at `t`, which lies within the chunk.
    #[inline]
    fn cell_at(&self, axis: usize, t: f32) -> i32 {
        let last = (1 << self.size[axis]) - 1;
        // An estimate, and then the plane's own word on it.
        let edge = (1_u64 << self.block[axis]) as f32 * (1.0 / 65_536.0);
        let low = (self.min[axis] - self.scene.anchor[axis]) as f32 * (1.0 / 65_536.0);
        let place = (self.ray.origin[axis] + t * self.ray.direction[axis] - low) / edge;
        let mut cell = (place as i32).clamp(0, last);
        let step = if self.forward(axis) { 1 } else { -1 };
        while (0..=last).contains(&(cell + step)) && self.plane_t(axis, self.exit(axis, cell)) <= t {
            cell += step;
        }
        while (0..=last).contains(&(cell - step)) && self.plane_t(axis, self.entry(axis, cell)) > t {
            cell -= step;
        }
        cell
    }

    /// Number of a block in the chunk, and of the half that it lies in.
    #[inline]
    fn index(&self, cell: [i32; 4]) -> (usize, u32) {
        let (mut index, mut shift, mut part) = (0, 0, 0);
        for a in 0..4 {
            index |= (cell[a] as usize) << shift;
            shift += self.size[a];
            if self.size[a] > 0 {
                part |= (cell[a] as u32 >> (self.size[a] - 1)) << a;
            }
        }
        (index, part)
    }

    /// The plane by which the ray leaves the half that `cell` lies in.
    #[inline]
    fn half_exit(&self, axis: usize, cell: i32) -> i32 {
        let half = self.size[axis].saturating_sub(1);
        self.exit(axis, cell >> half) << half
    }
}

/// The first run of a dense chunk, see [`super::leaf::leaf_run`].
pub(super) fn chunk_run(
    scene: &WorldScene,
    ray: &WorldRay,
    leaf: &LeafRow,
    interval: &LeafInterval,
    from: f32,
    before: f32,
    work: &mut Work,
) -> Option<Run> {
    let chunk = &scene.arenas.payload[leaf.payload as usize..];
    let lattice = Lattice { scene, ray, min: leaf.chunk_min(), block: leaf.block_log2(), size: leaf.size_log2() };
    let mut t = interval.enter.max(from);
    let mut cell: [i32; 4] = std::array::from_fn(|a| lattice.cell_at(a, t));
    let mut exits: [f32; 4] = std::array::from_fn(|a| lattice.plane_t(a, lattice.exit(a, cell[a])));

    // Find the plane at the start, if there is one
    let (mut axis, mut plane) = (interval.axis, interval.plane);
    if from > interval.enter {
        for a in 0..4 {
            let entry = lattice.entry(a, cell[a]);
            if lattice.plane_t(a, entry) == t {
                (axis, plane) = (a, lattice.plane(a, entry));
            }
        }
    }

    let mut run: Option<Run> = None;
    loop {
        // Look at the block, or at the empty half around it
        if !work.step_cell() {
            return None;
        }
        let (index, part) = lattice.index(cell);
        let empty_half = leaf.coarse >> part & 1 == 0;
        let block = if empty_half || !payload::is_solid(chunk, index) { 0 } else { payload::block(chunk, index) };
        match &run {
            Some(run) if run.block != block => return Some(*run),
            None if block != 0 => run = Some(Run { t0: t, t1: t, block, axis, plane }),
            _ => {}
        }

        // Go to where it ends
        let next = if empty_half {
            let halves: [f32; 4] = std::array::from_fn(|a| lattice.plane_t(a, lattice.half_exit(a, cell[a])));
            halves[0].min(halves[1]).min(halves[2].min(halves[3]))
        } else {
            exits[0].min(exits[1]).min(exits[2].min(exits[3]))
        };
        let end = next.min(interval.leave);
        if let Some(run) = &mut run {
            run.t1 = end;
        }
        if next >= interval.leave || (run.is_none() && next >= before) {
            return run;
        }
        t = next;
        for a in 0..4 {
            while exits[a] <= t {
                // Of the planes that are passed within an empty half, only those at its end are a face.
                if exits[a] == t {
                    (axis, plane) = (a, lattice.plane(a, lattice.exit(a, cell[a])));
                }
                cell[a] += if lattice.forward(a) { 1 } else { -1 };
                exits[a] = lattice.plane_t(a, lattice.exit(a, cell[a]));
            }
        }
    }
}
