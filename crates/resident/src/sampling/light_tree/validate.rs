//! Every invariant of a [`LightTree`].

use super::edit::height_limit;
use super::{Group, LightNode, LightTree};
use crate::rows::NONE;
use bytemuck::Zeroable;

impl LightTree {
    /// Walks the whole tree.
    ///
    /// # Errors
    /// The first thing that is not as it should be, with the node.
    pub fn validate(&self) -> Result<(), String> {
        let mut seen = vec![false; self.nodes.len()];
        let mut order = Vec::new();
        let mut open: Vec<(usize, usize)> = Vec::new();
        if !self.nodes.is_empty() {
            open.push((0, 0));
        }
        while let Some((at, parent)) = open.pop() {
            let fault = |what: String| Err(format!("node {at}: {what}"));
            let Some(node) = self.nodes.get(at) else { return fault("there is none".to_owned()) };
            if std::mem::replace(&mut seen[at], true) {
                return fault("two nodes lead to it".to_owned());
            }
            if node.parent as usize != parent {
                return fault(format!("its parent is {}, and should be {parent}", node.parent));
            }
            if node.first == 0 {
                if self.leaves.get(node.light as usize) != Some(&(at as u32)) {
                    return fault(format!("light {} is said to be elsewhere", node.light));
                }
                if node.bounds.intensity.is_nan() || node.bounds.intensity <= 0.0 {
                    return fault(format!("its intensity is {}", node.bounds.intensity));
                }
                if self.groups[at] != (Group { lights: 1, height: 0 }) {
                    return fault(format!("it is one light, and says {:?}", self.groups[at]));
                }
                continue;
            }
            if node.first.is_multiple_of(2) || node.light != NONE {
                return fault(format!("its parts are at {}, its light is {}", node.first, node.light));
            }
            order.push(at);
            open.extend([0, 1].map(|k| (node.first as usize + k, at)));
        }
        for &at in order.iter().rev() {
            let pair = self.nodes[at].first as usize;
            let bounds = self.nodes[pair].bounds.union(&self.nodes[pair + 1].bounds);
            if self.nodes[at].bounds != bounds {
                return Err(format!("node {at}: it is {:?}, and should be {bounds:?}", self.nodes[at].bounds));
            }
            let [a, b] = [self.groups[pair], self.groups[pair + 1]];
            let group = Group { lights: a.lights + b.lights, height: 1 + a.height.max(b.height) };
            if self.groups[at] != group {
                return Err(format!("node {at}: it has {:?}, and should have {group:?}", self.groups[at]));
            }
        }
        let root = self.groups.first().copied().unwrap_or_default();
        if root.height > height_limit(root.lights) {
            return Err(format!("{} lights are {} nodes high", root.lights, root.height));
        }
        if self.leaves.iter().filter(|&&leaf| leaf != NONE).count() != root.lights as usize {
            return Err("a light is said to be where there is none".to_owned());
        }
        for &pair in &self.free {
            for at in [pair as usize, pair as usize + 1] {
                if self.nodes.get(at) != Some(&LightNode::zeroed()) || std::mem::replace(&mut seen[at], true) {
                    return Err(format!("node {at}: it is free, and not zero or in use"));
                }
            }
        }
        match seen.iter().position(|seen| !seen) {
            Some(at) => Err(format!("node {at}: nothing leads to it, and it is not free")),
            None => Ok(()),
        }
    }
}
