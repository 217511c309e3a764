//! The eight-wide copy of a binary tree that is edited in place: what rays walk at the top level.
//!
//! The inner nodes of the binary tree are shared out among wide nodes: each wide node stands for a binary node, its root,
//! and for those below it down to other roots, at most seven together, so that at most eight children hang off it. Which
//! binary nodes are roots is remembered. An edit changes it near what was written only: a wide node that got too many
//! children makes roots of the smallest of its binary nodes, one that has room takes in the wide nodes below it that fit.
//! (A fresh copy opens the child with the largest box until there are eight: Wald, Benthin and Boulos 2008, "Getting Rid of
//! Packets", section 3.1.)

use super::bounds::Bounds;
use super::wide::{WIDTH, WideNode};
use orthant_bvh::{Aabb, Bvh, Child, ChildKind, NodeId, NodeWrites};

/// No node.
const NONE: u32 = u32::MAX;

/// Wide nodes over a binary tree. A leaf's child is its item; its count is 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct WideCopy {
    /// The nodes, unused ones among them.
    pub nodes: Vec<WideNode>,
    /// The node to start at; meaningless without nodes in use.
    pub root: u32,
    free: Vec<u32>,
    /// By binary node: the wide node of which it is the root, or [`NONE`].
    wide_of: Vec<u32>,
    /// By wide node: it waits in `work`.
    waiting: Vec<bool>,
    /// Roots whose wide nodes are to be made anew.
    work: Vec<NodeId>,
}

/// A child of a wide node that is being made.
#[derive(Clone, Copy)]
struct Open {
    child: Child,
    bounds: Aabb<f32, 3>,
    area: f32,
}

/// The children of a wide node that is being made.
struct Children {
    list: [Open; WIDTH],
    len: usize,
}

impl Children {
    fn new() -> Self {
        Self { list: [Open { child: Child::EMPTY, bounds: Aabb::EMPTY, area: 0.0 }; WIDTH], len: 0 }
    }

    fn push(&mut self, child: Child, bounds: Aabb<f32, 3>) {
        if child != Child::EMPTY {
            self.list[self.len] = Open { child, bounds, area: bounds.half_area() };
            self.len += 1;
        }
    }

    /// Puts the two children of a node in its place.
    fn open(&mut self, at: usize, bvh: &Bvh<f32, 3>, node: NodeId) {
        let node = &bvh.nodes()[node.index()];
        self.list[at] = Open { child: node.child[0], bounds: node.bounds[0], area: node.bounds[0].half_area() };
        self.push(node.child[1], node.bounds[1]);
    }

    /// The largest inner child of which `fits` approves.
    fn largest(&self, fits: impl Fn(NodeId) -> bool) -> Option<(usize, NodeId)> {
        let mut found: Option<(usize, NodeId)> = None;
        for (i, open) in self.list[..self.len].iter().enumerate() {
            if let ChildKind::Node(id) = open.child.kind()
                && found.is_none_or(|(best, _)| self.list[best].area < open.area)
                && fits(id)
            {
                found = Some((i, id));
            }
        }
        found
    }
}

impl WideCopy {
    /// Copies a whole tree, with room for more items.
    pub fn of(bvh: &mut Bvh<f32, 3>, room: usize) -> Self {
        bvh.take_writes();
        let mut copy = Self { wide_of: Vec::with_capacity(bvh.nodes().len() + room), ..Self::default() };
        copy.wide_of.resize(bvh.nodes().len(), NONE);
        if let Some(root) = bvh.root() {
            // A wide node has about five children where trees are large.
            copy.nodes.reserve((bvh.len() + room) / 4 + 1);
            copy.root = copy.make_root(root);
            copy.settle(bvh);
        }
        copy
    }

    /// Follows the edits since the writes were last taken: wide nodes in which a binary node was written are made anew.
    /// Returns how many those are.
    pub fn follow(&mut self, bvh: &Bvh<f32, 3>, writes: &NodeWrites) -> usize {
        self.wide_of.resize(writes.arena_len, NONE);
        for &id in &writes.freed {
            self.dismiss(id);
        }
        let Some(root) = writes.new_root else { return 0 };
        if self.wide_of[root.index()] == NONE {
            self.make_root(root);
        }
        self.root = self.wide_of[root.index()];
        for &id in &writes.written {
            let mut owner = id;
            while self.wide_of[owner.index()] == NONE
                && let Some(parent) = bvh.parent(owner)
            {
                owner = parent;
            }
            self.want(owner);
        }
        self.settle(bvh)
    }

