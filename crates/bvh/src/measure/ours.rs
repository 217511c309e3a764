//! This crate's operations.

use super::workload::{Load, RandomEdit};
use super::{Operation, Outcome, time};
use crate::aabb::Aabb;
use crate::build::Builder;
use crate::edit::insert::SiblingSearch;
use crate::query::ray::Ray;
use crate::tree::Bvh;

/// The trees that operations start from.
pub(super) struct Trees<const N: usize> {
    fresh: Bvh<f32, N>,
    edited: Bvh<f32, N>,
    rebuilt: Bvh<f32, N>,
    rebuilt_sah: Bvh<f32, N>,
    rays: Vec<Ray<f32, N>>,
}

const GOOD: &str = "the load has good boxes and known items";

impl<const N: usize> Trees<N> {
    pub(super) fn new(load: &Load<N>) -> Self {
        let build = |boxes: &[Aabb<f32, N>], builder| {
            let mut tree = Bvh::build(boxes, builder).expect(GOOD);
            tree.take_writes();
            tree
        };
        let fresh = build(&load.boxes, Builder::medium());
        let mut edited = fresh.clone();
        for edit in &load.edits {
            match *edit {
                RandomEdit::Move(item, bounds) => drop(edited.move_leaf(item, bounds).expect(GOOD)),
                RandomEdit::Remove(item) => drop(edited.remove(item).expect(GOOD)),
                RandomEdit::Insert(item, bounds) => edited.insert(item, bounds).expect(GOOD),
            }
        }
        let rays =
            load.rays.iter().map(|&(origin, direction)| Ray::new(origin, direction, 0.0, f32::INFINITY)).collect();
        let (rebuilt, rebuilt_sah) = (build(&load.edited, Builder::medium()), build(&load.edited, Builder::best()));
        Self { fresh, edited, rebuilt, rebuilt_sah, rays }
    }

    /// A tree to edit, with room for what comes in.
    fn start(&self, load: &Load<N>) -> Bvh<f32, N> {
        let mut tree = self.fresh.clone();
        tree.reserve(load.plan.edits);
        tree
    }
}

/// What is timed on a fresh tree.
type Work<'a, const N: usize> = Box<dyn Fn(&mut Bvh<f32, N>) + 'a>;

pub(super) fn operations<'a, const N: usize>(load: &'a Load<N>, trees: &'a Trees<N>) -> Vec<Operation<'a>> {
    let mut all = Vec::new();
    for (name, builder) in [
        ("build_fastest", Builder::fastest()),
        ("build_fast", Builder::fast()),
        ("build", Builder::medium()),
        ("build_sah", Builder::best()),
    ] {
        let build =
            move || time(Bvh::new(), |tree| *tree = Bvh::build(&load.boxes, builder).expect(GOOD), Bvh::sah_cost);
        all.push(Operation { name, items: load.boxes.len(), run: Box::new(build) });
    }
    let mut edit = |name, items, work: Work<'a, N>| {
        let run = Box::new(move || time(trees.start(load), |tree| work(tree), Bvh::sah_cost));
        all.push(Operation { name, items, run });
    };

    for (name, search) in [("insert", SiblingSearch::fast()), ("insert_best", SiblingSearch::exhaustive())] {
        let insert = move |tree: &mut Bvh<f32, N>| {
            tree.set_sibling_search(search);
            for (item, bounds) in (load.boxes.len() as u32..).zip(&load.new) {
                tree.insert(item, *bounds).expect(GOOD);
            }
        };
        edit(name, load.new.len(), Box::new(insert));
    }
    let remove = |tree: &mut Bvh<f32, N>| {
        for &(item, _) in &load.near {
            tree.remove(item).expect(GOOD);
        }
    };
    edit("remove", load.near.len(), Box::new(remove));
    let near = |tree: &mut Bvh<f32, N>| {
        for &(item, bounds) in &load.near {
            tree.move_leaf(item, bounds).expect(GOOD);
        }
    };
    edit("move", load.near.len(), Box::new(near));
    let far = |tree: &mut Bvh<f32, N>| {
        for (&(item, _), &bounds) in load.near.iter().zip(&load.new) {
            tree.move_leaf(item, bounds).expect(GOOD);
        }
    };
    edit("move_far", load.near.len(), Box::new(far));
    edit("refit_some", load.near.len(), Box::new(|tree| tree.refit(&load.near).expect(GOOD)));
    edit("refit", load.every.len(), Box::new(|tree| tree.refit(&load.every).expect(GOOD)));
    let budget = load.plan.n / 50;
    edit("optimize", budget, Box::new(move |tree| assert!(tree.optimize(budget).searched <= budget)));

    for (name, tree) in [
        ("query_fresh", &trees.fresh),
        ("query_edited", &trees.edited),
        ("query_rebuilt", &trees.rebuilt),
        ("query_rebuilt_sah", &trees.rebuilt_sah),
    ] {
        all.push(Operation { name, items: trees.rays.len(), run: Box::new(move || query(tree, &trees.rays)) });
    }
    all
}

/// The nearest box along each ray.
fn query<const N: usize>(tree: &Bvh<f32, N>, rays: &[Ray<f32, N>]) -> Outcome {
    let mut visits = 0u64;
    let walk = |visits: &mut &mut u64| {
        **visits = rays.iter().map(|ray| u64::from(core::hint::black_box(tree.ray(ray, |hit| hit.t)))).sum();
    };
    let outcome = time(&mut visits, walk, |_| tree.sah_cost());
    Outcome { visits: Some(visits as f64 / rays.len() as f64), ..outcome }
}
