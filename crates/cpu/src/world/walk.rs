//! The walk through the root BVH: near first, with what is behind the nearest run left out.

use super::leaf::{Run, leaf_run};
use super::ray::{WorldRay, WorldScene};
use orthant_resident::world::{LeafRow, Root, WorldCounts};

/// No leaf has more nodes above it, so that a walk never holds more children back.
const STACK: usize = 64;

/// The steps of a ray.
#[derive(Clone, Copy, Debug, Default)]
pub struct Work {
    /// What is left of the budget.
    left: u32,
    /// Whether the budget did not suffice.
    exhausted: bool,
    nodes: u32,
    leaves: u32,
    cells: u32,
}

impl Work {
    /// Nothing done yet.
    pub fn new(step_budget: u32) -> Self {
        Self { left: step_budget, ..Self::default() }
    }

    /// Whether the ray ran out of steps.
    pub fn is_exhausted(&self) -> bool {
        self.exhausted
    }

    /// Adds the work of a whole ray.
    pub fn count(&self, counts: &mut WorldCounts) {
        counts.rays += 1;
        counts.node_visits += u64::from(self.nodes);
        counts.leaf_visits += u64::from(self.leaves);
        counts.dda_steps += u64::from(self.cells);
        counts.exhausted += u64::from(self.exhausted);
    }

    #[inline]
    fn step(&mut self) -> bool {
        self.exhausted |= self.left == 0;
        self.left = self.left.saturating_sub(1);
        !self.exhausted
    }

    /// Takes a step to a cell; false if there is none left.
    #[inline]
    pub(super) fn step_cell(&mut self) -> bool {
        self.cells += 1;
        self.step()
    }
}

/// The run that begins first among those that end after `from`, and the leaf that it is in. `None` too if the budget ran out.
pub(super) fn nearest_run<'a>(
    scene: &WorldScene<'a>,
    ray: &WorldRay,
    from: f32,
    work: &mut Work,
) -> Option<(Run, &'a LeafRow)> {
    let arenas = scene.arenas;
    let mut best: Option<(Run, &LeafRow)> = None;
    let mut before = ray.t_max;
    let mut stack = [(0.0_f32, Root::EMPTY); STACK];
    let mut held = 0;
    let mut child = arenas.root;
    loop {
        // Go down to a leaf
        while let Some(slot) = child.as_node() {
            work.nodes += 1;
            if !work.step() {
                return None;
            }
            let node = &arenas.nodes[slot as usize];
            let [(enter_a, leave_a), (enter_b, leave_b)] = [0, 1].map(|c| ray.node_interval(&node.bounds[c], from));
            let meets_a = enter_a <= leave_a && enter_a < before;
            let meets_b = enter_b <= leave_b && enter_b < before;
            let [a, b] = node.children;
            child = match (meets_a, meets_b) {
                (true, true) => {
                    let (near, far) = if enter_b < enter_a { (b, (enter_a, a)) } else { (a, (enter_b, b)) };
                    if held == STACK {
                        // The tree breaks its promise: better a ray that is shown as lost than a child left out.
                        work.exhausted = true;
                        return None;
                    }
                    stack[held] = far;
                    held += 1;
                    near
                }
                (true, false) => a,
                (false, true) => b,
                (false, false) => Root::EMPTY,
            };
        }
        if let Some(slot) = child.as_leaf() {
            work.leaves += 1;
            if !work.step() {
                return None;
            }
            let leaf = &arenas.leaves[slot as usize];
            if let Some(run) = leaf_run(scene, ray, leaf, from, before, work) {
                before = run.t0;
                best = Some((run, leaf));
            }
            if work.exhausted {
                return None;
            }
        }

        // Take up the nearest of what was held back
        loop {
            if held == 0 {
                return best;
            }
            held -= 1;
            let (enter, root) = stack[held];
            if enter < before {
                child = root;
                break;
            }
        }
    }
}
