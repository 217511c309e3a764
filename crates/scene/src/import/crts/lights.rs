//! Quad lights: a node with an emissive quad, marked so that CRTS gets it back as a light.
//!
//! Whatever dialect a file has, the node's matrix is that of the newest one, which is also written: columns 0 and 1 are
//! the axes at length 1, column 2 is against the light, column 3 is the corner, and the quad spans `size` along the axes.

use super::images::{mark, orthant};
use super::schema::{self, LightEmits, LightOrigin};
use crate::model::*;
use glam::DVec3;
use serde_json::{Value, json};

/// The key of the mark, under `orthant` in the node's `extras`: `{ "color": [r, g, b], "energy", "size": [w, h] }`.
pub const QUAD_LIGHT: &str = "quad_light";

/// What a light object says besides its matrix. The radiance is `color * energy`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadLight {
    /// Linear.
    pub color: [f64; 3],
    pub energy: f64,
    /// Full lengths in metres along columns 0 and 1.
    pub size: [f64; 2],
}

impl QuadLight {
    /// The mark of a node.
    pub fn of_node(node: &Node) -> Option<Self> {
        let mark = mark(&node.extra, QUAD_LIGHT)?;
        let numbers = |key: &str| mark.get(key)?.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>();
        Some(Self {
            color: numbers("color")?.try_into().ok()?,
            energy: mark.get("energy")?.as_f64()?,
            size: numbers("size")?.try_into().ok()?,
        })
    }

    /// What the node carries.
    pub fn mark(&self) -> Extra {
        orthant(json!({ QUAD_LIGHT: { "color": self.color, "energy": self.energy, "size": self.size } }))
    }

    /// The quad's material: black but for its emission, which has the strength apart where it is over 1.
    pub fn material(&self) -> Material {
        let radiance = self.color.map(|c| (c * self.energy).max(0.0));
        let most = radiance.iter().copied().fold(0.0, f64::max);
        let strength = (most > 1.0).then_some(most);
        Material {
            base_color: [0.0, 0.0, 0.0, 1.0],
            metallic: 0.0,
            roughness: 1.0,
            emissive: radiance.map(|r| r / strength.unwrap_or(1.0)),
            emissive_strength: strength,
            ..Material::default()
        }
    }

    /// The corners of the quad, whose front looks along -Z.
    pub fn corners(&self) -> [[f32; 3]; 4] {
        let [w, h] = self.size.map(|s| s as f32);
        [[0.0, 0.0, 0.0], [0.0, h, 0.0], [w, h, 0.0], [w, 0.0, 0.0]]
    }
}

/// Two triangles of [`QuadLight::corners`].
pub const QUAD_INDICES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// How far an axis may be from length 1 to count as normalised.
const UNIT_TOLERANCE: f64 = 1e-6;

/// The frame of a light as it is written (see the module), and its size. `None` if the axes span no area.
pub fn frame(
    matrix: &[f64; 16],
    size: [f64; 2],
    origin: Option<LightOrigin>,
    emits: Option<LightEmits>,
) -> Option<([f64; 16], [f64; 2])> {
    let column = |c: usize| DVec3::from_slice(&matrix[4 * c..4 * c + 3]);
    let (x, y, z, position) = (column(0), column(1), column(2), column(3));
    let normal = x.cross(y);
    let is_mirrored = normal.dot(z) < 0.0;
    let (axis_x, axis_y, normal) = (x.try_normalize()?, y.try_normalize()?, normal.try_normalize()?);
    let origin = origin.unwrap_or(if is_mirrored { LightOrigin::Corner } else { LightOrigin::Center });
    let emits = emits.unwrap_or(if is_mirrored { LightEmits::Positive } else { LightEmits::Negative });
    // Against `normal` it shines along -column 2 of a right-handed matrix and +column 2 of a left-handed one.
    let against = (emits == LightEmits::Positive) == is_mirrored;

    let is_unit = |v: DVec3| (v.length() - 1.0).abs() <= UNIT_TOLERANCE;
    if origin == LightOrigin::Corner && against && !is_mirrored && is_unit(x) && is_unit(y) {
        return Some((*matrix, size));
    }
    let corner = match origin {
        LightOrigin::Corner => position,
        LightOrigin::Center => position - axis_x * (0.5 * size[0]) - axis_y * (0.5 * size[1]),
    };
    // Exchanged axes turn the normal.
    let (first, second, normal, size) =
        if against { (axis_x, axis_y, normal, size) } else { (axis_y, axis_x, -normal, [size[1], size[0]]) };
    // Values that the format can hold, so that they are read back as they are.
    let row = |v: DVec3, w: f64| [v.x, v.y, v.z, w].map(|c| f64::from(c as f32));
    let columns = [row(first, 0.0), row(second, 0.0), row(normal, 0.0), row(corner, 1.0)];
    columns.as_flattened().try_into().ok().map(|matrix| (matrix, size))
}

