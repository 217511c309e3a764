//! What a backend shows, read from its arenas alone, and the shadow world that says what it should show.

use orthant_render::world::live::LiveWorld;
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, kind};
use orthant_resident::world::{Root, WorldArenas, payload};
use orthant_world::{Aabb4, Block, CHUNK_BLOCKS, Chunk, ChunkShape, Lattice, RegionTree, Scale, World, WorldPatch};
use std::sync::Arc;

/// Every leaf that rays can reach.
pub fn leaves(arenas: &WorldArenas) -> Vec<LeafRow> {
    let (mut found, mut waiting) = (Vec::new(), vec![arenas.root]);
    while let Some(at) = waiting.pop() {
        if let Some(leaf) = at.as_leaf() {
            found.push(arenas.leaves[leaf as usize]);
        } else if let Some(node) = at.as_node() {
            waiting.extend(arenas.nodes[node as usize].children.iter().filter(|&&child| child != Root::EMPTY));
        }
    }
    found
}

/// The arenas as a world, without materials.
pub fn content(arenas: &WorldArenas) -> World {
    let parts = leaves(arenas).iter().map(|leaf| part(leaf, &arenas.payload)).collect();
    let mut world = World::new();
    let tree = RegionTree::branch(Aabb4::SPACE, parts);
    world.apply(&WorldPatch::of_tree(tree)).expect("leaves share no point");
    world
}

fn part(leaf: &LeafRow, words: &[u32]) -> RegionTree {
    let bounds = Aabb4::from_raw(leaf.min, leaf.max).expect("a box");
    let block = |bits| Block::from_bits(bits).expect("bits of a block");
    if leaf.kind() == kind::UNIFORM {
        return RegionTree::uniform(bounds, block(leaf.block));
    }
    let scale = Scale::new((leaf.kind >> 16 & 0xff) as i8 - 16).expect("a scale");
    let shape = if leaf.is_flat() { ChunkShape::Flat } else { ChunkShape::Cube };
    let chunk = if leaf.payload == NO_PAYLOAD {
        Chunk::uniform(block(leaf.block))
    } else {
        let words = &words[leaf.payload as usize..];
        let blocks: [Block; CHUNK_BLOCKS] = std::array::from_fn(|i| block(payload::block(words, i)));
        Chunk::from_blocks(&blocks)
    };
    RegionTree::chunk_array(bounds, Lattice { scale, shape }, vec![Arc::new(chunk)]).expect("a leaf lies in one chunk")
}

/// The world to which the boxes were copied that ticks brought up to date.
pub struct Shadow {
    pub active: World,
    staging: World,
}

impl Shadow {
    /// As the live world is when it is loaded.
    pub fn new(world: &World) -> Self {
        Self { active: world.clone(), staging: World::new() }
    }

    /// Follows the last tick.
    pub fn follow(&mut self, live: &LiveWorld) {
        let copy = |to: &mut World, boxes: &[Aabb4]| {
            for bounds in boxes {
                to.apply(&WorldPatch::of_tree(live.world().extract(bounds))).expect("content of a world");
            }
        };
        let trace = live.trace();
        copy(&mut self.active, &trace.active);
        if trace.snapshot {
            self.staging = self.active.clone();
        }
        copy(&mut self.staging, &trace.staging);
        if trace.swapped {
            // What was done to the old set was replayed, and what came after the swap came from the same world.
            copy(&mut self.staging, &trace.active);
            self.active = self.staging.clone();
        }
    }
}
