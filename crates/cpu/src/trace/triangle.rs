//! The ray-triangle test: Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection".
//!
//! The signs of the three edge functions are those of neighbouring triangles with the order of the corners reversed, so
//! a ray that leaves one triangle through an edge enters the other: no crack, and no fused multiply-add anywhere in
//! here, which would break that.

use super::object_ray::ObjectRay;

/// A hit in object space.
pub(super) struct TriangleHit {
    pub t: f32,
    pub b1: f32,
    pub b2: f32,
    pub back_face: bool,
}

/// Whether any ray can hit it: the corners are finite, and it has an area.
pub(crate) fn is_traceable(corners: [&[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let edge = |p: [f64; 3], q: [f64; 3]| [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
    let (u, v) = (edge(a, b), edge(a, c));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    corners.iter().all(|p| p.iter().all(|x| x.is_finite())) && normal != [0.0; 3]
}

/// Tests one triangle against the line of the ray; the caller compares `t` with its range.
///
/// The test does not look at `t`'s range, but `t` is clamped to the parameters at which the ray is inside the
/// triangle's own box, computed as for the boxes of the tree ([`super::boxes`]). Those grow with the box, so that no box
/// around this triangle is ever judged to begin behind `t` or to end before it: leaving out such boxes is exact.
#[inline(always)]
pub(super) fn intersect(ray: &ObjectRay, corners: [&[f32; 3]; 3], cull_back_faces: bool) -> Option<TriangleHit> {
    let [x, y, z] = ray.axes;
    let o = [ray.origin[x], ray.origin[y], ray.origin[z]];
    let local = |p: &[f32; 3]| {
        let pz = p[z] - o[2];
        (p[x] - o[0] - ray.shear[0] * pz, p[y] - o[1] - ray.shear[1] * pz, pz)
    };
    let (ax, ay, az) = local(corners[0]);
    let (bx, by, bz) = local(corners[1]);
    let (cx, cy, cz) = local(corners[2]);

    let mut u = cx * by - cy * bx;
    let mut v = ax * cy - ay * cx;
    let mut w = bx * ay - by * ax;
    if u == 0.0 || v == 0.0 || w == 0.0 {
        let cross = |ax: f32, ay: f32, bx: f32, by: f32| {
            // Products of two f32 are exact in f64, so that the sign of the difference is.
            (f64::from(ax) * f64::from(by) - f64::from(ay) * f64::from(bx)) as f32
        };
        u = cross(cx, cy, bx, by);
        v = cross(ax, ay, cx, cy);
        w = cross(bx, by, ax, ay);
    }
    let negative = u < 0.0 || v < 0.0 || w < 0.0;
    if negative && (cull_back_faces || u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let determinant = u + v + w;
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let t = ray.shear[2] * (u * az + v * bz + w * cz) * inverse;
    if !(t.is_finite() && inverse.is_finite() && determinant.is_finite()) {
        return intersect_extreme(ray, corners, cull_back_faces);
    }
    Some(within_box(ray, corners, t, v * inverse, w * inverse, negative))
}

/// The same test in `f64`, for coordinates whose products leave the range of `f32`.
#[cold]
fn intersect_extreme(ray: &ObjectRay, corners: [&[f32; 3]; 3], cull_back_faces: bool) -> Option<TriangleHit> {
    let [x, y, z] = ray.axes;
    let direction = |k: usize| f64::from(ray.direction[k]);
    let local = corners.map(|p| {
        let at = |k: usize| f64::from(p[k]) - f64::from(ray.origin[k]);
        let t = at(z) / direction(z);
        [at(x) - t * direction(x), at(y) - t * direction(y), t]
    });
    let edge = |p: [f64; 3], q: [f64; 3]| p[0] * q[1] - p[1] * q[0];
    let [a, b, c] = local;
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let negative = u < 0.0 || v < 0.0 || w < 0.0;
    let determinant = u + v + w;
    if (negative && (cull_back_faces || u > 0.0 || v > 0.0 || w > 0.0)) || determinant == 0.0 || determinant.is_nan() {
        return None;
    }
    let t = (u * a[2] + v * b[2] + w * c[2]) / determinant;
    Some(within_box(ray, corners, t as f32, (v / determinant) as f32, (w / determinant) as f32, negative))
}

#[inline(always)]
fn within_box(ray: &ObjectRay, corners: [&[f32; 3]; 3], t: f32, b1: f32, b2: f32, back_face: bool) -> TriangleHit {
    let (t_enter, t_leave) = ray.boxes.interval(corners);
    let t = if t > t_enter { t.min(t_leave.max(t_enter)) } else { t_enter };
    TriangleHit { t, b1, b2, back_face }
}
