//! The walk through the two levels of trees.

#[cfg(target_arch = "x86_64")]
use super::boxes::Avx2;
use super::boxes::{BoxRay, BoxTest, Lanes, Portable};
use super::object_ray::ObjectRay;
use super::stack::{Entry, Stack};
use super::triangle::{intersect, is_traceable};
use super::{Hit, Ray};
use crate::accel::bounds::ORIGIN_SLACK;
use crate::accel::wide::{WIDTH, WideNode};
use crate::accel::{Blas, blas};
use crate::scene::ResidentScene;
use glam::Vec3;
use orthant_resident::rows::{MeshDesc, NodeFlags, RenderNodeRow};

/// The nearest accepted hit.
pub(crate) fn closest_hit(scene: &ResidentScene, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> Option<Hit> {
    walk::<NearFirst, _, false>(scene, ray, accept)
}

/// Whether there is an accepted hit.
pub(crate) fn any_hit(scene: &ResidentScene, ray: &Ray, accept: impl FnMut(&Hit) -> bool) -> bool {
    walk::<Unordered, _, true>(scene, ray, accept).is_some()
}

/// The hit of one triangle of a RenderNode, whatever else is there; no tree is asked.
pub(crate) fn triangle_hit(scene: &ResidentScene, ray: &Ray, render_node: u32, triangle: u32) -> Option<Hit> {
    const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
    let row = scene.render_nodes.get(render_node as usize).filter(|row| row.flags & SEEN == SEEN)?;
    let desc = scene.mesh_descs.get(row.primitive as usize).filter(|desc| triangle < desc.triangle_count())?;
    let bounds = scene.blas.get(row.primitive as usize)?.as_ref()?.bounds();
    let corners = blas::corners(&scene.positions, &scene.indices, desc, triangle).filter(|&all| is_traceable(all))?;
    let origin = row.inverse.transform_point(ray.origin).to_array();
    let direction = row.inverse.transform_vector(ray.direction).to_array();
    let local = ObjectRay::new(origin, direction, ray.t_min, &bounds)?;
    let hit = intersect(&local, corners, row.flags & NodeFlags::DOUBLE_SIDED == 0)?;
    let is_within = ray.t_min.max(0.0) < hit.t && hit.t < ray.t_max;
    is_within.then_some(Hit { t: hit.t, render_node, triangle, b1: hit.b1, b2: hit.b2, back_face: hit.back_face })
}

#[inline]
fn walk<O: Order, A: FnMut(&Hit) -> bool, const ANY: bool>(scene: &ResidentScene, ray: &Ray, accept: A) -> Option<Hit> {
    #[cfg(target_arch = "x86_64")]
    if let Some(proof) = Avx2::detect() {
        return walk_avx2::<O, A, ANY>(proof, scene, ray, accept);
    }
    walk_with::<_, O, A, ANY>(Portable, scene, ray, accept)
}

/// The walk compiled for AVX2.
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "a function compiled for more than the machine is known to have")]
#[inline]
fn walk_avx2<O: Order, A: FnMut(&Hit) -> bool, const ANY: bool>(
    proof: Avx2,
    scene: &ResidentScene,
    ray: &Ray,
    accept: A,
) -> Option<Hit> {
    #[target_feature(enable = "avx2")]
    fn compiled<O: Order, A: FnMut(&Hit) -> bool, const ANY: bool>(
        proof: Avx2,
        scene: &ResidentScene,
        ray: &Ray,
        accept: A,
    ) -> Option<Hit> {
        walk_with::<_, O, A, ANY>(proof, scene, ray, accept)
    }
    // SAFETY: the proof says that the machine has AVX2.
    unsafe { compiled::<O, A, ANY>(proof, scene, ray, accept) }
}

