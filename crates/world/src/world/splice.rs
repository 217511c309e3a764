//! Splicing: making the regions be what a patch says.

use super::region::{Region, RegionId};
use super::{Applied, ApplyError, Work, World};
use crate::space::{Aabb4, Point4};
use rustc_hash::FxHashMap;
use std::ops::ControlFlow;

/// From so many on regions go into the index together.
const MANY: usize = 32;

/// Up to so many boxes that lie apart are spliced by themselves.
const FEW_PARTS: usize = 8;

/// A patch of more pieces is not looked at for being small.
const FEW_PIECES: usize = 64;

/// What became of a region since the splice began.
enum Fate {
    /// It was not there before.
    Added,
    /// It was there, and was this.
    Updated(Region),
}

/// A world while it is spliced, with the record of what changes.
pub(super) struct Splice<'a> {
    pub world: &'a mut World,
    fates: FxHashMap<RegionId, Fate>,
    removed: Vec<(RegionId, Region)>,
    /// What was put in, in order; some of it is gone again.
    pub fresh: Vec<RegionId>,
    pub work: Work,
}

impl<'a> Splice<'a> {
    pub fn new(world: &'a mut World, work: Work) -> Self {
        world.index.take_counters();
        Self { world, fates: FxHashMap::default(), removed: Vec::new(), fresh: Vec::new(), work }
    }

    pub fn insert(&mut self, region: Region) -> RegionId {
        self.work.regions_written += 1;
        let bounds = region.bounds.closed();
        let id = self.world.regions.insert(region);
        self.world.index.insert(id.slot() as u32, bounds).expect("a new slot and a box of the space");
        self.fates.insert(id, Fate::Added);
        self.fresh.push(id);
        id
    }

    /// Puts many regions in.
    pub fn insert_all(&mut self, regions: Vec<Region>) {
        if regions.len() < MANY {
            regions.into_iter().for_each(|region| {
                self.insert(region);
            });
            return;
        }
        let mut items = Vec::with_capacity(regions.len());
        for region in regions {
            self.work.regions_written += 1;
            let bounds = region.bounds.closed();
            let id = self.world.regions.insert(region);
            items.push((id.slot() as u32, bounds));
            self.fates.insert(id, Fate::Added);
            self.fresh.push(id);
        }
        self.world.index.insert_many(&items).expect("new slots and boxes of the space");
    }

    /// Puts in what of a region lies outside of a box.
    pub fn insert_rest(&mut self, region: &Region, hole: &Aabb4) {
        for slab in region.bounds.subtract(hole).iter() {
            if let Some(part) = region.clipped(slab) {
                self.insert(part);
            }
        }
    }

    /// The region that holds a point.
    pub fn region_at(&mut self, point: Point4) -> Option<RegionId> {
        let mut found = None;
        let at = orthant_bvh::Aabb::new(point.raw(), point.raw());
        let _: ControlFlow<()> = self.world.index.overlap_counted(&at, &mut self.work.index_nodes, |slot, _| {
            found = self.world.regions.in_slot(slot).map(|(id, _)| id);
            ControlFlow::Break(())
        });
        self.work.regions_read += 1;
        found
    }

    pub fn remove(&mut self, id: RegionId) -> Region {
        self.work.regions_written += 1;
        let region = self.world.regions.remove(id).expect("the splice removes what it found");
        self.world.index.remove(id.slot() as u32).expect("every region is in the index");
        match self.fates.remove(&id) {
            None => self.removed.push((id, region.clone())),
            Some(Fate::Updated(before)) => self.removed.push((id, before)),
            Some(Fate::Added) => {}
        }
        region
    }

    /// Gives a region that keeps its bounds another content.
    pub fn update(&mut self, id: RegionId, region: Region) {
        self.work.regions_written += 1;
        let kept = self.world.regions.get_mut(id).expect("the splice updates what it found");
        debug_assert_eq!(kept.bounds, region.bounds);
        let before = std::mem::replace(kept, region);
        self.fates.entry(id).or_insert(Fate::Updated(before));
    }

    /// The regions that share points with a box.
    pub fn regions_in(&mut self, bounds: &Aabb4) -> Vec<RegionId> {
        let mut found = Vec::new();
        let _: ControlFlow<()> = self.world.query_counted(bounds, &mut self.work, |id, _| {
            found.push(id);
            ControlFlow::Continue(())
        });
        found
    }

    /// Empties a box: what reaches out of it is carved.
    pub fn carve(&mut self, hole: &Aabb4) {
        for id in self.regions_in(hole) {
            let region = self.remove(id);
            self.insert_rest(&region, hole);
        }
    }

    /// Makes a box be what the pieces say, with little content gathered in chunks.
    fn replace(&mut self, bounds: &Aabb4, pieces: Vec<Region>) {
        let small = pieces.len() <= FEW_PIECES;
        if !(small && (self.replace_in_chunk(bounds, &pieces) || self.replace_small(bounds, &pieces))) {
            self.replace_exactly(bounds, pieces);
        }
    }

    /// Makes a box be what the pieces say, and nothing more.
    pub fn replace_exactly(&mut self, bounds: &Aabb4, pieces: Vec<Region>) {
        self.carve(bounds);
        self.insert_all(pieces);
    }

    /// Writes down what has changed.
    pub fn finish(self, applied: &mut Applied) {
        for (id, fate) in self.fates {
            match fate {
                Fate::Added => applied.added.push(id),
                // It may have been rewritten as it was.
                Fate::Updated(before) if self.world.region(id) == Some(&before) => {}
                Fate::Updated(before) => applied.updated.push((id, before)),
            }
        }
        applied.added.sort_unstable();
        applied.updated.sort_unstable_by_key(|(id, _)| *id);
        applied.removed = self.removed;
        applied.work = self.work;
        applied.work.index_nodes += self.world.index.take_counters().visited;
        // Nobody follows the index by its writes.
        self.world.index.take_writes();
    }
}

/// The boxes to splice, given where something changes: not all of the patch, of which much may be there already.
fn parts_to_write(changed: &[Aabb4]) -> Vec<Aabb4> {
    let volume = |b: &Aabb4| b.extent().iter().product::<f64>();
    let Some(hull) = changed.iter().copied().reduce(|hull, b| hull.hull(&b)) else { return Vec::new() };
    let apart = changed.iter().map(volume).sum::<f64>() < 0.25 * volume(&hull);
    // Many boxes are as a rule the pattern of one content, whose pieces are better left whole.
    if changed.len() <= FEW_PARTS && apart { changed.to_vec() } else { vec![hull] }
}

impl World {
    /// Makes the world be what the pieces say, within the bounds.
    pub(super) fn splice(
        &mut self,
        bounds: &Aabb4,
        pieces: Vec<Region>,
        applied: &mut Applied,
    ) -> Result<(), ApplyError> {
        let room = (orthant_bvh::MAX_ITEM as usize).saturating_sub(self.slot_count());
        // Carving makes at most eight regions of one, and a cell of them is gathered at a time.
        if pieces.len().saturating_mul(16) > room {
            return Err(ApplyError::WorldFull(orthant_bvh::MAX_ITEM));
        }
        let mut splice = Splice::new(self, applied.work);
        let parts = parts_to_write(&applied.changed);
        for part in &parts {
            if part == bounds {
                splice.replace(part, pieces);
                break;
            }
            splice.replace(part, pieces.iter().filter_map(|piece| piece.clipped(part)).collect());
        }
        splice.gather_fresh();
        splice.join_fresh();
        splice.finish(applied);
        Ok(())
    }
}
