//! From indices to ids. The scene is new, so the id of the n-th object of a kind is known before it is there, and objects
//! may refer to others that come later.

use super::Result;
use crate::import::ImportFault;
use crate::import::gltf::place::At;
use crate::import::gltf::schema::{Int, Root};
use crate::model::*;

/// How many objects of each kind the document has.
#[derive(Clone, Copy, Default)]
pub struct Counts {
    pub scenes: usize,
    pub nodes: usize,
    pub meshes: usize,
    pub materials: usize,
    pub textures: usize,
    pub images: usize,
    pub samplers: usize,
    pub accessors: usize,
    pub buffer_views: usize,
    pub buffers: usize,
    pub skins: usize,
    pub cameras: usize,
    /// Set from KHR_lights_punctual.
    pub lights: usize,
    /// Set from KHR_materials_variants.
    pub variants: usize,
}

impl Counts {
    pub fn of(root: &Root<'_>) -> Self {
        Self {
            scenes: root.scenes.len(),
            nodes: root.nodes.len(),
            meshes: root.meshes.len(),
            materials: root.materials.len(),
            textures: root.textures.len(),
            images: root.images.len(),
            samplers: root.samplers.len(),
            accessors: root.accessors.len(),
            buffer_views: root.buffer_views.len(),
            buffers: root.buffers.len(),
            skins: root.skins.len(),
            cameras: root.cameras.len(),
            lights: 0,
            variants: 0,
        }
    }
}

macro_rules! references {
    ($($method:ident: $field:ident => $id:ty, $kind:literal;)*) => {
        impl Counts {
            $(pub fn $method(&self, index: Int, at: &At<'_>) -> Result<$id> {
                match usize::try_from(index.0) {
                    Ok(i) if i < self.$field => Ok(Store::<$id, ()>::nth_id(i)),
                    _ => Err((
                        at.place(),
                        ImportFault::Index { kind: $kind, index: index.0, count: self.$field },
                    )),
                }
            })*
        }
    };
}

references! {
    scene: scenes => SceneId, "scene";
    node: nodes => NodeId, "node";
    mesh: meshes => MeshId, "mesh";
    material: materials => MaterialId, "material";
    texture: textures => TextureId, "texture";
    image: images => ImageId, "image";
    sampler: samplers => SamplerId, "sampler";
    accessor: accessors => AccessorId, "accessor";
    buffer_view: buffer_views => BufferViewId, "buffer view";
    buffer: buffers => BufferId, "buffer";
    skin: skins => SkinId, "skin";
    camera: cameras => CameraId, "camera";
    light: lights => LightId, "light";
    variant: variants => VariantId, "variant";
}