#[inline(always)]
fn walk_with<S: BoxTest, O: Order, A: FnMut(&Hit) -> bool, const ANY: bool>(
    boxes: S,
    scene: &ResidentScene,
    ray: &Ray,
    mut accept: A,
) -> Option<Hit> {
    let mut best = Hit { t: ray.t_max, render_node: 0, triangle: 0, b1: 0.0, b2: 0.0, back_face: false };
    let mut found = false;
    let t_min = if ray.t_min > 0.0 { ray.t_min } else { 0.0 };
    if !(ray.t_max > t_min && ray.origin.is_finite() && ray.direction.is_finite() && ray.direction != Vec3::ZERO) {
        return None;
    }
    let slack = ORIGIN_SLACK * ray.origin.abs().max_element();
    let world = BoxRay::new(ray.origin.to_array(), ray.direction.to_array(), [slack; 3], t_min);
    let tlas = &scene.tlas.wide;
    walk_tree::<S, O>(boxes, &tlas.nodes, tlas.root, &world, &mut best, |node, _, t_enter, best| {
        let Some(row) = scene.render_nodes.get(node as usize) else { return false };
        let primitive = row.primitive as usize;
        let (Some(Some(blas)), Some(desc)) = (scene.blas.get(primitive), scene.mesh_descs.get(primitive)) else {
            return false;
        };
        let instance = Instance { scene, node, row, blas, desc, t_enter, t_min };
        instance.walk::<S, A, ANY>(boxes, ray, best, &mut found, &mut accept)
    });
    found.then_some(best)
}

/// In a stack entry: a leaf, by its first item. (Node and item numbers stay below it: their arrays could not be made, and a
/// TLAS takes no higher items.)
const LEAF: u32 = 1 << 31;

/// In what order a walk visits the children of a node that the ray meets.
trait Order {
    /// Leaves wait for nearer siblings; they then hold one item each. Else they come before all inner ones.
    const SORTS_LEAVES: bool;
    /// Inner children are visited from near to far.
    const SORTS_INNER: bool;
}

/// Near to far: where a leaf is an instance, and what is behind the nearest hit is never entered.
struct NearFirst;

impl Order for NearFirst {
    const SORTS_LEAVES: bool = true;
    const SORTS_INNER: bool = true;
}

/// Leaves, then inner children from near to far: where a leaf is a few triangles.
struct LeavesFirst;

impl Order for LeavesFirst {
    const SORTS_LEAVES: bool = false;
    const SORTS_INNER: bool = true;
}

/// Leaves, then inner children as they come: for any hit at all among instances. A leaf beside inner children is large
/// for its place in the tree, so likely to be hit (a ground, a dome about everything), and near is no better than far.
struct Unordered;

impl Order for Unordered {
    const SORTS_LEAVES: bool = false;
    const SORTS_INNER: bool = false;
}

/// Visits the leaves below node `root` that the ray meets at `best.t` or before until `visit`, which gets a leaf's child and count,
/// says to stop. Returns whether it did.
#[inline(always)]
fn walk_tree<S: BoxTest, O: Order>(
    boxes: S,
    nodes: &[WideNode],
    root: u32,
    ray: &BoxRay,
    best: &mut Hit,
    mut visit: impl FnMut(u32, u8, f32, &mut Hit) -> bool,
) -> bool {
    if nodes.is_empty() {
        return false;
    }
    let mut stack = Stack::new();
    let mut enter = Lanes([0.0; WIDTH]);
    let mut current = Entry::new(0.0, root);
    loop {
        if O::SORTS_LEAVES && current.reference() & LEAF != 0 {
            if visit(current.reference() & !LEAF, 1, current.t(), best) {
                return true;
            }
        } else {
            let node = &nodes[current.reference() as usize];
            let mut mask = boxes.test(ray, node, best.t, &mut enter);
            if !O::SORTS_LEAVES {
                let mut leaves = mask & !u32::from(node.inner);
                mask &= u32::from(node.inner);
                while leaves != 0 {
                    let slot = leaves.trailing_zeros() as usize;
                    leaves &= leaves - 1;
                    if enter.0[slot] <= best.t && visit(node.child[slot], node.count[slot], enter.0[slot], best) {
                        return true;
                    }
                }
            }
            let entry = |slot: usize| {
                let leaf = if O::SORTS_LEAVES && node.inner & (1 << slot) == 0 { LEAF } else { 0 };
                Entry::new(enter.0[slot], node.child[slot] | leaf)
            };
            if mask != 0 {
                let first = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if mask == 0 {
                    current = entry(first);
                    continue;
                }
                let bottom = stack.len();
                stack.push(entry(first));
                while mask != 0 {
                    let slot = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    if O::SORTS_INNER {
                        stack.insert(bottom, entry(slot));
                    } else {
                        stack.push(entry(slot));
                    }
                }
            }
        }
        loop {
            let Some(entry) = stack.pop() else { return false };
            if entry.t() <= best.t {
                current = entry;
                break;
            }
        }
    }
}

