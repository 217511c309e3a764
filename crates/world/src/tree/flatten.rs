//! From a tree to the disjoint regions that a world keeps.

use super::{RegionNode, RegionTree, TreeError};
use crate::block::Block;
use crate::generate::Generator;
use crate::space::Aabb4;
use crate::world::{Content, Region};
use orthant_bvh::{Builder, Bvh};
use std::collections::HashMap;
use std::ops::ControlFlow;

/// The regions of a tree that are not air, disjoint, each in the world's own form; blocks translated.
///
/// `translate` gives the world's number for a block of the tree; `generated` that for a block of a generator.
pub(crate) fn flatten(
    tree: &RegionTree,
    limit: usize,
    translate: impl Fn(Block) -> Block,
    generated: impl Fn(&Generator, Block) -> Block,
) -> Result<Vec<Region>, TreeError> {
    let mut regions = Vec::new();
    let mut leaves = Vec::new();
    let mut waiting = vec![(tree, 0)];
    while let Some((part, depth)) = waiting.pop() {
        if depth > RegionTree::MAX_DEPTH {
            return Err(TreeError::TooDeep);
        }
        if !matches!(part.node, RegionNode::Branch(_)) {
            leaves.push(part.bounds);
        }
        match &part.node {
            RegionNode::Empty => {}
            RegionNode::Uniform(block) => regions.extend(Region::uniform(part.bounds, translate(*block))),
            RegionNode::ChunkArray(array) => {
                array.check(&part.bounds)?;
                // Equal chunks of one array are often one allocation, and stay one.
                let mut translated = HashMap::new();
                for (cell, chunk) in array.placed(&part.bounds) {
                    let Some(bounds) = cell.intersection(&part.bounds) else { continue };
                    let chunk = translated.entry(std::sync::Arc::as_ptr(chunk)).or_insert_with(|| {
                        let changes = chunk.palette().iter().any(|&block| translate(block) != block);
                        if changes { chunk.map(&translate).into() } else { chunk.clone() }
                    });
                    regions.extend(Region::chunk(bounds, array.lattice, chunk.clone()));
                }
            }
            RegionNode::Procedural(generator) => {
                let room = limit.saturating_sub(regions.len());
                for mut region in generator.regions(&part.bounds, room).map_err(|_| TreeError::TooLarge { limit })? {
                    region.content = match region.content {
                        Content::Uniform(block) => Content::Uniform(generated(generator, block)),
                        Content::Chunk { lattice, chunk } => {
                            let chunk = chunk.map(|block| generated(generator, block)).into();
                            Content::Chunk { lattice, chunk }
                        }
                    };
                    regions.push(region);
                }
            }
            RegionNode::Branch(parts) => {
                for child in parts.iter().rev() {
                    if !part.bounds.contains(&child.bounds) {
                        return Err(TreeError::Outside { part: Box::new(child.bounds), within: Box::new(part.bounds) });
                    }
                    waiting.push((child, depth + 1));
                }
            }
        }
        if regions.len().max(leaves.len()) > limit {
            return Err(TreeError::TooLarge { limit });
        }
    }
    check_disjoint(&leaves)?;
    Ok(regions)
}

/// Every point has one owner.
fn check_disjoint(leaves: &[Aabb4]) -> Result<(), TreeError> {
    if leaves.len() < 2 {
        return Ok(());
    }
    let boxes: Vec<_> = leaves.iter().map(Aabb4::closed).collect();
    let index = Bvh::build(&boxes, Builder::fast()).expect("boxes of the space are good bounds");
    for (i, bounds) in boxes.iter().enumerate() {
        let other = index.overlap(bounds, |item, _| {
            if item as usize == i { ControlFlow::Continue(()) } else { ControlFlow::Break(item as usize) }
        });
        if let ControlFlow::Break(other) = other {
            return Err(TreeError::Overlap(Box::new(leaves[i.min(other)]), Box::new(leaves[i.max(other)])));
        }
    }
    Ok(())
}
