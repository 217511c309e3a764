use super::binary::{BinaryNode, BinaryTree};
use super::blas::Blas;
use super::bounds::{Bounds, world_bounds};
use super::collapse::WideCopy;
use super::wide::expected_nodes;
use orthant_bvh::{Aabb, Bvh, Child, NodeId, NodeWrites};
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use rayon::prelude::*;

/// The tree over the RenderNodes that rays can hit, in world space relative to the scene's origin: a binary tree that is
/// edited in place, and the eight-wide copy of it that rays walk. Its items are RenderNode indices.
#[derive(Clone, Debug, Default)]
pub struct Tlas {
    bvh: Bvh<f32, 3>,
    pub(crate) wide: WideCopy,
    /// Buffers that are used again.
    writes: NodeWrites,
}

/// What following a batch took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TlasWork {
    /// Instances that came in.
    pub inserted: usize,
    /// Instances that went.
    pub removed: usize,
    /// Instances whose boxes changed.
    pub moved: usize,
    /// Nodes of the wide copy that were made anew.
    pub nodes_written: usize,
    /// Whether the tree was built whole: more than half of all rows had changed.
    pub rebuilt: bool,
}

/// Rows from which on their boxes are computed on all threads.
const PARALLEL: usize = 2048;
/// Moved instances from which on those that leave their places go out and in as a group.
const GROUP: usize = 32;

impl Tlas {
    /// Builds it over the rows that rays can hit: occupied, visible, with a BLAS that holds something.
    pub(crate) fn build(rows: &[RenderNodeRow], blas: &[Option<Blas>]) -> Self {
        let items: Vec<(u32, Aabb<f32, 3>)> = (0..rows.len() as u32)
            .into_par_iter()
            .with_min_len(PARALLEL)
            .filter_map(|row| Some((row, instance_box(rows, blas, row)?)))
            .collect();
        let boxes: Vec<Bounds> = items.iter().map(|(_, b)| Bounds { lower: b.min, upper: b.max }).collect();
        let joins = if boxes.len() < 2 { Vec::new() } else { joins(&BinaryTree::build(&boxes, 1)) };
        let mut bvh = Bvh::from_joins(&items, &joins).expect("the builder makes a tree of good boxes");
        bvh.reserve(slack(items.len()));
        let wide = WideCopy::of(&mut bvh, slack(items.len()));
        Self { bvh, wide, writes: NodeWrites::default() }
    }

    /// Follows changes of rows, or of what they show: `changed` are the rows, each once. O(changed rows x depth), or O(rows)
    /// where more than half have changed.
    pub(crate) fn follow(&mut self, changed: &[u32], rows: &[RenderNodeRow], blas: &[Option<Blas>]) -> TlasWork {
        if changed.is_empty() {
            return TlasWork::default();
        }
        if changed.len() > rows.len() / 2 {
            let before = self.len();
            *self = Self::build(rows, blas);
            let (inserted, removed) = (self.len().saturating_sub(before), before.saturating_sub(self.len()));
            let nodes_written = self.wide.nodes.len();
            return TlasWork { inserted, removed, moved: 0, nodes_written, rebuilt: true };
        }
        let boxes: Vec<Option<Aabb<f32, 3>>> = if changed.len() >= PARALLEL {
            changed.par_iter().with_min_len(PARALLEL / 8).map(|&row| instance_box(rows, blas, row)).collect()
        } else {
            changed.iter().map(|&row| instance_box(rows, blas, row)).collect()
        };

        let good = "the item is in the tree or not, as was found, and its box is good";
        let mut work = TlasWork::default();
        let (mut incoming, mut moved) = (Vec::new(), Vec::new());
        for (&row, bounds) in changed.iter().zip(boxes) {
            match (self.bvh.bounds_of(row), bounds) {
                (None, None) => {}
                (None, Some(bounds)) => incoming.push((row, bounds)),
                (Some(_), None) => {
                    self.bvh.remove(row).expect(good);
                    work.removed += 1;
                }
                (Some(old), Some(bounds)) if old != bounds => moved.push((row, bounds)),
                (Some(_), Some(_)) => {}
            }
        }
        (work.inserted, work.moved) = (incoming.len(), moved.len());
        if moved.len() < GROUP {
            for &(row, bounds) in &moved {
                self.bvh.move_leaf(row, bounds).expect(good);
            }
        } else {
            // What stays within the box of its pair is refitted; the others leave together, since they often go together.
            let stays = |&(row, bounds): &(u32, Aabb<f32, 3>)| {
                self.bvh.leaf_of(row).is_some_and(|(node, _)| self.bvh.nodes()[node.index()].union().contains(&bounds))
            };
            let (staying, leaving): (Vec<_>, Vec<_>) = moved.into_iter().partition(stays);
            for &(row, _) in &leaving {
                self.bvh.remove(row).expect(good);
            }
            self.bvh.refit(&staying).expect(good);
            incoming.extend(leaving);
        }
        self.bvh.insert_many(&incoming).expect(good);
        self.bvh.take_writes_into(&mut self.writes);
        work.nodes_written = self.wide.follow(&self.bvh, &self.writes);
        work
    }

