//! Scripts: operations as users write them, one JSON object a line, and how they become edits.
//!
//! An operation refers to an object by the index that it has in the loaded file (objects that edits make take the next
//! free numbers), by `"name:TEXT"` (the first of that name), or by `"$label"`, which an earlier operation has set with
//! `"as": "label"`. A label that is set again means the later object from then on.

use super::bytes::held_bytes;
use super::files::Folder;
use super::names::Names;
use super::ops::Shape;
use super::{Applied, Edit, EditError, Grouping, History};
use crate::Scene;
use crate::import::ImportOptions;
use crate::json_words::plain;
use crate::model::*;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// How an operation refers to an object.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a reference is an index, \"name:TEXT\" or \"$label\"")]
pub enum Reference {
    /// By its index in the loaded file.
    Index(usize),
    /// `"name:TEXT"` or `"$label"`.
    Text(String),
}

/// A member that may be null, and has to be there: leaving it out is more likely a mistake than a wish.
fn or_null<'de, T: Deserialize<'de>, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<T>, D::Error> {
    Option::<T>::deserialize(deserializer)
}

/// Present, null or absent: what null means differs from what absence means.
fn present<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Option<Reference>>, D::Error> {
    Option::<Reference>::deserialize(deserializer).map(Some)
}

/// An operation of a script. The members are those of the command line's table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
#[expect(missing_docs, reason = "the members are named and explained in docs/cli.md, operation by operation")]
#[non_exhaustive]
pub enum Operation {
    SetTransform {
        node: Reference,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        translation: Option<[f64; 3]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotation: Option<[f64; 4]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scale: Option<[f64; 3]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        matrix: Option<[f64; 16]>,
    },
    AddNode {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<Reference>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        name: Option<String>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        translation: Option<[f64; 3]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rotation: Option<[f64; 4]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scale: Option<[f64; 3]>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        matrix: Option<[f64; 16]>,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    AddShape {
        shape: Shape,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<Reference>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        material: Option<Reference>,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    AddLight {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<Reference>,
        light: Value,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    Delete {
        node: Reference,
    },
    Duplicate {
        node: Reference,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    Reparent {
        node: Reference,
        /// Null is the root; it has to be said.
        #[serde(deserialize_with = "present", default)]
        parent: Option<Option<Reference>>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        index: Option<usize>,
        #[serde(default)]
        keep_world: bool,
    },
    Rename {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        node: Option<Reference>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        mesh: Option<Reference>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        material: Option<Reference>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        light: Option<Reference>,
        #[serde(deserialize_with = "or_null")]
        name: Option<String>,
    },
    SetVisible {
        node: Reference,
        visible: bool,
    },
    SetMesh {
        node: Reference,
        #[serde(deserialize_with = "or_null")]
        mesh: Option<Reference>,
    },
    SetCamera {
        node: Reference,
        #[serde(deserialize_with = "or_null")]
        camera: Option<Reference>,
    },
    SetSkin {
        node: Reference,
        #[serde(deserialize_with = "or_null")]
        skin: Option<Reference>,
    },
    AssignMaterial {
        mesh: Reference,
        primitive: usize,
        #[serde(deserialize_with = "or_null")]
        material: Option<Reference>,
    },
    DuplicateMaterial {
        material: Reference,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    SetMaterial {
        material: Reference,
        set: Value,
    },
    SetLight {
        light: Reference,
        set: Value,
    },
    SetCameraParams {
        camera: Reference,
        set: Value,
    },
    SplitMesh {
        node: Reference,
    },
    MergeMesh {
        node: Reference,
    },
    SelectVariant {
        #[serde(deserialize_with = "or_null")]
        variant: Option<VariantReference>,
    },
    MergeScene {
        path: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        parent: Option<Reference>,
        #[serde(default, rename = "as", skip_serializing_if = "Option::is_none")]
        label: Option<String>,
    },
    /// With braces: of a unit variant, unknown members would be overlooked.
    RemoveUnused {},
    Undo {
        #[serde(default = "one")]
        count: usize,
    },
    Redo {
        #[serde(default = "one")]
        count: usize,
    },
    SetTime {
        seconds: f64,
        /// Left out, it is the first animation; null is the rest pose.
        #[serde(deserialize_with = "present", default, skip_serializing_if = "Option::is_none")]
        animation: Option<Option<Reference>>,
    },
}

fn one() -> usize {
    1
}

/// A variant: by index, or by its name as it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged, expecting = "a variant is an index or a name")]
pub enum VariantReference {
    /// Its index.
    Index(usize),
    /// Its name.
    Name(String),
}

impl Operation {
    /// Parses a line of a script. A byte-order mark before it, which some editors write at the start of a file, is skipped.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(line: &str) -> Result<Self, EditError> {
        let line = line.strip_prefix('\u{feff}').unwrap_or(line);
        serde_json::from_str(line).map_err(|error| {
            if error.is_syntax() || error.is_eof() {
                let what = format!("column {}: this is not valid JSON: {}", error.column(), plain(&error.to_string()));
                return EditError::value("", what);
            }
            if !line.trim_start().starts_with('{') {
                return EditError::value("", "an operation is an object, such as {\"op\": \"delete\", \"node\": 0}");
            }
            EditError::value(member_of(line).unwrap_or_default(), plain(&error.to_string()))
        })
    }

    /// The name of the operation.
    pub fn name(&self) -> &'static str {
        match self {
            Self::SetTransform { .. } => "set_transform",
            Self::AddNode { .. } => "add_node",
            Self::AddShape { .. } => "add_shape",
            Self::AddLight { .. } => "add_light",
            Self::Delete { .. } => "delete",
            Self::Duplicate { .. } => "duplicate",
            Self::Reparent { .. } => "reparent",
            Self::Rename { .. } => "rename",
            Self::SetVisible { .. } => "set_visible",
            Self::SetMesh { .. } => "set_mesh",
            Self::SetCamera { .. } => "set_camera",
            Self::SetSkin { .. } => "set_skin",
            Self::AssignMaterial { .. } => "assign_material",
            Self::DuplicateMaterial { .. } => "duplicate_material",
            Self::SetMaterial { .. } => "set_material",
            Self::SetLight { .. } => "set_light",
            Self::SetCameraParams { .. } => "set_camera_params",
            Self::SplitMesh { .. } => "split_mesh",
            Self::MergeMesh { .. } => "merge_mesh",
            Self::SelectVariant { .. } => "select_variant",
            Self::MergeScene { .. } => "merge_scene",
            Self::RemoveUnused {} => "remove_unused",
            Self::Undo { .. } => "undo",
            Self::Redo { .. } => "redo",
            Self::SetTime { .. } => "set_time",
        }
    }
}

/// What a line of a script came to.
#[derive(Debug)]
#[non_exhaustive]
pub enum Outcome {
    /// The document was edited: once, or once for each step that was undone or redone.
    Edited(Vec<Applied>),
    /// A time was set. That is no edit: the pose follows, the document does not.
    TimeSet {
        /// Seconds.
        seconds: f64,
        /// The animation; `None` is the rest pose.
        animation: Option<AnimationId>,
    },
}

/// A scene that a script edits: history and labels.
#[derive(Debug)]
pub struct Session {
    /// What has been done.
    pub history: History,
    labels: HashMap<String, AnyId>,
    names: Names,
    /// The label that the last operation set, and what it meant before.
    last_label: Option<(String, Option<AnyId>)>,
    folder: Folder,
    /// The files that were read for `merge_scene`.
    files: Vec<PathBuf>,
    /// What was to be said of the one that was read last.
    read_warnings: Vec<String>,
    /// Bytes that the scene and what is merged may take.
    max_memory: u64,
}

impl Session {
    /// `folder` is where the paths of `merge_scene` begin; `import` is how these files are read, and how much memory they and
    /// the scene may take together.
    pub fn new(folder: &Path, import: ImportOptions) -> Self {
        Self {
            history: History::default(),
            labels: HashMap::new(),
            names: Names::default(),
            last_label: None,
            max_memory: import.max_memory,
            folder: Folder::new(folder, import),
            files: Vec::new(),
            read_warnings: Vec::new(),
        }
    }

    /// The files that `merge_scene` has read so far, and those that they refer to.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Carries an operation out.
    ///
    /// # Errors
    /// Why it is refused. The scene is as before then, and so are history and labels.
    pub fn run(&mut self, scene: &mut Scene, operation: &Operation) -> Result<Outcome, EditError> {
        self.last_label = None;
        match operation {
            Operation::Undo { count } => self.history.undo(scene, *count).map(Outcome::Edited),
            Operation::Redo { count } => self.history.redo(scene, *count).map(Outcome::Edited),
            Operation::SetTime { seconds, animation } => {
                let animation = match animation {
                    Some(Some(reference)) => Some(self.find(scene, "animation", reference)?),
                    Some(None) => None,
                    None => {
                        let missing = || EditError::value("/seconds", "the scene has no animation to take the time of");
                        Some(scene.animations().ids().next().ok_or_else(missing)?)
                    }
                };
                Ok(Outcome::TimeSet { seconds: *seconds, animation })
            }
            operation => {
                let (edit, label) = self.resolve(scene, operation)?;
                let read_warnings = std::mem::take(&mut self.read_warnings);
                let mut applied = self.history.apply(scene, edit, Grouping::Alone)?;
                applied.notes.splice(0..0, read_warnings);
                if let (Some(label), Some(made)) = (label, applied.made) {
                    let before = self.labels.insert(label.clone(), made);
                    self.last_label = Some((label, before));
                }
                Ok(Outcome::Edited(vec![applied]))
            }
        }
    }

    /// Takes the operation back that was carried out last, because what follows the scene cannot: as if it had been refused,
    /// but that what could be redone before it is forgotten.
    ///
    /// # Errors
    /// If somebody else has edited the scene meanwhile.
    pub fn take_back(&mut self, scene: &mut Scene, operation: &Operation) -> Result<(), EditError> {
        match operation {
            Operation::Undo { count } => drop(self.history.redo(scene, *count)?),
            Operation::Redo { count } => drop(self.history.undo(scene, *count)?),
            Operation::SetTime { .. } => {}
            _ => {
                self.history.undo(scene, 1)?;
                self.history.forget_undone(scene);
            }
        }
        if let Some((label, before)) = self.last_label.take() {
            match before {
                Some(before) => drop(self.labels.insert(label, before)),
                None => drop(self.labels.remove(&label)),
            }
        }
        Ok(())
    }

    /// The object that a reference means.
    fn find<K: Id>(&mut self, scene: &Scene, key: &str, reference: &Reference) -> Result<K, EditError> {
        let kind = K::KIND;
        let fail = |what: String| EditError::value(format!("/{key}"), what);
        let found = match reference {
            Reference::Index(slot) => {
                let missing = || fail(format!("there is no {} {slot}: it never was, or has been deleted", kind.name()));
                scene.id_in_slot(kind, *slot).ok_or_else(missing)?
            }
            Reference::Text(text) => {
                if let Some(label) = text.strip_prefix('$') {
                    *self.labels.get(label).ok_or_else(|| {
                        fail(format!("no operation before this one has set the label {label:?} (with \"as\")"))
                    })?
                } else if let Some(name) = text.strip_prefix("name:") {
                    self.names
                        .first(scene, kind, name)
                        .ok_or_else(|| fail(format!("there is no {} of the name {name:?}", kind.name())))?
                } else {
                    let what = format!("{text:?} is no reference; use an index, \"name:TEXT\" or \"$label\"");
                    return Err(fail(what));
                }
            }
        };
        match K::from_any(found) {
            Some(id) if scene.contains(id) => Ok(id),
            Some(_) => {
                let what = match reference {
                    Reference::Index(_) => String::new(),
                    Reference::Text(text) => format!("{text:?}: "),
                };
                Err(fail(format!("{what}{}", EditError::Stale(found))))
            }
            None => Err(fail(format!("it is a {}, and should be a {}", found.kind().name(), kind.name()))),
        }
    }

    fn find_optional<K: Id>(
        &mut self,
        scene: &Scene,
        key: &str,
        reference: &Option<Reference>,
    ) -> Result<Option<K>, EditError> {
        reference.as_ref().map(|reference| self.find(scene, key, reference)).transpose()
    }

    /// The edit that an operation means, and the label that it sets.
    fn resolve(&mut self, scene: &Scene, operation: &Operation) -> Result<(Edit, Option<String>), EditError> {
        use Operation as Op;
        let mut new_label = None;
        let edit = match operation {
            Op::SetTransform { node, translation, rotation, scale, matrix } => {
                let node = self.find(scene, "node", node)?;
                let now = scene.nodes()[node].transform.clone();
                Edit::SetTransform { node, transform: transform(now, *translation, *rotation, *scale, *matrix)? }
            }
            Op::AddNode { parent, name, translation, rotation, scale, matrix, label } => {
                new_label = label.clone();
                let start = Transform::default();
                Edit::AddNode {
                    parent: self.find_optional(scene, "parent", parent)?,
                    name: name.clone(),
                    transform: transform(start, *translation, *rotation, *scale, *matrix)?,
                }
            }
            Op::AddShape { shape, parent, material, label } => {
                new_label = label.clone();
                Edit::AddShape {
                    shape: *shape,
                    parent: self.find_optional(scene, "parent", parent)?,
                    material: self.find_optional(scene, "material", material)?,
                }
            }
            Op::AddLight { parent, light, label } => {
                new_label = label.clone();
                Edit::AddLight { parent: self.find_optional(scene, "parent", parent)?, light: light.clone() }
            }
            Op::Delete { node } => Edit::Delete { node: self.find(scene, "node", node)? },
            Op::Duplicate { node, label } => {
                new_label = label.clone();
                Edit::Duplicate { node: self.find(scene, "node", node)? }
            }
            Op::Reparent { node, parent, index, keep_world } => {
                let Some(parent) = parent else {
                    return Err(EditError::value("/parent", "it is missing; null makes the node a root"));
                };
                Edit::Reparent {
                    node: self.find(scene, "node", node)?,
                    parent: self.find_optional(scene, "parent", parent)?,
                    index: *index,
                    keep_world: *keep_world,
                }
            }
            Op::Rename { node, mesh, material, light, name } => {
                let ids: [Option<AnyId>; 4] = [
                    self.find_optional::<NodeId>(scene, "node", node)?.map(Into::into),
                    self.find_optional::<MeshId>(scene, "mesh", mesh)?.map(Into::into),
                    self.find_optional::<MaterialId>(scene, "material", material)?.map(Into::into),
                    self.find_optional::<LightId>(scene, "light", light)?.map(Into::into),
                ];
                let mut there = ids.into_iter().flatten();
                let (Some(object), None) = (there.next(), there.next()) else {
                    return Err(EditError::value("", "one of node, mesh, material and light says what is renamed"));
                };
                Edit::Rename { object, name: name.clone() }
            }
            Op::SetVisible { node, visible } => {
                Edit::SetVisible { node: self.find(scene, "node", node)?, visible: *visible }
            }
            Op::SetMesh { node, mesh } => {
                Edit::SetMesh { node: self.find(scene, "node", node)?, mesh: self.find_optional(scene, "mesh", mesh)? }
            }
            Op::SetCamera { node, camera } => Edit::SetCamera {
                node: self.find(scene, "node", node)?,
                camera: self.find_optional(scene, "camera", camera)?,
            },
            Op::SetSkin { node, skin } => {
                Edit::SetSkin { node: self.find(scene, "node", node)?, skin: self.find_optional(scene, "skin", skin)? }
            }
            Op::AssignMaterial { mesh, primitive, material } => Edit::AssignMaterial {
                mesh: self.find(scene, "mesh", mesh)?,
                primitive: *primitive,
                material: self.find_optional(scene, "material", material)?,
            },
            Op::DuplicateMaterial { material, label } => {
                new_label = label.clone();
                Edit::DuplicateMaterial { material: self.find(scene, "material", material)? }
            }
            Op::SetMaterial { material, set } => {
                Edit::SetMaterial { material: self.find(scene, "material", material)?, set: set.clone() }
            }
            Op::SetLight { light, set } => {
                Edit::SetLight { light: self.find(scene, "light", light)?, set: set.clone() }
            }
            Op::SetCameraParams { camera, set } => {
                Edit::SetCameraParams { camera: self.find(scene, "camera", camera)?, set: set.clone() }
            }
            Op::SplitMesh { node } => Edit::SplitMesh { node: self.find(scene, "node", node)? },
            Op::MergeMesh { node } => Edit::MergeMesh { node: self.find(scene, "node", node)? },
            Op::SelectVariant { variant } => {
                let variant = variant.as_ref().map(|variant| find_variant(scene, variant)).transpose()?;
                Edit::SelectVariant { variant }
            }
            Op::MergeScene { path, parent, label } => {
                new_label = label.clone();
                let parent = self.find_optional(scene, "parent", parent)?;
                let read = self.folder.read(path, self.max_memory.saturating_sub(held_bytes(scene)))?;
                self.files.extend(read.files);
                self.read_warnings = read.warnings;
                Edit::MergeScene { file: read.file, parent }
            }
            Op::RemoveUnused {} => Edit::RemoveUnused,
            Op::Undo { .. } | Op::Redo { .. } | Op::SetTime { .. } => {
                return Err(EditError::value("/op", "it is no edit"));
            }
        };
        Ok((edit, new_label))
    }
}

fn find_variant(scene: &Scene, reference: &VariantReference) -> Result<VariantId, EditError> {
    let found = match reference {
        VariantReference::Index(slot) => scene.variants.id_in_slot(*slot),
        VariantReference::Name(name) => scene.variants.iter().find(|(_, v)| v.name == *name).map(|(id, _)| id),
    };
    found.ok_or_else(|| {
        if scene.variants.is_empty() {
            return EditError::value("/variant", "there is no such variant: the document has none; null selects none");
        }
        let names: Vec<&str> = scene.variants.values().map(|variant| variant.name.as_str()).collect();
        EditError::value("/variant", format!("there is no such variant; there are: {}", names.join(", ")))
    })
}

/// A transform with some of its parts set: the others stay as they are. A matrix is decomposed if it has to give some.
fn transform(
    now: Transform,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    matrix: Option<[f64; 16]>,
) -> Result<Transform, EditError> {
    if let Some(matrix) = matrix {
        if translation.is_some() || rotation.is_some() || scale.is_some() {
            return Err(EditError::value("/matrix", "give a matrix or its parts, not both"));
        }
        return Ok(Transform::Matrix(Box::new(matrix)));
    }
    match (translation, rotation, scale) {
        (None, None, None) => return Ok(now),
        (Some(translation), Some(rotation), Some(scale)) => {
            return Ok(Transform::Trs { translation, rotation, scale });
        }
        _ => {}
    }
    let parts = match now {
        Transform::Trs { .. } => Some(now),
        Transform::Matrix(_) => super::ops::decompose(&now.to_affine()),
    };
    let Some(Transform::Trs { translation: t, rotation: r, scale: s }) = parts else {
        let what = "it has a matrix that shears, so its other parts cannot be kept; give a whole matrix, or translation, \
                    rotation and scale together";
        return Err(EditError::value("/node", what));
    };
    Ok(Transform::Trs {
        translation: translation.unwrap_or(t),
        rotation: rotation.unwrap_or(r),
        scale: scale.unwrap_or(s),
    })
}

/// The member that a message is about: the one that alone brings it about.
fn member_of(line: &str) -> Option<String> {
    let mut members: serde_json::Map<String, Value> = serde_json::from_str(line).ok()?;
    let fault = |members: serde_json::Map<String, Value>| {
        serde_json::from_value::<Operation>(members.into()).err().map(|error| error.to_string())
    };
    let whole = fault(members.clone())?;
    let op = members.shift_remove("op")?;
    if !op.is_string() {
        return Some("/op".to_owned());
    }
    if whole.starts_with("unknown field") || whole.starts_with("missing field") || whole.starts_with("unknown variant")
    {
        return None;
    }
    members.into_iter().find_map(|(key, value)| {
        let alone = [("op".to_owned(), op.clone()), (key.clone(), value)].into_iter().collect();
        (fault(alone).as_ref() == Some(&whole)).then(|| format!("/{key}"))
    })
}
