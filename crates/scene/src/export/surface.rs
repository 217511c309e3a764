//! The vertices of a primitive as a format of plain triangles wants them.

use super::placed::Pose;
use crate::Scene;
use crate::accessor::{self, AccessorError};
use crate::model::*;
use glam::{DAffine3, DMat3, DVec3};

/// The vertices and elements of a primitive.
pub struct Surface {
    pub positions: Vec<[f32; 3]>,
    /// Unit vectors, or zero where the file's have no direction.
    pub normals: Option<Vec<[f32; 3]>>,
    /// `TEXCOORD_0`: v runs down, as in glTF.
    pub texcoords: Option<Vec<[f32; 2]>>,
    /// `COLOR_0`, linear.
    pub colors: Option<Vec<[f32; 4]>>,
    /// As the primitive has them; without an accessor, all vertices in order.
    pub indices: Vec<u32>,
}

impl Surface {
    /// Reads a primitive that has positions. Attributes whose count is another than that of the positions are left out.
    pub fn read(scene: &Scene, primitive: &Primitive, positions: AccessorId) -> Result<Self, AccessorError> {
        let positions = accessor::read_f32::<3>(scene, positions)?;
        let count = positions.len();
        let mut indices = Vec::new();
        match primitive.indices {
            Some(id) => accessor::read_vertex_indices_into(scene, id, count, &mut indices)?,
            None => indices.extend(0..count as u32),
        }
        let attribute = |semantic: &str| primitive.attributes.get(semantic);
        let normals = attribute("NORMAL").map(|id| accessor::read_f32::<3>(scene, id)).transpose()?;
        let texcoords = attribute("TEXCOORD_0").map(|id| accessor::read_f32::<2>(scene, id)).transpose()?;
        let colors = attribute("COLOR_0").map(|id| accessor::read_colors(scene, id)).transpose()?;
        Ok(Self {
            positions,
            normals: normals.filter(|values| values.len() == count),
            texcoords: texcoords.filter(|values| values.len() == count),
            colors: colors.filter(|values| values.len() == count),
            indices,
        })
    }

    /// Deforms the vertices: morph targets, then the skin (glTF 2.0, sections 3.7.2.2 and 3.7.3.3). A skin puts them into
    /// the world. Influences of joints that the skin does not have are left out.
    pub fn deform(&mut self, scene: &Scene, primitive: &Primitive, pose: &Pose) -> Result<(), AccessorError> {
        for (target, &weight) in primitive.targets.iter().zip(&pose.weights) {
            if weight == 0.0 {
                continue;
            }
            for (semantic, values) in [("POSITION", Some(&mut self.positions)), ("NORMAL", self.normals.as_mut())] {
                let (Some(id), Some(values)) = (target.get(semantic), values) else { continue };
                for (value, delta) in values.iter_mut().zip(accessor::read_f32::<3>(scene, id)?) {
                    for c in 0..3 {
                        value[c] += weight as f32 * delta[c];
                    }
                }
            }
        }
        if pose.joints.is_empty() {
            return Ok(());
        }
        let mut influences = Vec::new();
        for set in 0.. {
            let attribute = |name: &str| primitive.attributes.get(&format!("{name}_{set}"));
            let (Some(joints), Some(weights)) = (attribute("JOINTS"), attribute("WEIGHTS")) else { break };
            influences.push((accessor::read_joints(scene, joints)?, accessor::read_f32::<4>(scene, weights)?));
        }
        for v in 0..self.positions.len() {
            let (mut matrix, mut translation, mut sum) = (DMat3::ZERO, DVec3::ZERO, 0.0);
            for (joints, weights) in &influences {
                let (Some(joints), Some(weights)) = (joints.get(v), weights.get(v)) else { continue };
                for (&joint, &weight) in joints.iter().zip(weights) {
                    if let Some(joint) = pose.joints.get(usize::from(joint)).filter(|_| weight != 0.0) {
                        let weight = f64::from(weight);
                        matrix += joint.matrix3 * weight;
                        translation += joint.translation * weight;
                        sum += weight;
                    }
                }
            }
            // Weights must add up to 1; files round them, and some leave them off.
            let map = if sum > 0.0 {
                DAffine3::from_mat3_translation(matrix * (1.0 / sum), translation / sum)
            } else {
                DAffine3::IDENTITY
            };
            self.map_vertex(v, &map, cofactor(map.matrix3));
        }
        Ok(())
    }

