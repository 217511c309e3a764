//! About how many bytes an edit holds.

use super::Edit;
use super::step::{NodeField, Object, Step};
use crate::Scene;
use crate::model::size::{extra_bytes, json_bytes};
use crate::model::*;

/// Bytes that an edit holds: its own, and those of the objects that it keeps parked.
pub(super) fn bytes_of(scene: &Scene, edit: &Edit) -> usize {
    let text = |text: &Option<String>| text.as_ref().map_or(0, String::len);
    match edit {
        Edit::Steps { steps } => steps.iter().map(|step| size_of::<Step>() + step_bytes(scene, step)).sum(),
        Edit::SetMaterial { set, .. } | Edit::SetLight { set, .. } | Edit::SetCameraParams { set, .. } => {
            json_bytes(set)
        }
        Edit::AddLight { light, .. } => json_bytes(light),
        Edit::AddNode { name, .. } | Edit::Rename { name, .. } => text(name),
        // The history lets the document itself go: what came of it is in the scene.
        Edit::MergeScene { file, .. } => file.path.len() + file.blake3.len(),
        _ => 0,
    }
}

/// Bytes that a scene holds, what is parked included: its blobs, and the slots of its objects.
pub(super) fn held_bytes(scene: &Scene) -> u64 {
    let buffers: usize = scene.buffers.all().map(|buffer| buffer.data.len()).sum();
    let images: usize = scene.images.all().map(|image| image.data.as_ref().map_or(0, |data| data.len())).sum();
    let slots = scene.nodes.slot_bytes() + scene.meshes.slot_bytes() + scene.accessors.slot_bytes();
    (buffers + images + slots) as u64
}

fn step_bytes(scene: &Scene, step: &Step) -> usize {
    match step {
        Step::Unpark(ids) => ids.iter().map(|&id| size_of::<AnyId>() + parked_bytes(scene, id)).sum(),
        Step::Park(ids) => size_of_val(&ids[..]),
        Step::Replace(object) => size_of::<Object>() + value_bytes(object),
        Step::Node(_, NodeField::Weights(Some(weights))) => size_of_val(&weights[..]),
        Step::Node(_, NodeField::Name(Some(name))) => name.len(),
        Step::Node(_, NodeField::Transform(Transform::Matrix(matrix))) => size_of_val(&**matrix),
        Step::Node(_, NodeField::Extra(extra)) | Step::DocumentExtra(extra) | Step::AssetExtra(extra) => {
            extra_bytes(extra)
        }
        Step::TakeChannels { channels, samplers, .. } => size_of_val(&channels[..]) + size_of_val(&samplers[..]),
        Step::PutChannels { channels, samplers, .. } => {
            let extras = channels.iter().map(|(_, c)| extra_bytes(&c.target_extra) + extra_bytes(&c.extra));
            size_of_val(&channels[..]) + size_of_val(&samplers[..]) + extras.sum::<usize>()
        }
        Step::Extensions(names) => names.iter().flatten().map(|name| size_of::<String>() + name.len()).sum(),
        _ => 0,
    }
}

/// About what a parked object takes.
fn parked_bytes(scene: &Scene, id: AnyId) -> usize {
    match id {
        AnyId::Node(id) => scene.nodes.get_any(id).map_or(0, |x| {
            let name = x.name.as_ref().map_or(0, String::len);
            size_of_val(x) + x.children.len() * 16 + name + extra_bytes(&x.extra)
        }),
        AnyId::Mesh(id) => scene.meshes.get_any(id).map_or(0, |x| size_of_val(x) + mesh_bytes(x)),
        AnyId::Material(id) => scene.materials.get_any(id).map_or(0, material_bytes),
        AnyId::Animation(id) => scene.animations.get_any(id).map_or(0, |x| size_of_val(x) + animation_bytes(x)),
        AnyId::Buffer(id) => scene.buffers.get_any(id).map_or(0, |x| size_of_val(x) + x.data.len()),
        AnyId::Image(id) => {
            scene.images.get_any(id).map_or(0, |x| size_of_val(x) + x.data.as_ref().map_or(0, |data| data.len()))
        }
        AnyId::Skin(id) => scene.skins.get_any(id).map_or(0, |x| size_of_val(x) + size_of_val(&x.joints[..])),
        AnyId::Packet(id) => scene.packets.get_any(id).map_or(0, |x| size_of_val(x) + json_bytes(&x.0)),
        _ => 512,
    }
}

fn mesh_bytes(mesh: &Mesh) -> usize {
    let name = mesh.name.as_ref().map_or(0, String::len);
    let primitive = |p: &Primitive| {
        let attributes = p.attributes.0.len() + p.targets.iter().map(|target| target.0.len()).sum::<usize>();
        size_of::<Primitive>() + 40 * attributes + extra_bytes(&p.extra)
    };
    name + extra_bytes(&mesh.extra) + mesh.primitives.iter().map(primitive).sum::<usize>()
}

/// With its lobes, which most materials have not.
fn material_bytes(material: &Material) -> usize {
    let lobes = [
        material.clearcoat.as_ref().map(|x| size_of_val(&**x)),
        material.transmission.as_ref().map(|x| size_of_val(&**x)),
        material.diffuse_transmission.as_ref().map(|x| size_of_val(&**x)),
        material.volume.as_ref().map(|x| size_of_val(&**x)),
        material.specular.as_ref().map(|x| size_of_val(&**x)),
        material.sheen.as_ref().map(|x| size_of_val(&**x)),
        material.iridescence.as_ref().map(|x| size_of_val(&**x)),
        material.anisotropy.as_ref().map(|x| size_of_val(&**x)),
    ];
    let name = material.name.as_ref().map_or(0, String::len);
    let carried = extra_bytes(&material.extra) + extra_bytes(&material.pbr_extra);
    size_of_val(material) + lobes.into_iter().flatten().sum::<usize>() + name + carried
}

fn animation_bytes(animation: &Animation) -> usize {
    size_of_val(&animation.channels[..]) + size_of_val(&animation.samplers[..]) + extra_bytes(&animation.extra)
}

fn value_bytes(object: &Object) -> usize {
    match object {
        Object::Mesh(_, mesh) => mesh_bytes(mesh),
        Object::Animation(_, animation) => animation_bytes(animation),
        Object::Skin(_, skin) => size_of_val(&skin.joints[..]) + extra_bytes(&skin.extra),
        Object::Material(_, material) => material_bytes(material),
        Object::Light(_, light) => extra_bytes(&light.extra),
        Object::Camera(_, camera) => extra_bytes(&camera.extra),
    }
}
