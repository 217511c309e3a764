use super::{AccessorId, CameraId, Children, Extra, LightId, MeshId, NodeId, SkinId};
use glam::{DAffine3, DMat4, DQuat, DVec3, DVec4};
use serde::{Deserialize, Serialize};

/// A node's local transform, as the file has it: parent from node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Transform {
    /// Translation, rotation and scale: `T * R * S`.
    Trs {
        /// Metres.
        translation: [f64; 3],
        /// Quaternion, x y z w, as the file has it: [`Transform::to_affine`] normalises it.
        rotation: [f64; 4],
        /// Factors.
        scale: [f64; 3],
    },
    /// A column-major 4x4 matrix whose last row is (0, 0, 0, 1). Boxed, because few nodes of long documents have one.
    Matrix(Box<[f64; 16]>),
}

impl Default for Transform {
    fn default() -> Self {
        Self::Trs { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] }
    }
}

impl Transform {
    /// As an affine map. A rotation of length zero is none.
    pub fn to_affine(&self) -> DAffine3 {
        match self {
            Self::Trs { translation, rotation, scale } => {
                let rotation = DVec4::from_array(*rotation).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4);
                DAffine3::from_scale_rotation_translation(
                    DVec3::from_array(*scale),
                    rotation,
                    DVec3::from_array(*translation),
                )
            }
            Self::Matrix(m) => DAffine3::from_mat4(DMat4::from_cols_array(m)),
        }
    }
}

/// EXT_mesh_gpu_instancing: the node's mesh appears once per element. Each instance's transform is applied before the
/// node's own (`world * instance`).
#[derive(Clone, Debug, PartialEq)]
pub struct Instancing {
    /// `TRANSLATION` (VEC3).
    pub translation: Option<AccessorId>,
    /// `ROTATION` (VEC4, float or normalised).
    pub rotation: Option<AccessorId>,
    /// `SCALE` (VEC3).
    pub scale: Option<AccessorId>,
    /// Other attributes, such as `_ID`.
    pub custom: Vec<(String, AccessorId)>,
    /// The rest.
    pub extra: Extra,
}

/// A node of the hierarchy.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Node {
    /// `name`.
    pub name: Option<String>,
    /// The parent; `None` for a root or a node that no scene shows.
    pub parent: Option<NodeId>,
    /// The children.
    pub children: Children,
    /// Parent from node.
    pub transform: Transform,
    /// What it shows.
    pub mesh: Option<MeshId>,
    /// What deforms the mesh. Then the node's own transform does not place it.
    pub skin: Option<SkinId>,
    /// A camera here, looking along -Z with +Y up.
    pub camera: Option<CameraId>,
    /// A light here, shining along -Z.
    pub light: Option<LightId>,
    /// Morph weights that replace the mesh's default ones.
    pub weights: Option<Vec<f64>>,
    /// KHR_node_visibility: whether it and its descendants are shown. `None` where the extension is absent.
    pub visible: Option<bool>,
    /// EXT_mesh_gpu_instancing.
    pub instancing: Option<Box<Instancing>>,
    /// The rest.
    pub extra: Extra,
}

/// A skin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// `name`.
    pub name: Option<String>,
    /// Joints in the order that `JOINTS_n` refers to.
    pub joints: Vec<NodeId>,
    /// One MAT4 per joint; identities if absent.
    pub inverse_bind_matrices: Option<AccessorId>,
    /// `skeleton`.
    pub skeleton: Option<NodeId>,
    /// The rest.
    pub extra: Extra,
}

/// A camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// `name`.
    pub name: Option<String>,
    /// The projection.
    pub projection: CameraProjection,
    /// The rest.
    pub extra: Extra,
}

impl Camera {
    /// The vertical field of view, in radians, of a picture of an aspect (width over height). A camera of a CRTS file has a
    /// sensor that is fitted to the larger side of the picture: there the angle depends on the aspect. `None` for an
    /// orthographic camera.
    pub fn vertical_fov(&self, aspect: f64) -> Option<f64> {
        match &self.projection {
            CameraProjection::Orthographic { .. } => None,
            CameraProjection::Perspective { yfov, .. } => {
                let is_fitted = crate::import::crts::written_fov_y(self).is_some() && aspect > 0.0;
                let factor = if is_fitted { crate::import::crts::fit(aspect) } else { 1.0 };
                Some(2.0 * ((0.5 * yfov).tan() * factor).atan())
            }
        }
    }
}

/// A camera's projection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum CameraProjection {
    /// `perspective`.
    Perspective {
        /// Width over height.
        aspect_ratio: Option<f64>,
        /// Vertical field of view in radians.
        yfov: f64,
        /// Metres.
        znear: f64,
        /// Metres; `None` is infinite.
        zfar: Option<f64>,
        /// The rest of the `perspective` object.
        extra: Extra,
    },
    /// `orthographic`.
    Orthographic {
        /// Half the width in metres.
        xmag: f64,
        /// Half the height in metres.
        ymag: f64,
        /// Metres.
        znear: f64,
        /// Metres.
        zfar: f64,
        /// The rest of the `orthographic` object.
        extra: Extra,
    },
}

/// KHR_lights_punctual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// `name`.
    pub name: Option<String>,
    /// Linear colour.
    pub color: [f64; 3],
    /// Candela (point, spot) or lux (directional).
    pub intensity: f64,
    /// Metres; `None` is infinite.
    pub range: Option<f64>,
    /// The kind.
    pub kind: LightKind,
    /// The rest of the `spot` object.
    pub spot_extra: Extra,
    /// The rest.
    pub extra: Extra,
}

/// The kind of a punctual light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// `directional`.
    Directional,
    /// `point`.
    Point,
    /// `spot`.
    Spot {
        /// Radians from the axis at which the light begins to fall off.
        inner_cone_angle: f64,
        /// Radians from the axis at which it is zero.
        outer_cone_angle: f64,
    },
}