    /// Bytes in memory.
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice()) + 4 * self.wide_of.len() + 4 * self.free.len() + self.waiting.len()) as u64
    }

    /// Gives a binary node a wide node of its own, to be made.
    fn make_root(&mut self, id: NodeId) -> u32 {
        let wide = self.free.pop().unwrap_or_else(|| {
            self.nodes.push(WideNode::UNUSED);
            self.waiting.push(false);
            self.nodes.len() as u32 - 1
        });
        self.wide_of[id.index()] = wide;
        self.want(id);
        wide
    }

    /// Frees the wide node of a root.
    fn dismiss(&mut self, id: NodeId) {
        let wide = std::mem::replace(&mut self.wide_of[id.index()], NONE);
        if wide != NONE {
            self.nodes[wide as usize] = WideNode::UNUSED;
            self.free.push(wide);
        }
    }

    fn want(&mut self, root: NodeId) {
        let wide = self.wide_of[root.index()] as usize;
        if !std::mem::replace(&mut self.waiting[wide], true) {
            self.work.push(root);
        }
    }

    /// Makes all wide nodes that wait. Returns their number.
    fn settle(&mut self, bvh: &Bvh<f32, 3>) -> usize {
        let mut made = 0;
        while let Some(root) = self.work.pop() {
            made += 1;
            self.make(bvh, root);
        }
        made
    }

    fn make(&mut self, bvh: &Bvh<f32, 3>, root: NodeId) {
        let node = &bvh.nodes()[root.index()];
        let mut children = Children::new();
        for slot in 0..2 {
            children.push(node.child[slot], node.bounds[slot]);
        }
        // Its own nodes, the largest first
        while children.len < WIDTH
            && let Some((at, id)) = children.largest(|id| self.wide_of[id.index()] == NONE)
        {
            children.open(at, bvh, id);
        }
        // What it has no room for
        for i in 0..children.len {
            if let ChildKind::Node(id) = children.list[i].child.kind()
                && self.wide_of[id.index()] == NONE
            {
                self.make_root(id);
            }
        }
        // What it has room for, of those whose size is known. What is below such a node are roots or its own.
        while children.len < WIDTH
            && let Some((at, id)) = children.largest(|id| {
                let wide = self.wide_of[id.index()] as usize;
                let count = self.nodes[wide].used.count_ones() as usize;
                !self.waiting[wide] && children.len - 1 + count <= WIDTH
            })
        {
            self.dismiss(id);
            children.open(at, bvh, id);
            while let Some((at, id)) = children.largest(|id| self.wide_of[id.index()] == NONE) {
                children.open(at, bvh, id);
            }
        }

        let mut node = WideNode::UNUSED;
        for (slot, open) in children.list[..children.len].iter().enumerate() {
            match open.child.kind() {
                ChildKind::Leaf(item) => node.set_child(slot, item, 1),
                ChildKind::Node(id) => node.set_child(slot, self.wide_of[id.index()], 0),
                ChildKind::Empty => {}
            }
            node.set_bounds(slot, &Bounds { lower: open.bounds.min, upper: open.bounds.max });
        }
        let wide = self.wide_of[root.index()] as usize;
        self.waiting[wide] = false;
        self.nodes[wide] = node;
    }

    /// Checks that the copy holds what the tree holds: every wide node the children of its root, every leaf once, no node
    /// that nothing leads to.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub fn validate(&self, bvh: &Bvh<f32, 3>) -> Result<(), String> {
        let mut in_use = 0;
        let mut leaves = 0;
        let mut open: Vec<(NodeId, u32)> = bvh.root().map(|id| (id, self.root)).into_iter().collect();
        while let Some((root, wide)) = open.pop() {
            in_use += 1;
            if self.wide_of.get(root.index()) != Some(&wide) || self.waiting[wide as usize] {
                return Err(format!("node {} is not what wide node {wide} stands for", root.0));
            }
            let mut expected = Vec::new();
            let mut below = vec![root];
            while let Some(id) = below.pop() {
                let node = &bvh.nodes()[id.index()];
                for (child, bounds) in node.child.into_iter().zip(node.bounds) {
                    match child.kind() {
                        ChildKind::Node(id) if self.wide_of[id.index()] == NONE => below.push(id),
                        ChildKind::Node(id) => {
                            expected.push((self.wide_of[id.index()], 0, bounds));
                            open.push((id, self.wide_of[id.index()]));
                        }
                        ChildKind::Leaf(item) => {
                            leaves += 1;
                            expected.push((item, 1, bounds));
                        }
                        ChildKind::Empty => {}
                    }
                }
            }
            let node = &self.nodes[wide as usize];
            let mut found: Vec<(u32, u8, Aabb<f32, 3>)> = (0..WIDTH)
                .filter(|slot| node.used & 1 << slot != 0)
                .map(|slot| {
                    let bounds = node.bounds(slot);
                    (node.child[slot], node.count[slot], Aabb::new(bounds.lower, bounds.upper))
                })
                .collect();
            let key = |child: &(u32, u8, Aabb<f32, 3>)| (child.1, child.0);
            expected.sort_by_key(key);
            found.sort_by_key(key);
            if expected != found {
                return Err(format!("wide node {wide} has the children {found:?}, the tree has {expected:?}"));
            }
        }
        if leaves != bvh.len() {
            return Err(format!("the wide copy has {leaves} leaves, the tree {}", bvh.len()));
        }
        if in_use + self.free.len() != self.nodes.len() {
            return Err(format!(
                "{in_use} wide nodes are in use and {} free, of {}",
                self.free.len(),
                self.nodes.len()
            ));
        }
        Ok(())
    }
}
