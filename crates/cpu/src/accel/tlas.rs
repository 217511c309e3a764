use super::blas::Blas;
use super::bounds::{Bounds, world_bounds};
use super::wide::WideTree;
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use rayon::prelude::*;

/// The tree over the RenderNodes that rays can hit, in world space relative to the scene's origin. Its items
/// are RenderNode indices, one a leaf.
#[derive(Clone, Debug, Default)]
pub struct Tlas {
    pub(crate) tree: WideTree,
}

impl Tlas {
    /// Builds it over the rows that rays can hit: occupied, visible, with a BLAS that holds something.
    pub(crate) fn build(rows: &[RenderNodeRow], blas: &[Option<Blas>]) -> Self {
        let (nodes, boxes): (Vec<u32>, Vec<Bounds>) = rows
            .par_iter()
            .enumerate()
            .map(|(i, row)| (i as u32, instance_bounds(row, blas)))
            .filter(|(_, bounds)| !bounds.is_empty())
            .unzip();
        let mut tree = WideTree::build(&boxes, 1);
        for item in &mut tree.items {
            *item = nodes[*item as usize];
        }
        Self { tree }
    }

    /// Recomputes the boxes, where instances have moved. The set of instances stays; one that rays can no longer hit
    /// gets the empty box.
    pub(crate) fn update(&mut self, rows: &[RenderNodeRow], blas: &[Option<Blas>]) {
        let bounds: Vec<Bounds> = rows.par_iter().map(|row| instance_bounds(row, blas)).collect();
        self.tree.refit(|items| bounds.get(items[0] as usize).copied().unwrap_or(Bounds::EMPTY));
    }

    /// The world-space box of everything.
    pub fn bounds(&self) -> Bounds {
        self.tree.bounds()
    }

    /// Number of instances.
    pub fn len(&self) -> usize {
        self.tree.items.len()
    }

    /// Whether no instance is in it.
    pub fn is_empty(&self) -> bool {
        self.tree.items.is_empty()
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        self.tree.bytes()
    }
}

fn instance_bounds(row: &RenderNodeRow, blas: &[Option<Blas>]) -> Bounds {
    const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
    match blas.get(row.primitive as usize) {
        Some(Some(blas)) if row.flags & SEEN == SEEN => world_bounds(&blas.parts(), row),
        _ => Bounds::EMPTY,
    }
}
