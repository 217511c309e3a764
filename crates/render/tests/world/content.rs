//! What resident leaves say is where, against what a world says, exactly.

use super::interpreter::Interpreter;
use orthant_resident::world::payload;
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, kind};
use orthant_world::{Aabb4, Content, Region, World};
use std::collections::HashSet;

/// Boxes of one block each.
type Boxes = Vec<(Aabb4, u32)>;

fn volume(bounds: &Aabb4) -> u128 {
    bounds.extent_raw().iter().map(|&extent| extent as u128).product()
}

/// A row as boxes of one block: runs along x, within the row's box.
pub fn boxes_of_row(row: &LeafRow, words: &[u32]) -> Boxes {
    let bounds = Aabb4::from_raw(row.min, row.max).expect("rows hold boxes");
    if row.kind() == kind::UNIFORM {
        return vec![(bounds, row.block)];
    }
    let chunk = (row.payload != NO_PAYLOAD).then(|| &words[row.payload as usize..]);
    boxes_of_blocks(row.chunk_min(), row.block_log2(), row.size_log2(), &bounds, |i| match chunk {
        Some(chunk) => {
            let block = payload::block(chunk, i);
            assert_eq!(payload::is_solid(chunk, i), block != 0, "occupancy of block {i}");
            block
        }
        None => row.block,
    })
}

/// A region as boxes of one block.
fn boxes_of_region(region: &Region) -> Boxes {
    match &region.content {
        Content::Uniform(block) => vec![(region.bounds, block.to_bits())],
        Content::Chunk { lattice, chunk } => {
            let cell = region.chunk_bounds().expect("it is of a chunk");
            let log2 = lattice.block_extent().map(|extent| extent.raw().trailing_zeros());
            let size = lattice.shape.size().map(usize::trailing_zeros);
            let blocks = chunk.blocks();
            boxes_of_blocks(cell.min_raw(), log2, size, &region.bounds, |i| blocks[i].to_bits())
        }
    }
}

fn boxes_of_blocks(
    min: [i64; 4],
    block_log2: [u32; 4],
    size_log2: [u32; 4],
    within: &Aabb4,
    block: impl Fn(usize) -> u32,
) -> Boxes {
    let mut boxes = Boxes::new();
    let size = size_log2.map(|log2| 1_usize << log2);
    for row in 0..4096 / size[0] {
        let at = [0, row % size[1], row / size[1] % size[2], row / (size[1] * size[2])];
        let mut x = 0;
        while x < size[0] {
            let first = block(row * size[0] + x);
            let end = (x..size[0]).find(|&x| block(row * size[0] + x) != first).unwrap_or(size[0]);
            let corner = |x: usize, plus: i64| {
                let at = [x, at[1], at[2], at[3]];
                std::array::from_fn(|a| min[a] + ((at[a] as i64 + if a > 0 { plus } else { 0 }) << block_log2[a]))
            };
            let run = Aabb4::from_raw(corner(x, 0), corner(end, 1)).expect("a run of blocks is a box");
            if first != 0 {
                boxes.extend(run.intersection(within).map(|run| (run, first)));
            }
            x = end;
        }
    }
    boxes
}

/// Whether the leaves say of a box what the world says: as both are disjoint, the volumes of the one, of the other, and of
/// where they agree are then the same.
pub fn equal_within(leaves: &[LeafRow], arenas: &Interpreter, world: &World, bounds: &Aabb4) -> bool {
    let mut ours = 0;
    let mut agreed = 0;
    for row in leaves {
        let Some(part) = Aabb4::from_raw(row.min, row.max).expect("a box").intersection(bounds) else { continue };
        let boxes = clipped(boxes_of_row(row, &arenas.payload), &part);
        ours += boxes.iter().map(|(b, _)| volume(b)).sum::<u128>();
        for id in world.regions_in(&part) {
            let theirs = clipped(boxes_of_region(world.region(id).expect("found just now")), &part);
            agreed += volume_of_agreement(&boxes, theirs);
        }
    }
    let regions = world.regions_in(bounds).into_iter().map(|id| world.region(id).expect("found just now"));
    let theirs: u128 =
        regions.flat_map(|region| clipped(boxes_of_region(region), bounds)).map(|(b, _)| volume(&b)).sum();
    ours == theirs && ours == agreed
}

fn clipped(boxes: Boxes, to: &Aabb4) -> Boxes {
    boxes.into_iter().filter_map(|(b, block)| Some((b.intersection(to)?, block))).collect()
}

/// The volume in which both have the same block.
fn volume_of_agreement(ours: &Boxes, theirs: Boxes) -> u128 {
    // Boxes that are in both overlap nothing else, as each side is disjoint: they need not be compared with all.
    let both: HashSet<(Aabb4, u32)> = {
        let theirs: HashSet<_> = theirs.iter().copied().collect();
        ours.iter().copied().filter(|b| theirs.contains(b)).collect()
    };
    let rest = |boxes: &Boxes| boxes.iter().copied().filter(|b| !both.contains(b)).collect::<Boxes>();
    let theirs = rest(&theirs);
    let mut agreed = both.iter().map(|(b, _)| volume(b)).sum();
    for (b, block) in rest(ours) {
        for (other, _) in theirs.iter().filter(|(_, theirs)| *theirs == block) {
            agreed += b.intersection(other).map_or(0, |both| volume(&both));
        }
    }
    agreed
}

/// Whether no two rows share a point.
pub fn are_disjoint(leaves: &[LeafRow]) -> bool {
    let mut sorted: Vec<&LeafRow> = leaves.iter().collect();
    sorted.sort_unstable_by_key(|row| row.min[0]);
    sorted.iter().enumerate().all(|(i, row)| {
        let behind = sorted[i + 1..].iter().take_while(|other| other.min[0] < row.max[0]);
        behind.into_iter().all(|other| (1..4).any(|a| other.min[a] >= row.max[a] || row.min[a] >= other.max[a]))
    })
}

/// Rows without places, and what counts of their chunks, to compare sets of leaves. The coarse mask and the payload are of whole
/// chunks, also where they do not count.
pub fn shapes(leaves: &[LeafRow], arenas: &Interpreter) -> Vec<(LeafRow, Boxes)> {
    let shape = |row: &LeafRow| (LeafRow { payload: 0, coarse: 0, ..*row }, boxes_of_row(row, &arenas.payload));
    let mut shapes: Vec<_> = leaves.iter().map(shape).collect();
    shapes.sort_by_key(|(row, _)| row.min);
    shapes
}
