//! Emissive triangles and quads.

use super::{LightSample, LightTables};
use crate::path::alpha::surface_presence;
use crate::path::cone::RayCone;
use crate::path::material::{TextureFrame, emitted_radiance};
use crate::path::surface::SurfacePoint;
use crate::scene::ResidentScene;
use glam::{Vec2, Vec3};
use orthant_resident::rows::{EmitterRow, NONE};
use orthant_resident::sampling::warp::sample_triangle;

/// Density over solid angle with which next event estimation from `from`, where the geometric normal is `normal`, chooses
/// the direction to a point of an emissive surface, which is met under the cosine `cos`; the choice of the kind is
/// included. 0 for a surface that is in no emitter table.
#[inline]
pub fn emitter_pdf(
    scene: &ResidentScene,
    lights: &LightTables,
    point: &SurfacePoint,
    from: Vec3,
    normal: Vec3,
    cos: f32,
) -> f32 {
    let Some(row) = scene.emitters.get(point.node.emitter as usize) else { return 0.0 };
    if point.node.emitter == NONE || point.area <= 0.0 {
        return 0.0;
    }
    let chosen = lights.kinds.emitters * lights.emitters.probability(point.node.emitter, from, normal);
    if let Some(rectangle) = lights.quad(point.node.emitter).and_then(|quad| quad.seen_from(from)) {
        return chosen / rectangle.solid_angle();
    }
    let distance2 = (point.position - from).length_squared();
    chosen * triangle_probability(scene, row, point.triangle as usize) / point.area * distance2 / cos.abs().max(1e-9)
}

/// Samples a point of an emissive surface as seen from `from`, where the geometric normal is `normal`: `pick` chooses the emitter, `pick_triangle` the triangle,
/// `u` the point. The density leaves the choice of the kind out. `cone` is that of a ray from there.
#[inline]
pub fn sample_emitter(
    scene: &ResidentScene,
    lights: &LightTables,
    from: Vec3,
    normal: Vec3,
    cone: RayCone,
    pick: f32,
    pick_triangle: f32,
    u: Vec2,
) -> Option<LightSample> {
    // Choose an emitter
    let (index, chosen) = lights.emitters.sample(from, normal, pick)?;
    let row = scene.emitters.get(index as usize)?;

    // Choose a point on it: a quad's as a whole, else a triangle by area first
    let quad = lights.quad(index);
    let rectangle = quad.and_then(|quad| quad.seen_from(from));
    let (triangle, b) = match quad {
        Some(quad) => quad.point(rectangle.map_or(u, |r| r.sample(u))),
        None => {
            let first = row.first_triangle as usize;
            let table = scene.emitter_triangles.get(first..first + row.triangle_count as usize)?;
            let triangle = table.partition_point(|t| t.cumulative <= pick_triangle);
            if triangle >= table.len() {
                return None;
            }
            (triangle as u32, sample_triangle(u))
        }
    };
    let point = SurfacePoint::new(scene, row.render_node, triangle, b.x, b.y);
    let to_light = point.position - from;
    let distance2 = to_light.length_squared();
    if !(distance2 > 0.0 && point.area > 0.0) {
        return None;
    }
    let distance = distance2.sqrt();
    let direction = to_light / distance;
    let cos = -direction.dot(point.front);
    if cos == 0.0 || (cos < 0.0 && !point.is_double_sided()) {
        return None;
    }
    let density = match rectangle {
        Some(rectangle) => 1.0 / rectangle.solid_angle(),
        None => triangle_probability(scene, row, triangle as usize) / point.area * distance2 / cos.abs(),
    };
    let pdf = chosen * density;
    let presence = surface_presence(scene, &point);
    if !(pdf > 0.0 && presence > 0.0) {
        return None;
    }
    let frame = TextureFrame::new(scene, &point, cone.footprint(distance, cos));
    let radiance = emitted_radiance(scene, &point, &frame) * presence;
    let facing = if cos > 0.0 { point.front } else { -point.front };
    Some(LightSample { direction, end: Some(point.ray_origin(facing)), radiance, pdf })
}

#[inline]
fn triangle_probability(scene: &ResidentScene, row: &EmitterRow, triangle: usize) -> f32 {
    if triangle >= row.triangle_count as usize {
        return 0.0;
    }
    let first = row.first_triangle as usize;
    let cumulative = |t: usize| scene.emitter_triangles.get(first + t).map_or(0.0, |t| t.cumulative);
    cumulative(triangle) - if triangle == 0 { 0.0 } else { cumulative(triangle - 1) }
}
