//! Random sequences of every edit, against a model that looks at every box, after every step; and a replica that gets
//! node writes alone.

mod common;
mod replica;

use common::{Coordinate, Model, assert_equals_model};
use orthant_bvh::{Aabb, Builder, Bvh, MAX_DEPTH, SiblingSearch};
use proptest::prelude::*;
use replica::Replica;

/// A box in small integers, whatever the coordinate type.
#[derive(Clone, Debug)]
enum Shape {
    /// Corner and extents on each axis, often zero.
    Box([i32; 4], [u8; 4]),
    /// As far out as the type goes, on the axes of the mask.
    Unbounded(u8),
    /// Far from the rest.
    Outlier(i32),
}

#[derive(Clone, Debug)]
enum Op {
    Insert(Shape),
    Remove(usize),
    Move(usize, Shape),
    Nudge(usize, i32),
    Refit(Vec<(usize, Shape)>),
    Graft(Vec<Shape>, u8),
    InsertMany(Vec<Shape>),
    Prune(usize, u8),
    Optimize(usize),
    Rebuild(u8),
    Search(u8),
    Clear,
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        12 => (prop::array::uniform4(-6..7i32), prop::array::uniform4(0..4u8)).prop_map(|(c, e)| Shape::Box(c, e)),
        2 => prop::array::uniform4(-6..7i32).prop_map(|c| Shape::Box(c, [0; 4])),
        2 => Just(Shape::Box([1; 4], [1; 4])),
        1 => any::<u8>().prop_map(Shape::Unbounded),
        1 => (1..1000i32).prop_map(Shape::Outlier),
    ]
}

fn op() -> impl Strategy<Value = Op> {
    prop_oneof![
        20 => shape().prop_map(Op::Insert),
        12 => any::<usize>().prop_map(Op::Remove),
        8 => (any::<usize>(), shape()).prop_map(|(i, s)| Op::Move(i, s)),
        8 => (any::<usize>(), -2..3i32).prop_map(|(i, d)| Op::Nudge(i, d)),
        4 => prop::collection::vec((any::<usize>(), shape()), 0..100).prop_map(Op::Refit),
        3 => (prop::collection::vec(shape(), 0..40), any::<u8>()).prop_map(|(s, b)| Op::Graft(s, b)),
        3 => prop::collection::vec(shape(), 0..40).prop_map(Op::InsertMany),
        3 => (any::<usize>(), 0..4u8).prop_map(|(i, up)| Op::Prune(i, up)),
        2 => (0..60usize).prop_map(Op::Optimize),
        1 => any::<u8>().prop_map(Op::Rebuild),
        2 => any::<u8>().prop_map(Op::Search),
        1 => Just(Op::Clear),
    ]
}

fn bounds<S: Coordinate, const N: usize>(shape: &Shape) -> Aabb<S, N> {
    match *shape {
        Shape::Box(corner, extent) => Aabb::new(
            std::array::from_fn(|a| S::small(corner[a])),
            std::array::from_fn(|a| S::small(corner[a] + i32::from(extent[a]))),
        ),
        Shape::Unbounded(mask) => Aabb::new(
            std::array::from_fn(|a| if mask >> a & 1 == 1 { S::LOWEST } else { S::small(-1) }),
            std::array::from_fn(|a| if mask >> (a + 4) & 1 == 1 { S::HIGHEST } else { S::small(0) }),
        ),
        Shape::Outlier(at) => Aabb::new([S::small(at * 100_000); N], [S::small(at * 100_000 + 1); N]),
    }
}

fn builder(choice: u8) -> Builder {
    [Builder::fastest(), Builder::fast(), Builder::medium(), Builder::best()][choice as usize % 4]
}

/// The tree, what it should hold, and a copy elsewhere.
struct Run<S: Coordinate, const N: usize> {
    bvh: Bvh<S, N>,
    model: Model<S, N>,
    replica: Replica,
    next: u32,
}

impl<S: Coordinate, const N: usize> Run<S, N> {
    fn new() -> Self {
        Self { bvh: Bvh::new(), model: Model::new(), replica: Replica::default(), next: 0 }
    }

    fn pick(&self, choice: usize) -> Option<u32> {
        self.model.keys().nth(choice.checked_rem(self.model.len())?).copied()
    }

    /// A new item takes the lowest free id half of the time, as a slot arena would.
    fn new_item(&mut self) -> u32 {
        let free = (0..self.next).find(|item| !self.model.contains_key(item));
        match free {
            Some(item) if self.next.is_multiple_of(2) => item,
            _ => {
                self.next += 1;
                self.next - 1
            }
        }
    }

