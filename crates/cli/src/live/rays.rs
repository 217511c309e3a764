//! The hits of random rays in a scene that has followed edits, and in one that was loaded.

use super::aim::{Aim, Targets, world_triangle};
use super::geometry::Geometry;
use glam::Vec3;
use orthant_cpu::{Hit, Ray, ResidentScene};
use orthant_render::DerivedScene;
use orthant_scene::edit::random::Choices;
use orthant_scene::model::NodeId;

/// Rays of one comparison.
const RAYS: usize = 64;
/// One in so many goes through the whole scene, the others at a triangle.
const ACROSS: usize = 8;
/// How far hits may be apart, in neighbouring numbers, where both sides have the same origin. Hundreds of thousands of rays were
/// none apart; what a pose deforms is followed up to rounding.
const ULPS: u32 = 4;
/// How far hits may be apart otherwise, relative to the numbers that they come from: matrices were rounded on different ways.
const TOLERANCE: f64 = 1e-4;

/// What was derived, and what is resident of it.
pub type Side<'s> = (&'s DerivedScene, &'s ResidentScene);

/// Compares the hits of rays that `seed` chooses; slots are numbered differently on both sides, nodes and triangles are not.
/// Gives how many rays hit.
///
/// # Errors
/// The first ray that hits something else.
pub fn compare(synced: Side<'_>, fresh: Side<'_>, seed: u64) -> Result<u64, String> {
    let targets = Targets::of(Geometry::from(fresh.1));
    let is_same_origin = synced.0.origin == fresh.0.origin;
    let mut hits = 0;
    for (i, choice) in Choices(seed).take(RAYS).enumerate() {
        let aimed = if i % ACROSS == 0 { targets.across(choice) } else { targets.at_triangle(choice) };
        let Some(Aim { from, direction, size, .. }) = aimed else { continue };
        let ray = Ray::new(from.as_vec3(), direction.as_vec3());
        let seen = if is_same_origin { same(synced, fresh, &ray) } else { agree(synced, fresh, &ray, size) };
        hits += u64::from(seen.map_err(|what| format!("{ray:?}: {what}"))?);
    }
    Ok(hits)
}

/// What is hit: a triangle of a render node, which is that of its node which has this place among them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Name {
    node: NodeId,
    place: u32,
    triangle: u32,
}

impl Name {
    fn of(scene: &DerivedScene, hit: &Hit) -> Option<Self> {
        let node = scene.node_of(hit.render_node)?;
        let place = hit.render_node.checked_sub(scene.render_nodes_of(node).start)?;
        Some(Self { node, place, triangle: hit.triangle })
    }

    /// Its hit alone.
    fn hit(&self, side: Side<'_>, ray: &Ray) -> Option<Hit> {
        side.1.triangle_hit(ray, side.0.render_nodes_of(self.node).nth(self.place as usize)?, self.triangle)
    }
}

/// Whether both sides see something where they have the same origin; an error if they see different things. Of surfaces that are
/// equally near each may show the other: which one it is, slots decide.
fn same(synced: Side<'_>, fresh: Side<'_>, ray: &Ray) -> Result<bool, String> {
    let hit = |side: Side<'_>| side.1.closest_hit(ray, |_| true);
    let near = |a: f32, b: f32| a.to_bits().abs_diff(b.to_bits()) <= ULPS;
    let (a, b) = (hit(synced), hit(fresh));
    let names = (a.and_then(|a| Name::of(synced.0, &a)), b.and_then(|b| Name::of(fresh.0, &b)));
    match (a, b, names) {
        (None, None, _) => Ok(false),
        (Some(a), Some(b), (Some(x), Some(y)))
            if near(a.t, b.t)
                && (x == y
                    || x.hit(fresh, ray).is_some_and(|hit| near(hit.t, b.t))
                        && y.hit(synced, ray).is_some_and(|hit| near(hit.t, a.t))) =>
        {
            Ok(true)
        }
        _ => Err(format!(
            "a ray hits {:?} at {:?}, and should hit {:?} at {:?}",
            names.0,
            a.map(|a| a.t),
            names.1,
            b.map(|b| b.t)
        )),
    }
}

/// Whether both sides see something where their origins differ; an error if they see different things.
fn agree(synced: Side<'_>, fresh: Side<'_>, ray: &Ray, size: f64) -> Result<bool, String> {
    // Where numbers are so large or so small that f32 cannot tell neighbours apart, nothing can be compared.
    if !(size > 1e-3 * f64::from(ray.origin.length()) && size < 1e12 && size > 1e-12) {
        return Ok(false);
    }
    let shift = (fresh.0.origin - synced.0.origin).as_vec3();
    let moved = Ray { origin: ray.origin + shift, ..*ray };
    let hit = |side: Side<'_>, ray: &Ray| side.1.closest_hit(ray, |_| true);
    let (a, b) = (hit(synced, &moved), hit(fresh, ray));
    let slack =
        TOLERANCE * (size + f64::from(ray.origin.length() + shift.length()) + b.map_or(0.0, |b| f64::from(b.t)));
    let name = |side: Side<'_>, hit: &Hit| Name::of(side.0, hit);
    let is_same = match (&a, &b) {
        (None, None) => return Ok(false),
        (Some(a), Some(b)) => {
            f64::from((a.t - b.t).abs()) <= slack
                && (name(synced, a) == name(fresh, b) || is_at(fresh, name(synced, a), ray, b, slack))
        }
        _ => false,
    };
    if is_same {
        return Ok(true);
    }
    // At an edge, or where surfaces lie close together, rounding decides: neighbouring rays see other things too.
    let around = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| [axis, -axis]).concat();
    let is_smooth = around.iter().all(|&axis| {
        let near = hit(fresh, &Ray { origin: ray.origin + axis * (8.0 * slack) as f32, ..*ray });
        match (&near, &b) {
            (None, None) => true,
            (Some(near), Some(b)) => {
                near.render_node == b.render_node && f64::from((near.t - b.t).abs()) < 64.0 * slack
            }
            _ => false,
        }
    });
    if !is_smooth {
        return Ok(b.is_some());
    }
    let show = |side: Side<'_>, hit: Option<Hit>| hit.map(|hit| (name(side, &hit), hit.t));
    Err(format!("a ray hits {:?}, and should hit {:?}", show(synced, a), show(fresh, b)))
}

/// Whether a triangle passes through where a ray hits another: surfaces that coincide are equally near.
fn is_at(fresh: Side<'_>, name: Option<Name>, ray: &Ray, hit: &Hit, slack: f64) -> bool {
    let Some(name) = name else { return false };
    let Some(row) = fresh.0.render_nodes_of(name.node).nth(name.place as usize) else { return false };
    let count = fresh.1.mesh_descs[fresh.1.render_nodes[row as usize].primitive as usize].triangle_count();
    if name.triangle >= count {
        return false;
    }
    let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t);
    let [a, b, c] = world_triangle(&Geometry::from(fresh.1), row, name.triangle);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let (lower, upper) = (a.min(b).min(c) - slack, a.max(b).max(c) + slack);
    (point - a).dot(normal).abs() <= slack && point.cmpge(lower).all() && point.cmple(upper).all()
}
