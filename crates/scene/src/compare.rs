//! Whether two scenes are the same document.

use crate::Scene;
use crate::export::{ExportOptions, gltf};
use crate::model::*;
use crate::place::At;
use crate::visit::{self, VisitorMut};
use serde_json::Value;
use std::borrow::Cow;
use std::fmt;

/// Where two documents differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The first place, as a JSON pointer in the terms of glTF.
    pub pointer: String,
    /// What is there in the one and in the other.
    pub what: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.pointer, self.what)
    }
}

impl Scene {
    /// Whether two scenes are the same document: the same objects in the same order, with the same names, values,
    /// references, extensions and extras, and the same bytes of images and views. How the bytes of views are spread over
    /// buffers does not count, and neither do ids.
    ///
    /// # Errors
    /// The first difference.
    pub fn same_document(&self, other: &Self) -> Result<(), Difference> {
        for &kind in Kind::ALL.iter().filter(|&&kind| kind != Kind::Buffer) {
            let (a, b) = (self.count(kind), other.count(kind));
            if a != b {
                return Err(Difference { pointer: kind.array().to_owned(), what: format!("{a} and {b} objects") });
            }
        }
        let (a, b) = (canonical(self), canonical(other));
        let (a, b) = (&*a, &*b);
        match first_difference(a, b) {
            None => Ok(()),
            Some(pointer) => Err(closer(a, b, pointer)),
        }
    }
}

/// The object that differs.
fn first_difference(a: &Scene, b: &Scene) -> Option<String> {
    let ids_of_extensions = visit::declared_extensions;
    let of_document = [
        ("/asset", a.asset == b.asset),
        ("/scene", a.default_scene == b.default_scene),
        ("/extensionsUsed", ids_of_extensions(a).0 == ids_of_extensions(b).0),
        ("/extensionsRequired", ids_of_extensions(a).1 == ids_of_extensions(b).1),
        ("", a.extra == b.extra),
    ];
    if let Some((pointer, _)) = of_document.into_iter().find(|(_, same)| !same) {
        return Some(pointer.to_owned());
    }
    macro_rules! stores {
        ($($kind:ident $store:ident;)*) => {
            $(if let Some(i) = a.$store.values().zip(b.$store.values()).position(|(a, b)| a != b) {
                return Some(format!("{}/{i}", Kind::$kind.array()));
            })*
        };
    }
    stores! {
        Scene scenes; Node nodes; Mesh meshes; Material materials; Texture textures; Image images; Sampler samplers;
        Accessor accessors; Skin skins; Animation animations; Camera cameras; Light lights; Variant variants;
        Packet packets;
    }
    let views = a.buffer_views.iter().zip(b.buffer_views.iter());
    let same_view = |((a_id, a_view), (b_id, b_view)): &((BufferViewId, &BufferView), (BufferViewId, &BufferView))| {
        let mut elsewhere = BufferView { buffer: a_view.buffer, offset: a_view.offset, ..(*b_view).clone() };
        // Whether an offset of zero is stated is a question of where the bytes are.
        elsewhere.extra.stated = a_view.extra.stated;
        **a_view == elsewhere && a.view_bytes(*a_id) == b.view_bytes(*b_id)
    };
    let i = views.map(|pair| same_view(&pair)).position(|same| !same)?;
    Some(format!("{}/{i}", Kind::BufferView.array()))
}

/// With ids by the order of the document.
fn canonical(scene: &Scene) -> Cow<'_, Scene> {
    struct Renumber(Vec<Vec<usize>>);
    impl VisitorMut for Renumber {
        fn slot<K: Id>(&mut self, id: &mut K, _: &At<'_>) {
            let old: AnyId = (*id).into();
            let known = self.0[K::KIND as usize].get(old.slot()).copied().filter(|&index| index != usize::MAX);
            // A reference that leads nowhere is another one than any that leads somewhere.
            *id = known.map_or_else(K::null, Store::<K, ()>::nth_id);
        }

        fn parent(&mut self, id: &mut NodeId) {
            self.slot(id, &At::Root);
        }

        /// The JSON of extensions has the indices of the file that was loaded; what it means is in the links.
        fn extra(&mut self, extra: &mut Extra, at: &At<'_>) {
            visit::links_mut(self, extra, at);
            let links = extra.links().to_vec();
            let Some(extensions) = extra.extensions.take() else { return };
            let mut value = Value::Object(*extensions);
            for link in links {
                if let Some(slot) = value.pointer_mut(&link.path) {
                    visit::write_index(slot, link.target.kind(), link.target.slot() as u64);
                }
            }
            if let Value::Object(extensions) = value {
                extra.extensions = Some(Box::new(extensions));
            }
        }
    }
    let is_canonical = Kind::ALL
        .iter()
        .all(|&kind| scene.ids_of(kind).into_iter().enumerate().all(|(index, id)| id == AnyId::nth(kind, index)));
    if is_canonical && scene.change_log().revision() == 0 {
        return Cow::Borrowed(scene);
    }
    let by_kind = Kind::ALL.iter().map(|&kind| {
        let ids = scene.ids_of(kind);
        let mut indices = vec![usize::MAX; ids.iter().map(|id| id.slot() + 1).max().unwrap_or(0)];
        ids.into_iter().enumerate().for_each(|(index, id)| indices[id.slot()] = index);
        indices
    });
    let mut renumber = Renumber(by_kind.collect());
    let mut restored = scene.restored();
    visit::visit_mut(&mut restored, &mut renumber);
    Cow::Owned(restored)
}

