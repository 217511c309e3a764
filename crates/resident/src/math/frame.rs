use glam::Vec3;

/// Three orthonormal vectors; `n` is the local z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrthonormalFrame {
    /// Local x.
    pub t: Vec3,
    /// Local y.
    pub b: Vec3,
    /// Local z.
    pub n: Vec3,
}

impl OrthonormalFrame {
    /// A frame about a unit vector (Duff et al. 2017, "Building an Orthonormal Basis, Revisited").
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = if n.z < 0.0 { -1.0 } else { 1.0 };
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            t: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            b: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// World to local.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.t), v.dot(self.b), v.dot(self.n))
    }

    /// Local to world.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.t * v.x + self.b * v.y + self.n * v.z
    }
}

/// Normalises `v`, or gives `fallback` where its length is zero or not finite.
#[inline]
pub fn safe_normalize(v: Vec3, fallback: Vec3) -> Vec3 {
    let l2 = v.dot(v);
    if l2 > 0.0 && l2 < f32::INFINITY {
        return v / l2.sqrt();
    }
    // The square may have under- or overflowed although the vector is sound.
    let m = v.abs().max_element();
    if !(m > 0.0 && m < f32::INFINITY) {
        return fallback;
    }
    let s = v / m;
    s / s.dot(s).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_orthonormal_and_right_handed() {
        for n in [Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, Vec3::new(1e-8, 0.0, -1.0), Vec3::new(0.6, -0.48, 0.64)] {
            let f = OrthonormalFrame::from_normal(n);
            assert!(f.t.cross(f.b).distance(n) < 1e-6, "{n}");
            assert!(f.t.dot(f.b).abs() < 1e-6 && f.t.dot(n).abs() < 1e-6);
            let v = Vec3::new(0.1, -0.7, 0.3);
            assert!(f.to_world(f.to_local(v)).distance(v) < 1e-6);
        }
    }

    #[test]
    fn tiny_and_huge_vectors_are_normalised() {
        for s in [1e-30, 1e-12, 1.0, 1e25] {
            let v = safe_normalize(Vec3::new(3.0, 0.0, 4.0) * s, Vec3::Y);
            assert!(v.distance(Vec3::new(0.6, 0.0, 0.8)) < 1e-6, "{s}");
        }
        assert_eq!(safe_normalize(Vec3::ZERO, Vec3::Y), Vec3::Y);
        assert_eq!(safe_normalize(Vec3::NAN, Vec3::Y), Vec3::Y);
    }
}
