//! Child nodes in order.

use super::NodeId;
use std::collections::HashMap;
use std::fmt;

/// Ids of a leaf, and children of an inner node, at most.
const WIDTH: usize = 64;

/// Lists up to this length stay plain: searching one touches no more than a path through a tree does.
const LONGEST_LIST: usize = 4 * WIDTH;

/// Child nodes in order. Short lists are plain; a long one that is to be edited becomes a counted B+-tree
/// ([`Children::prepare`]), in which finding, inserting and removing one of n takes O(log n).
#[derive(Clone)]
pub struct Children(Form);

#[derive(Clone)]
enum Form {
    List(Vec<NodeId>),
    Tree(Box<Tree>),
}

impl Default for Children {
    fn default() -> Self {
        Self(Form::List(Vec::new()))
    }
}

impl fmt::Debug for Children {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl PartialEq for Children {
    fn eq(&self, other: &Self) -> bool {
        self.len() == other.len() && self.iter().eq(other.iter())
    }
}

impl From<Vec<NodeId>> for Children {
    fn from(ids: Vec<NodeId>) -> Self {
        Self(Form::List(ids))
    }
}

impl Children {
    /// The children in order.
    pub fn iter(&self) -> Iter<'_> {
        match &self.0 {
            Form::List(ids) => Iter { now: ids.iter(), tree: None, ahead: Vec::new(), left: ids.len() },
            Form::Tree(tree) => {
                Iter { now: [].iter(), tree: Some(tree), ahead: vec![tree.root], left: tree.count(tree.root) }
            }
        }
    }

    /// How many.
    pub fn len(&self) -> usize {
        match &self.0 {
            Form::List(ids) => ids.len(),
            Form::Tree(tree) => tree.count(tree.root),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that the list holds besides itself.
    pub(crate) fn heap_bytes(&self) -> usize {
        match &self.0 {
            Form::List(ids) => size_of_val(&ids[..]),
            // Blocks are half full at least on the whole; a map's entry takes about twice its content.
            Form::Tree(tree) => tree.blocks.len() * (size_of::<Block>() + WIDTH * 8) + tree.leaf_of.capacity() * 24,
        }
    }

    /// The place of a child, or `None` if it is none.
    pub fn position(&self, id: NodeId) -> Option<usize> {
        match &self.0 {
            Form::List(ids) => ids.iter().position(|&other| other == id),
            Form::Tree(tree) => tree.position(id),
        }
    }

    /// Makes a long list ready for edits, in O(n); nothing where that has been done.
    pub(crate) fn prepare(&mut self) {
        if let Form::List(ids) = &self.0
            && ids.len() > LONGEST_LIST
        {
            self.0 = Form::Tree(Box::new(Tree::new(ids)));
        }
    }

    /// Inserts a child before the one at `index`, or at the end if there are fewer. It must not be one already.
    pub(crate) fn insert(&mut self, index: usize, id: NodeId) {
        self.prepare();
        match &mut self.0 {
            Form::List(ids) => ids.insert(index.min(ids.len()), id),
            Form::Tree(tree) => tree.insert(index.min(tree.count(tree.root)), id),
        }
    }

    /// Takes a child out, and says where it was.
    pub(crate) fn remove(&mut self, id: NodeId) -> Option<usize> {
        self.prepare();
        match &mut self.0 {
            Form::List(ids) => {
                let index = ids.iter().position(|&other| other == id)?;
                ids.remove(index);
                Some(index)
            }
            Form::Tree(tree) => tree.remove(id),
        }
    }

    /// Shows each child with its place.
    pub(crate) fn each(&self, mut see: impl FnMut(usize, &NodeId)) {
        for (i, id) in self.iter().enumerate() {
            see(i, &id);
        }
    }

    /// Lets each child be changed to another.
    pub(crate) fn each_mut(&mut self, mut change: impl FnMut(usize, &mut NodeId)) {
        if let Form::Tree(_) = self.0 {
            self.0 = Form::List(self.iter().collect());
        }
        if let Form::List(ids) = &mut self.0 {
            ids.iter_mut().enumerate().for_each(|(i, id)| change(i, id));
        }
    }
}

/// The children of a node in order.
#[derive(Clone)]
pub struct Iter<'c> {
    now: std::slice::Iter<'c, NodeId>,
    tree: Option<&'c Tree>,
    /// Nodes of the tree that come after `now`, the next one last.
    ahead: Vec<u32>,
    left: usize,
}

impl Iterator for Iter<'_> {
    type Item = NodeId;

