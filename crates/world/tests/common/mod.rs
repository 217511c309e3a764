//! What the tests share: random numbers, and the plain map of voxels that a world is compared with.

#![allow(dead_code, reason = "not every test uses all of it")]

use orthant_world::{Aabb4, Applied, Block, Content, Point4, Region, RegionNode, RegionTree, Scale, World, WorldPatch};
use std::collections::HashMap;

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    pub fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }
}

/// A map from voxels to blocks.
pub struct Model {
    arena: Aabb4,
    edge: i64,
    voxels: HashMap<[i64; 4], Block>,
}

impl Model {
    pub fn new(arena: Aabb4, scale: Scale) -> Self {
        Self { arena, edge: scale.edge().raw(), voxels: HashMap::new() }
    }

    /// How many cells of a lattice share points with a box.
    pub fn cells(bounds: &Aabb4, extent: [i64; 4]) -> i64 {
        let (min, max) = (bounds.min_raw(), bounds.max_raw());
        (0..4).map(|a| (max[a] - 1).div_euclid(extent[a]) - min[a].div_euclid(extent[a]) + 1).product()
    }

    /// Every voxel of a box, by its lower corner.
    pub fn for_each(&self, bounds: &Aabb4, mut visit: impl FnMut([i64; 4])) {
        let (min, max) = (bounds.min_raw(), bounds.max_raw());
        let mut at = min;
        loop {
            visit(at);
            let mut a = 0;
            loop {
                at[a] += self.edge;
                if at[a] < max[a] {
                    break;
                }
                at[a] = min[a];
                a += 1;
                if a == 4 {
                    return;
                }
            }
        }
    }

    fn of_tree(tree: &RegionTree, at: [i64; 4]) -> Block {
        let point = Point4::from_raw(at);
        if !tree.bounds.contains_point(point) {
            return Block::AIR;
        }
        match &tree.node {
            RegionNode::Empty => Block::AIR,
            RegionNode::Uniform(block) => *block,
            RegionNode::ChunkArray(array) => {
                let (_, chunk) = array.placed(&tree.bounds).find(|(cell, _)| cell.contains_point(point)).unwrap();
                let (extent, size) = (array.lattice.block_extent(), array.lattice.shape.size());
                let index = |a: usize| at[a].div_euclid(extent[a].raw()).rem_euclid(size[a] as i64) as usize;
                chunk.get(array.lattice.shape.index(std::array::from_fn(index)))
            }
            RegionNode::Branch(parts) => {
                parts.iter().map(|part| Self::of_tree(part, at)).find(|block| !block.is_air()).unwrap_or(Block::AIR)
            }
            RegionNode::Procedural(_) => panic!("the model knows no generators"),
        }
    }

    pub fn block_at(&self, at: [i64; 4]) -> Block {
        self.voxels.get(&at).copied().unwrap_or(Block::AIR)
    }

    /// A voxel that the patch changes, if there is one.
    pub fn changed_by(&self, patch: &WorldPatch) -> Option<[i64; 4]> {
        let mut changed = None;
        self.for_each(&patch.authoritative_bounds, |at| {
            if Self::of_tree(&patch.subtree, at) != self.block_at(at) {
                changed = Some(at);
            }
        });
        changed
    }

    pub fn apply(&mut self, patch: &WorldPatch) {
        let mut writes = Vec::new();
        self.for_each(&patch.authoritative_bounds, |at| writes.push((at, Self::of_tree(&patch.subtree, at))));
        for (at, block) in writes {
            if block.is_air() {
                self.voxels.remove(&at);
            } else {
                self.voxels.insert(at, block);
            }
        }
    }

    /// Both agree everywhere in the arena, and the world has nothing outside of it.
    pub fn compare(&self, world: &World, context: &str) {
        if let Some(bounds) = world.bounds() {
            assert!(self.arena.contains(&bounds) || self.nothing_outside(world), "{context}: content left the arena");
        }
        self.for_each(&self.arena, |at| {
            let found = world.block_at(Point4::from_raw(at));
            assert_eq!(found, self.block_at(at), "{context}: voxel {:?}", Point4::from_raw(at));
        });
    }

    fn nothing_outside(&self, world: &World) -> bool {
        world.regions().all(|(_, region)| region.solid_bounds().is_none_or(|solid| self.arena.contains(&solid)))
    }

    pub fn len(&self) -> usize {
        self.voxels.len()
    }
}

/// What a patch reports is what happened: changed boxes are exact covers, ids follow.
pub fn check_applied(before: &World, after: &World, patch: &WorldPatch, applied: &Applied, model: &Model) {
    for (i, changed) in applied.changed.iter().enumerate() {
        assert!(patch.authoritative_bounds.contains(changed));
        assert!(applied.changed[i + 1..].iter().all(|other| !other.overlaps(changed)), "changed boxes are disjoint");
    }
    model.for_each(&patch.authoritative_bounds, |at| {
        let point = Point4::from_raw(at);
        let covered = applied.changed.iter().any(|b| b.contains_point(point));
        assert!(covered || before.block_at(point) == after.block_at(point), "a change at {point:?} is not covered");
    });
    for changed in &applied.changed {
        // Tight: on each of the eight faces something changed.
        let (min, max) = (changed.min_raw(), changed.max_raw());
        let mut touched = [[false; 2]; 4];
        model.for_each(changed, |at| {
            let point = Point4::from_raw(at);
            if before.block_at(point) != after.block_at(point) {
                for a in 0..4 {
                    touched[a][0] |= at[a] == min[a];
                    touched[a][1] |= at[a] + model.edge == max[a];
                }
            }
        });
        assert_eq!(touched, [[true; 2]; 4], "{changed:?} is larger than what changed in it");
    }
    // The regions of before, edited as the report says, are the regions of now.
    let mut regions: HashMap<_, Region> = before.regions().map(|(id, region)| (id, region.clone())).collect();
    for (id, region) in &applied.removed {
        assert_eq!(regions.remove(id).as_ref(), Some(region), "a removed region was there");
        assert!(after.region(*id).is_none());
    }
    for (id, region) in &applied.updated {
        let now = after.region(*id).expect("an updated region is there");
        assert_eq!(now.bounds, region.bounds);
        assert!(matches!(now.content, Content::Chunk { .. }) && now.content != region.content);
        assert_eq!(regions.insert(*id, now.clone()).as_ref(), Some(region));
    }
    for &id in &applied.added {
        assert!(regions.insert(id, after.region(id).expect("an added region is there").clone()).is_none());
    }
    assert_eq!(regions.len(), after.region_count());
    assert!(regions.iter().all(|(id, region)| after.region(*id) == Some(region)));
    assert_eq!(applied.revision, after.revision());
}
