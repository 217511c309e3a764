//! The JSON document. Members that have a default are written if the file that was loaded states them or if they differ
//! from it; nothing that is derived is written.

mod geometry;
mod materials;
mod nodes;
mod textures;

use super::buffers::Packed;
use super::images::Plan;
use super::indices::Indices;
use crate::Scene;
use crate::export::ExportFault;
use crate::export::json::{Json, Object};
use crate::model::*;
use crate::visit::{declared_extensions, write_index};
use serde_json::Value;

/// What the document is written from.
pub struct Document<'a> {
    pub scene: &'a Scene,
    pub indices: &'a Indices,
    pub packed: &'a Packed,
    pub images: &'a Plan,
    /// The URI of the one buffer; without it, the buffer is the BIN chunk.
    pub buffer_uri: Option<&'a str>,
}

/// The members of an extension that the model types.
type Typed<'t> = (&'static str, &'t dyn Fn(&mut Object<'_>));

impl Document<'_> {
    /// The JSON text.
    pub fn write(&self) -> Result<Vec<u8>, ExportFault> {
        let mut json = Json::default();
        json.object(|o| self.root(o));
        json.finish().map_err(ExportFault::NotFinite)
    }

    /// The JSON text of one material, light or camera; nothing for other kinds, and for what does not exist.
    pub fn object(&self, id: AnyId) -> Result<Vec<u8>, ExportFault> {
        let mut json = Json::default();
        let scene = self.scene;
        json.object(|o| match id {
            AnyId::Material(id) => scene.materials.get(id).into_iter().for_each(|x| self.material(o, x)),
            AnyId::Light(id) => scene.lights.get(id).into_iter().for_each(|x| self.light(o, x)),
            AnyId::Camera(id) => scene.cameras.get(id).into_iter().for_each(|x| self.camera(o, x)),
            _ => {}
        });
        json.finish().map_err(ExportFault::NotFinite)
    }

    fn root(&self, o: &mut Object<'_>) {
        let scene = self.scene;
        o.object("asset", |o| {
            let asset = &scene.asset;
            o.string("version", asset.version.as_deref().unwrap_or("2.0"));
            o.optional_string("minVersion", &asset.min_version);
            o.optional_string("generator", &asset.generator);
            o.optional_string("copyright", &asset.copyright);
            self.rest(o, &asset.extra);
        });
        let (used, required) = declared_extensions(scene);
        for (key, names) in [("extensionsUsed", used), ("extensionsRequired", required)] {
            if !names.is_empty() {
                o.array(key, names, |json, name| json.serialize(&name));
            }
        }
        if let Some(id) = scene.default_scene {
            o.integer("scene", self.indices.of(id));
        }
        o.lines("scenes", scene.scenes.values(), |o, x| self.scene_roots(o, x));
        o.lines("nodes", scene.nodes.values(), |o, x| self.node(o, x));
        o.lines("meshes", scene.meshes.values(), |o, x| self.mesh(o, x));
        o.lines("materials", scene.materials.values(), |o, x| self.material(o, x));
        o.lines("textures", scene.textures.values(), |o, x| self.texture(o, x));
        o.lines("images", scene.images.values().enumerate(), |o, (i, x)| self.image(o, i, x));
        o.lines("samplers", scene.samplers.values(), |o, x| self.sampler(o, x));
        o.lines("skins", scene.skins.values(), |o, x| self.skin(o, x));
        o.lines("animations", scene.animations.values(), |o, x| self.animation(o, x));
        o.lines("cameras", scene.cameras.values(), |o, x| self.camera(o, x));
        o.lines("accessors", scene.accessors.values(), |o, x| self.accessor(o, x));
        self.buffer_views(o);
        self.buffers(o);

        let lights = |o: &mut Object<'_>| o.lines("lights", scene.lights.values(), |o, x| self.light(o, x));
        let variants = |o: &mut Object<'_>| {
            o.lines("variants", scene.variants.values(), |o, x| {
                o.string("name", &x.name);
                self.rest(o, &x.extra);
            });
        };
        let packets = |o: &mut Object<'_>| {
            o.array("packets", scene.packets.values(), |json, Packet(packet)| json.serialize(packet));
        };
        let typed: [(bool, Typed<'_>); 3] = [
            (!scene.lights.is_empty(), ("KHR_lights_punctual", &lights)),
            (!scene.variants.is_empty(), ("KHR_materials_variants", &variants)),
            (!scene.packets.is_empty(), ("KHR_xmp_json_ld", &packets)),
        ];
        self.rest_with(o, &scene.extra, typed.into_iter().filter_map(|(has, typed)| has.then_some(typed)));
    }

    /// What an object carries besides what is modelled.
    fn rest(&self, o: &mut Object<'_>, extra: &Extra) {
        self.rest_with(o, extra, []);
    }

    /// [`Document::rest`], with extensions that are modelled. What such an extension carries besides goes into the same
    /// object.
    fn rest_with<'t>(&self, o: &mut Object<'_>, extra: &Extra, typed: impl IntoIterator<Item = Typed<'t>>) {
        if let Some(other) = &extra.other {
            o.values(&other.members);
        }
        let typed: Vec<Typed<'t>> = typed.into_iter().collect();
        let kept = extra.extensions.as_deref();
        if kept.is_some() || !typed.is_empty() {
            o.object("extensions", |o| {
                for (name, fill) in &typed {
                    o.object(name, |o| {
                        fill(o);
                        if let Some(Value::Object(members)) = kept.and_then(|kept| kept.get(*name)) {
                            o.values(members);
                        }
                    });
                }
                for (name, value) in kept.into_iter().flatten() {
                    if !typed.iter().any(|(typed, _)| typed == name) {
                        self.kept(o, name, value, extra.links());
                    }
                }
            });
        }
        if let Some(extras) = &extra.extras {
            o.value("extras", extras);
        }
    }

    /// An extension that is kept as JSON, its indices written anew.
    fn kept(&self, o: &mut Object<'_>, name: &str, value: &Value, links: &[Link]) {
        let inside = |link: &Link| {
            let rest = link.path.strip_prefix('/')?.strip_prefix(&*escaped(name))?;
            (rest.is_empty() || rest.starts_with('/')).then(|| rest.to_owned())
        };
        let mut links = links.iter().filter_map(|link| Some((inside(link)?, link.target))).peekable();
        if links.peek().is_none() {
            return o.value(name, value);
        }
        let mut value = value.clone();
        for (path, target) in links {
            let Some(slot) = value.pointer_mut(&path) else { continue };
            write_index(slot, target.kind(), self.indices.of_any(target));
        }
        o.value(name, &value);
    }

    /// An index, if there is one.
    fn index<K: Id>(&self, o: &mut Object<'_>, key: &str, id: Option<K>) {
        if let Some(id) = id {
            o.integer(key, self.indices.of(id));
        }
    }

    /// Indices, if there are any.
    fn indices<K: Id>(&self, o: &mut Object<'_>, key: &str, ids: impl ExactSizeIterator<Item = K>) {
        if ids.len() > 0 {
            o.array(key, ids, |json, id| json.serialize(&self.indices.of(id)));
        }
    }
}

/// A key as a JSON pointer has it.
fn escaped(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// A number that has a default.
fn number(o: &mut Object<'_>, stated: Stated, member: Member, value: f64, default: f64) {
    if value != default || stated.has(member) {
        o.number(member.name(), value);
    }
}

/// Numbers that have a default.
fn numbers<const N: usize>(o: &mut Object<'_>, stated: Stated, member: Member, value: &[f64; N], default: &[f64; N]) {
    if value != default || stated.has(member) {
        o.numbers(member.name(), value);
    }
}
