//! The document: what a glTF 2.0 file says, with stable ids in place of indices.
//!
//! Names and meanings are those of the glTF 2.0 specification. Everything that a file holds and Orthant does not know
//! (extras, unknown extensions) is kept for export.

mod animation;
mod blob;
mod children;
mod extra;
mod geometry;
mod ids;
mod lobes;
mod material;
mod node;
pub(crate) mod size;
mod specular_glossiness;
mod store;
mod texture;

pub use animation::*;
pub use blob::Blob;
pub use children::Children;
pub use extra::*;
pub use geometry::*;
pub use ids::*;
pub use material::*;
pub use node::*;
pub use specular_glossiness::{MetallicRoughness, SpecularGlossiness, metallic_roughness};
pub use store::Store;
pub use texture::*;

use serde_json::Value;

/// glTF `asset`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asset {
    /// `version`, if it is another than 2.0.
    pub version: Option<String>,
    /// `generator`.
    pub generator: Option<String>,
    /// `copyright`.
    pub copyright: Option<String>,
    /// `minVersion`.
    pub min_version: Option<String>,
    /// The rest.
    pub extra: Extra,
}

/// A glTF `scene`: a set of root nodes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneRoots {
    /// `name`.
    pub name: Option<String>,
    /// Root nodes in order.
    pub roots: Children,
    /// The rest.
    pub extra: Extra,
}

/// KHR_xmp_json_ld: a packet of metadata.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packet(pub Value);

/// The authoritative model scene.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    pub(crate) asset: Asset,
    pub(crate) default_scene: Option<SceneId>,
    pub(crate) scenes: Store<SceneId, SceneRoots>,
    pub(crate) nodes: Store<NodeId, Node>,
    pub(crate) meshes: Store<MeshId, Mesh>,
    pub(crate) materials: Store<MaterialId, Material>,
    pub(crate) textures: Store<TextureId, Texture>,
    pub(crate) images: Store<ImageId, Image>,
    pub(crate) samplers: Store<SamplerId, Sampler>,
    pub(crate) accessors: Store<AccessorId, Accessor>,
    pub(crate) buffer_views: Store<BufferViewId, BufferView>,
    pub(crate) buffers: Store<BufferId, Buffer>,
    pub(crate) skins: Store<SkinId, Skin>,
    pub(crate) animations: Store<AnimationId, Animation>,
    pub(crate) cameras: Store<CameraId, Camera>,
    pub(crate) lights: Store<LightId, Light>,
    pub(crate) variants: Store<VariantId, Variant>,
    pub(crate) packets: Store<PacketId, Packet>,
    pub(crate) extensions_used: Vec<String>,
    pub(crate) extensions_required: Vec<String>,
    /// Those of `extensions_used` that the file declares although nothing in it shows a use: export keeps them.
    pub(crate) extensions_declared_only: Vec<String>,
    pub(crate) extra: Extra,
    /// The material variant to show. It is edited and undone like the rest, and not part of a glTF document.
    pub(crate) shown_variant: Option<VariantId>,
    /// What edits need besides the document.
    pub(crate) editing: crate::edit::Editing,
}

