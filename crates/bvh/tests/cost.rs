//! What an edit may cost: counted, not timed.

use orthant_bvh::{Aabb, Builder, Bvh, Counters, MAX_DEPTH, SiblingSearch};

/// Reproducible numbers in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn below(&mut self, count: u32) -> u32 {
        ((self.next() * count as f32) as u32).min(count - 1)
    }

    /// A box of edge 1 in a cube that holds `count` of them, one in each unit on average.
    fn unit_box<const N: usize>(&mut self, count: u32) -> Aabb<f32, N> {
        let edge = (count as f32).powf(1.0 / N as f32);
        let at = std::array::from_fn(|_| self.next() * edge);
        Aabb::new(at, at.map(|c| c + 1.0))
    }
}

fn tree<const N: usize>(count: u32, random: &mut Random) -> Bvh<f32, N> {
    let boxes: Vec<_> = (0..count).map(|_| random.unit_box(count)).collect();
    let mut bvh = Bvh::build(&boxes, Builder::medium()).expect("good boxes");
    bvh.take_writes();
    bvh
}

/// The most nodes named in a batch and read, over edits one by one.
fn most(bvh: &mut Bvh<f32, 4>, edits: u32, mut edit: impl FnMut(&mut Bvh<f32, 4>, u32)) -> (usize, u64) {
    let mut most = (0, 0);
    for i in 0..edits {
        let depth = bvh.depth().max(20);
        bvh.take_counters();
        edit(bvh, i);
        let Counters { visited, .. } = bvh.take_counters();
        let writes = bvh.take_writes();
        let named = writes.written.len() + writes.freed.len();
        assert!(named <= 4 * depth as usize + 32);
        assert!(visited <= 12 * u64::from(depth), "{visited} nodes read at depth {depth}");
        most = (most.0.max(named), most.1.max(visited));
    }
    most
}

#[test]
fn one_edit_reads_and_writes_in_proportion_to_the_depth_whatever_the_size() {
    let mut worst = Vec::new();
    for count in [1_000u32, 10_000, 100_000] {
        let mut random = Random(5);
        let mut bvh = tree::<4>(count, &mut random);
        let moved = most(&mut bvh, 1000, |bvh, i| {
            bvh.move_leaf(i, random.unit_box(count)).expect("an item of the tree");
        });
        let removed = most(&mut bvh, 500, |bvh, i| {
            bvh.remove(i).expect("an item of the tree");
        });
        let inserted = most(&mut bvh, 500, |bvh, i| bvh.insert(i, random.unit_box(count)).expect("a new item"));
        worst.push([moved.0, removed.0, inserted.0]);
    }
    // A hundred times as many items are seven levels more, and two writes a level.
    for (small, large) in worst[0].iter().zip(worst[2]) {
        assert!(large <= small + 30, "{worst:?}");
    }
}

#[test]
fn the_arena_uses_freed_nodes_again() {
    let mut random = Random(9);
    let mut bvh = Bvh::<f32, 3>::new();
    let mut live = Vec::new();
    let mut free: Vec<u32> = (0..1000).rev().collect();
    let mut peak = 0;
    for _ in 0..200_000 {
        if live.is_empty() || (random.next() < 0.5 && live.len() < 1000) {
            let item = free.pop().expect("fewer than a thousand are live");
            bvh.insert(item, random.unit_box(1000)).expect("a new item");
            live.push(item);
            peak = peak.max(live.len());
        } else {
            let item = live.swap_remove(random.below(live.len() as u32) as usize);
            bvh.remove(item).expect("an item of the tree");
            free.push(item);
        }
    }
    assert!(bvh.nodes().len() * 2 <= peak * 3, "{} nodes for at most {peak} items", bvh.nodes().len());
    bvh.validate().expect("every invariant holds");
}

