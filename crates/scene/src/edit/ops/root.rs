//! What a merged document carries as a whole: extensions at its root, extras, the scene that it shows.

use crate::Scene;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::Step;
use crate::import::gltf;
use crate::model::*;
use crate::place::push_key;
use crate::visit;
use rustc_hash::FxHashMap;
use serde_json::{Map, Value};

/// Extensions whose objects at the root are modelled: they are merged one by one. What else is beside them is no list that
/// anything refers into.
const MODELLED: &[&str] = &["KHR_lights_punctual", "KHR_materials_variants", "KHR_xmp_json_ld"];

/// The extras of the wrapper node: those of the document, or of the scene that it shows. Notes what has no place there.
pub fn extras(p: &mut Plan<'_>, path: &str, other: &Scene, shown: Option<SceneId>) -> Option<Box<Value>> {
    let mut lost: Vec<String> = Vec::new();
    let mut extras = other.extra.extras.clone();
    let members =
        |extra: &Extra| extra.other.iter().flat_map(|other| other.members.keys()).cloned().collect::<Vec<_>>();
    lost.extend(members(&other.extra));
    if let Some((id, scene)) = shown.and_then(|id| Some((id, other.scenes.get(id)?))) {
        let of_scene = |what: String| format!("{what} of scene {}", Store::<SceneId, ()>::slot(id));
        match &scene.extra.extras {
            Some(_) if extras.is_some() => lost.push(of_scene("extras".to_owned())),
            of_scene => extras = extras.or_else(|| of_scene.clone()),
        }
        let names = scene.extra.extensions.iter().flat_map(|extensions| extensions.keys()).cloned();
        lost.extend(names.chain(members(&scene.extra)).map(of_scene));
    }
    let (asset, own) = (&other.asset, &p.scene.asset);
    lost.extend(
        asset
            .copyright
            .as_ref()
            .filter(|c| own.copyright.as_ref() != Some(c))
            .map(|c| format!("asset/copyright {c:?}")),
    );
    lost.extend(asset.extra.extras.as_ref().map(|_| "asset/extras".to_owned()));
    let names = asset.extra.extensions.iter().flat_map(|extensions| extensions.keys());
    lost.extend(names.map(|name| format!("asset/extensions/{name}")));
    if !lost.is_empty() {
        p.notes.push(format!("{path}: left out, as a node has no place for it: {}", lost.join(", ")));
    }
    let is_known = |name: &String| gltf::extensions::SUPPORTED.contains(&name.as_str()) || visit::has_links(name);
    let unknown: Vec<String> = visit::extensions_in_use(other).into_iter().filter(|name| !is_known(name)).collect();
    if !unknown.is_empty() {
        let names = unknown.join(", ");
        p.notes.push(format!(
            "{path}: kept as it is, with indices, if there are any, that are those of the file: {names}"
        ));
    }
    extras
}

/// Takes over the extensions at the root of a document. One that both documents have stays as it is, if it says the same.
pub fn unite(p: &mut Plan<'_>, path: &str, other: &Scene, renamed: &FxHashMap<AnyId, AnyId>) -> Result<()> {
    let Some(theirs) = &other.extra.extensions else { return Ok(()) };
    let mut extra = p.scene.extra.clone();
    let mut new: Vec<Link> = Vec::new();
    let mut extensions = extra.extensions.take().map_or_else(Map::new, |extensions| *extensions);
    for (name, value) in theirs.iter() {
        let (own, links) = (links_of(&p.scene.extra, name), links_of(&other.extra, name));
        match extensions.get(name) {
            None => {
                new.extend(links.into_iter().map(|link| {
                    let target = renamed.get(&link.target).copied().unwrap_or(link.target);
                    Link { path: link.path.clone(), target }
                }));
                extensions.insert(name.clone(), value.clone());
            }
            Some(there) if is_same((p.scene, there, &own), (other, value, &links)) => {}
            Some(_) if MODELLED.contains(&name.as_str()) => {
                p.notes
                    .push(format!("{path}: left out, as the document has its own: what is beside the list of {name}"));
            }
            Some(_) => {
                return Err(EditError::File(format!(
                    "{path}: both documents have {name} at their root, each with other content, and what refers into it does so \
                     by index; take the extension out of one of them first"
                )));
            }
        }
    }
    if Some(&extensions) == p.scene.extra.extensions.as_deref() {
        return Ok(());
    }
    extra.extensions = Some(Box::new(extensions));
    if !new.is_empty() {
        extra.other.get_or_insert_default().links.extend(new);
    }
    p.step(Step::DocumentExtra(extra));
    Ok(())
}

/// The references inside one extension.
fn links_of<'e>(extra: &'e Extra, name: &str) -> Vec<&'e Link> {
    let mut prefix = String::new();
    push_key(&mut prefix, name);
    prefix.push('/');
    extra.links().iter().filter(|link| link.path.starts_with(&*prefix)).collect()
}

/// Whether two extensions say the same: equal JSON, but for references, and equal content behind these.
fn is_same((a, json_a, links_a): (&Scene, &Value, &[&Link]), (b, json_b, links_b): (&Scene, &Value, &[&Link])) -> bool {
    let without = |json: &Value, links: &[&Link]| {
        let mut json = json.clone();
        for link in links {
            // The first step of the path is the name of the extension.
            let inside = link.path.get(1..).and_then(|path| path.find('/').map(|i| &path[i..]));
            if let Some(slot) = inside.and_then(|inside| json.pointer_mut(inside)) {
                *slot = Value::Null;
            }
        }
        json
    };
    let is_same_link = |(x, y): (&&Link, &&Link)| x.path == y.path && is_same_content((a, x.target), (b, y.target));
    links_a.len() == links_b.len()
        && without(json_a, links_a) == without(json_b, links_b)
        && links_a.iter().zip(links_b).all(is_same_link)
}

/// Whether two objects of two documents hold the same. Kinds that no extension at a root refers to count as different.
fn is_same_content((a, x): (&Scene, AnyId), (b, y): (&Scene, AnyId)) -> bool {
    match (x, y) {
        (AnyId::BufferView(x), AnyId::BufferView(y)) => a.view_bytes(x).is_some() && a.view_bytes(x) == b.view_bytes(y),
        (AnyId::Image(x), AnyId::Image(y)) => match (a.images.get(x), b.images.get(y)) {
            (Some(x), Some(y)) => x.data.is_some() && x.data == y.data,
            _ => false,
        },
        (AnyId::Texture(x), AnyId::Texture(y)) => {
            let (Some(x), Some(y)) = (a.textures.get(x), b.textures.get(y)) else { return false };
            let sampler = |scene: &Scene, id: Option<SamplerId>| id.and_then(|id| scene.samplers.get(id)).cloned();
            let of = |t: &Texture| [t.source, t.alternatives.webp, t.alternatives.basisu, t.alternatives.dds];
            let is_same_image = |(x, y): (Option<ImageId>, Option<ImageId>)| match (x, y) {
                (Some(x), Some(y)) => is_same_content((a, x.into()), (b, y.into())),
                (x, y) => x.is_none() && y.is_none(),
            };
            sampler(a, x.sampler) == sampler(b, y.sampler) && of(x).into_iter().zip(of(y)).all(is_same_image)
        }
        _ => false,
    }
}
