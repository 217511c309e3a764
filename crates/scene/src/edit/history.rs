//! Undo and redo.

use super::bytes::bytes_of;
use super::{Applied, Edit, EditError};
use crate::Scene;
use crate::model::NodeId;
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
    /// What was done, as it was asked for: with the scene as it was loaded, the entries are a script of the session
    /// ([`History::replay`]). A file that was merged is named by its path and hash.
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
        // What had been undone makes room for what is new, numbers included, but only if there will be anything new.
        if !self.undone.is_empty() {
            scene.would_apply(edit.clone())?;
            self.forget_undone(scene);
        }
        let applied = scene.apply(edit.clone())?;
        let edit = without_document(edit);
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
        let mut entry = Entry { edit, inverse: applied.inverse.clone(), bytes: 0, dragged };
        entry.bytes = entry_bytes(scene, &entry);
        self.bytes += entry.bytes;
        self.done.push_back(entry);
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
            let turned = turn(scene, &mut entry, &mut self.bytes);
            if turned.is_ok() {
                self.undone.push(entry)
            } else {
                self.done.push_back(entry)
            }
            all.push(turned?);
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
            let turned = turn(scene, &mut entry, &mut self.bytes);
            if turned.is_ok() {
                self.done.push_back(entry)
            } else {
                self.undone.push(entry)
            }
            all.push(turned?);
        }
        Ok(all)
    }

    /// Forgets what has been undone: it cannot be done again.
    pub fn forget_undone(&mut self, scene: &mut Scene) {
        for entry in self.undone.drain(..) {
            self.bytes -= entry.bytes;
            scene.forget(&entry.inverse);
        }
    }

    /// Bytes that it holds at most, but for its last edit.
    pub fn max_bytes(&self) -> usize {
        self.max_bytes
    }

    /// What has been undone, in the order in which it would be redone.
    pub fn to_redo(&self) -> impl ExactSizeIterator<Item = &Entry> {
        self.undone.iter().rev()
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

/// Carries out an entry's inverse, and keeps what takes that back. If the scene refuses it (somebody else has edited it),
/// the entry is as before.
fn turn(scene: &mut Scene, entry: &mut Entry, bytes: &mut usize) -> Result<Applied, EditError> {
    let applied = scene.apply(entry.inverse.clone())?;
    entry.inverse = applied.inverse.clone();
    entry.dragged = None;
    // What is parked now is another set of objects.
    *bytes -= entry.bytes;
    entry.bytes = entry_bytes(scene, entry);
    *bytes += entry.bytes;
    Ok(applied)
}

fn entry_bytes(scene: &Scene, entry: &Entry) -> usize {
    bytes_of(scene, &entry.inverse) + bytes_of(scene, &entry.edit) + size_of::<Entry>()
}

/// An edit as it is remembered: a merged document is in the scene, and need not be kept twice.
fn without_document(mut edit: Edit) -> Edit {
    if let Edit::MergeScene { file, .. } = &mut edit {
        file.scene = None;
    }
    edit
}
