//! Edits: a voxel, a box, a sphere, at any scale, as the patches that make them.

mod json;
mod sphere;

pub use json::{BlockRef, WorldEdit};
pub use sphere::{Sphere, fill_sphere};

use crate::block::Block;
use crate::space::{Aabb4, Aabb4Error, Scale};
use crate::tree::RegionTree;
use crate::world::WorldPatch;

/// How much an edit may look at.
#[derive(Clone, Copy, Debug)]
pub struct EditLimits {
    /// Chunk cells on the surface of a sphere.
    pub cells: usize,
}

impl Default for EditLimits {
    fn default() -> Self {
        Self { cells: 1 << 17 }
    }
}

/// Why there are no patches for an edit.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EditError {
    /// It is no box of the space.
    #[error(transparent)]
    Bounds(#[from] Aabb4Error),
    /// No such lattice cell.
    #[error("voxel {index:?} of scale {} lies beyond the space of a world", .scale.get())]
    Index {
        /// The lattice indices.
        index: [i64; 4],
        /// Their scale.
        scale: Scale,
    },
    /// Less than a voxel.
    #[error("a sphere needs a radius above 0")]
    Radius,
    /// Too much surface.
    #[error("the sphere has more than {limit} chunks on its surface; use a coarser scale or several smaller spheres")]
    TooLarge {
        /// The limit.
        limit: usize,
    },
    /// A name that the palette does not have.
    #[error("the palette has no material {name:?}; give the number of a block, or add the material by a patch")]
    UnknownBlock {
        /// The name.
        name: String,
    },
}

/// The box of a voxel: lattice indices at a scale.
///
/// # Errors
/// [`EditError::Index`] if it lies beyond space.
pub fn voxel_bounds(index: [i64; 4], scale: Scale) -> Result<Aabb4, EditError> {
    let edge = scale.edge().raw();
    let beyond = EditError::Index { index, scale };
    let mut min = [0; 4];
    for a in 0..4 {
        min[a] = index[a].checked_mul(edge).ok_or_else(|| beyond.clone())?;
    }
    Aabb4::from_raw(min, min.map(|c| c.saturating_add(edge))).map_err(|_| beyond)
}

/// Sets one voxel: lattice indices at the scale.
///
/// # Errors
/// [`EditError::Index`].
pub fn set_voxel(index: [i64; 4], scale: Scale, block: Block) -> Result<WorldPatch, EditError> {
    voxel_bounds(index, scale).map(|bounds| fill_box(bounds, block))
}

/// Fills a box; one region, however large.
pub const fn fill_box(bounds: Aabb4, block: Block) -> WorldPatch {
    WorldPatch::of_tree(RegionTree::uniform(bounds, block))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_are_lattice_cells_of_their_scale() {
        let half = Scale::new(-1).unwrap();
        let bounds = voxel_bounds([-1, 0, 3, 1], half).unwrap();
        assert_eq!(bounds.min().0.map(|c| c.to_f64()), [-0.5, 0.0, 1.5, 0.5]);
        assert_eq!(bounds.extent(), [0.5; 4]);
        assert!(matches!(voxel_bounds([i64::MAX, 0, 0, 0], half), Err(EditError::Index { .. })));
        assert!(matches!(voxel_bounds([1 << 45, 0, 0, 0], Scale::UNIT), Err(EditError::Index { .. })));
        assert!(voxel_bounds([(1 << 45) - 1, 0, 0, 0], Scale::UNIT).is_ok());
    }
}
