//! The same operations of `obvhs`, in 3D, on the same boxes, edits and rays.

use glam::Vec3A;
use obvhs::aabb::Aabb as PeerAabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};

use super::workload::{Load, RandomEdit};
use super::{Operation, Outcome, time};
use crate::aabb::Aabb;

/// The load in the peer's types.
pub(super) struct PeerLoad {
    boxes: Vec<PeerAabb>,
    new: Vec<PeerAabb>,
    near: Vec<(u32, PeerAabb)>,
    every: Vec<PeerAabb>,
    rays: Vec<Ray>,
}

impl PeerLoad {
    pub(super) fn new(load: &Load<3>) -> Self {
        let ray =
            |&(origin, direction): &([f32; 3], [f32; 3])| Ray::new_inf(Vec3A::from(origin), Vec3A::from(direction));
        Self {
            boxes: load.boxes.iter().map(peer_box).collect(),
            new: load.new.iter().map(peer_box).collect(),
            near: load.near.iter().map(|(item, bounds)| (*item, peer_box(bounds))).collect(),
            every: load.every.iter().map(|(_, bounds)| peer_box(bounds)).collect(),
            rays: load.rays.iter().map(ray).collect(),
        }
    }
}

/// The trees that operations start from.
pub(super) struct Trees {
    fresh: Bvh2,
    edited: Bvh2,
    rebuilt: Bvh2,
}

impl Trees {
    pub(super) fn new(load: &Load<3>, peer: &PeerLoad) -> Self {
        let fresh = editable(build(&peer.boxes, PlocSearchDistance::Medium, 3));
        let mut edited = fresh.clone();
        for edit in &load.edits {
            match edit {
                RandomEdit::Move(item, bounds) => drop(edited.move_primitive(peer_box(bounds), *item)),
                RandomEdit::Remove(item) => edited.remove_primitive(*item),
                RandomEdit::Insert(item, bounds) => drop(edited.insert_primitive(peer_box(bounds), *item)),
            }
        }
        let now: Vec<_> = load.edited.iter().map(peer_box).collect();
        Self { fresh, edited, rebuilt: build(&now, PlocSearchDistance::Medium, 3) }
    }

    /// A tree to edit, with room for what comes in.
    fn start(&self, load: &Load<3>) -> Bvh2 {
        let mut tree = self.fresh.clone();
        tree.nodes.reserve(2 * load.plan.edits);
        tree.parents.reserve(2 * load.plan.edits);
        tree.primitive_indices.reserve(load.plan.edits);
        tree.primitives_to_nodes.reserve(load.plan.edits);
        tree
    }
}

/// The peer's counterparts. A build is measured until the tree can be edited, as ours can: with parents and the map from
/// items to nodes.
pub(super) fn operations<'a>(load: &'a Load<3>, peer: &'a PeerLoad, trees: &'a Trees) -> Vec<Operation<'a>> {
    let mut all = Vec::new();
    for (name, distance, threshold) in [
        ("obvhs_build_fastest", PlocSearchDistance::Minimum, 0),
        ("obvhs_build_fast", PlocSearchDistance::Low, 2),
        ("obvhs_build", PlocSearchDistance::Medium, 3),
    ] {
        let build =
            move || time(Bvh2::default(), |tree| *tree = editable(build(&peer.boxes, distance, threshold)), sah_cost);
        all.push(Operation { name, items: peer.boxes.len(), run: Box::new(build) });
    }
    let mut edit = |name, items, work: Box<dyn Fn(&mut Bvh2) + 'a>| {
        let run = Box::new(move || time(trees.start(load), |tree| work(tree), sah_cost));
        all.push(Operation { name, items, run });
    };

    let insert = |tree: &mut Bvh2| {
        for (item, bounds) in (peer.boxes.len() as u32..).zip(&peer.new) {
            tree.insert_primitive(*bounds, item);
        }
    };
    edit("obvhs_insert", peer.new.len(), Box::new(insert));
    let remove = |tree: &mut Bvh2| {
        for &(item, _) in &peer.near {
            tree.remove_primitive(item);
        }
    };
    edit("obvhs_remove", peer.near.len(), Box::new(remove));
    let near = |tree: &mut Bvh2| {
        for &(item, bounds) in &peer.near {
            tree.move_primitive(bounds, item);
        }
    };
    edit("obvhs_move", peer.near.len(), Box::new(near));
    let far = |tree: &mut Bvh2| {
        for (&(item, _), &bounds) in peer.near.iter().zip(&peer.new) {
            tree.move_primitive(bounds, item);
        }
    };
    edit("obvhs_move_far", peer.near.len(), Box::new(far));
    let refit_some = |tree: &mut Bvh2| {
        for &(item, bounds) in &peer.near {
            let node = tree.primitives_to_nodes[item as usize] as usize;
            tree.resize_node(node, bounds);
        }
    };
    edit("obvhs_refit_some", peer.near.len(), Box::new(refit_some));
    let refit = |tree: &mut Bvh2| {
        for (item, bounds) in peer.every.iter().enumerate() {
            let node = tree.primitives_to_nodes[item] as usize;
            tree.nodes[node].set_aabb(*bounds);
        }
        tree.refit_all();
    };
    edit("obvhs_refit", peer.every.len(), Box::new(refit));
    let budget = load.plan.n / 50;
    let optimize = move |tree: &mut Bvh2| {
        let ratio = budget as f32 / tree.nodes.len() as f32;
        ReinsertionOptimizer::default().run(tree, ratio, Some(vec![1.0]));
    };
    edit("obvhs_optimize", budget, Box::new(optimize));

    for (name, tree) in [
        ("obvhs_query_fresh", &trees.fresh),
        ("obvhs_query_edited", &trees.edited),
        ("obvhs_query_rebuilt", &trees.rebuilt),
    ] {
        all.push(Operation { name, items: peer.rays.len(), run: Box::new(move || query(tree, &peer.rays)) });
    }
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
fn query(tree: &Bvh2, rays: &[Ray]) -> Outcome {
    let walk = |(): &mut ()| {
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
    };
    time((), walk, |()| sah_cost(tree))
}
