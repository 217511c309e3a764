//! Joining: equal uniform regions that form a box become one.
//!
//! Two boxes that share a face join at once. That alone would get stuck: boxes can tile a box so that no two of them form one (in
//! the plane, four bricks around a fifth). So where a neighbour has the same block but another face, the hull of both is
//! closed under the regions that it touches; if all of them have the block and fill the hull, they are one region. A box that
//! was broken up by edits and is whole again is found from any two of its pieces, in whatever order they came back.

use super::region::{Content, Region, RegionId};
use super::splice::Splice;
use crate::block::Block;
use crate::space::{Aabb4, Fixed, Point4, Volume};
use std::ops::ControlFlow;

/// So many regions a closure may have. Larger ones are found in steps, or left: the content is the same.
const MOST: usize = 64;

/// So often a hull may grow before the search is given up.
const ROUNDS: usize = 8;

/// Up to so many regions about an edit are kept in a list, which answers without the index.
const NEAR: usize = 48;

/// All regions that share points with a box, kept while regions are joined. The many small questions about an edit's
/// surroundings are answered from it.
struct Near {
    bounds: Aabb4,
    regions: Vec<(RegionId, Aabb4, Option<Block>)>,
}

/// The block of a uniform region.
fn block_of(region: &Region) -> Option<Block> {
    match region.content {
        Content::Uniform(block) => Some(block),
        Content::Chunk { .. } => None,
    }
}

impl Splice<'_> {
    /// Joins what was put in with what lies beside it.
    pub fn join_fresh(&mut self) {
        let live = self.fresh.iter().filter_map(|&id| self.world.regions.get(id));
        let Some(hull) = live.map(|region| region.bounds).reduce(|hull, b| hull.hull(&b)) else { return };
        let mut near = self.near(&hull);
        let mut next = 0;
        // Joined regions are put in themselves, and come up later.
        while let Some(&id) = self.fresh.get(next) {
            next += 1;
            self.join(id, &mut near);
        }
    }

    /// What lies in and beside a box, unless that is much.
    fn near(&mut self, hull: &Aabb4) -> Option<Near> {
        let step = Fixed::STEP.raw();
        let about = Aabb4::from_raw(hull.min_raw().map(|c| c - step), hull.max_raw().map(|c| c + step));
        // At the end of space the index is asked.
        let bounds = about.ok()?;
        let mut regions = Vec::new();
        let flow = self.world.query_counted(&bounds, &mut self.work, |id, region| {
            regions.push((id, region.bounds, block_of(region)));
            if regions.len() > NEAR { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        flow.is_continue().then_some(Near { bounds, regions })
    }

    /// Joins a region with what lies beside it, once.
    fn join(&mut self, id: RegionId, near: &mut Option<Near>) {
        let Some(region) = self.world.regions.get(id) else { return };
        let Some(block) = block_of(region) else { return };
        let bounds = region.bounds;
        for axis in 0..4 {
            for side in [beyond_min(&bounds, axis), beyond_max(&bounds, axis)].into_iter().flatten() {
                let Some((beside, other)) = self.uniform_at(side, block, near) else { continue };
                let hull = bounds.hull(&other);
                let found = if bounds.forms_a_box_with(&other) {
                    Some((hull, vec![id, beside]))
                } else {
                    self.close(hull, block, near)
                };
                if let Some((hull, parts)) = found {
                    let region = Region::uniform(hull, block).expect("a region is not air");
                    for &part in &parts {
                        self.remove(part);
                    }
                    let joined = self.insert(region);
                    if let Some(near) = near {
                        near.regions.retain(|(id, ..)| !parts.contains(id));
                        near.regions.push((joined, hull, Some(block)));
                    }
                    return;
                }
            }
        }
    }

    /// The region of a block that holds a point.
    fn uniform_at(&mut self, point: Point4, block: Block, near: &Option<Near>) -> Option<(RegionId, Aabb4)> {
        if let Some(near) = near.as_ref().filter(|near| near.bounds.contains_point(point)) {
            let (id, bounds, own) = near.regions.iter().find(|(_, bounds, _)| bounds.contains_point(point))?;
            return (*own == Some(block)).then_some((*id, *bounds));
        }
        let id = self.region_at(point)?;
        let region = self.world.regions.get(id)?;
        (block_of(region) == Some(block)).then_some((id, region.bounds))
    }

    /// The least box about a hull that no region crosses, and its regions, if they all are of the block and fill it.
    fn close(&mut self, mut hull: Aabb4, block: Block, near: &Option<Near>) -> Option<(Aabb4, Vec<RegionId>)> {
        for _ in 0..ROUNDS {
            let mut parts = Vec::new();
            let mut volume = Volume::default();
            let mut about = hull;
            let mut take = |id, bounds: &Aabb4, own| {
                if own != Some(block) || parts.len() == MOST {
                    return ControlFlow::Break(());
                }
                parts.push(id);
                about = about.hull(bounds);
                volume = volume.plus(Volume::of(bounds));
                ControlFlow::Continue(())
            };
            let flow = match near.as_ref().filter(|near| near.bounds.contains(&hull)) {
                Some(near) => {
                    let mut within = near.regions.iter().filter(|(_, bounds, _)| bounds.overlaps(&hull));
                    within.try_for_each(|(id, bounds, own)| take(*id, bounds, *own))
                }
                None => self
                    .world
                    .query_counted(&hull, &mut self.work, |id, region| take(id, &region.bounds, block_of(region))),
            };
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
