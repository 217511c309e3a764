//! A ray in a leaf: the stretches of blocks along it.

use super::chunk::chunk_run;
use super::ray::{WorldRay, WorldScene};
use super::walk::Work;
use orthant_resident::world::LeafRow;
use orthant_resident::world::rows::{NO_PAYLOAD, kind};

/// A stretch of a ray in one block: all 32 bits of it are equal. Runs touch where `t1` of the one is `t0` of the other, exactly,
/// because they share a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Where it begins; the start of the search if it began before.
    pub t0: f32,
    /// Where it ends within its leaf.
    pub t1: f32,
    /// The block's bits.
    pub block: u32,
    /// The axis of the plane at `t0`: of several the highest.
    pub axis: usize,
    /// That plane's raw coordinate.
    pub plane: i64,
}

/// Where a ray is in a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeafInterval {
    pub enter: f32,
    pub leave: f32,
    /// The axis by whose plane it is entered: of several the highest.
    pub axis: usize,
    pub plane: i64,
}

/// The exact interval of a box; `None` if it is empty. (The intervals of boxes that share no point never overlap, since a plane's
/// parameter is monotonic in its coordinate: this is what makes runs the same however a region is split.)
#[inline]
pub(super) fn leaf_interval(scene: &WorldScene, ray: &WorldRay, leaf: &LeafRow) -> Option<LeafInterval> {
    let mut interval = LeafInterval { enter: f32::NEG_INFINITY, leave: f32::INFINITY, axis: 0, plane: 0 };
    for a in 0..4 {
        let (near, far) = if ray.inverse[a] > 0.0 { (leaf.min[a], leaf.max[a]) } else { (leaf.max[a], leaf.min[a]) };
        let (enter, leave) = (scene.plane_t(ray, a, near), scene.plane_t(ray, a, far));
        if enter >= interval.enter {
            (interval.enter, interval.axis, interval.plane) = (enter, a, near);
        }
        interval.leave = interval.leave.min(leave);
    }
    (interval.enter < interval.leave).then_some(interval)
}

/// The first run of a leaf that ends after `from` and begins before `before`. Blocks of the chunk that are next to each other along
/// the ray and equal are one run.
#[inline]
pub(super) fn leaf_run(
    scene: &WorldScene,
    ray: &WorldRay,
    leaf: &LeafRow,
    from: f32,
    before: f32,
    work: &mut Work,
) -> Option<Run> {
    let interval = leaf_interval(scene, ray, leaf)?;
    if interval.leave <= from || interval.enter >= before {
        return None;
    }
    if leaf.kind() == kind::UNIFORM || leaf.payload == NO_PAYLOAD {
        let LeafInterval { enter, leave, axis, plane } = interval;
        return Some(Run { t0: enter.max(from), t1: leave, block: leaf.block, axis, plane });
    }
    chunk_run(scene, ray, leaf, &interval, from, before, work)
}