/// The member of an object that differs, if the written documents show one.
fn closer(a: &Scene, b: &Scene, pointer: String) -> Difference {
    let document = |scene| {
        let files = gltf::to_gltf(scene, "scene", &ExportOptions::default()).ok()?;
        serde_json::from_slice::<Value>(&files.document).ok()
    };
    let found = document(a).zip(document(b)).and_then(|(a, b)| {
        let mut found = pointer.clone();
        let (a, b) = descend(a.pointer(&pointer)?, b.pointer(&pointer)?, &mut found)?;
        Some(Difference { pointer: found, what: format!("{} and {}", short(a), short(b)) })
    });
    found.unwrap_or_else(|| Difference { pointer, what: "the data differ".to_owned() })
}

/// The first values that differ, and the pointer to them. Of absent members, null stands for what is not there.
fn descend<'v>(a: &'v Value, b: &'v Value, pointer: &mut String) -> Option<(&'v Value, &'v Value)> {
    let length = pointer.len();
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            let keys = a.keys().chain(b.keys().filter(|key| !a.contains_key(*key)));
            for key in keys.filter(|key| !["buffers", "buffer", "byteOffset"].contains(&key.as_str())) {
                crate::place::push_key(pointer, key);
                let (a, b) = (a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null));
                if let Some(found) = descend(a, b, pointer) {
                    return Some(found);
                }
                pointer.truncate(length);
            }
            None
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                pointer.push_str(&format!("/{i}"));
                if let Some(found) = descend(a, b, pointer) {
                    return Some(found);
                }
                pointer.truncate(length);
            }
            None
        }
        (a, b) => (a != b).then_some((a, b)),
    }
}

fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(60) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::every_slot_scene;

    fn difference(change: impl FnOnce(&mut Scene)) -> String {
        let (scene, mut changed) = (every_slot_scene(), every_slot_scene());
        change(&mut changed);
        let found = scene.same_document(&changed).unwrap_err();
        assert_eq!(found.pointer, changed.same_document(&scene).unwrap_err().pointer);
        found.to_string()
    }

    #[test]
    fn a_document_is_itself_whatever_its_ids() {
        let scene = every_slot_scene();
        scene.same_document(&scene).unwrap();
        // A slot that has been used before has another generation.
        let mut other = scene.clone();
        let mut moved = std::mem::take(&mut other.samplers);
        let old: Vec<(SamplerId, Sampler)> = moved.iter().map(|(id, sampler)| (id, sampler.clone())).collect();
        for (id, _) in &old {
            moved.remove(*id);
        }
        let mut map = Vec::new();
        for (id, sampler) in old.iter().rev() {
            map.push((*id, moved.insert(sampler.clone())));
        }
        other.samplers = moved;
        struct Map(Vec<(SamplerId, SamplerId)>);
        impl VisitorMut for Map {
            fn slot<K: Id>(&mut self, id: &mut K, _: &At<'_>) {
                let found = self.0.iter().find(|(old, _)| AnyId::from(*old) == (*id).into());
                if let Some((_, new)) = found {
                    *id = slotmap::KeyData::from_ffi(slotmap::Key::data(new).as_ffi()).into();
                }
            }
            fn parent(&mut self, _: &mut NodeId) {}
        }
        visit::visit_mut(&mut other, &mut Map(map));
        let ids = |scene: &Scene| scene.samplers.ids().collect::<Vec<_>>();
        assert_ne!(ids(&scene), ids(&other));
        scene.same_document(&other).unwrap();
    }

    #[test]
    fn the_first_difference_is_named() {
        let node = |scene: &Scene, i: usize| scene.nodes.ids().nth(i).unwrap();
        let rename = |scene: &mut Scene| {
            let id = node(scene, 2);
            scene.nodes.get_mut(id).unwrap().name = Some("other".to_owned());
        };
        assert_eq!(difference(rename), "/nodes/2/name: null and \"other\"");
        let unlink = |scene: &mut Scene| {
            let id = node(scene, 1);
            scene.nodes.get_mut(id).unwrap().extra.other.as_mut().unwrap().links[0].target = node(scene, 4).into();
        };
        assert_eq!(difference(unlink), "/nodes/1/extensions/MSFT_lod/ids/0: 2 and 4");
        let change_byte = |scene: &mut Scene| {
            let id = scene.buffers.ids().next().unwrap();
            let mut data = scene.buffers[id].data.to_vec();
            data[5] = 1;
            scene.buffers.get_mut(id).unwrap().data = Blob::new(data);
        };
        assert_eq!(difference(change_byte), "/bufferViews/0: the data differ");
        let drop_extension =
            |scene: &mut Scene| scene.extra.extensions.as_mut().unwrap().retain(|k, _| k != "X_unknown");
        assert!(difference(drop_extension).starts_with("/extensionsUsed: "), "{}", difference(drop_extension));
        let add = |scene: &mut Scene| {
            let camera = scene.cameras.values().next().unwrap().clone();
            scene.cameras.insert(camera);
        };
        assert_eq!(difference(add), "/cameras: 2 and 3 objects");
    }
}
