//! Planning: from a dirty box to the batch that brings it up to date.

use super::closure::{self, Closure, Found};
use super::{DerivedWorld, WorldError, carve, space};
use orthant_resident::world::MutationBatch;
use orthant_world::{Aabb4, Point4, World};

/// How much one operation may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpLimits {
    /// Chunks that are written, at most.
    pub chunks: usize,
    /// Leaves that go and come together, and leaves and regions that are looked at for one box.
    pub leaves: usize,
    /// Of a box that is too large for one operation the half that is nearer to this point is done first.
    pub focus: Option<Point4>,
}

impl Default for OpLimits {
    fn default() -> Self {
        Self { chunks: 64, leaves: 512, focus: None }
    }
}

/// What an operation did, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlanCounts {
    /// Leaves that are new.
    pub leaves_added: usize,
    /// Leaves that are gone.
    pub leaves_removed: usize,
    /// Leaves that kept their slot and got another chunk.
    pub leaves_changed: usize,
    /// Dense chunks that were written; those that were resident already are not.
    pub chunks_written: usize,
    /// Nodes that were written.
    pub node_writes: usize,
    /// Leaves and regions that were looked at.
    pub looked_at: usize,
}

/// One operation of the planner.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The writes; empty if nothing differed ([`MutationBatch::is_empty`]), and then not to be applied.
    pub batch: MutationBatch,
    /// Boxes in which the set now equals the world, within the clip. They may overlap.
    pub synced: Vec<Aabb4>,
    /// What was too large for one operation: boxes to be planned by themselves. With the synced boxes they cover what was asked for.
    pub deferred: Vec<Aabb4>,
    /// Leaves were cut at the borders of the box. Planning it again, with larger limits or when less else is to be done, joins
    /// them.
    pub untidy: bool,
    /// What was done.
    pub counts: PlanCounts,
}

impl DerivedWorld {
    /// Brings the leaves in a box to what the world says now.
    ///
    /// Leaves and regions that differ, and whatever overlaps one of them, are exchanged as wholes, so that there is a leaf for
    /// every region. If that is more than the limits allow, leaves are cut at the box and the world is put in within it
    /// alone; if that is too much as well, a part of the box is done and the rest deferred.
    ///
    /// # Errors
    /// [`WorldError::ArenaFull`]; nothing is changed then.
    pub fn plan(&mut self, world: &World, dirty: &Aabb4, limits: &OpLimits) -> Result<Plan, WorldError> {
        let mut plan = Plan {
            batch: self.begin_batch(),
            synced: Vec::new(),
            deferred: Vec::new(),
            untidy: false,
            counts: PlanCounts::default(),
        };
        // With one of each the smallest box is never too large.
        let limits = &OpLimits { chunks: limits.chunks.max(1), leaves: limits.leaves.max(1), ..*limits };
        let mut asked = *dirty;
        loop {
            // Where neither the world nor the set has anything they are equal.
            let Some(bounds) = self.reach(world).and_then(|reach| reach.intersection(&asked)) else {
                plan.synced.push(asked);
                return Ok(plan);
            };
            match closure::find(self, world, &bounds, limits, &mut plan.counts.looked_at) {
                Found::Closed(Closure { stale, wanted, mut covered }) => {
                    if !(stale.is_empty() && wanted.is_empty()) {
                        plan.batch = self.splice(&stale, wanted, &mut plan.counts)?;
                    }
                    covered.retain(|bounds| !asked.contains(bounds));
                    plan.synced = covered;
                    plan.synced.push(asked);
                    return Ok(plan);
                }
                Found::TooLargeAround => {
                    let (stale, wanted) = carve::cut(self, world, &bounds);
                    plan.batch = self.splice(&stale, wanted, &mut plan.counts)?;
                    plan.untidy = true;
                    plan.synced.push(asked);
                    return Ok(plan);
                }
                Found::TooLargeWithin => {
                    let Some(halves) = space::halves(&bounds) else {
                        unreachable!("the smallest box has one region and one leaf at most")
                    };
                    let [first, second] = self.in_order(&asked, halves, limits);
                    plan.deferred.push(second);
                    asked = first;
                }
            }
        }
    }

