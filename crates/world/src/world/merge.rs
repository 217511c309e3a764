//! Joining: equal uniform regions that form a box become one.
//!
//! Two boxes that share a face join at once. That alone would get stuck: boxes can tile a box so that no two of them form one (in
//! the plane, four bricks around a fifth). So where a neighbour has the same block but another face, the hull of both is
//! closed under the regions that it touches; if all of them have the block and fill the hull, they are one region. A box that
//! was broken up by edits and is whole again is found from any two of its pieces, in whatever order they came back.

use super::region::{Content, RegionId};
use super::splice::Splice;
use crate::block::Block;
use crate::space::{Aabb4, Point4, Volume};
use std::ops::ControlFlow;

/// So many regions a closure may have. Larger ones are found in steps, or left: the content is the same.
const MOST: usize = 64;

/// So often a hull may grow before the search is given up.
const ROUNDS: usize = 8;

impl Splice<'_> {
    /// Joins what was put in with what lies beside it.
    pub fn join_fresh(&mut self) {
        let mut next = 0;
        // Joined regions are put in themselves, and come up later.
        while let Some(&id) = self.fresh.get(next) {
            next += 1;
            self.join(id);
        }
    }

    /// Joins a region with what lies beside it, once.
    fn join(&mut self, id: RegionId) {
        let Some((bounds, block)) = self.uniform(id) else { return };
        for axis in 0..4 {
            for side in [beyond_min(&bounds, axis), beyond_max(&bounds, axis)].into_iter().flatten() {
                let Some(beside) = self.region_at(side) else { continue };
                let Some((other, _)) = self.uniform(beside).filter(|&(_, other)| other == block) else { continue };
                let hull = bounds.hull(&other);
                let found = if bounds.forms_a_box_with(&other) {
                    Some((hull, vec![id, beside]))
                } else {
                    self.close(hull, block)
                };
                if let Some((hull, parts)) = found {
                    for part in parts {
                        self.remove(part);
                    }
                    let region = super::Region::uniform(hull, block).expect("a region is not air");
                    self.insert(region);
                    return;
                }
            }
        }
    }

    fn uniform(&self, id: RegionId) -> Option<(Aabb4, Block)> {
        let region = self.world.regions.get(id)?;
        match region.content {
            Content::Uniform(block) => Some((region.bounds, block)),
            Content::Chunk { .. } => None,
        }
    }

    /// The least box about a hull that no region crosses, and its regions, if they all are of the block and fill it.
    fn close(&mut self, mut hull: Aabb4, block: Block) -> Option<(Aabb4, Vec<RegionId>)> {
        for _ in 0..ROUNDS {
            let mut parts = Vec::new();
            let mut volume = Volume::default();
            let mut about = hull;
            let flow = self.world.query_counted(&hull, &mut self.work, |id, region| {
                if region.content != Content::Uniform(block) || parts.len() == MOST {
                    return ControlFlow::Break(());
                }
                parts.push(id);
                about = about.hull(&region.bounds);
                volume = volume.plus(Volume::of(&region.bounds));
                ControlFlow::Continue(())
            });
            if flow.is_break() {
                return None;
            }
            if about == hull {
                return (volume == Volume::of(&hull)).then_some((hull, parts));
            }
            hull = about;
        }
        None
    }
}

/// The point beside the lower corner, beyond the lower face of an axis; `None` at the end of space.
fn beyond_min(bounds: &Aabb4, axis: usize) -> Option<Point4> {
    let mut at = bounds.min_raw();
    at[axis] -= 1;
    Some(Point4::from_raw(at)).filter(|&point| Aabb4::SPACE.contains_point(point))
}

/// The point beside the lower corner, beyond the upper face of an axis.
fn beyond_max(bounds: &Aabb4, axis: usize) -> Option<Point4> {
    let mut at = bounds.min_raw();
    at[axis] = bounds.max_raw()[axis];
    Some(Point4::from_raw(at)).filter(|&point| Aabb4::SPACE.contains_point(point))
}
