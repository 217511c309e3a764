//! The same operations of `obvhs`, in 3D, on the same boxes, edits and rays.

use glam::Vec3A;
use obvhs::aabb::Aabb as PeerAabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

use super::workload::{self, Random, RandomEdit};
use super::{Measurement, Plan, time};
use crate::aabb::Aabb;

/// Measures the peer's counterparts. A build is measured until the tree can be edited, as ours is: with parents and the
/// map from items to nodes; `bare` names the build alone.
pub fn measure(plan: Plan) -> Vec<Measurement> {
    let Plan { n, edits, rays, runs } = plan;
    let mut random = Random(1);
    let edge = workload::edge::<3>(n);
    let source: Vec<Aabb<f32, 3>> = (0..n).map(|_| workload::random_box(&mut random, edge)).collect();
    let boxes: Vec<PeerAabb> = source.iter().map(peer_box).collect();
    let rays: Vec<_> = workload::random_rays::<3>(rays, edge, &mut random)
        .into_iter()
        .map(|(origin, direction)| Ray::new_inf(Vec3A::from(origin), Vec3A::from(direction)))
        .collect();
    let mut all = Vec::new();
    let mut add = |name: &str, items, seconds, tree: &Bvh2| {
        let sah = Some(sah_cost(tree));
        all.push(Measurement { sah, ..Measurement::new(name, 3, n, items, seconds) });
    };

    for (name, bare, distance, threshold) in [
        ("obvhs_build_fastest", "obvhs_build_fastest_bare", PlocSearchDistance::Minimum, 0),
        ("obvhs_build_fast", "obvhs_build_fast_bare", PlocSearchDistance::Low, 2),
        ("obvhs_build", "obvhs_build_bare", PlocSearchDistance::Medium, 3),
    ] {
        let (seconds, tree) = time(runs, || None, |tree| *tree = Some(editable(build(&boxes, distance, threshold))));
        if let Some(tree) = tree {
            add(name, n, seconds, &tree);
        }
        let (seconds, tree) = time(runs, || None, |tree| *tree = Some(build(&boxes, distance, threshold)));
        if let Some(tree) = tree {
            add(bare, n, seconds, &tree);
        }
    }

    let fresh = editable(build(&boxes, PlocSearchDistance::Medium, 3));
    let new: Vec<_> = (0..edits).map(|_| peer_box(&workload::random_box::<3>(&mut random, edge))).collect();
    let some: Vec<u32> = (0..edits).map(|_| random.below(n) as u32).collect();
    let near: Vec<_> =
        some.iter().map(|&i| (i, peer_box(&workload::nudged(&mut random, &source[i as usize])))).collect();
    let far: Vec<_> = some.iter().zip(&new).map(|(&i, &b)| (i, b)).collect();
    let every: Vec<_> = source.iter().map(|b| peer_box(&workload::nudged(&mut random, b))).collect();

    let (seconds, tree) = time(
        runs,
        || fresh.clone(),
        |tree| {
            for (item, bounds) in (n as u32..).zip(&new) {
                tree.insert_primitive(*bounds, item);
            }
        },
    );
    add("obvhs_insert", edits, seconds, &tree);
    let mut first = std::collections::HashSet::new();
    let once: Vec<_> = near.iter().filter(|(item, _)| first.insert(*item)).copied().collect();
    let (seconds, tree) = time(
        runs,
        || fresh.clone(),
        |tree| {
            for &(item, _) in &once {
                tree.remove_primitive(item);
            }
        },
    );
    add("obvhs_remove", once.len(), seconds, &tree);
    for (name, moves) in [("obvhs_move", &near), ("obvhs_move_far", &far)] {
        let (seconds, tree) = time(
            runs,
            || fresh.clone(),
            |tree| {
                for &(item, bounds) in moves {
                    tree.move_primitive(bounds, item);
                }
            },
        );
        add(name, edits, seconds, &tree);
    }
    let (seconds, tree) = time(
        runs,
        || fresh.clone(),
        |tree| {
            for &(item, bounds) in &once {
                let node = tree.primitives_to_nodes[item as usize] as usize;
                tree.resize_node(node, bounds);
            }
        },
    );
    add("obvhs_refit_some", once.len(), seconds, &tree);
    let (seconds, tree) = time(
        runs,
        || fresh.clone(),
        |tree| {
            for (item, bounds) in every.iter().enumerate() {
                let node = tree.primitives_to_nodes[item] as usize;
                tree.nodes[node].set_aabb(*bounds);
            }
            tree.refit_all();
        },
    );
    add("obvhs_refit", n, seconds, &tree);
    let budget = n / 50;
    let (seconds, tree) = time(
        runs.min(3),
        || fresh.clone(),
        |tree| {
            let ratio = budget as f32 / tree.nodes.len() as f32;
            ReinsertionOptimizer::default().run(tree, ratio, Some(vec![1.0]));
        },
    );
    add("obvhs_optimize", budget, seconds, &tree);
    all.push(query("obvhs_query_fresh", &fresh, &rays, runs));

    let mut now = source.clone();
    let edits = workload::random_edits(&mut now, edits, &mut random);
    let mut edited = fresh.clone();
    for edit in &edits {
        match edit {
            RandomEdit::Move(item, bounds) => drop(edited.move_primitive(peer_box(bounds), *item)),
            RandomEdit::Remove(item) => edited.remove_primitive(*item),
            RandomEdit::Insert(item, bounds) => drop(edited.insert_primitive(peer_box(bounds), *item)),
        }
    }
    all.push(query("obvhs_query_edited", &edited, &rays, runs));
    let now: Vec<_> = now.iter().map(peer_box).collect();
    all.push(query("obvhs_query_rebuilt", &build(&now, PlocSearchDistance::Medium, 3), &rays, runs));
    all
}