    fn next(&mut self) -> Option<NodeId> {
        loop {
            if let Some(&id) = self.now.next() {
                self.left -= 1;
                return Some(id);
            }
            let tree = self.tree?;
            match &tree.blocks[self.ahead.pop()? as usize].content {
                Content::Leaf(ids) => self.now = ids.iter(),
                Content::Inner { children, .. } => self.ahead.extend(children.iter().rev()),
            }
        }
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for Iter<'_> {}

/// A B+-tree by position: inner nodes know how many ids are below them. Blocks are freed when they are empty and not
/// before (Johnson and Shasha 1993, "B-trees with inserts and deletes: why free-at-empty is better than merge-at-half").
#[derive(Clone)]
struct Tree {
    blocks: Vec<Block>,
    free: Vec<u32>,
    root: u32,
    /// The leaf that holds an id.
    leaf_of: HashMap<NodeId, u32>,
}

#[derive(Clone)]
struct Block {
    /// [`NO_PARENT`] for the root.
    parent: u32,
    content: Content,
}

#[derive(Clone)]
enum Content {
    Leaf(Vec<NodeId>),
    Inner { children: Vec<u32>, count: usize },
}

const NO_PARENT: u32 = u32::MAX;

impl Tree {
    fn new(ids: &[NodeId]) -> Self {
        let mut tree = Self { blocks: Vec::new(), free: Vec::new(), root: 0, leaf_of: HashMap::new() };
        tree.leaf_of.reserve(ids.len());
        // Three quarters full: the first insertions split nothing.
        let mut level: Vec<u32> = Vec::new();
        for ids in ids.chunks(WIDTH * 3 / 4) {
            let leaf = tree.block(Content::Leaf(ids.to_vec()));
            tree.leaf_of.extend(ids.iter().map(|&id| (id, leaf)));
            level.push(leaf);
        }
        while level.len() > 1 {
            let above: Vec<u32> = level.chunks(WIDTH * 3 / 4).map(|children| tree.inner(children.to_vec())).collect();
            level = above;
        }
        tree.root = level.first().copied().unwrap_or_else(|| tree.block(Content::Leaf(Vec::new())));
        tree
    }

    fn block(&mut self, content: Content) -> u32 {
        let block = Block { parent: NO_PARENT, content };
        match self.free.pop() {
            Some(at) => {
                self.blocks[at as usize] = block;
                at
            }
            None => {
                self.blocks.push(block);
                (self.blocks.len() - 1) as u32
            }
        }
    }

    fn inner(&mut self, children: Vec<u32>) -> u32 {
        let count = children.iter().map(|&child| self.count(child)).sum();
        let at = self.block(Content::Inner { children: Vec::new(), count });
        for &child in &children {
            self.blocks[child as usize].parent = at;
        }
        self.blocks[at as usize].content = Content::Inner { children, count };
        at
    }

    /// Ids below a block.
    fn count(&self, at: u32) -> usize {
        match &self.blocks[at as usize].content {
            Content::Leaf(ids) => ids.len(),
            Content::Inner { count, .. } => *count,
        }
    }

    fn children_mut(&mut self, at: u32) -> &mut Vec<u32> {
        match &mut self.blocks[at as usize].content {
            Content::Inner { children, .. } => children,
            Content::Leaf(_) => unreachable!("a parent is an inner block"),
        }
    }

    fn leaf_mut(&mut self, at: u32) -> &mut Vec<NodeId> {
        match &mut self.blocks[at as usize].content {
            Content::Leaf(ids) => ids,
            Content::Inner { .. } => unreachable!("an id is in a leaf"),
        }
    }

    /// Adds to the counts of all inner blocks above one.
    fn recount(&mut self, at: u32, change: isize) {
        let mut above = self.blocks[at as usize].parent;
        while above != NO_PARENT {
            let block = &mut self.blocks[above as usize];
            if let Content::Inner { count, .. } = &mut block.content {
                *count = count.wrapping_add_signed(change);
            }
            above = block.parent;
        }
    }

    fn position(&self, id: NodeId) -> Option<usize> {
        let mut at = *self.leaf_of.get(&id)?;
        let Content::Leaf(ids) = &self.blocks[at as usize].content else { return None };
        let mut position = ids.iter().position(|&other| other == id)?;
        loop {
            let above = self.blocks[at as usize].parent;
            if above == NO_PARENT {
                return Some(position);
            }
            if let Content::Inner { children, .. } = &self.blocks[above as usize].content {
                let before = children.iter().take_while(|&&child| child != at);
                position += before.map(|&child| self.count(child)).sum::<usize>();
            }
            at = above;
        }
    }

    fn insert(&mut self, mut index: usize, id: NodeId) {
        let mut at = self.root;
        while let Content::Inner { children, .. } = &self.blocks[at as usize].content {
            let mut chosen = children[children.len() - 1];
            for &child in children {
                let count = self.count(child);
                if index <= count {
                    chosen = child;
                    break;
                }
                index -= count;
            }
            at = chosen;
        }
        let ids = self.leaf_mut(at);
        ids.insert(index.min(ids.len()), id);
        let upper = (ids.len() > WIDTH).then(|| ids.split_off(WIDTH / 2));
        self.leaf_of.insert(id, at);
        self.recount(at, 1);
        if let Some(upper) = upper {
            let new = self.block(Content::Leaf(Vec::new()));
            for id in &upper {
                self.leaf_of.insert(*id, new);
            }
            *self.leaf_mut(new) = upper;
            self.add_after(at, new);
        }
    }

    /// Puts a block behind its new neighbour, whose parent has counted what is in it already.
    fn add_after(&mut self, neighbour: u32, new: u32) {
        let above = self.blocks[neighbour as usize].parent;
        if above == NO_PARENT {
            self.root = self.inner(vec![neighbour, new]);
            return;
        }
        self.blocks[new as usize].parent = above;
        let children = self.children_mut(above);
        let place = children.iter().position(|&child| child == neighbour).map_or(children.len(), |i| i + 1);
        children.insert(place, new);
        if children.len() > WIDTH {
            let upper = children.split_off(WIDTH / 2);
            let sibling = self.inner(upper);
            let moved = self.count(sibling);
            if let Content::Inner { count, .. } = &mut self.blocks[above as usize].content {
                *count -= moved;
            }
            self.add_after(above, sibling);
        }
    }

    fn remove(&mut self, id: NodeId) -> Option<usize> {
        let position = self.position(id)?;
        let mut at = self.leaf_of.remove(&id)?;
        self.leaf_mut(at).retain(|&other| other != id);
        self.recount(at, -1);
        while self.count(at) == 0 && at != self.root {
            let above = self.blocks[at as usize].parent;
            self.children_mut(above).retain(|&child| child != at);
            self.free.push(at);
            at = above;
        }
        if self.count(self.root) == 0 {
            *self = Self::new(&[]);
        }
        while let Content::Inner { children, .. } = &self.blocks[self.root as usize].content
            && let &[only] = &children[..]
        {
            self.free.push(self.root);
            self.root = only;
            self.blocks[only as usize].parent = NO_PARENT;
        }
        Some(position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Store;
    use proptest::prelude::*;

    fn id(i: usize) -> NodeId {
        Store::<NodeId, ()>::nth_id(i)
    }

    /// The same edits on a tree and on a list.
    fn agree(start: usize, edits: &[(bool, usize)]) {
        let mut list: Vec<NodeId> = (0..start).map(id).collect();
        let mut tree = Tree::new(&list);
        let mut next = start;
        for &(insert, at) in edits {
            if insert || list.is_empty() {
                let at = at % (list.len() + 1);
                list.insert(at, id(next));
                tree.insert(at, id(next));
                next += 1;
            } else {
                let at = at % list.len();
                assert_eq!(tree.remove(list.remove(at)), Some(at));
            }
        }
        let children = Children(Form::Tree(Box::new(tree)));
        assert_eq!(children.len(), list.len());
        assert!(children.iter().eq(list.iter().copied()));
        for (i, &id) in list.iter().enumerate() {
            assert_eq!(children.position(id), Some(i));
        }
        assert_eq!(children.position(id(next)), None);
    }

    proptest! {
        #[test]
        fn a_tree_is_the_list(start in 0usize..400, edits in prop::collection::vec(any::<(bool, usize)>(), 0..400)) {
            agree(start, &edits);
        }
    }

    #[test]
    fn a_tree_shrinks_to_nothing_and_grows_again() {
        let mut edits = vec![(false, 7); 10_000];
        edits.extend((0..10_000).map(|i| (true, i * 7919)));
        agree(10_000, &edits);
    }

    #[test]
    fn a_path_through_a_million_children_is_short() {
        let ids: Vec<NodeId> = (0..1_000_000).map(id).collect();
        let tree = Tree::new(&ids);
        let mut depth = 0;
        let mut at = tree.leaf_of[&id(777_777)];
        while at != NO_PARENT {
            at = tree.blocks[at as usize].parent;
            depth += 1;
        }
        assert!(depth <= 4, "{depth} levels");
    }

    #[test]
    fn a_list_that_is_edited_becomes_a_tree_when_it_is_long() {
        let mut children = Children::from((0..1000).map(id).collect::<Vec<_>>());
        assert_eq!(children.remove(id(500)), Some(500));
        assert!(matches!(children.0, Form::Tree(_)));
        children.insert(0, id(500));
        assert_eq!(children.iter().next(), Some(id(500)));
        let mut short = Children::from(vec![id(1), id(2)]);
        short.insert(1, id(3));
        assert!(short.iter().eq([id(1), id(3), id(2)]));
        children.each_mut(|_, child| *child = id(5));
        assert!(children.iter().all(|child| child == id(5)));
    }
}