    /// How many leaves the operation adds, removes or changes, for those whose writes are bounded by that.
    fn apply(&mut self, op: &Op) -> Option<usize> {
        match op {
            Op::Insert(shape) => {
                let (item, bounds) = (self.new_item(), bounds(shape));
                self.bvh.insert(item, bounds).expect("a new item with a good box");
                self.model.insert(item, bounds);
                return Some(1);
            }
            Op::Remove(choice) => {
                if let Some(item) = self.pick(*choice) {
                    assert_eq!(self.bvh.remove(item).ok(), self.model.remove(&item));
                }
                return Some(1);
            }
            Op::Move(choice, shape) => {
                if let Some(item) = self.pick(*choice) {
                    self.bvh.move_leaf(item, bounds(shape)).expect("an item of the tree");
                    self.model.insert(item, bounds(shape));
                }
                return Some(1);
            }
            Op::Nudge(choice, by) => {
                if let Some(item) = self.pick(*choice) {
                    let mut b = self.model[&item];
                    let moved =
                        |c: S| S::small((c.to_f64() as i32).saturating_add(*by).clamp(-1_000_000_000, 1_000_000_000));
                    b = Aabb::new(b.min.map(moved), b.max.map(moved));
                    self.bvh.move_leaf(item, b).expect("an item of the tree");
                    self.model.insert(item, b);
                }
                return Some(1);
            }
            Op::Refit(changes) => {
                let boxes: Vec<_> =
                    changes.iter().filter_map(|(choice, shape)| Some((self.pick(*choice)?, bounds(shape)))).collect();
                self.bvh.refit(&boxes).expect("items of the tree");
                self.model.extend(boxes);
                return Some(changes.len());
            }
            Op::Graft(shapes, choice) => {
                let items: Vec<_> = shapes
                    .iter()
                    .map(|shape| {
                        self.next += 1;
                        (self.next - 1, bounds(shape))
                    })
                    .collect();
                let subtree = Bvh::build_items(&items, builder(*choice)).expect("new items with good boxes");
                self.bvh.graft(&subtree).expect("new items");
                self.model.extend(items);
            }
            Op::InsertMany(shapes) => {
                // An item that was free before may be offered twice.
                let items: Model<S, N> = shapes.iter().map(|shape| (self.new_item(), bounds(shape))).collect();
                let items: Vec<_> = items.into_iter().collect();
                self.bvh.insert_many(&items).expect("new items");
                self.model.extend(items);
            }
            Op::Prune(choice, up) => {
                if let Some(item) = self.pick(*choice) {
                    let (mut node, _) = self.bvh.leaf_of(item).expect("an item of the tree");
                    for _ in 0..*up {
                        node = self.bvh.parent(node).unwrap_or(node);
                    }
                    let pruned = self.bvh.prune(node).expect("a node of the tree");
                    let out: Model<S, N> = pruned.items().map(|(item, _)| (item, self.model[&item])).collect();
                    assert!(out.contains_key(&item));
                    assert_equals_model(&pruned, &out, 0);
                    self.model.retain(|item, _| !out.contains_key(item));
                }
            }
            Op::Optimize(budget) => {
                let before = self.bvh.sah_cost();
                self.bvh.optimize(*budget);
                // Unbounded boxes drown the surface of the others in rounding.
                assert!(self.bvh.sah_cost() <= before * 1.001);
            }
            Op::Rebuild(choice) => self.bvh.rebuild(builder(*choice)),
            Op::Search(choice) => self.bvh.set_sibling_search(match choice % 3 {
                0 => SiblingSearch::fast(),
                1 => SiblingSearch { visits: 4, least_gain_percent: 10, least_gain_aside_percent: 10 },
                _ => SiblingSearch::exhaustive(),
            }),
            Op::Clear => {
                self.bvh.clear();
                self.model.clear();
            }
        }
        None
    }

    fn step(&mut self, op: &Op, seed: i32) {
        let depth_before = self.bvh.depth();
        let leaves = self.apply(op);
        assert!(self.bvh.depth() <= MAX_DEPTH);
        let writes = self.bvh.take_writes();
        if let Some(leaves) = leaves {
            let bound = leaves * (4 * depth_before.max(self.bvh.depth()) as usize + 32);
            assert!(writes.written.len() + writes.freed.len() <= bound, "{op:?} names more than {bound} nodes");
        }
        self.replica.follow(&writes, &self.bvh);
        self.replica.assert_same(&self.bvh);
        assert_equals_model(&self.bvh, &self.model, seed);
    }
}

fn run<S: Coordinate, const N: usize>(ops: &[(Op, i32)]) {
    let mut run = Run::<S, N>::new();
    for (op, seed) in ops {
        run.step(op, *seed);
    }
}

/// 48 cases each; `PROPTEST_CASES` asks for another number.
fn config() -> ProptestConfig {
    let default = ProptestConfig::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { default.cases } else { 48 };
    ProptestConfig { cases, ..default }
}

macro_rules! random_edits {
    ($($name:ident: $scalar:ty, $dim:expr;)*) => {
        proptest! {
            #![proptest_config(config())]
            $(
                #[test]
                fn $name(ops in prop::collection::vec((op(), 0..1 << 24i32), 1..160)) {
                    run::<$scalar, $dim>(&ops);
                }
            )*
        }
    };
}

random_edits! {
    random_edits_agree_with_brute_force_in_3d_f32: f32, 3;
    random_edits_agree_with_brute_force_in_4d_f32: f32, 4;
    random_edits_agree_with_brute_force_in_3d_f64: f64, 3;
    random_edits_agree_with_brute_force_in_4d_f64: f64, 4;
    random_edits_agree_with_brute_force_in_3d_i32: i32, 3;
    random_edits_agree_with_brute_force_in_4d_i32: i32, 4;
    random_edits_agree_with_brute_force_in_3d_i64: i64, 3;
    random_edits_agree_with_brute_force_in_4d_i64: i64, 4;
    random_edits_agree_with_brute_force_in_2d_f32: f32, 2;
}

#[test]
fn a_refit_of_all_leaves_of_a_fresh_tree_is_followed_by_the_replica() {
    let mut run = Run::<i32, 4>::new();
    let shapes: Vec<_> = (0..500).map(|i| Shape::Box([i % 7, i % 11, i % 13, i % 3], [1; 4])).collect();
    run.step(&Op::Graft(shapes, 2), 1);
    run.step(&Op::Rebuild(1), 2);
    for shift in 1..4 {
        let changes = (0..500).map(|i| (i, Shape::Box([i as i32 % 5, shift, -(i as i32 % 9), 0], [2; 4]))).collect();
        run.step(&Op::Refit(changes), 3 * shift);
    }
    run.step(&Op::Insert(Shape::Outlier(3)), 4);
}