    /// A box about all that the world or the set has, within the clip.
    fn reach(&self, world: &World) -> Option<Aabb4> {
        let ours = space::raw_about(&self.tree.bounds(), self.origin);
        let both = match (world.bounds(), ours) {
            (Some(world), Some(ours)) => Some(world.hull(&ours)),
            (world, ours) => world.or(ours),
        };
        both?.intersection(&self.clip)
    }

    /// The parts of the asked-for box on both sides of a cut, the one to be done first before the other.
    fn in_order(&self, asked: &Aabb4, [lower, upper]: [Aabb4; 2], limits: &OpLimits) -> [Aabb4; 2] {
        let axis =
            (0..4).find(|&a| lower.max_raw()[a] == upper.min_raw()[a] && lower.max_raw()[a] < upper.max_raw()[a]);
        let axis = axis.unwrap_or(0);
        let at = lower.max_raw()[axis];
        let (mut max, mut min) = (asked.max_raw(), asked.min_raw());
        (max[axis], min[axis]) = (at, at);
        let sides = [Aabb4::from_raw(asked.min_raw(), max), Aabb4::from_raw(min, asked.max_raw())];
        let [Ok(below), Ok(above)] = sides else { unreachable!("the cut is within a part of the box") };
        let is_above = limits.focus.is_some_and(|focus| focus.raw()[axis] >= at);
        if is_above { [above, below] } else { [below, above] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::BuildOptions;
    use orthant_world::{Block, BlockId, Generator, RegionTree, Scale, WorldPatch};

    fn platforms(half_extent: i32) -> World {
        let bounds = Aabb4::from_ints([-half_extent; 4], [half_extent; 4]).unwrap();
        let mut world = World::new();
        let tree = RegionTree { bounds, node: orthant_world::RegionNode::Procedural(Generator::Platforms { seed: 1 }) };
        world.apply(&WorldPatch::of_tree(tree)).unwrap();
        world
    }

    fn fill(min: [i32; 4], max: [i32; 4], id: u16) -> WorldPatch {
        let bounds = Aabb4::from_ints(min, max).unwrap();
        WorldPatch::of_tree(RegionTree::uniform(bounds, Block::of(BlockId(id), Scale::UNIT)))
    }

    #[test]
    fn a_voxel_of_a_platform_splits_it_into_slabs_and_a_chunk_and_it_becomes_one_leaf_again() {
        let mut world = platforms(352);
        let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
        derived.validate().unwrap();
        let before = derived.leaf_count();
        let whole = world.block_at(orthant_world::Point4::from_ints([3, -5, 6, 7])).id().0;
        // The chunk reaches to the upper side of the platform: there is no slab above.
        for (id, leaves) in [(0, before + 7), (whole + 1, before + 7), (whole, before)] {
            let applied = world.apply(&fill([3, -5, 6, 7], [4, -4, 7, 8], id)).unwrap();
            let [changed] = applied.changed[..] else { panic!("one voxel was changed") };
            let plan = derived.plan(&world, &changed, &OpLimits::default()).unwrap();
            assert!(!plan.untidy && plan.deferred.is_empty());
            derived.commit(&plan.batch).unwrap();
            derived.validate().unwrap();
            assert_eq!(derived.leaf_count(), leaves);
            assert_eq!(derived.leaf_count(), world.region_count());
        }
        assert_eq!(derived.stats().payload.live, 0, "a platform has no payload");
    }

    #[test]
    fn a_box_in_which_nothing_differs_writes_nothing() {
        let world = platforms(352);
        let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
        let revision = derived.revision();
        let bounds = Aabb4::from_ints([-400; 4], [400; 4]).unwrap();
        let plan = derived.plan(&world, &bounds, &OpLimits::default()).unwrap();
        assert!(plan.batch.is_empty() && plan.synced == [bounds]);
        assert_eq!((derived.revision(), plan.batch.new_revision), (revision, revision));
    }
}
