//! Views: cameras of the document, cameras given by hand, and framing of a whole scene.

use crate::derived::DerivedScene;
use glam::{DAffine3, DMat3, DVec3};
use orthant_resident::Camera;
use orthant_resident::camera::Projection;
use orthant_scene::Scene;
use orthant_scene::animation::Posed;
use orthant_scene::model::{CameraId, CameraProjection};

/// A camera in the document's world, in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Centre of the lens, in metres.
    pub eye: DVec3,
    /// Right, up and backward (the camera looks along the negative third axis), orthonormal.
    pub axes: DMat3,
    /// The projection.
    pub projection: Projection,
    /// Radius of the lens in metres; 0 is a pinhole.
    pub lens_radius: f64,
    /// Distance of the plane in focus, in metres.
    pub focus_distance: f64,
    /// Nothing nearer is seen, in metres.
    pub near: f64,
    /// Nothing farther is seen, in metres.
    pub far: f64,
}

/// Vertical field of view of a framed scene, in radians: a 50 mm lens on a 35 mm film has 27 degrees, a phone about 50.
const FRAMING_FOV: f64 = 35.0 * std::f64::consts::PI / 180.0;

impl View {
    /// Looks from `eye` at `target`. `up` need only not be parallel to that; `fov_y` is the vertical field of view in
    /// radians.
    ///
    /// Returns `None` where eye and target coincide, or a coordinate is not finite.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3, fov_y: f64) -> Option<Self> {
        let backward = (eye - target).try_normalize()?;
        let right = up.cross(backward).try_normalize().unwrap_or_else(|| backward.any_orthonormal_vector());
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        let projection = Projection::Perspective { tan_half_fov_y: (fov_y * 0.5).tan() as f32 };
        Some(Self::pinhole(eye, axes, projection, (eye - target).length()))
    }

    fn pinhole(eye: DVec3, axes: DMat3, projection: Projection, focus_distance: f64) -> Self {
        Self { eye, axes, projection, lens_radius: 0.0, focus_distance, near: 0.0, far: f64::INFINITY }
    }

    /// A camera of the document, at the first node that the scene shows with it, for a picture of an aspect (width over
    /// height; what is seen of a CRTS camera depends on it); `None` where no node shows it.
    pub fn of_camera(scene: &Scene, derived: &DerivedScene, id: CameraId, aspect: f64) -> Option<Self> {
        scene.cameras().get(id)?;
        let camera = Posed::new(scene, &derived.pose).camera(id);
        let node = derived.hierarchy.nodes.iter().find(|n| n.is_used() && scene.nodes()[n.node].camera == Some(id))?;
        let DAffine3 { matrix3, translation } = node.world;
        let backward = matrix3.z_axis.try_normalize()?;
        // A camera's node may be scaled or sheared; what counts is where it looks and what is up there.
        let right = matrix3.y_axis.cross(backward).try_normalize()?;
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        let (projection, near, far) = match camera.projection {
            CameraProjection::Perspective { yfov, znear, zfar, .. } => {
                let tan_half_fov_y = (camera.vertical_fov(aspect).unwrap_or(yfov) * 0.5).tan() as f32;
                (Projection::Perspective { tan_half_fov_y }, znear, zfar.unwrap_or(f64::INFINITY))
            }
            CameraProjection::Orthographic { ymag, znear, zfar, .. } => {
                (Projection::Orthographic { half_height: ymag.abs() as f32 }, znear, zfar)
            }
        };
        let focus_distance = derived.bounds().map_or(1.0, |(lo, hi)| ((lo + hi) * 0.5 - translation).dot(-backward));
        let focus_distance = if focus_distance > 0.0 { focus_distance } else { 1.0 };
        Some(Self { near, far, ..Self::pinhole(translation, axes, projection, focus_distance) })
    }

    /// The first camera of the document that the scene shows; `aspect` as for [`Self::of_camera`].
    pub fn first_camera(scene: &Scene, derived: &DerivedScene, aspect: f64) -> Option<Self> {
        scene.cameras().ids().find_map(|id| Self::of_camera(scene, derived, id, aspect))
    }

    /// Sees a whole box from the front, a little from the right and above (a glTF model faces +Z). `aspect` is width
    /// over height. The box's eight corners touch the frame with a margin of 5 %.
    pub fn framing((lo, hi): (DVec3, DVec3), aspect: f64) -> Self {
        let centre = (lo + hi) * 0.5;
        let backward = DVec3::new(0.45, 0.35, 1.0).normalize();
        let right = DVec3::Y.cross(backward).normalize();
        let axes = DMat3::from_cols(right, backward.cross(right), backward);
        let tan_y = (FRAMING_FOV * 0.5).tan();
        let tan_x = tan_y * aspect;
        let mut distance = 0.0f64;
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lo[axis] } else { hi[axis] };
            let p = axes.transpose() * (DVec3::new(pick(0), pick(1), pick(2)) - centre);
            distance = distance.max(p.z + 1.05 * (p.x.abs() / tan_x).max(p.y.abs() / tan_y));
        }
        // A scene of one point has no size; any distance does.
        let distance = if distance > 0.0 { distance } else { 1.0 };
        let projection = Projection::Perspective { tan_half_fov_y: tan_y as f32 };
        Self::pinhole(centre + backward * distance, axes, projection, distance)
    }

    /// As plain data, relative to the origin of a derived scene.
    pub fn to_camera(&self, origin: DVec3) -> Camera {
        let axis = |v: DVec3| v.as_vec3().to_array();
        Camera {
            position: axis(self.eye - origin),
            right: axis(self.axes.x_axis),
            up: axis(self.axes.y_axis),
            forward: axis(-self.axes.z_axis),
            projection: self.projection,
            lens_radius: self.lens_radius as f32,
            focus_distance: self.focus_distance as f32,
            near: self.near as f32,
            far: self.far as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_framed_box_lies_inside_the_frame_and_touches_it() {
        for aspect in [0.5, 1.0, 16.0 / 9.0] {
            let bounds = (DVec3::new(-3.0, 0.0, 10.0), DVec3::new(5.0, 1.0, 12.0));
            let view = View::framing(bounds, aspect);
            let Projection::Perspective { tan_half_fov_y } = view.projection else { panic!("perspective") };
            let mut largest = 0.0f64;
            for corner in 0..8 {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { bounds.0[axis] } else { bounds.1[axis] };
                let p = view.axes.transpose() * (DVec3::new(pick(0), pick(1), pick(2)) - view.eye);
                let y = p.y / -p.z / f64::from(tan_half_fov_y);
                let x = p.x / -p.z / (f64::from(tan_half_fov_y) * aspect);
                largest = largest.max(x.abs()).max(y.abs());
            }
            assert!((0.93..=0.96).contains(&largest), "{largest}");
        }
    }

    #[test]
    fn looking_straight_down_has_a_right_and_an_up() {
        let view = View::look_at(DVec3::Y * 5.0, DVec3::ZERO, DVec3::Y, 1.0).expect("a direction");
        assert!((view.axes.determinant() - 1.0).abs() < 1e-12);
        assert_eq!(View::look_at(DVec3::ONE, DVec3::ONE, DVec3::Y, 1.0), None);
    }
}
