//! Edits: the only way in which a [`Scene`] changes.
//!
//! [`Scene::apply`] takes an [`Edit`] and gives the edit that takes it back, and what was touched. An edit is planned
//! first (`ops`, one file for each family): everything is checked, and the plan is a list of [`Step`]s, each of which can be
//! carried out and taken back exactly (`step`). So a refused edit changes nothing, and an inverse is the reverse list of
//! inverse steps.
//!
//! What leaves the document is parked: it keeps its id and its content for the history, and nobody sees it. When the
//! history forgets an edit, [`Scene::forget`] ends what only that edit could have brought back.
//!
//! An edit costs what it touches. Who refers to an object is known from the reverse-reference index, which is made once
//! ([`Scene::prepare_edits`], O(n log n)); no edit but `RemoveUnused` looks at the whole document.

mod bytes;
mod changes;
mod channels;
mod checked;
mod error;
pub mod files;
mod fingerprint;
mod history;
mod names;
pub mod ops;
mod plan;
pub mod random;
mod replay;
pub mod script;
mod step;
mod twins;

pub use changes::{ChangeLog, ChangeSet, Cursor, Facets};
pub use error::EditError;
pub use history::{Grouping, History};
pub use ops::Edit;
pub use replay::ReplayError;
pub use step::{NodeField, Object, Place, Step};

use crate::Scene;
use crate::model::AnyId;
use crate::visit::ReferenceIndex;
use plan::Plan;
use step::Execution;
use twins::Twins;

/// What edits need besides the document.
#[derive(Clone, Debug, Default)]
pub(crate) struct Editing {
    index: Option<Box<ReferenceIndex>>,
    twins: Twins,
    log: ChangeLog,
}

/// What an edit did.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Applied {
    /// The edit that takes it back exactly, as long as no other has been applied since.
    pub inverse: Edit,
    /// What was touched.
    pub changes: ChangeSet,
    /// The object that the edit made, if it made one: the node, the material, the wrapper of a merged file.
    pub made: Option<AnyId>,
    /// Objects of the document that were looked at or changed: the cost of the edit.
    pub visited: u64,
    /// What could not be done as the edit asks for it, in words: what a merged document has that this one has no place for.
    pub notes: Vec<String>,
}

impl Scene {
    /// Applies an edit. Steps (an inverse) are checked: they may come from anywhere.
    ///
    /// # Errors
    /// The reason for which it is refused. The scene is as before then.
    pub fn apply(&mut self, edit: Edit) -> Result<Applied, EditError> {
        self.prepare_edits();
        let mut index = self.editing.index.take().unwrap_or_default();
        let mut twins = std::mem::take(&mut self.editing.twins);
        let applied = self.apply_with(&mut index, &mut twins, edit);
        if let Ok(applied) = &applied {
            twins.follow(self, &applied.changes);
            self.editing.log.push(&applied.changes);
        }
        (self.editing.index, self.editing.twins) = (Some(index), twins);
        applied
    }

    /// Whether [`Scene::apply`] would refuse an edit: the scene is as before, and no number is taken.
    ///
    /// # Errors
    /// As [`Scene::apply`].
    pub fn would_apply(&mut self, edit: Edit) -> Result<(), EditError> {
        if matches!(edit, Edit::Steps { .. }) {
            return Ok(());
        }
        self.prepare_edits();
        let index = self.editing.index.take().unwrap_or_default();
        let mut twins = std::mem::take(&mut self.editing.twins);
        let mut plan = Plan::new(self, &index, &mut twins);
        let planned = ops::plan(&mut plan, edit);
        plan.abandon();
        (self.editing.index, self.editing.twins) = (Some(index), twins);
        planned
    }

    fn apply_with(&mut self, index: &mut ReferenceIndex, twins: &mut Twins, edit: Edit) -> Result<Applied, EditError> {
        let is_foreign = matches!(edit, Edit::Steps { .. });
        let (steps, made, visited, notes) = match edit {
            Edit::Steps { steps } => (steps, None, 0, Vec::new()),
            edit => {
                let mut plan = Plan::new(self, index, twins);
                if let Err(error) = ops::plan(&mut plan, edit) {
                    plan.abandon();
                    return Err(error);
                }
                let (made, visited, notes) = (plan.made, plan.visited, std::mem::take(&mut plan.notes));
                (plan.finish(), made, visited, notes)
            }
        };
        let mut execution = Execution { scene: self, index, changes: ChangeSet::default(), visited };
        let mut inverse: Vec<Step> = Vec::with_capacity(steps.len());
        for (i, step) in steps.into_iter().enumerate() {
            let check = || checked::before(execution.scene, execution.index, &step);
            if is_foreign && let Err(error) = check().map_err(checked::refused(Some(i))) {
                inverse.into_iter().rev().for_each(|step| drop(execution.run(step)));
                return Err(error);
            }
            inverse.push(execution.run(step));
        }
        let check = || checked::after(execution.scene, execution.index, &execution.changes);
        if is_foreign && let Err(error) = check().map_err(checked::refused(None)) {
            inverse.into_iter().rev().for_each(|step| drop(execution.run(step)));
            return Err(error);
        }
        debug_assert_eq!(check(), Ok(()), "what was planned leads to a document");
        inverse.reverse();
        let Execution { changes, visited, .. } = execution;
        Ok(Applied { inverse: Edit::Steps { steps: inverse }, changes, made, visited, notes })
    }

    /// Makes what edits need and a freshly loaded scene does not have: the index of who refers to what, that of equal
    /// meshes, and search trees over long lists of children. The first edit does it if nobody has before; afterwards it costs nothing.
    pub fn prepare_edits(&mut self) {
        if self.editing.index.is_some() {
            return;
        }
        // Room for nodes to come, so that the first that comes does not move all of them.
        self.nodes.reserve(self.nodes.slot_bound() / 8 + 1024);
        self.nodes.values_mut().for_each(|node| node.children.prepare());
        self.scenes.values_mut().for_each(|scene| scene.roots.prepare());
        self.editing.twins = Twins::of(self);
        self.editing.index = Some(Box::new(ReferenceIndex::of(self)));
    }

    /// What edits touched, by revision.
    pub fn change_log(&self) -> &ChangeLog {
        &self.editing.log
    }

    /// Who refers to an object. `None` before the first edit or [`Scene::prepare_edits`].
    pub fn reference_index(&self) -> Option<&ReferenceIndex> {
        self.editing.index.as_deref()
    }

    /// Ends the objects that only this inverse (or an undone edit's redo) could have brought back: their ids become stale
    /// and their memory is freed. Called with what a history drops.
    pub fn forget(&mut self, edit: &Edit) {
        let Edit::Steps { steps } = edit else { return };
        for step in steps {
            if let Step::Unpark(ids) = step {
                // So that the first one's slot is the next one to be taken.
                ids.iter().rev().for_each(|&id| self.purge(id));
            }
        }
    }
}

#[cfg(test)]
mod tests;