#[test]
fn a_batched_refit_mends_each_node_above_once() {
    let mut random = Random(3);
    let count = 50_000;
    let mut bvh = tree::<3>(count, &mut random);
    // Neighbours on the curve share most of what is above them.
    let (some, _) = bvh.leaf_of(17).expect("an item of the tree");
    let mut node = some;
    for _ in 0..8 {
        node = bvh.parent(node).unwrap_or(node);
    }
    let subtree = bvh.prune(node).expect("a node of the tree");
    let inner = subtree.node_count();
    let boxes: Vec<_> = subtree.items().map(|(item, b)| (item, Aabb::new(b.min, b.max.map(|c| c + 0.001)))).collect();
    bvh.graft(&subtree).expect("its items are gone");
    bvh.take_writes();
    bvh.take_counters();
    bvh.refit(&boxes).expect("items of the tree");
    let writes = bvh.take_writes().written.len();
    assert!(writes <= inner + MAX_DEPTH as usize, "{writes} writes for {inner} inner nodes");
    let visited = bvh.take_counters().visited as usize;
    assert!(visited <= 2 * (inner + 2 * MAX_DEPTH as usize), "{visited} reads for {inner} inner nodes");
    bvh.validate().expect("every invariant holds");
}

#[test]
fn a_refit_of_one_leaf_in_a_hundred_thousand_reads_its_path() {
    let mut bvh = tree::<3>(100_000, &mut Random(4));
    let mut moved = bvh.bounds_of(500).expect("an item of the tree");
    moved.max[0] += 0.5;
    bvh.take_counters();
    bvh.refit(&[(500, moved)]).expect("an item of the tree");
    assert!(bvh.take_counters().visited <= 4 * u64::from(bvh.depth()));
}

#[test]
fn grafts_and_prunes_write_the_subtree_and_a_path() {
    let mut random = Random(8);
    let mut bvh = tree::<3>(100_000, &mut random);
    let items: Vec<_> = (0..1000u32).map(|i| (100_000 + i, random.unit_box(1000))).collect();
    let subtree = Bvh::build_items(&items, Builder::fast()).expect("good boxes");
    let root = bvh.graft(&subtree).expect("new items").expect("more than one item");
    let depth = bvh.depth() as usize;
    let written = bvh.take_writes().written.len();
    assert!(written <= 999 + 4 * depth + 32, "{written} writes");

    let before = bvh.len();
    let pruned = bvh.prune(root).expect("the root of the subtree");
    assert_eq!(bvh.len() + pruned.len(), before);
    let writes = bvh.take_writes();
    assert!(writes.freed.len() <= pruned.len() + 1);
    assert!(writes.written.len() <= 4 * depth + 32);
}

#[test]
fn inserts_in_the_worst_order_stay_within_the_depth_bound() {
    // Each box holds all before it; and each is far beyond all before it.
    let nested = (0..3000).map(|i| Aabb::new([0.0f64; 3], [1.02f64.powi(i); 3]));
    let distant = (0..3000).map(|i| Aabb::new([1.1f64.powi(i); 3], [1.1f64.powi(i) + 1.0; 3]));
    for boxes in [nested.collect::<Vec<_>>(), distant.collect()] {
        let mut bvh = Bvh::<f64, 3>::new();
        for (item, bounds) in (0..).zip(boxes) {
            bvh.insert(item, bounds).expect("a good box");
            assert!(bvh.depth() <= MAX_DEPTH);
        }
        bvh.validate().expect("every invariant holds");
    }
}

#[test]
fn a_fast_search_makes_a_tree_nearly_as_good_as_an_exhaustive_one() {
    let build = |search| {
        let mut random = Random(12);
        let mut bvh = Bvh::<f32, 3>::new();
        bvh.set_sibling_search(search);
        for item in 0..20_000 {
            bvh.insert(item, random.unit_box(20_000)).expect("a good box");
        }
        bvh.sah_cost()
    };
    let (fast, best) = (build(SiblingSearch::fast()), build(SiblingSearch::exhaustive()));
    assert!(fast <= 1.08 * best, "{fast} against {best}");
}
