//! Undo and redo.

use super::step::{NodeField, Object, Step};
use super::{Applied, Edit, EditError};
use crate::Scene;
use crate::model::{AnyId, NodeId};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;

/// Time within which moves of one node become one step.
const DRAG: Duration = Duration::from_millis(500);

/// Whether an edit may join the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Grouping {
    /// A step of its own.
    #[default]
    Alone,
    /// Live dragging, at this time (of any clock that does not go back): a transform joins the one before it if that was
    /// of the same node and at most half a second ago.
    Drag(Duration),
}

/// One step of the history.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    /// What was done, as it was asked for: with the scene as it was loaded, the entries are a script of the session.
    pub edit: Edit,
    /// What takes it back, or, when it has been undone, does it again.
    pub inverse: Edit,
    /// Bytes that it holds, parked objects included.
    pub bytes: usize,
    #[serde(skip)]
    dragged: Option<(NodeId, Duration)>,
}

/// The edits of a session, to be undone and redone. It holds values only; the scene is given with each call, and must be
/// edited by nobody else.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct History {
    done: VecDeque<Entry>,
    undone: Vec<Entry>,
    max_bytes: usize,
    bytes: usize,
    /// Edits that no longer fitted.
    #[serde(default)]
    forgotten: u64,
}

impl Default for History {
    /// 256 MiB.
    fn default() -> Self {
        Self::new(256 << 20)
    }
}

impl History {
    /// A history that forgets its oldest edits when it holds more than a number of bytes.
    pub fn new(max_bytes: usize) -> Self {
        Self { done: VecDeque::new(), undone: Vec::new(), max_bytes, bytes: 0, forgotten: 0 }
    }

    /// Applies an edit and remembers it. What had been undone is forgotten.
    ///
    /// # Errors
    /// As [`Scene::apply`]. Nothing is forgotten then.
    pub fn apply(&mut self, scene: &mut Scene, edit: Edit, grouping: Grouping) -> Result<Applied, EditError> {
        let applied = scene.apply(edit.clone())?;
        for entry in self.undone.drain(..).rev() {
            self.bytes -= entry.bytes;
            scene.forget(&entry.inverse);
        }
        let dragged = match (&edit, grouping) {
            (Edit::SetTransform { node, .. }, Grouping::Drag(time)) => Some((*node, time)),
            _ => None,
        };
        if let Some((node, time)) = dragged
            && let Some(last) = self.done.back_mut()
            && let Some((last_node, last_time)) = last.dragged
            && last_node == node
            && time.saturating_sub(last_time) <= DRAG
        {
            // Its inverse leads to where the drag began.
            (last.edit, last.dragged) = (edit, dragged);
            return Ok(applied);
        }
        let bytes = bytes_of(scene, &applied.inverse) + bytes_of(scene, &edit) + size_of::<Entry>();
        self.bytes += bytes;
        self.done.push_back(Entry { edit, inverse: applied.inverse.clone(), bytes, dragged });
        while self.bytes > self.max_bytes && self.done.len() > 1 {
            let Some(oldest) = self.done.pop_front() else { break };
            self.bytes -= oldest.bytes;
            self.forgotten += 1;
            scene.forget(&oldest.inverse);
        }
        Ok(applied)
    }

    /// Takes the last edits back, the last one first. What each touched comes in that order.
    ///
    /// # Errors
    /// If there are fewer; nothing is undone then.
    pub fn undo(&mut self, scene: &mut Scene, count: usize) -> Result<Vec<Applied>, EditError> {
        let there = self.done.len();
        if there < count {
            return Err(EditError::EndOfHistory { what: "undo", asked: count, there });
        }
        let mut all = Vec::with_capacity(count);
        for _ in 0..count {
            let Some(mut entry) = self.done.pop_back() else { break };
            all.push(turn(scene, &mut entry)?);
            self.undone.push(entry);
        }
        Ok(all)
    }

