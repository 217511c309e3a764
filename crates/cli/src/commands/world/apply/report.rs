//! A line of the report: what a patch did, and what it made the planner write.

use super::follow::Planned;
use orthant_world::Applied;
use orthant_world::edit::WorldEdit;
use serde_json::{Value, json};
use std::time::Duration;

/// What a line of the script did.
#[derive(Clone, Debug)]
pub struct Entry {
    kind: &'static str,
    patches: usize,
    regions: [usize; 3],
    changed: usize,
    materials: usize,
    revision: u64,
    time: Duration,
    /// What followed.
    pub planned: Planned,
}

impl Entry {
    /// Of an edit of this kind.
    pub fn new(kind: &'static str, applied: &[Applied], time: Duration) -> Self {
        let sum = |count: fn(&Applied) -> usize| applied.iter().map(count).sum();
        Self {
            kind,
            patches: applied.len(),
            regions: [sum(|a| a.added.len()), sum(|a| a.removed.len()), sum(|a| a.updated.len())],
            changed: sum(|a| a.changed.len()),
            materials: sum(|a| a.palette.len()),
            revision: applied.last().map_or(0, |a| a.revision),
            time,
            planned: Planned::default(),
        }
    }

    /// As JSON.
    pub fn line(&self) -> Value {
        let us = |time: Duration| (time.as_secs_f64() * 1e7).round() / 10.0;
        let [added, removed, updated] = self.regions;
        let planned = &self.planned;
        json!({
            "op": self.kind,
            "patches": self.patches,
            "apply_us": us(self.time),
            "plan_us": us(planned.plan_time),
            "commit_us": us(planned.commit_time),
            "changed": self.changed,
            "regions": { "added": added, "removed": removed, "updated": updated },
            "materials": self.materials,
            "operations": planned.operations,
            "batches": planned.batches,
            "expected_root": planned.expected_root.0,
            "new_root": planned.new_root.0,
            "expected_revision": planned.expected_revision,
            "new_revision": planned.new_revision,
            "node_writes": planned.node_writes,
            "leaf_writes": planned.leaf_writes,
            "payload_writes": planned.payload_writes,
            "payload_words": planned.payload_words,
            "palette_writes": planned.palette_writes,
            "freed_nodes": planned.freed_nodes,
            "freed_leaves": planned.freed_leaves,
            "freed_payload_spans": planned.freed_payload_spans,
            "leaves_added": planned.leaves_added,
            "leaves_removed": planned.leaves_removed,
            "leaves_changed": planned.leaves_changed,
            "upload_bytes": planned.upload_bytes,
            "leaves": planned.leaves,
            "depth": planned.depth,
            "revision": self.revision,
        })
    }
}

/// The kind of an edit, as the script names it.
pub fn name(edit: &WorldEdit) -> &'static str {
    match edit {
        WorldEdit::Set { .. } => "set",
        WorldEdit::Fill { .. } => "fill",
        WorldEdit::Sphere { .. } => "sphere",
        WorldEdit::Patch(_) => "patch",
    }
}
