//! From indices to ids. The scene is new, so the id of the n-th object of a kind is known before it is there, and objects
//! may refer to others that come later.

use super::Result;
use crate::Scene;
use crate::import::ImportFault;
use crate::import::gltf::Fault;
use crate::import::gltf::schema::{Int, Root};
use crate::import::warning::{WarningKind, Warnings};
use crate::model::*;
use crate::place::At;
use crate::visit::{self, VisitorMut};

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

/// Finds the indices inside extensions that are kept as JSON, and makes sure that no index of the document, wherever it
/// is, leads nowhere: the visitor knows them all.
pub fn connect(scene: &mut Scene, warnings: &mut Warnings) -> Result<()> {
    let counts: Vec<usize> = Kind::ALL.iter().map(|&kind| scene.count(kind)).collect();
    connect_to(scene, &|kind| counts[kind as usize], warnings)
}

/// [`connect`], where what is referred to is elsewhere: `bounds` says how many objects of a kind there are.
pub fn connect_to(scene: &mut Scene, bounds: &dyn Fn(Kind) -> usize, warnings: &mut Warnings) -> Result<()> {
    let count = Kind::ALL.iter().map(|&kind| bounds(kind)).collect();
    let mut connect = Connect { count, warnings, fault: None };
    visit::visit_mut(scene, &mut connect);
    connect.fault.map_or(Ok(()), Err)
}

struct Connect<'w> {
    /// By [`Kind`].
    count: Vec<usize>,
    warnings: &'w mut Warnings,
    fault: Option<Fault>,
}

impl VisitorMut for Connect<'_> {
    fn slot<K: Id>(&mut self, id: &mut K, at: &At<'_>) {
        let id: AnyId = (*id).into();
        let (kind, index) = (id.kind(), id.slot());
        let count = self.count[kind as usize];
        if index >= count && self.fault.is_none() {
            self.fault = Some((at.place(), ImportFault::Index { kind: kind.name(), index: index as u64, count }));
        }
    }

    fn extra(&mut self, extra: &mut Extra, at: &At<'_>) {
        let Self { count, warnings, .. } = self;
        visit::connect(
            extra,
            at,
            |kind| count[kind as usize],
            |at| warnings.push(WarningKind::Tolerated("an extension refers to what is not there"), || at.place()),
        );
        visit::links_mut(self, extra, at);
    }

    fn parent(&mut self, _: &mut NodeId) {}
}
