//! Splicing: making the regions be what a patch says.

use super::region::{Region, RegionId};
use super::{Applied, ApplyError, Work, World};
use crate::space::Aabb4;
use rustc_hash::FxHashMap;
use std::ops::ControlFlow;

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
    pub work: Work,
}

impl<'a> Splice<'a> {
    pub fn new(world: &'a mut World, work: Work) -> Self {
        world.index.take_counters();
        Self { world, fates: FxHashMap::default(), removed: Vec::new(), work }
    }

    pub fn insert(&mut self, region: Region) -> RegionId {
        self.work.regions_written += 1;
        let bounds = region.bounds.closed();
        let id = self.world.regions.insert(region);
        self.world.index.insert(id.slot() as u32, bounds).expect("a new slot and a box of the space");
        self.fates.insert(id, Fate::Added);
        id
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
            for slab in region.bounds.subtract(hole).iter() {
                if let Some(part) = region.clipped(slab) {
                    self.insert(part);
                }
            }
        }
    }

    /// Writes down what has changed.
    pub fn finish(self, applied: &mut Applied) {
        for (id, fate) in self.fates {
            match fate {
                Fate::Added => applied.added.push(id),
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
        splice.carve(bounds);
        for piece in pieces {
            splice.insert(piece);
        }
        splice.finish(applied);
        Ok(())
    }
}
