//! The edits that there are, one file for each family: what each means, as steps.

mod applicable;
mod assign;
mod bounds;
mod delete;
mod duplicate;
mod hierarchy;
mod joints;
mod links;
mod members;
mod merge_scene;
mod mesh;
mod parameters;
mod root;
mod shape;
mod skins;

pub(crate) use hierarchy::decompose;
pub use merge_scene::MergedFile;
pub use shape::Shape;

use super::plan::{Plan, Result};
use super::step::Step;
use crate::model::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// One change to a scene, as a value: it can be printed, saved, sent and replayed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Edit {
    /// Sets a node's local transform. A rotation need not have length 1; a matrix may not shear.
    SetTransform {
        /// The node.
        node: NodeId,
        /// Parent from node.
        transform: Transform,
    },
    /// Adds an empty node, behind its siblings.
    AddNode {
        /// `None` makes it a root of the scene that is shown.
        parent: Option<NodeId>,
        /// Its name.
        name: Option<String>,
        /// Parent from node.
        transform: Transform,
    },
    /// Adds a node with geometry of its own.
    AddShape {
        /// What geometry.
        shape: Shape,
        /// As for `AddNode`.
        parent: Option<NodeId>,
        /// `None` is the default material.
        material: Option<MaterialId>,
    },
    /// Adds a node with a light of its own.
    AddLight {
        /// As for `AddNode`.
        parent: Option<NodeId>,
        /// A light of KHR_lights_punctual.
        light: Value,
    },
    /// Deletes a node and all below it, with what refers to them: animation channels, joints of skins, roots of scenes.
    /// Meshes, materials, cameras and lights stay (`RemoveUnused` takes them).
    Delete {
        /// The top of the subtree.
        node: NodeId,
    },
    /// Copies a node and all below it, beside it. Meshes, materials, cameras and lights are shared; skins whose joints are
    /// copied are copied too, and animations that move the originals move the copies.
    Duplicate {
        /// The top of the subtree.
        node: NodeId,
    },
    /// Moves a node and all below it to another parent. Refused where a skin's joints would have no common root, or a scene would
    /// show what they deform without them.
    Reparent {
        /// The node.
        node: NodeId,
        /// `None` makes it a root of the scene that is shown.
        parent: Option<NodeId>,
        /// Before which of the siblings that it will have; at the end without.
        index: Option<usize>,
        /// Keep the place in the world rather than the local transform.
        keep_world: bool,
    },
    /// Renames a node, mesh, material, light, camera, skin or animation.
    Rename {
        /// What.
        object: AnyId,
        /// `None` takes the name away.
        name: Option<String>,
    },
    /// Shows or hides a node with all below it.
    SetVisible {
        /// The node.
        node: NodeId,
        /// Whether it is shown, if all above it are.
        visible: bool,
    },
    /// Sets what mesh a node shows. A skin or weights that do not fit the new mesh go.
    SetMesh {
        /// The node.
        node: NodeId,
        /// The mesh.
        mesh: Option<MeshId>,
    },
    /// Sets what camera is at a node.
    SetCamera {
        /// The node.
        node: NodeId,
        /// The camera.
        camera: Option<CameraId>,
    },
    /// Sets what deforms a node's mesh, which must have joints and weights. Every scene that shows the node has to have the
    /// joints.
    SetSkin {
        /// The node.
        node: NodeId,
        /// The skin.
        skin: Option<SkinId>,
    },
    /// Sets the material of one primitive, for all nodes that show the mesh.
    AssignMaterial {
        /// The mesh.
        mesh: MeshId,
        /// The primitive's index in it.
        primitive: usize,
        /// The material; `None` is the default one.
        material: Option<MaterialId>,
    },
    /// Copies a material. Nothing uses the copy yet.
    DuplicateMaterial {
        /// The original.
        material: MaterialId,
    },
    /// Changes a material by a JSON merge patch (RFC 7396) over what glTF says of it; indices are slots.
    SetMaterial {
        /// The material.
        material: MaterialId,
        /// The patch.
        set: Value,
    },
    /// Changes a light by a JSON merge patch over its KHR_lights_punctual object.
    SetLight {
        /// The light.
        light: LightId,
        /// The patch.
        set: Value,
    },
    /// Changes a camera by a JSON merge patch over what glTF says of it.
    SetCameraParams {
        /// The camera.
        camera: CameraId,
        /// The patch.
        set: Value,
    },
    /// Gives a node its own mesh and materials over the same geometry.
    SplitMesh {
        /// The node.
        node: NodeId,
    },
    /// The inverse: back to an equal mesh of others. What nobody else uses of its own goes.
    MergeMesh {
        /// The node.
        node: NodeId,
    },
    /// Shows a material variant, or none.
    SelectVariant {
        /// The variant.
        variant: Option<VariantId>,
    },
    /// Appends a whole document below a new node.
    MergeScene {
        /// The document.
        file: MergedFile,
        /// The new node's parent, as for `AddNode`.
        parent: Option<NodeId>,
    },
    /// Drops what nothing refers to.
    RemoveUnused,
    /// Steps that have been planned already: an inverse, or what was undone.
    Steps {
        /// In order.
        steps: Vec<Step>,
    },
}

/// Plans an edit.
pub(super) fn plan(p: &mut Plan<'_>, edit: Edit) -> Result<()> {
    match edit {
        Edit::SetTransform { node, transform } => hierarchy::set_transform(p, node, transform),
        Edit::AddNode { parent, name, transform } => hierarchy::add_node(p, parent, name, transform),
        Edit::AddShape { shape, parent, material } => shape::add(p, shape, parent, material),
        Edit::AddLight { parent, light } => parameters::add_light(p, parent, &light),
        Edit::Delete { node } => delete::delete(p, node),
        Edit::Duplicate { node } => duplicate::duplicate(p, node),
        Edit::Reparent { node, parent, index, keep_world } => hierarchy::reparent(p, node, parent, index, keep_world),
        Edit::Rename { object, name } => assign::rename(p, object, name),
        Edit::SetVisible { node, visible } => hierarchy::set_visible(p, node, visible),
        Edit::SetMesh { node, mesh } => assign::set_mesh(p, node, mesh),
        Edit::SetCamera { node, camera } => assign::set_camera(p, node, camera),
        Edit::SetSkin { node, skin } => assign::set_skin(p, node, skin),
        Edit::AssignMaterial { mesh, primitive, material } => assign::material(p, mesh, primitive, material),
        Edit::DuplicateMaterial { material } => assign::duplicate_material(p, material),
        Edit::SetMaterial { material, set } => parameters::set(p, material.into(), &set),
        Edit::SetLight { light, set } => parameters::set(p, light.into(), &set),
        Edit::SetCameraParams { camera, set } => parameters::set(p, camera.into(), &set),
        Edit::SplitMesh { node } => mesh::split(p, node),
        Edit::MergeMesh { node } => mesh::merge(p, node),
        Edit::SelectVariant { variant } => assign::select_variant(p, variant),
        Edit::MergeScene { file, parent } => merge_scene::merge(p, file, parent),
        Edit::RemoveUnused => delete::remove_unused(p),
        // These are carried out as they are.
        Edit::Steps { steps } => {
            steps.into_iter().for_each(|step| p.step(step));
            Ok(())
        }
    }
}

/// The name of a copy.
fn copy_name(name: Option<&str>) -> String {
    name.map_or_else(|| "copy".to_owned(), |name| format!("{name} copy"))
}
