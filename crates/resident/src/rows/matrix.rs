use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, Vec3};

/// An affine transform as three rows of four floats: row `i` is `[m_i0, m_i1, m_i2, t_i]`.
///
/// A point `p` maps to `rows[i][0] * p.x + rows[i][1] * p.y + rows[i][2] * p.z + rows[i][3]`. It is the layout of
/// `VkTransformMatrixKHR` and the only matrix layout that is resident.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Mat3x4 {
    /// The rows.
    pub rows: [[f32; 4]; 3],
}

impl Mat3x4 {
    /// The identity.
    pub const IDENTITY: Self = Self { rows: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]] };

    /// Rounds an `f64` affine transform to rows of `f32`.
    #[inline]
    pub fn from_affine(m: &DAffine3) -> Self {
        let (x, y, z, t) = (m.matrix3.x_axis, m.matrix3.y_axis, m.matrix3.z_axis, m.translation);
        Self {
            rows: [
                [x.x as f32, y.x as f32, z.x as f32, t.x as f32],
                [x.y as f32, y.y as f32, z.y as f32, t.y as f32],
                [x.z as f32, y.z as f32, z.z as f32, t.z as f32],
            ],
        }
    }

    /// In `f64`.
    pub fn to_affine(&self) -> DAffine3 {
        let [x, y, z] = self.rows.map(|row| row.map(f64::from));
        DAffine3::from_cols_array_2d(&[[x[0], y[0], z[0]], [x[1], y[1], z[1]], [x[2], y[2], z[2]], [x[3], y[3], z[3]]])
    }

    /// Maps a point.
    #[inline]
    pub fn transform_point(&self, p: Vec3) -> Vec3 {
        let r = &self.rows;
        Vec3::new(
            r[0][0] * p.x + r[0][1] * p.y + r[0][2] * p.z + r[0][3],
            r[1][0] * p.x + r[1][1] * p.y + r[1][2] * p.z + r[1][3],
            r[2][0] * p.x + r[2][1] * p.y + r[2][2] * p.z + r[2][3],
        )
    }

    /// Maps a direction (the translation is left out; the length changes with the scale).
    #[inline]
    pub fn transform_vector(&self, v: Vec3) -> Vec3 {
        let r = &self.rows;
        Vec3::new(
            r[0][0] * v.x + r[0][1] * v.y + r[0][2] * v.z,
            r[1][0] * v.x + r[1][1] * v.y + r[1][2] * v.z,
            r[2][0] * v.x + r[2][1] * v.y + r[2][2] * v.z,
        )
    }

    /// Multiplies a vector by the transpose of the 3x3 part. Called on the *inverse* matrix of an instance it maps an
    /// object-space normal to world space (not normalised).
    #[inline]
    pub fn transpose_transform_vector(&self, v: Vec3) -> Vec3 {
        let r = &self.rows;
        Vec3::new(
            r[0][0] * v.x + r[1][0] * v.y + r[2][0] * v.z,
            r[0][1] * v.x + r[1][1] * v.y + r[2][1] * v.z,
            r[0][2] * v.x + r[1][2] * v.y + r[2][2] * v.z,
        )
    }

    /// Determinant of the 3x3 part: negative when the transform mirrors.
    #[inline]
    pub fn determinant(&self) -> f32 {
        let r = &self.rows;
        let row = |i: usize| Vec3::new(r[i][0], r[i][1], r[i][2]);
        row(0).dot(row(1).cross(row(2)))
    }
}