    /// Does again what was undone last.
    ///
    /// # Errors
    /// If fewer have been undone; nothing is redone then.
    pub fn redo(&mut self, scene: &mut Scene, count: usize) -> Result<Vec<Applied>, EditError> {
        let there = self.undone.len();
        if there < count {
            return Err(EditError::EndOfHistory { what: "redo", asked: count, there });
        }
        let mut all = Vec::with_capacity(count);
        for _ in 0..count {
            let Some(mut entry) = self.undone.pop() else { break };
            all.push(turn(scene, &mut entry)?);
            self.done.push_back(entry);
        }
        Ok(all)
    }

    /// The edits that can be undone, oldest first.
    pub fn done(&self) -> impl ExactSizeIterator<Item = &Entry> {
        self.done.iter()
    }

    /// How many edits can be redone.
    pub fn undone(&self) -> usize {
        self.undone.len()
    }

    /// How many of the oldest edits have been forgotten, because the history would have held too many bytes.
    pub fn forgotten(&self) -> u64 {
        self.forgotten
    }

    /// Bytes that the history holds, parked objects included.
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

/// Carries out an entry's inverse, and keeps what takes that back.
fn turn(scene: &mut Scene, entry: &mut Entry) -> Result<Applied, EditError> {
    let steps = std::mem::replace(&mut entry.inverse, Edit::Steps { steps: Vec::new() });
    let applied = scene.apply(steps)?;
    entry.inverse = applied.inverse.clone();
    entry.dragged = None;
    Ok(applied)
}

/// Bytes that an edit holds: its own, and those of the objects that it keeps parked.
fn bytes_of(scene: &Scene, edit: &Edit) -> usize {
    let Edit::Steps { steps } = edit else { return 0 };
    let of_step = |step: &Step| match step {
        Step::Unpark(ids) => ids.iter().map(|&id| size_of::<AnyId>() + object_bytes(scene, id)).sum(),
        Step::Park(ids) => size_of_val(&ids[..]),
        Step::Replace(object) => size_of::<Object>() + value_bytes(object),
        Step::Node(_, NodeField::Weights(Some(weights))) => size_of_val(&weights[..]),
        _ => 0,
    };
    steps.iter().map(|step| size_of::<Step>() + of_step(step)).sum()
}

/// About what a parked object takes.
fn object_bytes(scene: &Scene, id: AnyId) -> usize {
    match id {
        AnyId::Node(id) => scene.nodes.get_any(id).map_or(0, |x| size_of_val(x) + x.children.len() * 16),
        AnyId::Mesh(id) => scene.meshes.get_any(id).map_or(0, mesh_bytes),
        AnyId::Animation(id) => scene.animations.get_any(id).map_or(0, animation_bytes),
        AnyId::Buffer(id) => scene.buffers.get_any(id).map_or(0, |x| size_of_val(x) + x.data.len()),
        AnyId::Image(id) => {
            scene.images.get_any(id).map_or(0, |x| size_of_val(x) + x.data.as_ref().map_or(0, |data| data.len()))
        }
        AnyId::Skin(id) => scene.skins.get_any(id).map_or(0, |x| size_of_val(x) + size_of_val(&x.joints[..])),
        _ => 1024,
    }
}

fn mesh_bytes(mesh: &crate::model::Mesh) -> usize {
    let attributes: usize = mesh
        .primitives
        .iter()
        .map(|p| 40 * (p.attributes.0.len() + p.targets.iter().map(|t| t.0.len()).sum::<usize>()))
        .sum();
    size_of_val(mesh) + size_of_val(&mesh.primitives[..]) + attributes
}

fn animation_bytes(animation: &crate::model::Animation) -> usize {
    size_of_val(animation) + size_of_val(&animation.channels[..]) + size_of_val(&animation.samplers[..])
}

fn value_bytes(object: &Object) -> usize {
    match object {
        Object::Mesh(_, mesh) => mesh_bytes(mesh),
        Object::Animation(_, animation) => animation_bytes(animation),
        Object::Skin(_, skin) => size_of_val(&skin.joints[..]),
        Object::Material(..) => size_of::<crate::model::Material>(),
        Object::Light(..) | Object::Camera(..) => 0,
    }
}
