//! `--verify`: leaves, arenas and world say the same.

use super::follow::Follower;
use crate::job::validate::compare_arenas;
use orthant_render::world::{Leaf, LeafContent};
use orthant_world::{Aabb4, Block, Content, Fixed, Lattice, Point4, World};
use std::sync::Arc;

/// Compares everything.
///
/// * the world keeps its own invariants;
/// * the planner keeps its: leaves are disjoint and tight, the tree leads to them, spans are counted;
/// * what the batches alone have made of the arenas is the planner's mirror;
/// * every leaf has the blocks of the world, and together they have as much of it as the world has: so nothing is missing.
///
/// # Errors
/// The first difference.
pub fn all(world: &World, follower: &Follower) -> Result<(), String> {
    world.validate().map_err(|e| format!("the world: {e}"))?;
    follower.derived.validate().map_err(|e| format!("the leaves: {e}"))?;
    compare_arenas(follower.derived.mirror(), &follower.arenas)?;
    leaves(world, follower)
}

fn leaves(world: &World, follower: &Follower) -> Result<(), String> {
    let mut volume = 0.0;
    for leaf in follower.derived.leaves() {
        volume += check_leaf(world, &leaf)?;
    }
    let expected = world.stats().solid_volume;
    // Sums of the same volumes in another order.
    if (volume - expected).abs() > 1e-9 * expected.max(1.0) {
        return Err(format!("the leaves have a volume of {volume}, and the world one of {expected}"));
    }
    Ok(())
}

/// Compares a leaf with the world, and gives the volume of what is solid in it.
fn check_leaf(world: &World, leaf: &Leaf) -> Result<f64, String> {
    let differs = |at: &Aabb4, is: Block, should: Block| {
        Err(format!("a leaf has {is:?} at {:?}, where the world has {should:?}", at.min().0.map(Fixed::to_f64)))
    };
    match &leaf.content {
        LeafContent::Uniform(block) => {
            // Every part of the world in the box is that block.
            let mut covered = 0.0;
            for id in world.regions_in(&leaf.bounds) {
                let Some((region, within)) =
                    world.region(id).and_then(|r| Some((r, r.bounds.intersection(&leaf.bounds)?)))
                else {
                    continue;
                };
                covered += solid_of(world, region.bounds, &within, |at, found| {
                    if found == *block { Ok(()) } else { differs(at, *block, found) }
                })?;
            }
            let own: f64 = leaf.bounds.extent().iter().product();
            if (covered - own).abs() > 1e-9 * own {
                return Err(format!("a leaf of {block:?} fills {:?}, where the world is partly air", leaf.bounds));
            }
            Ok(own)
        }
        LeafContent::Chunk { lattice, chunk } if is_region(world, leaf) => {
            blocks_of(*lattice, &leaf.bounds, |_, index| Ok(!chunk.get(index).is_air()))
        }
        LeafContent::Chunk { lattice, chunk } => blocks_of(*lattice, &leaf.bounds, |at, index| {
            let (is, should) = (chunk.get(index), world.block_at(at.min()));
            if is == should { Ok(!is.is_air()) } else { differs(at, is, should).map(|()| false) }
        }),
        LeafContent::Filled { lattice, block } => blocks_of(*lattice, &leaf.bounds, |at, _| {
            let should = world.block_at(at.min());
            if *block == should { Ok(true) } else { differs(at, *block, should).map(|()| false) }
        }),
    }
}

/// Whether a leaf is a region of the world, with the very same chunk.
fn is_region(world: &World, leaf: &Leaf) -> bool {
    let Some((_, region)) = world.region_at(leaf.bounds.min()) else { return false };
    match (&region.content, &leaf.content) {
        (Content::Chunk { lattice: a, chunk: ours }, LeafContent::Chunk { lattice: b, chunk: theirs }) => {
            a == b && Arc::ptr_eq(ours, theirs) && region.bounds.contains(&leaf.bounds)
        }
        _ => false,
    }
}

/// Visits what is solid of a region within a box, and adds its volume up.
fn solid_of(
    world: &World,
    region: Aabb4,
    within: &Aabb4,
    mut visit: impl FnMut(&Aabb4, Block) -> Result<(), String>,
) -> Result<f64, String> {
    let Some((_, found)) = world.region_at(region.min()) else { return Ok(0.0) };
    match &found.content {
        Content::Uniform(block) => {
            visit(within, *block)?;
            Ok(within.extent().iter().product())
        }
        Content::Chunk { lattice, chunk } => blocks_of(*lattice, within, |at, index| {
            let block = chunk.get(index);
            if block.is_air() { Ok(false) } else { visit(at, block).map(|()| true) }
        }),
    }
}

/// Visits the blocks of a lattice within a box that lies in one chunk, each with its part in the box and its linear index, and adds up
/// the volumes of those that are solid.
fn blocks_of(
    lattice: Lattice,
    bounds: &Aabb4,
    mut visit: impl FnMut(&Aabb4, usize) -> Result<bool, String>,
) -> Result<f64, String> {
    let (block, chunk) = (lattice.block_extent().map(Fixed::raw), lattice.chunk_extent().map(Fixed::raw));
    let size = lattice.shape.size();
    let (min, max) = (bounds.min_raw(), bounds.max_raw());
    let cell: [i64; 4] = std::array::from_fn(|a| min[a].div_euclid(chunk[a]) * chunk[a]);
    let mut volume = 0.0;
    for index in 0..size.iter().product() {
        let at = lattice.shape.at(index);
        let low: [i64; 4] = std::array::from_fn(|a| (cell[a] + at[a] as i64 * block[a]).max(min[a]));
        let high: [i64; 4] = std::array::from_fn(|a| (cell[a] + (at[a] as i64 + 1) * block[a]).min(max[a]));
        let Ok(part) = Aabb4::new(Point4::from_raw(low), Point4::from_raw(high)) else { continue };
        if visit(&part, index)? {
            volume += part.extent().iter().product::<f64>();
        }
    }
    Ok(volume)
}
