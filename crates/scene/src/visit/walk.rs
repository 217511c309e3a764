//! The walks: which member of which object is a slot. Written once; the macro makes the shared and the mutable form.

use super::{At, Visitor, VisitorMut};
use crate::Scene;
use crate::model::*;

macro_rules! walks {
    ($module:ident, $visitor:ident, [$($m:tt)?], $iter:ident, $values:ident, $any:ident, [$($by:tt)?]) => {
        mod $module {
            use super::*;

            walks!(@objects $visitor, [$($m)?], $values, $any;
                buffers Buffer buffer; buffer_views BufferView buffer_view; accessors Accessor accessor;
                samplers Sampler sampler; images Image image; textures Texture texture; materials Material material;
                meshes Mesh mesh; cameras Camera camera; lights Light light; variants Variant variant;
                packets Packet packet; skins Skin skin; nodes Node node; animations Animation animation;
                scenes Scene scene_roots;);

            /// What belongs to no object.
            pub fn root(scene: &$($m)? Scene, v: &mut impl $visitor) {
                let at = &At::Root;
                for (name, has) in [
                    ("KHR_lights_punctual", !scene.lights.is_empty()),
                    ("KHR_materials_variants", !scene.variants.is_empty()),
                    ("KHR_xmp_json_ld", !scene.packets.is_empty()),
                ] {
                    if has {
                        v.extension(name);
                    }
                }
                v.extra(&$($m)? scene.asset.extra, &at.key("asset"));
                optional(&$($m)? scene.default_scene, &at.key("scene"), v);
                v.extra(&$($m)? scene.extra, at);
            }

            fn optional<K: Id>(slot: &$($m)? Option<K>, at: &At<'_>, v: &mut impl $visitor) {
                if let Some(id) = slot {
                    v.slot($($by)? id, at);
                }
            }

            fn list<K: Id>(slots: &$($m)? [K], at: &At<'_>, v: &mut impl $visitor) {
                for (i, id) in slots.$iter().enumerate() {
                    v.slot($($by)? id, &at.index(i));
                }
            }

            fn attributes(slots: &$($m)? [(String, AccessorId)], at: &At<'_>, v: &mut impl $visitor) {
                for (semantic, id) in slots.$iter() {
                    v.slot($($by)? id, &at.key(semantic));
                }
            }

            fn buffer(o: &$($m)? Buffer, at: &At<'_>, v: &mut impl $visitor) {
                v.extra(&$($m)? o.extra, at);
            }

            fn buffer_view(o: &$($m)? BufferView, at: &At<'_>, v: &mut impl $visitor) {
                walks!(@slot v, [$($by)?] [$($m)?] o.buffer, &at.key("buffer"));
                v.extra(&$($m)? o.extra, at);
            }

            fn accessor(o: &$($m)? Accessor, at: &At<'_>, v: &mut impl $visitor) {
                optional(&$($m)? o.view, &at.key("bufferView"), v);
                if let Some(s) = &$($m)? o.sparse {
                    let at = &at.key("sparse");
                    let (indices, values) = (&at.key("indices"), &at.key("values"));
                    walks!(@slot v, [$($by)?] [$($m)?] s.indices_view, &indices.key("bufferView"));
                    v.extra(&$($m)? s.indices_extra, indices);
                    walks!(@slot v, [$($by)?] [$($m)?] s.values_view, &values.key("bufferView"));
                    v.extra(&$($m)? s.values_extra, values);
                    v.extra(&$($m)? s.extra, at);
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn sampler(o: &$($m)? Sampler, at: &At<'_>, v: &mut impl $visitor) {
                v.extra(&$($m)? o.extra, at);
            }

            fn image(o: &$($m)? Image, at: &At<'_>, v: &mut impl $visitor) {
                if let ImageSource::View(id) = &$($m)? o.source {
                    v.slot($($by)? id, &at.key("bufferView"));
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn texture(o: &$($m)? Texture, at: &At<'_>, v: &mut impl $visitor) {
                optional(&$($m)? o.source, &at.key("source"), v);
                let extensions = &at.key("extensions");
                let a = &$($m)? o.alternatives;
                for (name, id) in [
                    ("EXT_texture_webp", &$($m)? a.webp),
                    ("KHR_texture_basisu", &$($m)? a.basisu),
                    ("MSFT_texture_dds", &$($m)? a.dds),
                ] {
                    if id.is_some() {
                        v.extension(name);
                        optional(id, &extensions.key(name).key("source"), v);
                    }
                }
                optional(&$($m)? o.sampler, &at.key("sampler"), v);
                v.extra(&$($m)? o.extra, at);
            }

            fn texture_info(info: &$($m)? Option<TextureInfo>, at: &At<'_>, v: &mut impl $visitor) {
                let Some(o) = info else { return };
                walks!(@slot v, [$($by)?] [$($m)?] o.texture, &at.key("index"));
                if let Some(t) = &$($m)? o.transform {
                    v.extension("KHR_texture_transform");
                    v.extra(&$($m)? t.extra, &at.key("extensions").key("KHR_texture_transform"));
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn material(o: &$($m)? Material, at: &At<'_>, v: &mut impl $visitor) {
                let pbr = &at.key("pbrMetallicRoughness");
                texture_info(&$($m)? o.base_color_texture, &pbr.key("baseColorTexture"), v);
                texture_info(&$($m)? o.metallic_roughness_texture, &pbr.key("metallicRoughnessTexture"), v);
                v.extra(&$($m)? o.pbr_extra, pbr);
                texture_info(&$($m)? o.normal_texture, &at.key("normalTexture"), v);
                texture_info(&$($m)? o.occlusion_texture, &at.key("occlusionTexture"), v);
                texture_info(&$($m)? o.emissive_texture, &at.key("emissiveTexture"), v);
                lobes(o, at, v);
                v.extra(&$($m)? o.extra, at);
            }

            fn lobes(o: &$($m)? Material, at: &At<'_>, v: &mut impl $visitor) {
                for (name, has) in [
                    ("KHR_materials_unlit", o.unlit),
                    ("KHR_materials_emissive_strength", o.emissive_strength.is_some()),
                    ("KHR_materials_ior", o.ior.is_some()),
                    ("KHR_materials_dispersion", o.dispersion.is_some()),
                ] {
                    if has {
                        v.extension(name);
                    }
                }
                let extensions = &at.key("extensions");
                if let Some(e) = &$($m)? o.clearcoat {
                    let at = &extensions.key("KHR_materials_clearcoat");
                    v.extension("KHR_materials_clearcoat");
                    texture_info(&$($m)? e.texture, &at.key("clearcoatTexture"), v);
                    texture_info(&$($m)? e.roughness_texture, &at.key("clearcoatRoughnessTexture"), v);
                    texture_info(&$($m)? e.normal_texture, &at.key("clearcoatNormalTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.transmission {
                    let at = &extensions.key("KHR_materials_transmission");
                    v.extension("KHR_materials_transmission");
                    texture_info(&$($m)? e.texture, &at.key("transmissionTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.diffuse_transmission {
                    let at = &extensions.key("KHR_materials_diffuse_transmission");
                    v.extension("KHR_materials_diffuse_transmission");
                    texture_info(&$($m)? e.texture, &at.key("diffuseTransmissionTexture"), v);
                    texture_info(&$($m)? e.color_texture, &at.key("diffuseTransmissionColorTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.volume {
                    let at = &extensions.key("KHR_materials_volume");
                    v.extension("KHR_materials_volume");
                    texture_info(&$($m)? e.thickness_texture, &at.key("thicknessTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.specular {
                    let at = &extensions.key("KHR_materials_specular");
                    v.extension("KHR_materials_specular");
                    texture_info(&$($m)? e.texture, &at.key("specularTexture"), v);
                    texture_info(&$($m)? e.color_texture, &at.key("specularColorTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.sheen {
                    let at = &extensions.key("KHR_materials_sheen");
                    v.extension("KHR_materials_sheen");
                    texture_info(&$($m)? e.color_texture, &at.key("sheenColorTexture"), v);
                    texture_info(&$($m)? e.roughness_texture, &at.key("sheenRoughnessTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.iridescence {
                    let at = &extensions.key("KHR_materials_iridescence");
                    v.extension("KHR_materials_iridescence");
                    texture_info(&$($m)? e.texture, &at.key("iridescenceTexture"), v);
                    texture_info(&$($m)? e.thickness_texture, &at.key("iridescenceThicknessTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
                if let Some(e) = &$($m)? o.anisotropy {
                    let at = &extensions.key("KHR_materials_anisotropy");
                    v.extension("KHR_materials_anisotropy");
                    texture_info(&$($m)? e.texture, &at.key("anisotropyTexture"), v);
                    v.extra(&$($m)? e.extra, at);
                }
            }

            fn mesh(o: &$($m)? Mesh, at: &At<'_>, v: &mut impl $visitor) {
                let primitives_at = &at.key("primitives");
                for (i, p) in o.primitives.$iter().enumerate() {
                    primitive(p, &primitives_at.index(i), v);
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn primitive(o: &$($m)? Primitive, at: &At<'_>, v: &mut impl $visitor) {
                attributes(&$($m)? o.attributes.0, &at.key("attributes"), v);
                optional(&$($m)? o.indices, &at.key("indices"), v);
                optional(&$($m)? o.material, &at.key("material"), v);
                let targets_at = &at.key("targets");
                for (i, target) in o.targets.$iter().enumerate() {
                    attributes(&$($m)? target.0, &targets_at.index(i), v);
                }
                let mappings_at = &at.path("/extensions/KHR_materials_variants/mappings");
                for (i, mapping) in o.variants.$iter().enumerate() {
                    let at = &mappings_at.index(i);
                    v.extension("KHR_materials_variants");
                    walks!(@slot v, [$($by)?] [$($m)?] mapping.material, &at.key("material"));
                    list(&$($m)? mapping.variants, &at.key("variants"), v);
                    v.extra(&$($m)? mapping.extra, at);
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn camera(o: &$($m)? Camera, at: &At<'_>, v: &mut impl $visitor) {
                match &$($m)? o.projection {
                    CameraProjection::Perspective { extra, .. } => v.extra(extra, &at.key("perspective")),
                    CameraProjection::Orthographic { extra, .. } => v.extra(extra, &at.key("orthographic")),
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn light(o: &$($m)? Light, at: &At<'_>, v: &mut impl $visitor) {
                v.extra(&$($m)? o.spot_extra, &at.key("spot"));
                v.extra(&$($m)? o.extra, at);
            }

            fn variant(o: &$($m)? Variant, at: &At<'_>, v: &mut impl $visitor) {
                v.extra(&$($m)? o.extra, at);
            }

            /// A packet is metadata through and through.
            fn packet(_: &$($m)? Packet, _: &At<'_>, _: &mut impl $visitor) {}

            fn skin(o: &$($m)? Skin, at: &At<'_>, v: &mut impl $visitor) {
                optional(&$($m)? o.inverse_bind_matrices, &at.key("inverseBindMatrices"), v);
                optional(&$($m)? o.skeleton, &at.key("skeleton"), v);
                list(&$($m)? o.joints, &at.key("joints"), v);
                v.extra(&$($m)? o.extra, at);
            }

            fn node(o: &$($m)? Node, at: &At<'_>, v: &mut impl $visitor) {
                if let Some(id) = &$($m)? o.parent {
                    v.parent($($by)? id);
                }
                v.children(&$($m)? o.children, &at.key("children"));
                optional(&$($m)? o.mesh, &at.key("mesh"), v);
                optional(&$($m)? o.skin, &at.key("skin"), v);
                optional(&$($m)? o.camera, &at.key("camera"), v);
                if o.light.is_some() {
                    v.extension("KHR_lights_punctual");
                }
                if o.visible.is_some() {
                    v.extension("KHR_node_visibility");
                }
                optional(&$($m)? o.light, &at.path("/extensions/KHR_lights_punctual/light"), v);
                if let Some(e) = &$($m)? o.instancing {
                    let at = &at.path("/extensions/EXT_mesh_gpu_instancing");
                    v.extension("EXT_mesh_gpu_instancing");
                    let attributes_at = &at.key("attributes");
                    optional(&$($m)? e.translation, &attributes_at.key("TRANSLATION"), v);
                    optional(&$($m)? e.rotation, &attributes_at.key("ROTATION"), v);
                    optional(&$($m)? e.scale, &attributes_at.key("SCALE"), v);
                    attributes(&$($m)? e.custom, attributes_at, v);
                    v.extra(&$($m)? e.extra, at);
                }
                v.extra(&$($m)? o.extra, at);
            }

            pub fn animation(o: &$($m)? Animation, at: &At<'_>, v: &mut impl $visitor) {
                let (samplers_at, channels_at) = (&at.key("samplers"), &at.key("channels"));
                for (i, s) in o.samplers.$iter().enumerate() {
                    let at = &samplers_at.index(i);
                    walks!(@slot v, [$($by)?] [$($m)?] s.input, &at.key("input"));
                    walks!(@slot v, [$($by)?] [$($m)?] s.output, &at.key("output"));
                    v.extra(&$($m)? s.extra, at);
                }
                for (i, c) in o.channels.$iter().enumerate() {
                    let at = &channels_at.index(i);
                    let target_at = &at.key("target");
                    optional(&$($m)? c.node, &target_at.key("node"), v);
                    v.extra(&$($m)? c.target_extra, target_at);
                    v.extra(&$($m)? c.extra, at);
                }
                v.extra(&$($m)? o.extra, at);
            }

            fn scene_roots(o: &$($m)? SceneRoots, at: &At<'_>, v: &mut impl $visitor) {
                v.children(&$($m)? o.roots, &at.key("nodes"));
                v.extra(&$($m)? o.extra, at);
            }
        }
    };

    // A slot that is always filled: by value in the shared walk, by reference in the mutable one.
    (@slot $v:ident, [*] [] $slot:expr, $at:expr) => { $v.slot($slot, $at) };
    (@slot $v:ident, [] [mut] $slot:expr, $at:expr) => { $v.slot(&mut $slot, $at) };

    (@objects $visitor:ident, [$($m:tt)?], $values:ident, $any:ident; $($store:ident $kind:ident $walk:ident;)*) => {
        /// Every object of the document, in its order.
        pub fn document(scene: &$($m)? Scene, v: &mut impl $visitor) {
            root(scene, v);
            $({
                let array = &At::Root.path(Kind::$kind.array());
                for (i, o) in scene.$store.$values().enumerate() {
                    $walk(o, &array.index(i), v);
                }
            })*
        }

        /// One object, parked or not. Nothing, if it does not exist.
        pub fn object(scene: &$($m)? Scene, id: AnyId, v: &mut impl $visitor) {
            let array = At::Root.path(id.kind().array());
            let at = &array.index(id.slot());
            match id {
                $(AnyId::$kind(id) => if let Some(o) = scene.$store.$any(id) { $walk(o, at, v) },)*
            }
        }
    };
}

walks!(shared, Visitor, [], iter, values, get_any, [*]);
walks!(mutable, VisitorMut, [mut], iter_mut, values_mut, get_any_mut, []);

/// Shows every reference of the document to a visitor, in a fixed order.
pub fn visit(scene: &Scene, visitor: &mut impl Visitor) {
    shared::document(scene, visitor);
}

/// Shows the references of one object to a visitor. Places are those of a document in which its index is its slot.
pub fn visit_object(scene: &Scene, id: AnyId, visitor: &mut impl Visitor) {
    shared::object(scene, id, visitor);
}

/// [`visit_object`] for what belongs to the document as a whole.
pub(crate) fn visit_root(scene: &Scene, visitor: &mut impl Visitor) {
    shared::root(scene, visitor);
}

/// Shows the references of an animation, which need not be in the document, to a visitor.
pub(super) fn visit_animation(animation: &Animation, visitor: &mut impl Visitor) {
    shared::animation(animation, &At::Root, visitor);
}

/// Lets a visitor change every reference of the document. Only who keeps the document consistent may do this.
pub(crate) fn visit_mut(scene: &mut Scene, visitor: &mut impl VisitorMut) {
    mutable::document(scene, visitor);
}

/// Lets a visitor change the references of one object, which may be parked.
pub(crate) fn visit_object_mut(scene: &mut Scene, id: AnyId, visitor: &mut impl VisitorMut) {
    mutable::object(scene, id, visitor);
}