    /// Maps all vertices: points by the map, normals by its inverse transpose.
    pub fn transform(&mut self, map: &DAffine3) {
        if *map == DAffine3::IDENTITY {
            return;
        }
        let normals = cofactor(map.matrix3);
        (0..self.positions.len()).for_each(|v| self.map_vertex(v, map, normals));
    }

    fn map_vertex(&mut self, v: usize, map: &DAffine3, normal_map: DMat3) {
        let point = |p: [f32; 3]| glam::Vec3::from(p).as_dvec3();
        self.positions[v] = map.transform_point3(point(self.positions[v])).as_vec3().to_array();
        if let Some(normals) = &mut self.normals {
            normals[v] = (normal_map * point(normals[v])).normalize_or_zero().as_vec3().to_array();
        }
    }
}

/// The inverse transpose but for a positive factor; it exists for singular matrices too.
fn cofactor(m: DMat3) -> DMat3 {
    let cofactor = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    if m.determinant() < 0.0 { -cofactor } else { cofactor }
}

/// Whether a primitive has triangles.
pub fn is_surface(mode: PrimitiveMode) -> bool {
    matches!(mode, PrimitiveMode::Triangles | PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan)
}

/// Strips and fans as triangles (glTF 2.0, section 3.7.2.1); an incomplete triangle at the end is dropped.
pub fn triangles(mode: PrimitiveMode, mut indices: Vec<u32>) -> Vec<u32> {
    match mode {
        PrimitiveMode::TriangleStrip => indices
            .windows(3)
            .enumerate()
            .flat_map(|(i, w)| if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[0], w[2], w[1]] })
            .collect(),
        PrimitiveMode::TriangleFan => {
            let Some((&first, rest)) = indices.split_first() else { return Vec::new() };
            rest.windows(2).flat_map(|w| [w[0], w[1], first]).collect()
        }
        _ => {
            indices.truncate(indices.len() / 3 * 3);
            indices
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_winding() {
        assert_eq!(triangles(PrimitiveMode::TriangleStrip, vec![0, 1, 2, 3]), [0, 1, 2, 1, 3, 2]);
        assert_eq!(triangles(PrimitiveMode::TriangleFan, vec![0, 1, 2, 3]), [1, 2, 0, 2, 3, 0]);
        assert_eq!(triangles(PrimitiveMode::Triangles, vec![0, 1, 2, 3]), [0, 1, 2]);
    }

    #[test]
    fn normals_stay_perpendicular_under_any_map() {
        let tilted = [[1.0f32, 0.0, -1.0], [0.0, 1.0, 0.0]];
        for scale in [DVec3::new(3.0, 1.0, 1.0), DVec3::new(-3.0, 1.0, 2.0), DVec3::new(-1.0, -1.0, -1.0)] {
            let mut surface = Surface {
                positions: tilted.to_vec(),
                normals: Some(vec![[0.70710677, 0.0, 0.70710677]; 2]),
                texcoords: None,
                colors: None,
                indices: Vec::new(),
            };
            let map = DAffine3::from_scale(scale);
            surface.transform(&map);
            let normal = glam::Vec3::from(surface.normals.unwrap()[0]);
            assert!(normal.is_normalized());
            assert!(surface.positions.iter().all(|&p| normal.dot(p.into()).abs() < 1e-6));
            // The side that the normal shows is the side that the surface had it on.
            let outside = map.transform_vector3(DVec3::new(1.0, 0.0, 1.0)).as_vec3();
            assert!(normal.dot(outside) > 0.0, "{scale}");
        }
    }
}
