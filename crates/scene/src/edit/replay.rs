//! Doing the edits of a log again.
//!
//! A [`History`] is a log of edits: saved, it can be done again on the document as it was loaded, and is the same undo
//! stack then. Edits are values without blobs: geometry that an edit makes follows from the edit, and a merged document is
//! known by the hash of its content, so that whoever replays a log has to find it.
//!
//! The ids of objects that edits made may be others than they were (an edit that was undone and then forgotten has left no
//! trace in the log, and did use up an id): they are translated. The document is the same then, but for the order of what
//! the edits made.

use super::ops::MergedFile;
use super::{Edit, EditError, Grouping, History, Step};
use crate::Scene;
use crate::model::{AnyId, Id};
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// Why a log was not replayed to its end.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReplayError {
    /// The log has lost its first edits, as it would have held too many bytes.
    Forgotten(u64),
    /// An edit is refused.
    Refused {
        /// Its number in the log, from 0: first what was done, then what had been undone, in the order of a redo.
        entry: usize,
        /// Why.
        error: EditError,
    },
}

impl fmt::Display for ReplayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Forgotten(count) => write!(
                f,
                "the log has forgotten its first {count} edits and cannot be replayed; keep a log with a larger limit"
            ),
            Self::Refused { entry, error } => write!(f, "edit {entry} of the log: {error}"),
        }
    }
}

impl std::error::Error for ReplayError {}

impl History {
    /// Does the edits of a log again on the document as it was loaded then. `find` gives the document that an edit merges,
    /// by its path and its hash ([`Folder::read_again`](super::files::Folder::read_again)). What had been undone is undone.
    ///
    /// # Errors
    /// Which edit is refused, and why; the scene has the edits before it then.
    pub fn replay(
        log: &Self,
        scene: &mut Scene,
        find: &mut dyn FnMut(&MergedFile) -> Result<Arc<Scene>, EditError>,
    ) -> Result<Self, ReplayError> {
        if log.forgotten() > 0 {
            return Err(ReplayError::Forgotten(log.forgotten()));
        }
        let mut history = Self::new(log.max_bytes());
        let mut ids = HashMap::new();
        let done = log.done().map(|entry| (entry, true));
        let all = done.chain(log.to_redo().map(|entry| (entry, false)));
        for (number, (entry, is_done)) in all.enumerate() {
            let refused = |error| ReplayError::Refused { entry: number, error };
            let mut edit = translated(entry.edit.clone(), &ids).map_err(refused)?;
            if let Edit::MergeScene { file, .. } = &mut edit {
                file.scene = Some(find(file).map_err(refused)?);
            }
            let applied = history.apply(scene, edit, Grouping::Alone).map_err(refused)?;
            let (then, now) = (made(&entry.inverse, is_done), made(&applied.inverse, true));
            if then.len() != now.len() || then.iter().zip(&now).any(|(then, now)| then.kind() != now.kind()) {
                let what = "it makes other objects than it made; the log is of another document".to_owned();
                return Err(refused(EditError::Steps { step: None, what }));
            }
            ids.extend(then.into_iter().zip(now));
        }
        let undone = log.undone();
        let refused = |error| ReplayError::Refused { entry: log.done().len(), error };
        history.undo(scene, undone).map_err(refused)?;
        Ok(history)
    }
}

/// The objects that an edit made, in their order: those that its inverse takes out of the document, or, when it has been
/// undone, those that doing it again brings in.
fn made(inverse: &Edit, is_done: bool) -> Vec<AnyId> {
    let Edit::Steps { steps } = inverse else { return Vec::new() };
    let ids = steps.iter().flat_map(|step| match step {
        Step::Park(ids) if is_done => &ids[..],
        Step::Unpark(ids) if !is_done => &ids[..],
        _ => &[],
    });
    ids.copied().collect()
}

/// An edit with the ids that its objects have now.
fn translated(mut edit: Edit, ids: &HashMap<AnyId, AnyId>) -> Result<Edit, EditError> {
    fn to<K: Id>(ids: &HashMap<AnyId, AnyId>, id: &mut K) {
        if let Some(new) = ids.get(&(*id).into()).copied().and_then(K::from_any) {
            *id = new;
        }
    }
    match &mut edit {
        Edit::SetTransform { node, .. }
        | Edit::Delete { node }
        | Edit::Duplicate { node }
        | Edit::SetVisible { node, .. }
        | Edit::SplitMesh { node }
        | Edit::MergeMesh { node } => to(ids, node),
        Edit::AddNode { parent, .. } | Edit::AddLight { parent, .. } | Edit::MergeScene { parent, .. } => {
            parent.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::AddShape { parent, material, .. } => {
            parent.iter_mut().for_each(|id| to(ids, id));
            material.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::Reparent { node, parent, .. } => {
            to(ids, node);
            parent.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::Rename { object, .. } => {
            if let Some(&new) = ids.get(object) {
                *object = new;
            }
        }
        Edit::SetMesh { node, mesh } => {
            to(ids, node);
            mesh.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::SetCamera { node, camera } => {
            to(ids, node);
            camera.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::SetSkin { node, skin } => {
            to(ids, node);
            skin.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::AssignMaterial { mesh, material, .. } => {
            to(ids, mesh);
            material.iter_mut().for_each(|id| to(ids, id));
        }
        Edit::DuplicateMaterial { material } | Edit::SetMaterial { material, .. } => to(ids, material),
        Edit::SetLight { light, .. } => to(ids, light),
        Edit::SetCameraParams { camera, .. } => to(ids, camera),
        Edit::SelectVariant { variant } => variant.iter_mut().for_each(|id| to(ids, id)),
        Edit::RemoveUnused => {}
        Edit::Steps { .. } => {
            if ids.iter().any(|(then, now)| then != now) {
                let what = "steps that were planned elsewhere cannot be replayed after an edit that makes objects";
                return Err(EditError::Steps { step: None, what: what.to_owned() });
            }
        }
    }
    Ok(edit)
}
