//! The radius of the scene, kept while instances come, go, move and change their shape.

use orthant_resident::extent::Extent;
use orthant_resident::slot_tree::SlotTree;

/// The box about all that is seen, as a tree over render-node rows.
#[derive(Clone, Debug)]
pub struct SceneExtent {
    tree: SlotTree<Extent>,
    reshaped: Vec<u32>,
}

impl SceneExtent {
    /// Over the boxes of all rows.
    pub fn new(rows: usize, of: impl Fn(usize) -> Extent) -> Self {
        Self { tree: SlotTree::new(rows, of), reshaped: Vec::new() }
    }

    /// Notes that the geometry of an instance may have other bounds, though its row is what it was.
    pub fn reshaped(&mut self, row: u32) {
        self.reshaped.push(row);
    }

    /// Follows rows that changed, and those that were noted. O(log n) each; the number of rows that it looked at.
    pub fn update(&mut self, changed: &[u32], rows: usize, of: impl Fn(usize) -> Extent) -> usize {
        self.tree.update(rows, changed.iter().copied().chain(self.reshaped.drain(..)), of)
    }

    /// [`orthant_resident::extent::scene_radius`] of the rows.
    pub fn radius(&self) -> f32 {
        self.tree.total().radius()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_resident::extent::scene_radius;
    use orthant_resident::rows::{MeshDesc, NodeFlags, RenderNodeRow};

    fn row(at: f32) -> RenderNodeRow {
        let mut row = RenderNodeRow { primitive: 0, flags: NodeFlags::VISIBLE, ..RenderNodeRow::HOLE };
        row.world.rows[0][3] = at;
        row
    }

    fn of<'r>(rows: &'r [RenderNodeRow], descs: &'r [MeshDesc]) -> impl Fn(usize) -> Extent + 'r {
        |row| Extent::of_instance(&rows[row], descs)
    }

    #[test]
    fn one_of_a_million_instances_is_followed_at_the_cost_of_its_group() {
        let mut descs = [MeshDesc { bounds_min: [-1.0; 3], bounds_max: [1.0; 3], ..bytemuck::Zeroable::zeroed() }];
        let mut rows: Vec<RenderNodeRow> = (0..1_000_000).map(|i| row((i % 1000) as f32)).collect();
        let mut extent = SceneExtent::new(rows.len(), of(&rows, &descs));
        assert_eq!(extent.radius(), scene_radius(&rows, &descs));
        // Out of the others, and back among them: the box shrinks too.
        for at in [5000.0, 3.0] {
            rows[777_777] = row(at);
            assert!(extent.update(&[777_777], rows.len(), of(&rows, &descs)) <= 16);
            assert_eq!(extent.radius(), scene_radius(&rows, &descs));
        }
        rows.truncate(100);
        descs[0].bounds_max = [3.0; 3];
        (0..100).for_each(|row| extent.reshaped(row));
        extent.update(&[], rows.len(), of(&rows, &descs));
        assert_eq!(extent.radius(), scene_radius(&rows, &descs));
    }
}
