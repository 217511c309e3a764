//! Every builder over input that is empty, tiny, all the same, huge, unbounded, crowded or stretched.

mod common;

use common::{Coordinate, Model, assert_equals_model};
use orthant_bvh::{Aabb, Builder, Bvh, BvhError, MAX_DEPTH, MAX_ITEM};

const BUILDERS: [Builder; 6] = [
    Builder::fastest(),
    Builder::fast(),
    Builder::medium(),
    Builder::best(),
    Builder::SampledSah { sample: 4 },
    Builder::Ploc { radius: 1000, coarse_passes: 0 },
];

fn assert_builds<S: Coordinate, const N: usize>(boxes: &[Aabb<S, N>]) {
    let model: Model<S, N> = (0..).zip(boxes.iter().copied()).collect();
    for builder in BUILDERS {
        let bvh = Bvh::build(boxes, builder).unwrap_or_else(|error| panic!("{builder:?}: {error}"));
        assert!(bvh.depth() <= MAX_DEPTH);
        assert!(bvh.sah_cost().is_finite());
        for seed in [0, 123_456, 9_999_999] {
            assert_equals_model(&bvh, &model, seed);
        }
    }
}

fn point<const N: usize>(at: [f32; N]) -> Aabb<f32, N> {
    Aabb::new(at, at)
}

#[test]
fn nothing() {
    assert_builds::<f32, 3>(&[]);
    let mut bvh = Bvh::<f32, 3>::new();
    assert_eq!((bvh.root(), bvh.depth(), bvh.bounds()), (None, 0, Aabb::EMPTY));
    assert_eq!(bvh.optimize(10).searched, 0);
    bvh.refit(&[]).expect("nothing to do");
    bvh.rebuild(Builder::best());
    bvh.validate().expect("an empty tree is valid");
}

#[test]
fn one_two_and_three() {
    for count in 1..=3 {
        assert_builds::<i64, 4>(&vec![Aabb::new([1; 4], [2; 4]); count]);
        assert_builds(&(0..count).map(|i| point([i as f32, 0.0, 0.0])).collect::<Vec<_>>());
    }
}

#[test]
fn all_equal() {
    assert_builds(&[Aabb::new([1.0f32; 3], [2.0; 3]); 1000]);
    assert_builds(&[point([0.5f32; 4]); 1000]);
    assert_builds(&[Aabb::new([i32::MIN; 4], [i32::MAX; 4]); 100]);
    assert_builds(&[Aabb::new([f32::NEG_INFINITY; 3], [f32::INFINITY; 3]); 100]);
}

#[test]
fn equal_boxes_make_a_shallow_tree() {
    for builder in BUILDERS {
        let bvh = Bvh::build(&[Aabb::new([1.0f32; 3], [2.0; 3]); 4096], builder).expect("good boxes");
        assert_eq!(bvh.depth(), 12, "{builder:?}");
    }
}

#[test]
fn huge() {
    let huge = |scale: f32| (0..200).map(move |i| Aabb::new([-scale; 3], [scale * (1.0 - i as f32 / 300.0); 3]));
    assert_builds(&huge(f32::MAX).collect::<Vec<_>>());
    assert_builds(
        &huge(1e20).chain((0..200).map(|i| point([i as f32 % 7.0, i as f32 % 11.0, 1.0]))).collect::<Vec<_>>(),
    );
    assert_builds(&(0..200i64).map(|i| Aabb::new([i64::MIN + i; 4], [i64::MAX - i; 4])).collect::<Vec<_>>());
}

#[test]
fn unbounded_slabs_among_small_boxes() {
    let slab = Aabb::new(
        [f64::NEG_INFINITY, -8.0, f64::NEG_INFINITY, f64::NEG_INFINITY],
        [f64::INFINITY, 0.0, f64::INFINITY, f64::INFINITY],
    );
    let boxes: Vec<_> = (0..300)
        .map(|i| {
            let at = [f64::from(i % 7), f64::from(i % 5), f64::from(i % 11), f64::from(i % 3)];
            if i % 20 == 0 { slab } else { Aabb::new(at, at.map(|c| c + 1.0)) }
        })
        .collect();
    assert_builds(&boxes);
}