fn peer_box(b: &Aabb<f32, 3>) -> PeerAabb {
    PeerAabb::new(Vec3A::from(b.min), Vec3A::from(b.max))
}

fn build(boxes: &[PeerAabb], distance: PlocSearchDistance, threshold: usize) -> Bvh2 {
    let indices = (0..boxes.len() as u32).collect();
    PlocBuilder::with_capacity(boxes.len()).build(distance, boxes, indices, SortPrecision::U64, threshold)
}

fn editable(mut tree: Bvh2) -> Bvh2 {
    tree.init_parents_if_uninit();
    tree.init_primitives_to_nodes_if_uninit();
    tree
}

/// As [`crate::Bvh::sah_cost`].
fn sah_cost(tree: &Bvh2) -> f64 {
    let area = |b: &PeerAabb| Aabb::new(b.min.to_array(), b.max.to_array()).half_area_f64();
    tree.nodes.iter().map(|node| area(node.aabb())).sum::<f64>() / area(tree.nodes[0].aabb())
}

/// The nearest box along each ray.
fn query(name: &str, tree: &Bvh2, rays: &[Ray], runs: usize) -> Measurement {
    let (seconds, _) = time(
        runs,
        || (),
        |()| {
            for ray in rays {
                let mut hit = RayHit::none();
                obvhs::fast_stack!(u32, (96, 192), tree.max_depth, stack, {
                    tree.ray_traverse_dynamic(&mut stack, *ray, &mut hit, |node, ray, hit| {
                        let t = node.aabb().intersect_ray(ray).max(0.0);
                        if t < ray.tmax {
                            hit.t = t;
                            ray.tmax = t;
                        }
                        true
                    })
                });
                core::hint::black_box(hit.t);
            }
        },
    );
    Measurement {
        sah: Some(sah_cost(tree)),
        ..Measurement::new(name, 3, tree.nodes.len().div_ceil(2), rays.len(), seconds)
    }
}
