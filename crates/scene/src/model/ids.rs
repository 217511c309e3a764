use super::{Scene, Store};
use slotmap::Key;

macro_rules! ids {
    ($($(#[$doc:meta])* $kind:ident: $id:ident in $store:ident, $array:literal, $name:literal;)*) => {
        slotmap::new_key_type! {
            $($(#[$doc])* pub struct $id;)*
        }

        /// A kind of object that has ids.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Kind {
            $($(#[$doc])* $kind,)*
        }

        impl Kind {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// In words.
            pub fn name(self) -> &'static str {
                match self { $(Self::$kind => $name,)* }
            }

            /// Where the document lists its objects: a JSON pointer.
            pub fn array(self) -> &'static str {
                match self { $(Self::$kind => $array,)* }
            }
        }

        /// The id of an object of any kind.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        pub enum AnyId {
            $($(#[$doc])* $kind($id),)*
        }

        impl AnyId {
            /// The kind of the object.
            pub fn kind(self) -> Kind {
                match self { $(Self::$kind(_) => Kind::$kind,)* }
            }

            /// The slot of the id: after loading one file, its index in the file.
            pub fn slot(self) -> usize {
                match self { $(Self::$kind(id) => Store::<$id, ()>::slot(id),)* }
            }

            /// The id of object number `index` of a new scene.
            pub(crate) fn nth(kind: Kind, index: usize) -> Self {
                match kind { $(Kind::$kind => Self::$kind(Store::<$id, ()>::nth_id(index)),)* }
            }
        }

        impl Scene {
            /// Takes an object out of the document, or back in.
            pub(crate) fn set_parked(&mut self, id: AnyId, parked: bool) -> bool {
                match id { $(AnyId::$kind(id) => self.$store.set_parked(id, parked),)* }
            }

            /// Whether the object has been taken out of the document and may come back.
            pub(crate) fn is_parked(&self, id: AnyId) -> bool {
                match id {
                    $(AnyId::$kind(id) => self.$store.get(id).is_none() && self.$store.get_any(id).is_some(),)*
                }
            }

            /// Ends a parked object.
            pub(crate) fn purge(&mut self, id: AnyId) {
                match id { $(AnyId::$kind(id) => drop(self.$store.purge(id)),)* }
            }

            /// Objects of all kinds that are parked.
            pub fn parked_objects(&self) -> usize {
                let counts = [$(self.$store.parked()),*];
                counts.iter().sum()
            }

            /// Inserts copies of all objects of another document, parked. The answer gives each old id its new one; what the
            /// copies refer to is not changed.
            pub(crate) fn insert_parked_copies(&mut self, other: &Scene) -> Vec<(AnyId, AnyId)> {
                let mut ids = Vec::new();
                $(for (id, object) in other.$store.iter() {
                    let new = self.$store.insert_parked(object.clone());
                    ids.push((id.into(), new.into()));
                })*
                ids
            }

            /// The object of a kind that is in a slot: its index in the file that was loaded.
            pub fn id_in_slot(&self, kind: Kind, slot: usize) -> Option<AnyId> {
                match kind { $(Kind::$kind => self.$store.id_in_slot(slot).map(AnyId::$kind),)* }
            }

            /// One past the largest slot of a kind that was ever used.
            pub(crate) fn slot_bound(&self, kind: Kind) -> usize {
                match kind { $(Kind::$kind => self.$store.slot_bound(),)* }
            }

            /// How many objects of a kind there are.
            pub fn count(&self, kind: Kind) -> usize {
                match kind { $(Kind::$kind => self.$store.len(),)* }
            }

            /// Whether the object exists.
            pub fn contains(&self, id: impl Into<AnyId>) -> bool {
                match id.into() { $(AnyId::$kind(id) => self.$store.get(id).is_some(),)* }
            }

            /// The same objects under the ids that they would have if the scene had just been loaded. What refers to
            /// them is as before: it has to follow.
            pub(crate) fn restored(&self) -> Scene {
                let mut scene = self.clone();
                scene.editing = Default::default();
                $({
                    scene.$store = Store::default();
                    for (i, object) in self.$store.values().enumerate() {
                        scene.$store.insert_nth(i, object.clone());
                    }
                })*
                scene
            }

            /// The ids of all objects of a kind, in the order of the document.
            pub fn ids_of(&self, kind: Kind) -> Vec<AnyId> {
                match kind { $(Kind::$kind => self.$store.ids().map(AnyId::$kind).collect(),)* }
            }
        }

        $(impl $id {
            /// The id of no object: stale in every scene.
            pub const NULL: Self = Self(slotmap::KeyData::from_ffi((1 << 32) | u32::MAX as u64));
        }

        impl Id for $id {
            const KIND: Kind = Kind::$kind;

            fn from_any(id: AnyId) -> Option<Self> {
                match id {
                    AnyId::$kind(id) => Some(id),
                    _ => None,
                }
            }
        }

        impl From<$id> for AnyId {
            #[inline]
            fn from(id: $id) -> Self {
                Self::$kind(id)
            }
        })*
    };
}

/// An id of one kind.
pub trait Id: Key + Into<AnyId> {
    /// The kind.
    const KIND: Kind;

    /// The id, if it is of this kind.
    fn from_any(id: AnyId) -> Option<Self>;
}

ids! {
    /// A scene (set of roots).
    Scene: SceneId in scenes, "/scenes", "scene";
    /// A node.
    Node: NodeId in nodes, "/nodes", "node";
    /// A mesh.
    Mesh: MeshId in meshes, "/meshes", "mesh";
    /// A material.
    Material: MaterialId in materials, "/materials", "material";
    /// A texture.
    Texture: TextureId in textures, "/textures", "texture";
    /// An image.
    Image: ImageId in images, "/images", "image";
    /// A sampler.
    Sampler: SamplerId in samplers, "/samplers", "sampler";
    /// An accessor.
    Accessor: AccessorId in accessors, "/accessors", "accessor";
    /// A buffer view.
    BufferView: BufferViewId in buffer_views, "/bufferViews", "buffer view";
    /// A buffer.
    Buffer: BufferId in buffers, "/buffers", "buffer";
    /// A skin.
    Skin: SkinId in skins, "/skins", "skin";
    /// An animation.
    Animation: AnimationId in animations, "/animations", "animation";
    /// A camera.
    Camera: CameraId in cameras, "/cameras", "camera";
    /// A punctual light.
    Light: LightId in lights, "/extensions/KHR_lights_punctual/lights", "light";
    /// A material variant.
    Variant: VariantId in variants, "/extensions/KHR_materials_variants/variants", "variant";
    /// A packet of metadata.
    Packet: PacketId in packets, "/extensions/KHR_xmp_json_ld/packets", "metadata packet";
}
