//! The hits of random rays in a scene that has followed edits, and in one that was loaded.

use glam::{DVec3, Vec3};
use orthant_cpu::{Hit, Ray, ResidentScene};
use orthant_render::DerivedScene;
use orthant_resident::extent::Extent;
use orthant_resident::rows::{NodeFlags, RenderNodeRow};
use orthant_resident::slot_tree::Join;
use orthant_scene::edit::random::{Choice, Choices};
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
    let is_visible = |row: &RenderNodeRow| row.flags & NodeFlags::VISIBLE != 0;
    let rows = &fresh.1.render_nodes;
    let targets: Vec<u32> = (0..rows.len() as u32).filter(|&i| is_visible(&rows[i as usize])).collect();
    if targets.is_empty() {
        return Ok(0);
    }
    let extent =
        rows.iter().map(|row| Extent::of_instance(row, &fresh.1.mesh_descs)).fold(Extent::NOTHING, Extent::join);
    let is_same_origin = synced.0.origin == fresh.0.origin;
    let mut hits = 0;
    for (i, choice) in Choices(seed).take(RAYS).enumerate() {
        let aimed = if i % ACROSS == 0 { across(&extent, choice) } else { at_triangle(fresh.1, &targets, choice) };
        let Some((ray, size)) = aimed else { continue };
        let seen = if is_same_origin { same(synced, fresh, &ray) } else { agree(synced, fresh, &ray, size) };
        hits += u64::from(seen.map_err(|what| format!("{ray:?}: {what}"))?);
    }
    Ok(hits)
}

fn unit(bits: u32) -> f64 {
    f64::from(bits) / f64::from(u32::MAX)
}

fn direction(bits: u32) -> DVec3 {
    let direction = [bits, bits.rotate_left(11), bits.rotate_left(22)].map(|bits| unit(bits) - 0.5);
    DVec3::from_array(direction).try_normalize().unwrap_or(DVec3::Y)
}

/// A ray through the whole scene, from outside, and the size of that.
fn across(extent: &Extent, (_, a, b, c): Choice) -> Option<(Ray, f64)> {
    let (lower, upper) = (extent.lower.as_dvec3(), extent.upper.as_dvec3());
    let at = DVec3::new(unit(a), unit(b), unit(c));
    let (target, size) = (lower + (upper - lower) * at, (upper - lower).length());
    let direction = direction(a ^ b.rotate_left(7) ^ c.rotate_left(19));
    let ray = Ray::new((target - direction * size).as_vec3(), direction.as_vec3());
    (size > 0.0 && ray.origin.is_finite()).then_some((ray, size))
}

/// A ray at a triangle, and the size of that.
fn at_triangle(scene: &ResidentScene, rows: &[u32], (op, a, b, c): Choice) -> Option<(Ray, f64)> {
    let row = rows[a as usize % rows.len()];
    let count = scene.mesh_descs[scene.render_nodes[row as usize].primitive as usize].triangle_count();
    let corners = world_triangle(scene, row, b.checked_rem(count)?);
    let (u, v) = (unit(c), unit(c.rotate_left(16)) * (1.0 - unit(c)));
    let target = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
    let size = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
    let (direction, away) = (direction(b), size * (0.5 + f64::from(op)));
    let ray = Ray::new((target - direction * away).as_vec3(), direction.as_vec3());
    (target.is_finite() && ray.origin.is_finite()).then_some((ray, size))
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
    let [a, b, c] = world_triangle(fresh.1, row, name.triangle);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let (lower, upper) = (a.min(b).min(c) - slack, a.max(b).max(c) + slack);
    (point - a).dot(normal).abs() <= slack && point.cmpge(lower).all() && point.cmple(upper).all()
}

fn world_triangle(scene: &ResidentScene, row: u32, triangle: u32) -> [DVec3; 3] {
    let world = scene.render_nodes[row as usize].world.to_affine();
    scene.triangle_positions(row, triangle).map(|corner| world.transform_point3(corner.as_dvec3()))
}