    /// The world-space box of everything.
    pub fn bounds(&self) -> Bounds {
        let bounds = self.bvh.bounds();
        Bounds { lower: bounds.min, upper: bounds.max }
    }

    /// Number of instances.
    pub fn len(&self) -> usize {
        self.bvh.len()
    }

    /// Whether no instance is in it.
    pub fn is_empty(&self) -> bool {
        self.bvh.is_empty()
    }

    /// Nodes that a ray through the bounds of everything is expected to visit: the sum of their surfaces over that of the root
    /// (the surface area heuristic). Looks at all nodes.
    pub fn expected_nodes(&self) -> f64 {
        expected_nodes(&self.wide.nodes, self.bounds())
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        size_of_val(self.bvh.nodes()) as u64 + self.wide.bytes()
    }

    /// Checks that the tree holds the rows that rays can hit, each with its box, that every invariant of it holds, and that the
    /// wide copy is one of it. Looks at everything.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub(crate) fn validate(&self, rows: &[RenderNodeRow], blas: &[Option<Blas>]) -> Result<(), String> {
        self.bvh.validate().map_err(|e| format!("the TLAS: {e}"))?;
        for row in 0..rows.len() as u32 {
            let (expected, found) = (instance_box(rows, blas, row), self.bvh.bounds_of(row));
            if expected != found {
                return Err(format!("the TLAS: render node {row} has the box {expected:?}, but {found:?} is resident"));
            }
        }
        if let Some((row, _)) = self.bvh.items().find(|&(row, _)| row as usize >= rows.len()) {
            return Err(format!("the TLAS: it holds render node {row} of {}", rows.len()));
        }
        self.wide.validate(&self.bvh).map_err(|what| format!("the TLAS: {what}"))
    }
}

/// Room for items to come that a fresh tree keeps, so that the first edits do not move it in memory.
fn slack(items: usize) -> usize {
    items / 8 + 1024
}

/// The joins of a tree with one item a leaf, parents first.
fn joins(tree: &BinaryTree) -> Vec<[Child; 2]> {
    // Joins are numbered in the order in which a walk meets them.
    let mut joins: Vec<[Child; 2]> = Vec::with_capacity(tree.items().len());
    let mut open = vec![(tree.root(), None)];
    while let Some((node, above)) = open.pop() {
        let child = match tree.node(node) {
            BinaryNode::Leaf { first, .. } => Child::leaf(tree.items()[first as usize]),
            BinaryNode::Inner(first, second) => {
                let join = joins.len();
                joins.push([Child::EMPTY; 2]);
                open.extend([(second, Some((join, 1))), (first, Some((join, 0)))]);
                Child::node(NodeId(join as u32))
            }
        };
        if let Some((join, slot)) = above {
            joins[join][slot] = child;
        }
    }
    joins
}

/// The box of a row that rays can hit. A box that lies wholly at infinity is none: no ray gets there.
fn instance_box(rows: &[RenderNodeRow], blas: &[Option<Blas>], row: u32) -> Option<Aabb<f32, 3>> {
    const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
    let row = rows.get(row as usize).filter(|row| row.flags & SEEN == SEEN)?;
    let blas = blas.get(row.primitive as usize)?.as_ref()?;
    let bounds = world_bounds(&blas.parts(), row);
    let bounds = Aabb::new(bounds.lower, bounds.upper);
    bounds.bad_axis().is_none().then_some(bounds)
}
