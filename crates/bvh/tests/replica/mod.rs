//! A copy of a tree that follows by node writes alone.

use std::any::Any;

use orthant_bvh::{Bvh, Node, NodeWrites, Scalar};

/// A copy of a tree's arena that sees nothing but what a device would be sent.
#[derive(Default)]
pub struct Replica {
    pub nodes: Vec<Vec<u8>>,
    pub root: Option<u32>,
}

/// The record of a node as bytes: what would be uploaded.
pub fn record<S: Scalar, const N: usize>(node: &Node<S, N>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for slot in 0..2 {
        for a in 0..N {
            bytes.extend(bytes_of(node.bounds[slot].min[a]));
            bytes.extend(bytes_of(node.bounds[slot].max[a]));
        }
        bytes.extend(node.child[slot].0.to_le_bytes());
    }
    bytes
}

impl Replica {
    /// Applies a batch; the tree is read at the written nodes alone.
    pub fn follow<S: Scalar, const N: usize>(&mut self, writes: &NodeWrites, bvh: &Bvh<S, N>) {
        let mut named: Vec<_> = writes.written.iter().chain(&writes.freed).collect();
        named.sort();
        named.dedup();
        assert_eq!(named.len(), writes.written.len() + writes.freed.len(), "a node is named twice");

        let free = record(&Node::<S, N>::FREE);
        assert!(writes.freed.iter().all(|id| id.index() < self.nodes.len()), "what was never known cannot be freed");
        self.nodes.resize(writes.arena_len, free.clone());
        for id in &writes.written {
            self.nodes[id.index()] = record(&bvh.nodes()[id.index()]);
        }
        for id in &writes.freed {
            assert_ne!(self.nodes[id.index()], free, "node {id:?} was free already");
            self.nodes[id.index()] = free.clone();
        }
        self.root = writes.new_root.map(|id| id.0);
    }

    pub fn assert_same<S: Scalar, const N: usize>(&self, bvh: &Bvh<S, N>) {
        assert_eq!(self.root, bvh.root().map(|id| id.0));
        assert_eq!(self.nodes.len(), bvh.nodes().len());
        for (id, (copy, node)) in self.nodes.iter().zip(bvh.nodes()).enumerate() {
            assert_eq!(copy, &record(node), "node {id} differs in the copy");
        }
    }
}

/// The bit pattern of a coordinate: positive and negative zero differ.
fn bytes_of<S: Scalar>(value: S) -> [u8; 8] {
    let value: &dyn Any = &value;
    if let Some(value) = value.downcast_ref::<f32>() {
        u64::from(value.to_bits()).to_le_bytes()
    } else if let Some(value) = value.downcast_ref::<f64>() {
        value.to_bits().to_le_bytes()
    } else if let Some(value) = value.downcast_ref::<i32>() {
        i64::from(*value).to_le_bytes()
    } else {
        value.downcast_ref::<i64>().expect("there are four scalars").to_le_bytes()
    }
}
