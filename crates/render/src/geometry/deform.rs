//! Morph targets and skins: the pose as vertices (glTF 2.0, sections 3.7.2.2 and 3.7.3.3).

use glam::{DAffine3, Mat3, Vec3};
use orthant_scene::Scene;
use orthant_scene::accessor;
use orthant_scene::model::Primitive;

/// The pose of one node: what its primitives are deformed by.
#[derive(Clone, Debug, Default)]
pub struct SkinPose {
    /// Morph weights; missing ones are 0.
    pub weights: Vec<f64>,
    /// For each joint, the frame in which vertices are stored from the mesh's space. Empty without a skin.
    pub joints: Vec<DAffine3>,
}

/// A morph target with its weight.
#[derive(Clone, Debug, Default)]
struct Target {
    weight: f32,
    positions: Option<Vec<[f32; 3]>>,
    normals: Option<Vec<[f32; 3]>>,
}

/// Four joints of every vertex, and how much each counts.
#[derive(Clone, Debug, Default)]
struct Influences {
    joints: Vec<[u16; 4]>,
    weights: Vec<[f32; 4]>,
}

/// What deforms the vertices of one primitive.
#[derive(Clone, Debug, Default)]
pub struct Deformation {
    /// Targets whose weight is not 0.
    targets: Vec<Target>,
    /// `JOINTS_n` and `WEIGHTS_n`, set by set.
    influences: Vec<Influences>,
    /// As in [`SkinPose::joints`], rounded.
    joints: Vec<(Mat3, Vec3)>,
}

impl Deformation {
    /// Reads the targets and influences of a primitive.
    pub fn read(scene: &Scene, primitive: &Primitive, pose: &SkinPose) -> Result<Self, String> {
        let vertices = primitive.attributes.get("POSITION").map_or(0, |id| scene.accessors()[id].count);
        let mut deformation = Self::default();
        for (i, target) in primitive.targets.iter().enumerate() {
            let weight = pose.weights.get(i).copied().unwrap_or(0.0) as f32;
            if weight == 0.0 {
                continue;
            }
            let deltas = |semantic: &str| -> Result<Option<Vec<[f32; 3]>>, String> {
                let Some(id) = target.get(semantic) else { return Ok(None) };
                let values = accessor::read_f32::<3>(scene, id).map_err(|e| e.to_string())?;
                same_count(values, vertices, &format!("{semantic} of morph target {i}")).map(Some)
            };
            let (positions, normals) = (deltas("POSITION")?, deltas("NORMAL")?);
            deformation.targets.push(Target { weight, positions, normals });
        }
        if !pose.joints.is_empty() {
            for set in 0.. {
                let (joints, weights) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
                let (Some(j), Some(w)) = (primitive.attributes.get(&joints), primitive.attributes.get(&weights)) else {
                    break;
                };
                let j = same_count(accessor::read_joints(scene, j).map_err(|e| e.to_string())?, vertices, &joints)?;
                let w = same_count(accessor::read_f32::<4>(scene, w).map_err(|e| e.to_string())?, vertices, &weights)?;
                for (joints, weights) in j.iter().zip(&w) {
                    for (joint, weight) in joints.iter().zip(weights) {
                        if *weight != 0.0 && usize::from(*joint) >= pose.joints.len() {
                            return Err(format!(
                                "a vertex names joint {joint}, but the skin has {} joints",
                                pose.joints.len()
                            ));
                        }
                    }
                }
                deformation.influences.push(Influences { joints: j, weights: w });
            }
            let round = |m: &DAffine3| (m.matrix3.as_mat3(), m.translation.as_vec3());
            deformation.joints = pose.joints.iter().map(round).collect();
        }
        Ok(deformation)
    }

    /// The weighted sum of a vertex's joint matrices; the identity where it has no weight.
    fn blend(&self, vertex: usize) -> (Mat3, Vec3) {
        let (mut m, mut t, mut sum) = (Mat3::ZERO, Vec3::ZERO, 0.0);
        for Influences { joints, weights } in &self.influences {
            for (&joint, &weight) in joints[vertex].iter().zip(&weights[vertex]) {
                if weight != 0.0 {
                    let (jm, jt) = self.joints[usize::from(joint)];
                    m += jm * weight;
                    t += jt * weight;
                    sum += weight;
                }
            }
        }
        // Weights must add up to 1 (section 3.7.3.3); files round them, and some leave them off.
        if sum > 0.0 { (m * (1.0 / sum), t / sum) } else { (Mat3::IDENTITY, Vec3::ZERO) }
    }
}

fn same_count<T>(values: Vec<T>, count: usize, name: &str) -> Result<Vec<T>, String> {
    if values.len() == count {
        Ok(values)
    } else {
        Err(format!("{name} has {} elements where POSITION has {count}", values.len()))
    }
}

/// Deforms positions and, where given, normals (which stay unnormalised).
pub(super) fn deform(
    positions: &[[f32; 3]],
    normals: Option<&[[f32; 3]]>,
    deformation: &Deformation,
) -> (Vec<[f32; 3]>, Option<Vec<[f32; 3]>>) {
    let mut positions = positions.to_vec();
    let mut normals = normals.map(<[_]>::to_vec);
    for target in &deformation.targets {
        add_weighted(&mut positions, target.positions.as_deref(), target.weight);
        if let Some(normals) = &mut normals {
            add_weighted(normals, target.normals.as_deref(), target.weight);
        }
    }
    if !deformation.joints.is_empty() && !deformation.influences.is_empty() {
        for (v, p) in positions.iter_mut().enumerate() {
            let (m, t) = deformation.blend(v);
            *p = (m * Vec3::from_array(*p) + t).to_array();
            if let Some(normals) = &mut normals {
                // The cofactor matrix maps normals as the inverse transpose does, and exists for singular matrices too.
                let cofactor =
                    Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
                normals[v] = (cofactor * Vec3::from_array(normals[v])).to_array();
            }
        }
    }
    (positions, normals)
}

fn add_weighted(values: &mut [[f32; 3]], deltas: Option<&[[f32; 3]]>, weight: f32) {
    for (value, delta) in values.iter_mut().zip(deltas.unwrap_or_default()) {
        for c in 0..3 {
            value[c] += weight * delta[c];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_vertex_between_two_joints_is_moved_by_both() {
        let deformation = Deformation {
            targets: vec![Target { weight: 0.5, positions: Some(vec![[2.0, 0.0, 0.0]]), normals: None }],
            influences: vec![Influences { joints: vec![[0, 1, 0, 0]], weights: vec![[0.25, 0.75, 0.0, 0.0]] }],
            joints: [DVec3::Y, DVec3::Z * 4.0].map(|t| (Mat3::IDENTITY, t.as_vec3())).to_vec(),
        };
        let (p, n) = deform(&[[1.0, 0.0, 0.0]], Some(&[[0.0, 1.0, 0.0]]), &deformation);
        assert_eq!(p, [[2.0, 0.25, 3.0]]);
        assert_eq!(n, Some(vec![[0.0, 1.0, 0.0]]));
    }

    #[test]
    fn weights_that_do_not_add_up_to_one_are_normalised() {
        let deformation = Deformation {
            targets: vec![],
            influences: vec![Influences { joints: vec![[0; 4]], weights: vec![[0.5, 0.0, 0.0, 0.0]] }],
            joints: vec![(Mat3::IDENTITY * 3.0, Vec3::ZERO)],
        };
        assert_eq!(deform(&[[1.0, 2.0, 3.0]], None, &deformation).0, [[3.0, 6.0, 9.0]]);
    }
}
