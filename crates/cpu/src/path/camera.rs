//! From pixels to rays.

use super::cone::RayCone;
use crate::trace::Ray;
use glam::{Vec2, Vec3};
use orthant_resident::camera::Projection;
use orthant_resident::sampling::warp::sample_disc;
use orthant_resident::{Camera, Frame};

/// A camera with what all of its rays share.
#[derive(Clone, Copy, Debug)]
pub struct View {
    camera: Camera,
    width: f32,
    height: f32,
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
}

impl View {
    /// Prepares the camera of a frame.
    pub fn new(frame: &Frame) -> Self {
        let c = frame.camera;
        Self {
            camera: c,
            width: frame.width as f32,
            height: frame.height as f32,
            position: Vec3::from_array(c.position),
            right: Vec3::from_array(c.right),
            up: Vec3::from_array(c.up),
            forward: Vec3::from_array(c.forward),
        }
    }

    /// The camera of a frame at another place, with other vectors to the right, up and forward: that of a layer of a world.
    pub fn of_layer(frame: &Frame, position: Vec3, [right, up, forward]: [Vec3; 3]) -> Self {
        Self { position, right, up, forward, ..Self::new(frame) }
    }

    /// The ray through the film point `film` (in pixels from the upper left corner) and the point of the lens that `lens`
    /// in 0..1 squared selects, with its cone.
    #[inline]
    pub fn camera_ray(&self, film: Vec2, lens: Vec2) -> (Ray, RayCone) {
        let sx = (2.0 * film.x / self.width - 1.0) * (self.width / self.height);
        let sy = 1.0 - 2.0 * film.y / self.height;
        // Direction with a component of 1 along the forward axis, so that depths are ray parameters.
        let (mut origin, mut along, cone) = match self.camera.projection {
            Projection::Perspective { tan_half_fov_y } => {
                let along = self.forward + (self.right * sx + self.up * sy) * tan_half_fov_y;
                (self.position, along, RayCone { width: 0.0, spread: 2.0 * tan_half_fov_y / self.height })
            }
            Projection::Orthographic { half_height } => {
                let origin = self.position + (self.right * sx + self.up * sy) * half_height;
                (origin, self.forward, RayCone { width: 2.0 * half_height / self.height, spread: 0.0 })
            }
        };
        if self.camera.lens_radius > 0.0 {
            let focus = origin + along * self.camera.focus_distance;
            let d = sample_disc(lens) * self.camera.lens_radius;
            origin += self.right * d.x + self.up * d.y;
            along = (focus - origin) / self.camera.focus_distance;
        }
        let length = along.length();
        let ray = Ray {
            origin,
            direction: along / length,
            t_min: self.camera.near * length,
            t_max: self.camera.far * length,
        };
        (ray, cone)
    }

    /// Distance of a point along the forward axis.
    #[inline]
    pub fn depth(&self, p: Vec3) -> f32 {
        (p - self.position).dot(self.forward)
    }
}
