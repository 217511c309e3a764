//! Where two sets of disjoint regions differ.

use super::region::{Content, Region, block_range, for_each_block, solid_within};
use super::{Work, World};
use crate::block::Block;
use crate::space::{Aabb4, Lattice};
use orthant_bvh::{Builder, Bvh};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Up to this many boxes are searched one by one.
const FEW: usize = 16;

/// Regions that can be searched by box.
pub(super) struct Pieces<'a> {
    regions: &'a [Region],
    index: Option<Bvh<i64, 4>>,
}

impl<'a> Pieces<'a> {
    pub fn new(regions: &'a [Region]) -> Self {
        let index = (regions.len() > FEW).then(|| {
            let boxes: Vec<_> = regions.iter().map(|region| region.bounds.closed()).collect();
            Bvh::build(&boxes, Builder::fast()).expect("boxes of the space are good bounds")
        });
        Self { regions, index }
    }

    pub fn for_each_in(&self, bounds: &Aabb4, mut visit: impl FnMut(&'a Region)) {
        match &self.index {
            None => self.regions.iter().filter(|region| region.bounds.overlaps(bounds)).for_each(visit),
            Some(index) => {
                let _: ControlFlow<()> = index.overlap(&bounds.closed(), |item, _| {
                    visit(&self.regions[item as usize]);
                    ControlFlow::Continue(())
                });
            }
        }
    }
}

impl World {
    /// Where, within the bounds, the world differs from what the pieces say: disjoint boxes, each the smallest about the
    /// differences of one region with one piece, or with air. The pieces are disjoint.
    pub(super) fn diff(&self, bounds: &Aabb4, pieces: &[Region], work: &mut Work) -> Vec<Aabb4> {
        let mut changed = Vec::new();
        let index = Pieces::new(pieces);
        let mut holes = Vec::new();
        let _: ControlFlow<()> = self.query_counted(bounds, work, |_, region| {
            let Some(part) = region.bounds.intersection(bounds) else { return ControlFlow::Continue(()) };
            holes.clear();
            index.for_each_in(&part, |piece| {
                holes.push(piece.bounds);
                changed.extend(difference(region, piece, bounds));
            });
            without(&part, &holes, &mut |rest| changed.extend(solid_in(region, rest)));
            ControlFlow::Continue(())
        });
        for piece in pieces {
            let Some(part) = piece.bounds.intersection(bounds) else { continue };
            holes.clear();
            let _: ControlFlow<()> = self.query_counted(&part, work, |_, region| {
                holes.push(region.bounds);
                ControlFlow::Continue(())
            });
            without(&part, &holes, &mut |rest| changed.extend(solid_in(piece, rest)));
        }
        changed
    }
}

/// The box of what is solid in a part of a region.
fn solid_in(region: &Region, part: &Aabb4) -> Option<Aabb4> {
    match &region.content {
        Content::Uniform(_) => Some(*part),
        Content::Chunk { lattice, chunk } => solid_within(part, *lattice, chunk),
    }
}

/// Visits disjoint boxes that make up what is left of a box without some holes. Many holes are divided by planes first, so
/// that a row of n of them costs n log n; nothing recurses.
pub(super) fn without(bounds: &Aabb4, holes: &[Aabb4], visit: &mut impl FnMut(&Aabb4)) {
    let within = |part: &Aabb4, holes: &[Aabb4]| -> Vec<Aabb4> {
        holes.iter().filter(|hole| hole.overlaps(part)).copied().collect()
    };
    let mut waiting = vec![(*bounds, within(bounds, holes))];
    while let Some((rest, holes)) = waiting.pop() {
        let Some((hole, others)) = holes.split_first() else {
            visit(&rest);
            continue;
        };
        match halves(&rest, &holes) {
            Some(parts) => waiting.extend(parts.map(|part| (part, within(&part, &holes)))),
            None => waiting.extend(rest.subtract(hole).iter().map(|slab| (*slab, within(slab, others)))),
        }
    }
}

/// Cuts a box in two so that each part has at most three quarters of the holes; `None` for few holes, and where no plane
/// does that.
fn halves(bounds: &Aabb4, holes: &[Aabb4]) -> Option<[Aabb4; 2]> {
    if holes.len() <= FEW {
        return None;
    }
    let cut = |axis: usize| {
        let mut planes: Vec<i64> = holes.iter().map(|hole| hole.min_raw()[axis]).collect();
        let middle = planes.len() / 2;
        let (_, &mut plane, _) = planes.select_nth_unstable(middle);
        let low = holes.iter().filter(|hole| hole.min_raw()[axis] < plane).count();
        let high = holes.iter().filter(|hole| hole.max_raw()[axis] > plane).count();
        (low.max(high), axis, plane)
    };
    let (most, axis, plane) = (0..4).map(cut).min()?;
    let inside = bounds.min_raw()[axis] < plane && plane < bounds.max_raw()[axis];
    (inside && 4 * most <= 3 * holes.len()).then(|| bounds.split(axis, plane).into())
}

/// The smallest box about the differences of two regions where they overlap, within bounds.
fn difference(a: &Region, b: &Region, within: &Aabb4) -> Option<Aabb4> {
    let both = a.bounds.intersection(&b.bounds)?.intersection(within)?;
    match (&a.content, &b.content) {
        (Content::Uniform(a), Content::Uniform(b)) => (a != b).then_some(both),
        (Content::Chunk { lattice: la, chunk: a }, Content::Chunk { lattice: lb, chunk: b }) => {
            if la == lb {
                if Arc::ptr_eq(a, b) {
                    return None;
                }
                return differing(&both, *la, |index, _| a.get(index) != b.get(index));
            }
            difference_of_lattices(&both, |raw| a.get(la.block_index(raw)), *la, |raw| b.get(lb.block_index(raw)), *lb)
        }
        (Content::Uniform(block), Content::Chunk { lattice, chunk })
        | (Content::Chunk { lattice, chunk }, Content::Uniform(block)) => {
            differing(&both, *lattice, |index, _| chunk.get(index) != *block)
        }
    }
}

/// The smallest box about the blocks that differ, within a box of one chunk.
fn differing(both: &Aabb4, lattice: Lattice, differs: impl Fn(usize, [usize; 4]) -> bool) -> Option<Aabb4> {
    let (mut min, mut max) = ([usize::MAX; 4], [0; 4]);
    for_each_block(block_range(both, lattice), lattice, |at, index| {
        if differs(index, at) {
            for a in 0..4 {
                min[a] = min[a].min(at[a]);
                max[a] = max[a].max(at[a] + 1);
            }
        }
    });
    if max == [0; 4] {
        return None;
    }
    super::region::block_box(&lattice.chunk_at(both.min_raw()), lattice, min, max).intersection(both)
}

/// The same for two chunks of different lattices: by the finer block on each axis.
fn difference_of_lattices(
    both: &Aabb4,
    a: impl Fn([i64; 4]) -> Block,
    la: Lattice,
    b: impl Fn([i64; 4]) -> Block,
    lb: Lattice,
) -> Option<Aabb4> {
    let (la, lb) = (la.block_log2(), lb.block_log2());
    let log2: [u32; 4] = std::array::from_fn(|axis| la[axis].min(lb[axis]));
    let mut differing: Option<Aabb4> = None;
    for cell in both.cells(log2) {
        let raw = cell.min_raw();
        if a(raw) != b(raw) {
            differing = Some(differing.map_or(cell, |so_far| so_far.hull(&cell)));
        }
    }
    differing?.intersection(both)
}
