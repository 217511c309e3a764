//! The hits of random rays in a scene that has followed edits, and in one that was loaded.

use glam::{DVec3, Vec3};
use orthant_cpu::{Hit, Ray, ResidentScene};
use orthant_render::DerivedScene;
use orthant_resident::rows::NodeFlags;
use orthant_scene::edit::random::Choices;

/// Rays of one comparison.
const RAYS: usize = 64;
/// How far hits may be apart, relative to the numbers that they come from: matrices were rounded on different ways.
const TOLERANCE: f64 = 1e-4;

/// What was derived, and what is resident of it.
pub type Side<'s> = (&'s DerivedScene, &'s ResidentScene);

/// Compares the hits of rays that `seed` chooses; slots are numbered differently on both sides, nodes and triangles are not.
/// Gives how many rays hit.
///
/// # Errors
/// The first ray that hits something else.
pub fn compare(synced: Side<'_>, fresh: Side<'_>, seed: u64) -> Result<u64, String> {
    let visible = |row: &&orthant_resident::rows::RenderNodeRow| row.flags & NodeFlags::VISIBLE != 0;
    let targets: Vec<usize> = (0..fresh.1.render_nodes.len()).filter(|&i| visible(&&fresh.1.render_nodes[i])).collect();
    if targets.is_empty() {
        return Ok(0);
    }
    let mut hits = 0;
    for (op, a, b, c) in Choices(seed).take(RAYS) {
        let unit = |bits: u32| f64::from(bits) / f64::from(u32::MAX);
        let row = targets[a as usize % targets.len()] as u32;
        let count = fresh.1.mesh_descs[fresh.1.render_nodes[row as usize].primitive as usize].index_count / 3;
        if count == 0 {
            continue;
        }
        let corners = world_triangle(fresh.1, row, b % count);
        let (u, v) = (unit(c), unit(c.rotate_left(16)) * (1.0 - unit(c)));
        let target = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
        let size = (corners[1] - corners[0]).length().max((corners[2] - corners[0]).length());
        let direction = DVec3::new(unit(b) - 0.5, unit(b.rotate_left(11)) - 0.5, unit(b.rotate_left(22)) - 0.5);
        let direction = direction.try_normalize().unwrap_or(DVec3::Y);
        let away = size * (0.5 + f64::from(op));
        // Where numbers are so large or so small that f32 cannot tell neighbours apart, nothing can be compared.
        if !(target.is_finite() && size > 1e-3 * target.length() && size < 1e12 && size > 1e-12) {
            continue;
        }
        let ray = Ray::new((target - direction * away).as_vec3(), direction.as_vec3());
        hits += u64::from(agree(synced, fresh, &ray, size).map_err(|what| format!("{ray:?}: {what}"))?);
    }
    Ok(hits)
}

/// Whether both sides see something; an error if they see different things.
fn agree(synced: Side<'_>, fresh: Side<'_>, ray: &Ray, size: f64) -> Result<bool, String> {
    let shift = (fresh.0.origin - synced.0.origin).as_vec3();
    let moved = Ray { origin: ray.origin + shift, ..*ray };
    let hit = |side: Side<'_>, ray: &Ray| side.1.closest_hit(ray, |_| true);
    let (a, b) = (hit(synced, &moved), hit(fresh, ray));
    let slack =
        TOLERANCE * (size + f64::from(ray.origin.length() + shift.length()) + b.map_or(0.0, |b| f64::from(b.t)));
    let name = |side: Side<'_>, hit: &Hit| side.0.node_of(hit.render_node).map(|id| (id, hit.triangle));
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

/// Whether a triangle of a node passes through where a ray hits another: surfaces that coincide are equally near.
fn is_at(fresh: Side<'_>, name: Option<(orthant_scene::model::NodeId, u32)>, ray: &Ray, hit: &Hit, slack: f64) -> bool {
    let Some((node, triangle)) = name else { return false };
    let point = ray.origin.as_dvec3() + ray.direction.as_dvec3() * f64::from(hit.t);
    fresh.0.render_nodes_of(node).any(|row| {
        let count = fresh.1.mesh_descs[fresh.1.render_nodes[row as usize].primitive as usize].index_count / 3;
        if triangle >= count {
            return false;
        }
        let [a, b, c] = world_triangle(fresh.1, row, triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let lower = a.min(b).min(c) - slack;
        let upper = a.max(b).max(c) + slack;
        (point - a).dot(normal).abs() <= slack && point.cmpge(lower).all() && point.cmple(upper).all()
    })
}

fn world_triangle(scene: &ResidentScene, row: u32, triangle: u32) -> [DVec3; 3] {
    let world = scene.render_nodes[row as usize].world.to_affine();
    scene.triangle_positions(row, triangle).map(|corner| world.transform_point3(corner.as_dvec3()))
}
