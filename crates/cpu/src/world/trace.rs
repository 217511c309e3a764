//! A ray in a world: through media to a surface.

use super::leaf::{Run, leaf_run};
use super::ray::{WorldRay, WorldScene};
use super::walk::{Work, nearest_run};
use glam::Vec3;
use orthant_resident::math::exp2;
use orthant_resident::world::rows::{block, flags};
use orthant_resident::world::{BlockRow, WorldCounts};
use std::f32::consts::LOG2_E;

/// Where a ray meets a surface: an opaque block begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldHit {
    /// Ray parameter.
    pub t: f32,
    /// The axis of the face.
    pub axis: usize,
    /// Whether the face's outward normal points to the positive end of the axis.
    pub positive: bool,
    /// The block's bits.
    pub block: u32,
    /// Raw coordinate of the face's plane.
    pub plane: i64,
}

/// How a ray ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RayEnd {
    /// At a surface.
    Hit(WorldHit),
    /// Nowhere.
    Sky,
    /// In the midst of its steps: the budget did not suffice.
    Exhausted,
}

/// A ray from its start to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transit {
    /// The end.
    pub end: RayEnd,
    /// What passes from there to the start.
    pub transmittance: Vec3,
    /// Radiance that arrives at the start from the media on the way.
    pub glow: Vec3,
}

/// The palette's row of a block; `None` if it has none.
#[inline]
pub fn block_row<'a>(scene: &WorldScene<'a>, bits: u32) -> Option<&'a BlockRow> {
    scene.arenas.palette.get(block::id(bits) as usize).filter(|row| row.flags & flags::KNOWN != 0)
}

/// Whether light passes a block, and how.
#[inline]
fn transparent_row<'a>(scene: &WorldScene<'a>, bits: u32) -> Option<&'a BlockRow> {
    block_row(scene, bits).filter(|row| row.flags & flags::TRANSPARENT != 0)
}

/// `exp(-depth)` by component.
#[inline]
pub(crate) fn exp_negative(depth: Vec3) -> Vec3 {
    Vec3::new(exp2(depth.x * -LOG2_E), exp2(depth.y * -LOG2_E), exp2(depth.z * -LOG2_E))
}

/// The media on a ray, from its start onwards.
struct Media {
    depth: Vec3,
    glow: Vec3,
}

impl Media {
    /// Passes a whole run.
    #[inline]
    fn pass(&mut self, scene: &WorldScene, bits: u32, length: f32) {
        let Some(row) = transparent_row(scene, bits) else { return };
        let depth = Vec3::from_array(row.absorption) * length;
        let emission = Vec3::from_array(row.emission);
        if emission != Vec3::ZERO {
            self.glow += exp_negative(self.depth) * emission * (Vec3::ONE - exp_negative(depth));
        }
        self.depth += depth;
    }
}

/// Follows a ray to the first surface.
///
/// A *run* is a stretch of one block, merged over the leaves and cells that it passes. The one that the ray begins in is no
/// surface, whatever it is made of. Absorption is summed over whole runs in their order, so that the result does not depend on how a
/// region is split.
pub fn trace_ray(scene: &WorldScene, ray: &WorldRay, counts: &mut WorldCounts) -> Transit {
    let mut work = Work::new(scene.step_budget);
    let mut media = Media { depth: Vec3::ZERO, glow: Vec3::ZERO };
    let end = follow(scene, ray, &mut media, &mut work);
    work.count(counts);
    let transmittance = if media.depth == Vec3::ZERO { Vec3::ONE } else { exp_negative(media.depth) };
    Transit { end, transmittance, glow: media.glow }
}

fn follow(scene: &WorldScene, ray: &WorldRay, media: &mut Media, work: &mut Work) -> RayEnd {
    let mut from = ray.t_min;
    // The run that the ray is in: its block and where it began.
    let mut current: Option<(u32, f32)> = None;
    let finish = |current: Option<(u32, f32)>, media: &mut Media, end: f32| {
        if let Some((bits, begin)) = current {
            media.pass(scene, bits, end.min(ray.t_max) - begin);
        }
    };
    let mut leaf = None;
    let mut is_start = true;
    while from < ray.t_max {
        // Find the next run: first in the leaf in which the last one ended
        let mut next: Option<Run> = leaf.and_then(|leaf| leaf_run(scene, ray, leaf, from, ray.t_max, work));
        if next.is_none() && !work.is_exhausted() {
            (next, leaf) = nearest_run(scene, ray, from, work).unzip();
        }
        if work.is_exhausted() {
            return RayEnd::Exhausted;
        }
        let Some(run) = next else { break };

        // Go on in it, or begin it
        let touches = run.t0 <= from;
        let goes_on = touches && current.is_some_and(|(bits, _)| bits == run.block);
        let begins_inside = touches && is_start;
        if !goes_on {
            finish(current, media, from);
            if !begins_inside && transparent_row(scene, run.block).is_none() {
                let positive = ray.inverse[run.axis] < 0.0;
                return RayEnd::Hit(WorldHit {
                    t: run.t0,
                    axis: run.axis,
                    positive,
                    block: run.block,
                    plane: run.plane,
                });
            }
            current = Some((run.block, run.t0));
        }
        is_start = false;
        from = run.t1;
    }
    finish(current, media, from);
    RayEnd::Sky
}
