//! This crate's operations.

use super::workload::{self, Random, RandomEdit};
use super::{Measurement, Plan, time};
use crate::aabb::Aabb;
use crate::build::Builder;
use crate::edit::insert::SiblingSearch;
use crate::error::BvhError;
use crate::query::ray::Ray;
use crate::tree::Bvh;

/// Measures every operation on a tree of random boxes in `N` dimensions.
///
/// # Errors
/// None is expected: the boxes are good and the items known.
pub fn measure<const N: usize>(plan: Plan) -> Result<Vec<Measurement>, BvhError> {
    let Plan { n, edits, rays, runs } = plan;
    let mut random = Random(1);
    let edge = workload::edge::<N>(n);
    let boxes: Vec<Aabb<f32, N>> = (0..n).map(|_| workload::random_box(&mut random, edge)).collect();
    let rays = workload::random_rays::<N>(rays, edge, &mut random);
    let mut all = Vec::new();
    let mut add = |name: &str, items, seconds, tree: Option<&Bvh<f32, N>>| {
        let sah = tree.map(Bvh::sah_cost);
        all.push(Measurement { sah, ..Measurement::new(name, N, n, items, seconds) });
    };

    for (name, builder) in [
        ("build_fastest", Builder::fastest()),
        ("build_fast", Builder::fast()),
        ("build", Builder::medium()),
        ("build_sah", Builder::best()),
    ] {
        let (seconds, tree) = time(runs, Bvh::new, |tree| *tree = Bvh::build(&boxes, builder).unwrap_or_default());
        add(name, n, seconds, Some(&tree));
    }

    let fresh = Bvh::build(&boxes, Builder::medium())?;
    let mut fresh = fresh;
    fresh.take_writes();
    let fresh = fresh;
    let new: Vec<_> = (0..edits).map(|_| workload::random_box::<N>(&mut random, edge)).collect();
    let some: Vec<u32> = (0..edits).map(|_| random.below(n) as u32).collect();
    let near: Vec<_> = some.iter().map(|&i| (i, workload::nudged(&mut random, &boxes[i as usize]))).collect();
    let far: Vec<_> = some.iter().zip(&new).map(|(&i, &b)| (i, b)).collect();
    let every: Vec<_> = (0..).zip(&boxes).map(|(i, b)| (i, workload::nudged(&mut random, b))).collect();

    for (name, search) in [("insert", SiblingSearch::fast()), ("insert_best", SiblingSearch::exhaustive())] {
        let start = || {
            let mut tree = fresh.clone();
            tree.set_sibling_search(search);
            tree
        };
        let (seconds, tree) = time(runs, start, |tree| {
            for (item, bounds) in (n as u32..).zip(&new) {
                let done = tree.insert(item, *bounds);
                debug_assert_eq!(done, Ok(()));
            }
        });
        add(name, edits, seconds, Some(&tree));
    }
    let (seconds, tree) = time(
        runs,
        || fresh.clone(),
        |tree| {
            for &item in &some {
                // An item that was drawn twice is gone the second time.
                let _gone = tree.remove(item);
            }
        },
    );
    add("remove", edits, seconds, Some(&tree));
    for (name, moves) in [("move", &near), ("move_far", &far)] {
        let (seconds, tree) = time(
            runs,
            || fresh.clone(),
            |tree| {
                for &(item, bounds) in moves {
                    let done = tree.move_leaf(item, bounds);
                    debug_assert!(done.is_ok());
                }
            },
        );
        add(name, edits, seconds, Some(&tree));
    }
    let mut first = std::collections::HashSet::new();
    let once: Vec<_> = near.iter().filter(|(item, _)| first.insert(*item)).copied().collect();
    for (name, boxes) in [("refit_some", &once), ("refit", &every)] {
        let (seconds, tree) = time(
            runs,
            || fresh.clone(),
            |tree| {
                let done = tree.refit(boxes);
                debug_assert_eq!(done, Ok(()));
            },
        );
        add(name, boxes.len(), seconds, Some(&tree));
    }
    let budget = n / 50;
    let (seconds, tree) = time(
        runs.min(3),
        || fresh.clone(),
        |tree| {
            tree.optimize(budget);
        },
    );
    add("optimize", budget, seconds, Some(&tree));
    all.push(query("query_fresh", &fresh, &rays, runs));

    let mut now = boxes.clone();
    let edits = workload::random_edits(&mut now, edits, &mut random);
    let mut edited = fresh.clone();
    for edit in &edits {
        match *edit {
            RandomEdit::Move(item, bounds) => drop(edited.move_leaf(item, bounds)?),
            RandomEdit::Remove(item) => drop(edited.remove(item)?),
            RandomEdit::Insert(item, bounds) => edited.insert(item, bounds)?,
        }
    }
    all.push(query("query_edited", &edited, &rays, runs));
    all.push(query("query_rebuilt", &Bvh::build(&now, Builder::medium())?, &rays, runs));
    all.push(query("query_rebuilt_sah", &Bvh::build(&now, Builder::best())?, &rays, runs));
    Ok(all)
}

/// The nearest box along each ray.
fn query<const N: usize>(name: &str, tree: &Bvh<f32, N>, rays: &[([f32; N], [f32; N])], runs: usize) -> Measurement {
    let rays: Vec<_> = rays.iter().map(|&(o, d)| Ray::new(o, d, 0.0, f32::INFINITY)).collect();
    let mut visits = 0u64;
    let (seconds, _) = time(
        runs,
        || (),
        |()| {
            visits = rays.iter().map(|ray| u64::from(core::hint::black_box(tree.ray(ray, |hit| hit.t)))).sum();
        },
    );
    Measurement {
        sah: Some(tree.sah_cost()),
        visits: Some(visits as f64 / rays.len() as f64),
        ..Measurement::new(name, N, tree.len(), rays.len(), seconds)
    }
}
