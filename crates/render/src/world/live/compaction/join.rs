//! Joining leaves of one block that form a box together.

use crate::world::{Leaf, LeafContent};
use orthant_world::{Aabb4, Block};

/// Rounds over all axes; each may make boxes of what the one before joined.
const ROUNDS: usize = 4;

/// The same content in fewer leaves: uniform leaves of one block whose boxes form a box are one. Other leaves stay as they are.
/// O(n log n).
pub fn join(leaves: Vec<Leaf>) -> Vec<Leaf> {
    let (mut uniform, mut rest): (Vec<(Block, Aabb4)>, Vec<Leaf>) = (Vec::new(), Vec::new());
    for leaf in leaves {
        match leaf.content {
            LeafContent::Uniform(block) => uniform.push((block, leaf.bounds)),
            _ => rest.push(leaf),
        }
    }
    for _ in 0..ROUNDS {
        let before = uniform.len();
        for axis in 0..4 {
            join_along(&mut uniform, axis);
        }
        if uniform.len() == before {
            break;
        }
    }
    rest.extend(uniform.into_iter().map(|(block, bounds)| Leaf { bounds, content: LeafContent::Uniform(block) }));
    rest
}

/// Joins runs of equal cross-section along an axis.
fn join_along(leaves: &mut Vec<(Block, Aabb4)>, axis: usize) {
    let key = |(block, bounds): &(Block, Aabb4)| {
        let (mut min, mut max) = (bounds.min_raw(), bounds.max_raw());
        let along = min[axis];
        (min[axis], max[axis]) = (0, 0);
        (block.to_bits(), min, max, along)
    };
    leaves.sort_unstable_by_key(key);
    let mut joined: Vec<(Block, Aabb4)> = Vec::with_capacity(leaves.len());
    for leaf in leaves.drain(..) {
        match joined.last_mut() {
            Some(last) if continues(last, &leaf, axis) => last.1 = last.1.hull(&leaf.1),
            _ => joined.push(leaf),
        }
    }
    *leaves = joined;
}

fn continues((block, bounds): &(Block, Aabb4), (next, after): &(Block, Aabb4), axis: usize) -> bool {
    let (min, max) = (bounds.min_raw(), bounds.max_raw());
    let same = |a: usize| min[a] == after.min_raw()[a] && max[a] == after.max_raw()[a];
    block == next && max[axis] == after.min_raw()[axis] && (0..4).all(|a| a == axis || same(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_world::{BlockId, Scale};

    fn leaf(id: u16, min: [i32; 4], max: [i32; 4]) -> Leaf {
        let block = Block::of(BlockId(id), Scale::UNIT);
        Leaf { bounds: Aabb4::from_ints(min, max).unwrap(), content: LeafContent::Uniform(block) }
    }

    #[test]
    fn a_carved_box_that_is_whole_again_is_one_leaf() {
        let whole = Aabb4::from_ints([-9; 4], [9; 4]).unwrap();
        let hole = Aabb4::from_ints([1; 4], [2; 4]).unwrap();
        let block = Block::of(BlockId(3), Scale::UNIT);
        let mut leaves: Vec<Leaf> = whole
            .subtract(&hole)
            .iter()
            .chain([&hole])
            .map(|&bounds| Leaf { bounds, content: LeafContent::Uniform(block) })
            .collect();
        assert_eq!(leaves.len(), 9);
        leaves.push(leaf(4, [9, -9, -9, -9], [10, 9, 9, 9]));
        let joined = join(leaves);
        assert_eq!(joined, [leaf(3, [-9; 4], [9; 4]), leaf(4, [9, -9, -9, -9], [10, 9, 9, 9])]);
    }

    #[test]
    fn leaves_that_touch_with_other_faces_or_blocks_stay() {
        let leaves = vec![
            leaf(1, [0; 4], [2; 4]),
            leaf(1, [2, 0, 0, 0], [3, 1, 2, 2]),
            leaf(2, [-1, 0, 0, 0], [0, 2, 2, 2]),
            leaf(1, [0, 3, 0, 0], [2, 4, 2, 2]),
        ];
        assert_eq!(join(leaves.clone()).len(), leaves.len());
    }
}