/// One instance that a ray may hit.
struct Instance<'a> {
    scene: &'a ResidentScene,
    node: u32,
    row: &'a RenderNodeRow,
    blas: &'a Blas,
    desc: &'a MeshDesc,
    /// Where the ray enters the instance's box: its hits are not before.
    t_enter: f32,
    t_min: f32,
}

impl Instance<'_> {
    #[inline(always)]
    fn walk<S: BoxTest, A: FnMut(&Hit) -> bool, const ANY: bool>(
        &self,
        boxes: S,
        ray: &Ray,
        best: &mut Hit,
        found: &mut bool,
        accept: &mut A,
    ) -> bool {
        let origin = self.row.inverse.transform_point(ray.origin).to_array();
        let direction = self.row.inverse.transform_vector(ray.direction).to_array();
        let Some(local) = ObjectRay::new(origin, direction, self.t_min, &self.blas.bounds()) else { return false };
        let cull = self.row.flags & NodeFlags::DOUBLE_SIDED == 0;
        let opaque = self.row.flags & NodeFlags::OPAQUE != 0;
        let (positions, indices) = (&self.scene.positions, &self.scene.indices);
        let tree = &self.blas.tree;
        walk_tree::<S, LeavesFirst>(boxes, &tree.nodes, 0, &local.boxes, best, |first, count, _, best| {
            for &triangle in &tree.items[first as usize..first as usize + usize::from(count)] {
                let Some(corners) = blas::corners(positions, indices, self.desc, triangle) else { continue };
                let Some(hit) = intersect(&local, corners, cull) else { continue };
                let t = if hit.t > self.t_enter { hit.t } else { self.t_enter };
                let hit = Hit { t, render_node: self.node, triangle, b1: hit.b1, b2: hit.b2, back_face: hit.back_face };
                let nearer = t < best.t || (t == best.t && (self.node, triangle) < (best.render_node, best.triangle));
                if t > self.t_min && nearer && (opaque || accept(&hit)) {
                    *best = hit;
                    *found = true;
                    if ANY {
                        return true;
                    }
                }
            }
            false
        })
    }
}

/// Ways to compute the same, for the tests.
#[cfg(test)]
pub(super) mod reference {
    use super::*;

    /// The answers of every instruction set that the machine has.
    pub fn closest_hits(scene: &ResidentScene, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Vec<Option<Hit>> {
        let mut hits = vec![walk_with::<_, NearFirst, _, false>(Portable, scene, ray, &accept)];
        #[cfg(target_arch = "x86_64")]
        hits.extend(Avx2::detect().map(|proof| walk_avx2::<NearFirst, _, false>(proof, scene, ray, &accept)));
        hits
    }

    /// Every triangle of every instance, without a tree.
    pub fn brute_force(scene: &ResidentScene, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        for (node, row) in scene.render_nodes.iter().enumerate() {
            let Some(desc) = scene.mesh_descs.get(row.primitive as usize) else { continue };
            for triangle in 0..desc.triangle_count() {
                let Some(hit) = triangle_hit(scene, ray, node as u32, triangle) else { continue };
                // Triangles come in ascending order: the first of equally near ones stays.
                let nearer = best.is_none_or(|best| hit.t < best.t);
                if nearer && (row.flags & NodeFlags::OPAQUE != 0 || accept(&hit)) {
                    best = Some(hit);
                }
            }
        }
        best
    }
}