#[test]
fn spacing_that_rises_along_a_line() {
    // Only one pair in a pass would find each other.
    assert_builds(&(0..3000).map(|i| point([(i * i) as f32, 0.0, 0.0])).collect::<Vec<_>>());
    assert_builds(&(0..120).map(|i| point([2f32.powi(i), 0.0, 0.0])).collect::<Vec<_>>());
    assert_builds(&(0..1000).map(|i| Aabb::new([0.0f64; 3], [1.01f64.powi(i); 3])).collect::<Vec<_>>());
}

#[test]
fn a_crowd_far_from_one_box() {
    let mut boxes: Vec<_> = (0..2000).map(|i| point([i as f32 % 13.0, i as f32 % 17.0, i as f32 % 19.0])).collect();
    boxes.push(point([1e9; 3]));
    assert_builds(&boxes);
}

#[test]
fn boxes_that_are_none_are_refused_and_change_nothing() {
    let good = Aabb::new([0.0f32; 3], [1.0; 3]);
    let inverted = Aabb::new([0.0, 2.0, 0.0], [1.0, 1.0, 1.0]);
    let nan = Aabb::new([0.0; 3], [1.0, 1.0, f32::NAN]);
    for builder in BUILDERS {
        let error = Bvh::build(&[good, inverted], builder).expect_err("inverted");
        assert!(matches!(error, BvhError::BadBounds { item: 1, axis: 1, .. }));
    }
    let mut bvh = Bvh::build(&[good; 5], Builder::fast()).expect("good boxes");
    bvh.take_writes();
    assert!(matches!(bvh.insert(5, nan), Err(BvhError::BadBounds { item: 5, axis: 2, .. })));
    assert!(matches!(bvh.move_leaf(3, inverted), Err(BvhError::BadBounds { item: 3, axis: 1, .. })));
    assert!(matches!(bvh.refit(&[(0, inverted.union(&good)), (1, nan)]), Err(BvhError::BadBounds { item: 1, .. })));
    assert_eq!(bvh.take_writes().written, []);
    assert_equals_model(&bvh, &(0..5).map(|item| (item, good)).collect(), 0);
}

#[test]
fn items_that_are_unknown_known_or_out_of_range_are_refused() {
    let cube = Aabb::new([0; 3], [1; 3]);
    let mut bvh = Bvh::<i32, 3>::build_items(&[(7, cube), (9, cube), (11, cube)], Builder::best()).expect("good");
    assert_eq!(bvh.insert(7, cube), Err(BvhError::DuplicateItem { item: 7 }));
    assert_eq!(bvh.insert(MAX_ITEM + 1, cube), Err(BvhError::ItemOutOfRange { item: MAX_ITEM + 1 }));
    assert_eq!(bvh.remove(8), Err(BvhError::UnknownItem { item: 8 }));
    assert_eq!(bvh.move_leaf(u32::MAX, cube), Err(BvhError::UnknownItem { item: u32::MAX }));
    assert_eq!(bvh.refit(&[(7, cube), (100, cube)]), Err(BvhError::UnknownItem { item: 100 }));
    assert_eq!(bvh.graft(&bvh.clone()), Err(BvhError::DuplicateItem { item: 7 }));
    let unknown = orthant_bvh::NodeId(50);
    assert_eq!(bvh.prune(unknown).err(), Some(BvhError::UnknownNode { node: 50 }));
    let twice = Bvh::build_items(&[(7, cube), (7, cube)], Builder::fast());
    assert_eq!(twice.err(), Some(BvhError::DuplicateItem { item: 7 }));
    bvh.validate().expect("refusals change nothing");
}
