//! Closing the holes that removed render nodes have left: an operation of its own, with a budget, never a part of an edit.

use super::{Sync, SyncReport, Work};
use crate::DeriveError;
use crate::derived::DerivedScene;
use orthant_resident::SceneBatch;
use orthant_resident::rows::{NONE, RenderNodeRow};
use orthant_scene::Scene;
use orthant_scene::animation::Posed;

impl DerivedScene {
    /// Whether more than half of the render-node buffer is holes.
    pub fn holes_are_due(&self) -> bool {
        u64::from(self.free_render_nodes()) * 2 > self.render_nodes.len() as u64
    }

    /// Moves render nodes from the end of their buffer into its holes, at most `max_rows` rows (but one node's at least), and
    /// shortens it. Nodes keep the order of their rows; render-node indices change, so TLAS instances do. Does nothing without
    /// holes; [`DerivedScene::free_render_nodes`] says how many are left.
    ///
    /// # Errors
    /// If the scene was derived without [`crate::DeriveOptions::live`], or the last sync failed.
    pub fn close_holes(&mut self, scene: &Scene, max_rows: u32) -> Result<(SceneBatch, SyncReport), DeriveError> {
        if self.live.as_ref().is_some_and(|live| live.has_failed) {
            let what = "the last sync failed, and its rows may be of neither state";
            return Err(DeriveError::new("", what, "take the edit back and sync first"));
        }
        let Some(mut live) = self.live.take() else { return Err(super::not_live()) };
        let pose = std::mem::take(&mut self.pose);
        let posed = Posed::new(scene, &pose);
        let mut sync = Sync { derived: self, live: &mut live, scene, posed, work: Work::default() };
        sync.close_holes(max_rows);
        let result = sync.batch();
        (self.pose, self.live) = (pose, Some(live));
        Ok(result)
    }
}

impl Sync<'_> {
    fn close_holes(&mut self, max_rows: u32) {
        let mut left = max_rows;
        let mut is_first = true;
        loop {
            let first_hole = self.live.node_spans.free_spans().next();
            let Some((hole, length)) = first_hole else { break };
            // The last node into the hole that it fits best; if it is too large for all of them, what follows the first hole
            // slides down to where that begins.
            let last = self.span_at(self.live.node_spans.end() - 1);
            let ((entry, first, count), to) = match self.live.node_spans.hole_for(last.2) {
                Some(to) => (last, to),
                None => (self.span_at(hole + length), hole),
            };
            if count > left && !is_first {
                break;
            }
            (left, is_first) = (left.saturating_sub(count), false);
            self.live.node_spans.free(first, count);
            self.live.node_spans.take(to, count);
            self.move_rows(entry, first, to, count);
        }
        let end = self.live.node_spans.end() as usize;
        self.derived.render_nodes.truncate(end);
        self.derived.owners.truncate(end);
    }

    /// The entry whose rows hold a row that is in use, its first row and how many it has.
    fn span_at(&self, row: u32) -> (u32, u32, u32) {
        let entry = self.derived.owners[row as usize];
        let node = &self.derived.hierarchy.nodes[entry as usize];
        (entry, node.first_render_node, node.render_node_count)
    }

    /// Moves rows down.
    fn move_rows(&mut self, entry: u32, first: u32, to: u32, count: u32) {
        for i in 0..count {
            let row = self.derived.render_nodes[(first + i) as usize];
            if row.emitter != NONE {
                self.derived.emitters[row.emitter as usize].render_node = to + i;
                self.live.dirty.emitters.mark(row.emitter);
            }
            self.put_row(to + i, row);
            self.derived.owners[(to + i) as usize] = entry;
        }
        for row in first.max(to + count)..first + count {
            self.put_row(row, RenderNodeRow::HOLE);
            self.derived.owners[row as usize] = NONE;
        }
        self.derived.hierarchy.nodes[entry as usize].first_render_node = to;
    }
}
