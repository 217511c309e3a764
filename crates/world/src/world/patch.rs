//! Patches, the only way in which a world changes, and what applying one says.

use super::region::{Region, RegionId};
use crate::block::BlockId;
use crate::palette::{OnConflict, PaletteEntry, PaletteError};
use crate::space::Aabb4;
use crate::tree::{RegionTree, TreeError};
use serde::{Deserialize, Serialize};

/// Inside of the bounds the subtree replaces everything, absence included; outside of them nothing changes.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(try_from = "PatchWire")]
pub struct WorldPatch {
    /// What the patch decides about.
    pub authoritative_bounds: Aabb4,
    /// What is there from now on. It lies within the bounds; what it does not cover is air.
    pub subtree: RegionTree,
    /// Materials that the patch brings, under the numbers that its blocks call them by. Other numbers are the world's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub palette: Vec<PaletteEntry>,
    /// What becomes of a material whose name the world has with another content.
    #[serde(default, skip_serializing_if = "is_refuse")]
    pub on_conflict: OnConflict,
}

fn is_refuse(on_conflict: &OnConflict) -> bool {
    *on_conflict == OnConflict::Refuse
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PatchWire {
    authoritative_bounds: Aabb4,
    subtree: crate::tree::TreeWire,
    #[serde(default)]
    palette: Vec<PaletteEntry>,
    #[serde(default)]
    on_conflict: OnConflict,
}

impl TryFrom<PatchWire> for WorldPatch {
    type Error = String;

    fn try_from(wire: PatchWire) -> Result<Self, String> {
        Ok(Self {
            authoritative_bounds: wire.authoritative_bounds,
            subtree: wire.subtree.into_tree(Some(wire.authoritative_bounds))?,
            palette: wire.palette,
            on_conflict: wire.on_conflict,
        })
    }
}

impl WorldPatch {
    /// A patch that brings no materials.
    pub const fn new(authoritative_bounds: Aabb4, subtree: RegionTree) -> Self {
        Self { authoritative_bounds, subtree, palette: Vec::new(), on_conflict: OnConflict::Refuse }
    }

    /// A patch whose subtree fills its bounds.
    pub const fn of_tree(subtree: RegionTree) -> Self {
        Self::new(subtree.bounds, subtree)
    }
}

/// How much a patch may make.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Regions that the subtree may have, those of generators included.
    pub regions: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { regions: 1 << 22 }
    }
}

/// Why a patch was refused. The world is then unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ApplyError {
    /// The subtree is none, or too large.
    #[error(transparent)]
    Tree(#[from] TreeError),
    /// Its materials do not go with the world's.
    #[error(transparent)]
    Palette(#[from] PaletteError),
    /// The subtree reaches out of the bounds.
    #[error(
        "the subtree {subtree:?} leaves the authoritative bounds {bounds:?}; a patch changes nothing outside of them"
    )]
    Outside {
        /// The subtree's box.
        subtree: Box<Aabb4>,
        /// The patch's bounds.
        bounds: Box<Aabb4>,
    },
    /// Regions are numbered by 31 bits.
    #[error("the world would have more than {0} regions; split it")]
    WorldFull(u32),
}

/// What applying a patch did: everything that a derived structure needs in order to follow.
#[derive(Clone, Debug, Default)]
pub struct Applied {
    /// The world's revision before.
    pub revision_before: u64,
    /// The world's revision now: one more, or the same if nothing changed.
    pub revision: u64,
    /// Where blocks changed: disjoint boxes, each the smallest about what changed in one region of the old or the new
    /// content. Outside of them nothing changed.
    pub changed: Vec<Aabb4>,
    /// Regions that are gone, as they were.
    pub removed: Vec<(RegionId, Region)>,
    /// Regions that are new.
    pub added: Vec<RegionId>,
    /// Chunk regions that have the bounds they had and other blocks, with what they were.
    pub updated: Vec<(RegionId, Region)>,
    /// Materials that are new or other than before.
    pub palette: Vec<BlockId>,
    /// What it cost.
    pub work: Work,
}

impl Applied {
    /// Whether the patch changed nothing: nothing was written.
    pub fn is_noop(&self) -> bool {
        self.revision == self.revision_before
    }
}

/// Work counted, for bounds that do not depend on a clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Regions looked at.
    pub regions_read: u64,
    /// Regions put in, taken out or rewritten.
    pub regions_written: u64,
    /// Nodes of the index read, by searches and by edits of it.
    pub index_nodes: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_outermost_tree_of_a_patch_may_leave_out_its_bounds() {
        let json = r#"{"authoritative_bounds":{"min":[0,0,0,0],"max":[4,4,4,4]},"subtree":{"uniform":3}}"#;
        let patch: WorldPatch = serde_json::from_str(json).unwrap();
        assert_eq!(patch.subtree.bounds, patch.authoritative_bounds);
        let again: WorldPatch = serde_json::from_str(&serde_json::to_string(&patch).unwrap()).unwrap();
        assert_eq!(again, patch);
        let inner =
            r#"{"authoritative_bounds":{"min":[0,0,0,0],"max":[4,4,4,4]},"subtree":{"branch":[{"uniform":3}]}}"#;
        assert!(serde_json::from_str::<WorldPatch>(inner).is_err());
    }
}
