//! Spheres. The ball is divided from its bounding box down: boxes inside of it are one patch each however large, boxes
//! outside are none, and what is left at the size of a chunk is a patch of one chunk, with what the world has around the ball.

use super::{EditError, EditLimits, fill_box};
use crate::block::Block;
use crate::chunk::Chunk;
use crate::space::{Aabb4, Fixed, Lattice, Point4, Scale};
use crate::tree::RegionTree;
use crate::world::{World, WorldPatch, block_box};
use std::ops::ControlFlow;
use std::sync::Arc;

/// A ball of voxels: those whose centres are no farther from the centre than the radius.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sphere {
    /// The centre.
    pub center: Point4,
    /// The radius in units.
    pub radius: Fixed,
    /// The voxels' scale.
    pub scale: Scale,
}

/// How a box of voxels lies to the ball.
#[derive(PartialEq)]
enum Side {
    Inside,
    Outside,
    Across,
}

impl Sphere {
    /// The ball's box.
    ///
    /// # Errors
    /// [`EditError::Radius`], [`EditError::Bounds`].
    pub fn bounds(&self) -> Result<Aabb4, EditError> {
        let radius = self.radius.raw();
        if radius <= 0 {
            return Err(EditError::Radius);
        }
        let center = self.center.raw();
        let min = center.map(|c| c.saturating_sub(radius));
        Ok(Aabb4::from_raw(min, center.map(|c| c.saturating_add(radius)))?)
    }

    /// Where the centres of the voxels of a box lie, by their squared distances in steps of 1/131,072. Within the ball's
    /// box, widened by a chunk, differences are below 2^63 and their squares' sum below 2^127.
    fn side(&self, bounds: &Aabb4, lattice: Lattice) -> Side {
        let extent = lattice.block_extent();
        let (mut nearest, mut farthest) = (0_u128, 0_u128);
        for a in 0..4 {
            let (center, half) = (2 * i128::from(self.center.raw()[a]), i128::from(extent[a].raw()));
            let first = 2 * i128::from(bounds.min_raw()[a]) + half - center;
            let last = 2 * i128::from(bounds.max_raw()[a]) - half - center;
            let near = if first > 0 { first } else { last.min(0) }.unsigned_abs();
            let far = first.unsigned_abs().max(last.unsigned_abs());
            nearest += near * near;
            farthest += far * far;
        }
        let radius = 2 * u128::from(self.radius.raw().unsigned_abs());
        match (nearest > radius * radius, farthest <= radius * radius) {
            (true, _) => Side::Outside,
            (_, true) => Side::Inside,
            _ => Side::Across,
        }
    }
}

/// The patches that fill a ball, each of one box or one chunk. In a world that is flat (everything in `0 <= w < 1`) a ball whose
/// centre has w = 1/2 is flat too. Digging (filling with air) costs nothing where there is nothing.
///
/// # Errors
/// [`EditError`].
pub fn fill_sphere(
    world: &World,
    sphere: &Sphere,
    block: Block,
    limits: &EditLimits,
) -> Result<Vec<WorldPatch>, EditError> {
    let mut bounds = sphere.bounds()?;
    let flat_world = world.bounds().is_some_and(|b| Lattice::flat(sphere.scale).admits(&b));
    let flat = flat_world && 2 * sphere.center.raw()[3] == Fixed::ONE.raw();
    let lattice = if flat { Lattice::flat(sphere.scale) } else { Lattice::cube(sphere.scale) };
    if flat {
        let (mut min, mut max) = (bounds.min_raw(), bounds.max_raw());
        (min[3], max[3]) = (0, Fixed::ONE.raw());
        bounds = Aabb4::from_raw(min, max)?;
    }
    // The surface is counted before any of it is made.
    let mut parts = Vec::new();
    let mut cells = 0;
    let mut waiting = vec![lattice.chunks_about(&bounds)];
    while let Some(part) = waiting.pop() {
        match sphere.side(&part, lattice) {
            Side::Outside => continue,
            _ if block.is_air() && is_empty(world, &part) => continue,
            Side::Inside => parts.push((part, Side::Inside)),
            Side::Across => match halves(&part, lattice) {
                Some(parts) => waiting.extend(parts),
                None => {
                    cells += 1;
                    if cells > limits.cells {
                        return Err(EditError::TooLarge { limit: limits.cells });
                    }
                    parts.push((part, Side::Across));
                }
            },
        }
    }
    let mut patches = Vec::with_capacity(parts.len());
    for (part, side) in parts {
        match side {
            Side::Inside => patches.push(fill_box(part, block)),
            _ => fill_cell(world, sphere, block, &part, lattice, &mut patches),
        }
    }
    Ok(patches)
}

