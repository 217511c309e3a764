//! `RegionTree`: a part of a world as it is exchanged, in patches and in files.

mod flatten;
mod json;

pub(crate) use flatten::flatten;
pub(crate) use json::TreeWire;

use crate::block::Block;
use crate::chunk::Chunk;
use crate::generate::Generator;
use crate::space::{Aabb4, Lattice};
use std::sync::Arc;

/// What is in a box.
#[derive(Clone, PartialEq, Debug)]
pub struct RegionTree {
    /// The box.
    pub bounds: Aabb4,
    /// What is in it.
    pub node: RegionNode,
}

/// What is in the box of a [`RegionTree`].
#[derive(Clone, PartialEq, Debug)]
pub enum RegionNode {
    /// Air.
    Empty,
    /// One block, everywhere in the box.
    Uniform(Block),
    /// What a generator makes of the box.
    Procedural(Generator),
    /// Blocks of a lattice.
    ChunkArray(ChunkArray),
    /// Parts that share no point and lie in the box. What none of them covers is air.
    Branch(Vec<RegionTree>),
}

/// The chunks of a lattice that share points with a box, x fastest, w slowest. What they hold outside of the box does not
/// count. How many there are follows from the box.
#[derive(Clone, PartialEq, Debug)]
pub struct ChunkArray {
    /// Which lattice.
    pub lattice: Lattice,
    /// The chunks.
    pub chunks: Vec<Arc<Chunk>>,
}

/// What is wrong with a tree.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TreeError {
    /// A part reaches out of the box that it is in.
    #[error("the part {part:?} leaves its box {within:?}; parts lie within the box that they are in")]
    Outside {
        /// The part.
        part: Box<Aabb4>,
        /// The box that it is in.
        within: Box<Aabb4>,
    },
    /// Two parts share points.
    #[error("the parts {0:?} and {1:?} overlap; every point has one owner")]
    Overlap(Box<Aabb4>, Box<Aabb4>),
    /// Not as many chunks as the box has.
    #[error("the box {bounds:?} has {expected} chunks of this lattice, and {given} are given")]
    ChunkCount {
        /// The box.
        bounds: Box<Aabb4>,
        /// Chunks that share points with it.
        expected: u64,
        /// Chunks that are given.
        given: usize,
    },
    /// A flat chunk beyond `0 <= w < 1`.
    #[error("the box {0:?} has flat chunks; those lie in 0 <= w < 1")]
    FlatBeyondW(Box<Aabb4>),
    /// Branches in branches in branches.
    #[error("the tree is deeper than {} levels; join its branches", RegionTree::MAX_DEPTH)]
    TooDeep,
    /// More regions than are allowed.
    #[error("the tree has more than {limit} regions; split the patch")]
    TooLarge {
        /// The limit.
        limit: usize,
    },
}

impl RegionTree {
    /// Levels of branches that a tree may have.
    pub const MAX_DEPTH: usize = 64;

    /// Air.
    pub const fn empty(bounds: Aabb4) -> Self {
        Self { bounds, node: RegionNode::Empty }
    }

    /// One block.
    pub const fn uniform(bounds: Aabb4, block: Block) -> Self {
        Self { bounds, node: RegionNode::Uniform(block) }
    }

    /// Chunks.
    ///
    /// # Errors
    /// [`TreeError::ChunkCount`], [`TreeError::FlatBeyondW`].
    pub fn chunk_array(bounds: Aabb4, lattice: Lattice, chunks: Vec<Arc<Chunk>>) -> Result<Self, TreeError> {
        let array = ChunkArray { lattice, chunks };
        array.check(&bounds)?;
        Ok(Self { bounds, node: RegionNode::ChunkArray(array) })
    }

    /// Parts.
    pub const fn branch(bounds: Aabb4, parts: Vec<Self>) -> Self {
        Self { bounds, node: RegionNode::Branch(parts) }
    }
}

impl ChunkArray {
    /// Whether it has the chunks that the box asks for.
    pub(crate) fn check(&self, bounds: &Aabb4) -> Result<(), TreeError> {
        if !self.lattice.admits(bounds) {
            return Err(TreeError::FlatBeyondW(Box::new(*bounds)));
        }
        let expected = bounds.cell_count(self.lattice.chunk_log2());
        if expected != self.chunks.len() as u64 {
            return Err(TreeError::ChunkCount { bounds: Box::new(*bounds), expected, given: self.chunks.len() });
        }
        Ok(())
    }

    /// Every chunk with its box, for an array that fills `bounds`.
    pub fn placed<'a>(&'a self, bounds: &Aabb4) -> impl Iterator<Item = (Aabb4, &'a Arc<Chunk>)> {
        bounds.cells(self.lattice.chunk_log2()).zip(&self.chunks)
    }
}
