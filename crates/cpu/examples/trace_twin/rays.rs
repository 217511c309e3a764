//! The rays of the measurement.

use glam::Vec3;
use orthant_cpu::{Ray, ResidentScene};

/// Three kinds of rays.
pub struct Rays {
    /// From a pinhole camera above the scene's edge, in rows of pixels.
    pub primary: Vec<Ray>,
    /// From what those hit, to points of a disc light above the scene.
    pub shadow: Vec<Ray>,
    /// From what those hit, in cosine-distributed directions.
    pub incoherent: Vec<Ray>,
}

impl Rays {
    /// About `size * size` of each kind.
    pub fn new(scene: &ResidentScene, size: u32) -> Self {
        let bounds = scene.tlas.bounds();
        let (lower, upper) = (Vec3::from_array(bounds.lower), Vec3::from_array(bounds.upper));
        let extent = (upper - lower).max_element();
        let eye = Vec3::new(0.5 * (lower.x + upper.x), upper.y + 0.08 * extent, upper.z - 0.05 * extent);
        let target = Vec3::new(0.5 * (lower.x + upper.x), lower.y, 0.6 * lower.z + 0.4 * upper.z);
        let forward = (target - eye).normalize();
        let right = forward.cross(Vec3::Y).normalize();
        let up = right.cross(forward);
        let mut rays = Self { primary: Vec::new(), shadow: Vec::new(), incoherent: Vec::new() };
        let mut random = Random(1);
        for y in 0..size {
            for x in 0..size {
                let at = |i: u32| (2 * i + 1) as f32 / size as f32 - 1.0;
                let direction = (forward + 0.6 * (at(x) * right - at(y) * up)).normalize();
                let ray = Ray::new(eye, direction);
                rays.primary.push(ray);
                let Some(hit) = scene.closest_hit(&ray, |h| super::accepts(h.render_node, h.triangle)) else {
                    continue;
                };
                let [a, b, c] = scene.triangle_positions(hit.render_node, hit.triangle);
                let row = &scene.render_nodes[hit.render_node as usize];
                let normal = row.inverse.transpose_transform_vector((b - a).cross(c - a)).normalize();
                let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
                let point = ray.origin + hit.t * direction + normal * 1e-3;
                let light = Vec3::new(
                    lower.x + random.next() * (upper.x - lower.x),
                    upper.y + 0.5 * extent,
                    lower.z + random.next() * (upper.z - lower.z),
                );
                let (direction, distance) = (light - point).normalize_and_length();
                rays.shadow.push(Ray { origin: point, direction, t_min: 0.0, t_max: distance });
                let direction = (normal + random.unit()).normalize_or(normal);
                rays.incoherent.push(Ray::new(point, direction));
            }
        }
        rays
    }
}

/// PCG, for the scene and the rays.
pub struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    pub fn next(&mut self) -> f32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081);
        ((word >> 43) ^ word) as u32 as f32 / 4_294_967_808.0
    }

    /// Uniform on the unit sphere.
    pub fn unit(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let (sin, cos) = (std::f32::consts::TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }
}