fn is_empty(world: &World, bounds: &Aabb4) -> bool {
    world.query(bounds, |_, _| ControlFlow::Break(())).is_continue()
}

/// The box of whole chunks in two, along the axis of the most chunks; `None` for one chunk.
fn halves(bounds: &Aabb4, lattice: Lattice) -> Option<[Aabb4; 2]> {
    let log2 = lattice.chunk_log2();
    let chunks = |a: usize| bounds.extent_raw()[a] >> log2[a];
    let axis = (0..4).max_by_key(|&a| chunks(a)).filter(|&a| chunks(a) > 1)?;
    let middle = bounds.min_raw()[axis] + ((chunks(axis) / 2) << log2[axis]);
    let (mut max, mut min) = (bounds.max_raw(), bounds.min_raw());
    (max[axis], min[axis]) = (middle, middle);
    Some([Aabb4::from_raw_unchecked(bounds.min_raw(), max), Aabb4::from_raw_unchecked(min, bounds.max_raw())])
}

/// The voxels of one chunk that are in the ball.
fn fill_cell(
    world: &World,
    sphere: &Sphere,
    block: Block,
    cell: &Aabb4,
    lattice: Lattice,
    patches: &mut Vec<WorldPatch>,
) {
    let size = lattice.shape.size();
    let inside = |at: [usize; 4]| {
        let voxel = block_box(cell, lattice, at, at.map(|c| c + 1));
        sphere.side(&voxel, lattice) == Side::Inside
    };
    if let Some(mut blocks) = world.blocks_of_cell(cell, lattice) {
        let mut any = false;
        for (index, slot) in blocks.iter_mut().enumerate() {
            if inside(lattice.shape.at(index)) {
                *slot = block;
                any = true;
            }
        }
        if any {
            let chunk = Arc::new(Chunk::from_blocks(&blocks));
            let tree = RegionTree::chunk_array(*cell, lattice, vec![chunk]);
            patches.push(WorldPatch::of_tree(tree.expect("a cell of the lattice has one chunk")));
        }
        return;
    }
    // Something finer lies in the cell: row by row, and nothing else is touched.
    for row in 0..size[1] * size[2] * size[3] {
        let [y, z, w] = [row % size[1], row / size[1] % size[2], row / (size[1] * size[2])];
        let filled: Vec<usize> = (0..size[0]).filter(|&x| inside([x, y, z, w])).collect();
        // A row of a ball has no gap.
        if let (Some(&first), Some(&last)) = (filled.first(), filled.last()) {
            let run = block_box(cell, lattice, [first, y, z, w], [last + 1, y + 1, z + 1, w + 1]);
            patches.push(fill_box(run, block));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::BlockId;

    fn block(id: u16) -> Block {
        Block::of(BlockId(id), Scale::UNIT)
    }

    fn sphere(center: [f64; 4], radius: f64, scale: i8) -> Sphere {
        Sphere {
            center: Point4(center.map(|c| Fixed::from_f64(c).unwrap())),
            radius: Fixed::from_f64(radius).unwrap(),
            scale: Scale::new(scale).unwrap(),
        }
    }

    fn fill(world: &mut World, sphere: &Sphere, block: Block) -> usize {
        let patches = fill_sphere(world, sphere, block, &EditLimits::default()).unwrap();
        patches.iter().for_each(|patch| drop(world.apply(patch).unwrap()));
        world.validate().unwrap();
        patches.len()
    }

    /// Every voxel of a box by its centre.
    fn check(world: &World, ball: &Sphere, half: i64, inside: Block, outside: impl Fn([i64; 4]) -> Block) {
        let edge = ball.scale.edge().raw();
        let center = ball.center.raw().map(|c| c.div_euclid(edge));
        let range = || -half..half;
        for (dw, dz) in range().flat_map(|w| range().map(move |z| (w, z))) {
            for (dy, dx) in range().flat_map(|y| range().map(move |x| (y, x))) {
                let index = [center[0] + dx, center[1] + dy, center[2] + dz, center[3] + dw];
                let at: [i64; 4] = index.map(|i| i * edge);
                let square = |a: usize| {
                    let d = (2 * at[a] + edge - 2 * ball.center.raw()[a]) as f64 / 131_072.0;
                    d * d
                };
                let within = (0..4).map(square).sum::<f64>() <= ball.radius.to_f64().powi(2);
                let expected = if within { inside } else { outside(index) };
                assert_eq!(world.block_at(Point4::from_raw(at)), expected, "voxel {index:?}");
            }
        }
    }

    #[test]
    fn a_sphere_is_the_voxels_whose_centres_it_holds() {
        for (center, radius, scale, half) in
            [([0.5; 4], 5.0, 0, 8), ([-3.25, 7.0, 100.5, -9.0], 2.5, -1, 8), ([1.0e6, -9.0, 0.0, 4.0], 24.0, 2, 8)]
        {
            let mut world = World::new();
            let ball = sphere(center, radius, scale);
            fill(&mut world, &ball, block(3));
            check(&world, &ball, half, block(3), |_| Block::AIR);
            // What is around it stays.
            let mut world = World::new();
            let all = Lattice::cube(ball.scale).chunks_about(&ball.bounds().unwrap());
            world.apply(&fill_box(all, block(1))).unwrap();
            fill(&mut world, &ball, Block::AIR);
            let lattice_box =
                |index: [i64; 4]| all.contains_point(Point4::from_raw(index.map(|i| i * ball.scale.edge().raw())));
            check(&world, &ball, half, Block::AIR, |i| if lattice_box(i) { block(1) } else { Block::AIR });
        }
    }

    #[test]
    fn finer_content_about_a_sphere_stays() {
        let mut world = World::new();
        let fine = super::super::set_voxel([41, 2, 2, 2], Scale::new(-3).unwrap(), block(7)).unwrap();
        world.apply(&fine).unwrap();
        let ball = sphere([0.5; 4], 5.0, 0);
        fill(&mut world, &ball, block(3));
        assert_eq!(world.block_at(fine.authoritative_bounds.min()), block(3), "within");
        let beside = super::super::set_voxel([47, 47, 2, 2], Scale::new(-3).unwrap(), block(7)).unwrap();
        world.apply(&beside).unwrap();
        fill(&mut world, &ball, block(4));
        assert_eq!(world.block_at(beside.authoritative_bounds.min()), block(7), "beside");
        assert_eq!(world.block_at(Point4::from_ints([0; 4])), block(4));
    }

    #[test]
    fn a_sphere_in_a_flat_world_is_flat() {
        let mut world = World::new();
        world.apply(&fill_box(Aabb4::from_ints([-40, -40, -40, 0], [40, 0, 40, 1]).unwrap(), block(1))).unwrap();
        fill(&mut world, &sphere([0.0, 0.0, 0.0, 0.5], 10.0, 0), block(2));
        let bounds = world.bounds().unwrap();
        assert_eq!((bounds.min_raw()[3], bounds.max_raw()[3]), (0, Fixed::ONE.raw()));
        assert_eq!(world.block_at(Point4::from_ints([0, 9, 0, 0])), block(2));
    }

    #[test]
    fn a_huge_sphere_is_refused_or_costs_what_is_there() {
        let mut world = World::new();
        let huge = sphere([0.0; 4], 1.0e9, 0);
        let limits = EditLimits { cells: 1000 };
        assert_eq!(fill_sphere(&world, &huge, block(1), &limits), Err(EditError::TooLarge { limit: 1000 }));
        assert_eq!(fill_sphere(&world, &huge, Block::AIR, &limits), Ok(vec![]));
        world.apply(&fill_box(Aabb4::from_ints([5; 4], [90; 4]).unwrap(), block(1))).unwrap();
        let patches = fill_sphere(&world, &huge, Block::AIR, &limits).unwrap();
        assert_eq!(patches.len(), 1, "all that is there is inside");
        let coarse = Sphere { scale: Scale::MAX, radius: Fixed::from_int(500_000), ..huge };
        assert!(fill_sphere(&world, &coarse, block(1), &EditLimits::default()).is_ok());
    }
}
