//! The rays of the measurement.

use glam::Vec3;
use orthant_cpu::{Ray, ResidentScene};
use orthant_resident::Camera;
use orthant_resident::camera::Projection;

/// Three kinds of rays.
pub struct Rays {
    /// From the camera, in rows of pixels.
    pub primary: Vec<Ray>,
    /// From what those hit, to points above the scene.
    pub shadow: Vec<Ray>,
    /// From what those hit, in cosine-distributed directions.
    pub incoherent: Vec<Ray>,
}

/// The any-hit rule for what is not opaque: the same for every contender, and about as cheap as none.
pub fn accepts(node: u32, triangle: u32) -> bool {
    (node.wrapping_mul(0x9e37_79b9) ^ triangle.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 31 == 0
}

impl Rays {
    /// `size * size` primary rays; of the others, one where such a ray hits.
    pub fn new(scene: &ResidentScene, camera: &Camera, size: u32) -> Self {
        let bounds = scene.tlas.bounds();
        let (lower, upper) = (Vec3::from_array(bounds.lower), Vec3::from_array(bounds.upper));
        let extent = (upper - lower).max_element();
        let [eye, right, up, forward] =
            [camera.position, camera.right, camera.up, camera.forward].map(Vec3::from_array);
        let tan = match camera.projection {
            Projection::Perspective { tan_half_fov_y } => tan_half_fov_y,
            Projection::Orthographic { .. } => 0.5,
        };
        let mut rays = Self { primary: Vec::new(), shadow: Vec::new(), incoherent: Vec::new() };
        let mut random = Random(1);
        for y in 0..size {
            for x in 0..size {
                let at = |i: u32| (2 * i + 1) as f32 / size as f32 - 1.0;
                let direction = (forward + tan * (at(x) * right - at(y) * up)).normalize();
                let ray = Ray::new(eye, direction);
                rays.primary.push(ray);
                let Some(hit) = scene.closest_hit(&ray, |h| accepts(h.render_node, h.triangle)) else {
                    continue;
                };
                let [a, b, c] = scene.triangle_positions(hit.render_node, hit.triangle);
                let row = &scene.render_nodes[hit.render_node as usize];
                let normal = row.inverse.transpose_transform_vector((b - a).cross(c - a)).normalize();
                let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
                let point = ray.origin + hit.t * direction + normal * (1e-4 * extent);
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

/// PCG (O'Neill 2014).
struct Random(pub u64);

impl Random {
    /// Uniform in 0..1.
    fn next(&mut self) -> f32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081);
        ((word >> 43) ^ word) as u32 as f32 / 4_294_967_808.0
    }

    /// Uniform on the unit sphere.
    fn unit(&mut self) -> Vec3 {
        let z = 1.0 - 2.0 * self.next();
        let (sin, cos) = (std::f32::consts::TAU * self.next()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, z)
    }
}
