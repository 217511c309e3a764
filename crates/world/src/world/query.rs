//! Finding regions, and taking a part of a world out as a tree.

use super::region::{Content, Region, RegionId};
use super::{Work, World};
use crate::block::Block;
use crate::palette::Palette;
use crate::space::{Aabb4, Point4};
use crate::tree::{ChunkArray, RegionNode, RegionTree};
use orthant_bvh::ValidateError;
use std::ops::ControlFlow;

impl World {
    /// Visits the regions that share points with a box, until the visitor breaks. The order is that of the index.
    pub fn query<B>(&self, bounds: &Aabb4, visit: impl FnMut(RegionId, &Region) -> ControlFlow<B>) -> ControlFlow<B> {
        self.query_counted(bounds, &mut Work::default(), visit)
    }

    /// [`Self::query`], which adds what it reads to a count.
    pub fn query_counted<B>(
        &self,
        bounds: &Aabb4,
        work: &mut Work,
        mut visit: impl FnMut(RegionId, &Region) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let Work { regions_read, index_nodes, .. } = work;
        self.index.overlap_counted(&bounds.closed(), index_nodes, |slot, _| {
            *regions_read += 1;
            let (id, region) = self.regions.in_slot(slot).expect("the index names live slots");
            visit(id, region)
        })
    }

    /// The regions that share points with a box.
    pub fn regions_in(&self, bounds: &Aabb4) -> Vec<RegionId> {
        let mut found = Vec::new();
        let _: ControlFlow<()> = self.query(bounds, |id, _| {
            found.push(id);
            ControlFlow::Continue(())
        });
        found
    }

    /// The region that holds a point.
    pub fn region_at(&self, point: Point4) -> Option<(RegionId, &Region)> {
        match self.index.point(&point.raw(), |slot, _| ControlFlow::Break(slot)) {
            ControlFlow::Break(slot) => self.regions.in_slot(slot),
            ControlFlow::Continue(()) => None,
        }
    }

    /// The content of a box as a tree: what a patch of it would carry.
    pub fn extract(&self, bounds: &Aabb4) -> RegionTree {
        let mut parts = Vec::new();
        let _: ControlFlow<()> = self.query(bounds, |_, region| {
            parts.extend(region.clipped(bounds).map(tree_of));
            ControlFlow::Continue(())
        });
        match (parts.len(), parts.pop()) {
            (0, _) | (_, None) => RegionTree::empty(*bounds),
            (1, Some(part)) if part.bounds == *bounds => part,
            (_, Some(last)) => {
                parts.push(last);
                RegionTree::branch(*bounds, parts)
            }
        }
    }

    /// Whether both hold the same blocks everywhere, whatever their regions and however their palettes are numbered.
    /// Materials are the same if their names are; a number without a material is the same as the same number.
    pub fn same_content(&self, other: &Self) -> bool {
        let everywhere = Aabb4::SPACE;
        let translate = |block: Block| translate(block, &other.palette, &self.palette);
        let regions: Option<Vec<Region>> = other.regions().map(|(_, region)| translated(region, &translate)).collect();
        regions.is_some_and(|regions| self.diff(&everywhere, &regions, &mut Work::default()).is_empty())
    }

    /// Checks every invariant: the index is sound and has every region once, under its box; regions are disjoint and in the
    /// form that a world keeps.
    ///
    /// # Errors
    /// The first that is broken.
    pub fn validate(&self) -> Result<(), InvalidWorld> {
        self.index.validate()?;
        if self.index.len() != self.region_count() {
            return Err(InvalidWorld::IndexCount { index: self.index.len(), regions: self.region_count() });
        }
        for (id, region) in self.regions() {
            if self.index.bounds_of(id.slot() as u32) != Some(region.bounds.closed()) {
                return Err(InvalidWorld::IndexBox(id));
            }
            let other = self.query(&region.bounds, |other, _| {
                if other == id { ControlFlow::Continue(()) } else { ControlFlow::Break(other) }
            });
            if let ControlFlow::Break(other) = other {
                return Err(InvalidWorld::Overlap(id, other));
            }
            let kept = match &region.content {
                Content::Uniform(block) => Region::uniform(region.bounds, *block),
                Content::Chunk { lattice, chunk } => {
                    if !lattice.admits(&region.bounds)
                        || !region.chunk_bounds().is_some_and(|c| c.contains(&region.bounds))
                    {
                        return Err(InvalidWorld::Form(id));
                    }
                    Region::chunk(region.bounds, *lattice, chunk.clone())
                }
            };
            if kept.as_ref() != Some(region) {
                return Err(InvalidWorld::Form(id));
            }
        }
        Ok(())
    }
}

/// A broken invariant: a fault of this crate.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidWorld {
    /// The index itself.
    #[error("the index is unsound: {0}")]
    Index(#[from] ValidateError),
    /// Items without regions, or regions without items.
    #[error("the index has {index} items for {regions} regions")]
    IndexCount {
        /// Items of the index.
        index: usize,
        /// Regions.
        regions: usize,
    },
    /// The index has a region under another box.
    #[error("region {0:?} is not in the index under its box")]
    IndexBox(RegionId),
    /// Two owners.
    #[error("regions {0:?} and {1:?} overlap")]
    Overlap(RegionId, RegionId),
    /// A region that should have been made simpler.
    #[error("region {0:?} is not in the form that a world keeps")]
    Form(RegionId),
}

/// By content ([`World::same_content`]), never by the shape of regions; and by the palettes' materials.
impl PartialEq for World {
    fn eq(&self, other: &Self) -> bool {
        self.same_content(other)
    }
}

/// A block of one palette in the numbers of another; `None` if that has no such name.
fn translate(block: Block, from: &Palette, to: &Palette) -> Option<Block> {
    match from.get(block.id()) {
        Some(material) => to.id_of(&material.name).map(|id| block.with_id(id)),
        None if to.get(block.id()).is_some() => None,
        None => Some(block),
    }
}

fn translated(region: &Region, translate: &impl Fn(Block) -> Option<Block>) -> Option<Region> {
    let content = match &region.content {
        Content::Uniform(block) => Content::Uniform(translate(*block)?),
        Content::Chunk { lattice, chunk } => {
            // A block that only lies outside of the region does not count; it may have no translation.
            let unknown = Block::AIR;
            let mapped = chunk.map(|block| translate(block).unwrap_or(unknown));
            let lost = chunk.palette().iter().any(|&block| translate(block).is_none());
            if lost && !same_solid(region, &mapped) {
                return None;
            }
            Content::Chunk { lattice: *lattice, chunk: mapped.into() }
        }
    };
    Some(Region { bounds: region.bounds, content })
}

/// Whether a translated chunk still has a block wherever the region has one.
fn same_solid(region: &Region, mapped: &crate::chunk::Chunk) -> bool {
    let Content::Chunk { lattice, chunk } = &region.content else { return true };
    let mut same = true;
    super::region::for_each_block(super::region::block_range(&region.bounds, *lattice), *lattice, |_, index| {
        same &= chunk.get(index).is_air() == mapped.get(index).is_air();
    });
    same
}

/// A region as a tree.
pub(crate) fn tree_of(region: Region) -> RegionTree {
    let node = match region.content {
        Content::Uniform(block) => RegionNode::Uniform(block),
        Content::Chunk { lattice, chunk } => RegionNode::ChunkArray(ChunkArray { lattice, chunks: vec![chunk] }),
    };
    RegionTree { bounds: region.bounds, node }
}