/// What a file of this format says about its lights.
pub fn written_dialect(header: &mut schema::Header) {
    header.crts_version = 2;
    header.light_origin = Some(LightOrigin::Corner);
    header.light_emits = Some(LightEmits::Negative);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns 0 to 2 with their lengths, and column 3.
    fn matrix(x: [f64; 3], y: [f64; 3], z: [f64; 3], p: [f64; 3]) -> [f64; 16] {
        let row = |v: [f64; 3], w: f64| [v[0], v[1], v[2], w];
        [row(x, 0.0), row(y, 0.0), row(z, 0.0), row(p, 1.0)].as_flattened().try_into().unwrap()
    }

    const SIZE: [f64; 2] = [4.0, 2.0];

    #[test]
    fn the_older_dialect_has_its_centre_in_column_3_and_shines_against_column_2() {
        let old = matrix([2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 1.0], [10.0, 10.0, 10.0]);
        let (frame, size) = frame(&old, SIZE, None, None).unwrap();
        assert_eq!(frame, matrix([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [8.0, 9.0, 10.0]));
        assert_eq!(size, SIZE);
    }

    #[test]
    fn the_newer_dialect_has_its_corner_in_column_3_and_shines_along_column_2() {
        let new = matrix([2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, -1.0], [10.0, 10.0, 10.0]);
        let (frame, size) = frame(&new, SIZE, None, None).unwrap();
        assert_eq!(frame, matrix([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [10.0, 10.0, 10.0]));
        assert_eq!(size, SIZE);
    }

    #[test]
    fn what_the_header_says_goes_before_the_determinant() {
        let right_handed = matrix([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [10.0, 10.0, 10.0]);
        let (corner, emits) = (Some(LightOrigin::Corner), Some(LightEmits::Negative));
        assert_eq!(frame(&right_handed, SIZE, corner, emits), Some((right_handed, SIZE)));
        // Shining along +Z, the same surface has its axes exchanged.
        let (turned, size) = frame(&right_handed, SIZE, corner, Some(LightEmits::Positive)).unwrap();
        assert_eq!(turned, matrix([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [10.0, 10.0, 10.0]));
        assert_eq!(size, [2.0, 4.0]);
    }

    #[test]
    fn a_frame_is_its_own_frame() {
        let skew = matrix([1.0, 2.0, 0.3], [-0.5, 0.25, 4.0], [0.1, 0.1, -1.0], [0.1, -7.3, 1e4]);
        let (first, size) = frame(&skew, SIZE, None, None).unwrap();
        let (corner, emits) = (Some(LightOrigin::Corner), Some(LightEmits::Negative));
        assert_eq!(frame(&first, size, corner, emits), Some((first, size)));
    }

    #[test]
    fn a_light_without_area_has_no_frame() {
        let flat = matrix([1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]);
        assert_eq!(frame(&flat, SIZE, None, None), None);
        assert_eq!(frame(&[0.0; 16], SIZE, None, None), None);
    }

    #[test]
    fn the_mark_gives_the_light_back() {
        let light = QuadLight { color: [0.1, 1.0, 0.5], energy: 20.0, size: [0.3, 2.0] };
        let node = Node { extra: light.mark(), ..Node::default() };
        assert_eq!(QuadLight::of_node(&node), Some(light));
        assert_eq!(QuadLight::of_node(&Node::default()), None);
        let material = light.material();
        assert_eq!((material.emissive, material.emissive_strength), ([0.1, 1.0, 0.5], Some(20.0)));
    }
}