macro_rules! getters {
    ($($(#[$doc:meta])* $name:ident: $id:ty => $value:ty;)*) => {
        impl Scene {
            $($(#[$doc])* pub fn $name(&self) -> &Store<$id, $value> { &self.$name })*
        }
    };
}

getters! {
    /// All scenes (sets of roots).
    scenes: SceneId => SceneRoots;
    /// All nodes.
    nodes: NodeId => Node;
    /// All meshes.
    meshes: MeshId => Mesh;
    /// All materials.
    materials: MaterialId => Material;
    /// All textures.
    textures: TextureId => Texture;
    /// All images.
    images: ImageId => Image;
    /// All samplers.
    samplers: SamplerId => Sampler;
    /// All accessors.
    accessors: AccessorId => Accessor;
    /// All buffer views.
    buffer_views: BufferViewId => BufferView;
    /// All buffers.
    buffers: BufferId => Buffer;
    /// All skins.
    skins: SkinId => Skin;
    /// All animations.
    animations: AnimationId => Animation;
    /// All cameras.
    cameras: CameraId => Camera;
    /// All punctual lights.
    lights: LightId => Light;
    /// All material variants.
    variants: VariantId => Variant;
    /// All packets of metadata.
    packets: PacketId => Packet;
}

impl Scene {
    /// glTF `asset`.
    pub fn asset(&self) -> &Asset {
        &self.asset
    }

    /// The scene to show: glTF `scene`, if the file names one.
    pub fn default_scene(&self) -> Option<SceneId> {
        self.default_scene
    }

    /// The material variant to show, if one has been selected.
    pub fn shown_variant(&self) -> Option<VariantId> {
        self.shown_variant
    }

    /// The material that a primitive shows: that of the variant which is shown, if it has one of its own for that.
    pub fn shown_material(&self, primitive: &Primitive) -> Option<MaterialId> {
        let shown = self.shown_variant;
        let mapped = shown.and_then(|v| primitive.variants.iter().find(|mapping| mapping.variants.contains(&v)));
        mapped.map_or(primitive.material, |mapping| Some(mapping.material))
    }

    /// `extensionsUsed`, in file order.
    pub fn extensions_used(&self) -> &[String] {
        &self.extensions_used
    }

    /// `extensionsRequired`, in file order.
    pub fn extensions_required(&self) -> &[String] {
        &self.extensions_required
    }

    /// The bytes of a buffer view, or `None` if the view is stale or does not lie in its buffer (which import refuses).
    pub fn view_bytes(&self, id: BufferViewId) -> Option<&[u8]> {
        let view = self.buffer_views.get(id)?;
        let buffer = self.buffers.get(view.buffer)?;
        buffer.data.get(view.offset..view.offset.checked_add(view.length)?)
    }

    /// [`Scene::view_bytes`] as a shared part of the buffer: nothing is copied.
    pub fn view_blob(&self, id: BufferViewId) -> Option<Blob> {
        let view = self.buffer_views.get(id)?;
        let buffer = self.buffers.get(view.buffer)?;
        buffer.data.slice(view.offset..view.offset.checked_add(view.length)?)
    }

    /// The name of an object; `None` if it has none, or its kind has none.
    pub fn name_of(&self, id: AnyId) -> Option<&str> {
        match id {
            AnyId::Scene(id) => self.scenes.get(id)?.name.as_deref(),
            AnyId::Node(id) => self.nodes.get(id)?.name.as_deref(),
            AnyId::Mesh(id) => self.meshes.get(id)?.name.as_deref(),
            AnyId::Material(id) => self.materials.get(id)?.name.as_deref(),
            AnyId::Texture(id) => self.textures.get(id)?.name.as_deref(),
            AnyId::Image(id) => self.images.get(id)?.name.as_deref(),
            AnyId::Sampler(id) => self.samplers.get(id)?.name.as_deref(),
            AnyId::Accessor(id) => self.accessors.get(id)?.name.as_deref(),
            AnyId::BufferView(id) => self.buffer_views.get(id)?.name.as_deref(),
            AnyId::Buffer(id) => self.buffers.get(id)?.name.as_deref(),
            AnyId::Skin(id) => self.skins.get(id)?.name.as_deref(),
            AnyId::Animation(id) => self.animations.get(id)?.name.as_deref(),
            AnyId::Camera(id) => self.cameras.get(id)?.name.as_deref(),
            AnyId::Light(id) => self.lights.get(id)?.name.as_deref(),
            AnyId::Variant(id) => Some(&self.variants.get(id)?.name),
            AnyId::Packet(_) => None,
        }
    }

    /// What the document itself carries besides what is modelled.
    pub fn extra(&self) -> &Extra {
        &self.extra
    }
}
