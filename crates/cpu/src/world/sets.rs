//! The active set, and the staging set that takes its place.

use orthant_resident::BackendError;
use orthant_resident::world::{ArenaLens, MutationBatch, SetSlot, WorldApplied, WorldArenas, WorldBytes};

/// The sets of a backend in memory. Frames read [`Self::active`]; only batches and swaps write.
#[derive(Debug, Default)]
pub(crate) struct WorldSets {
    active: WorldArenas,
    staging: Option<WorldArenas>,
}

impl WorldSets {
    /// What frames see.
    pub fn active(&self) -> &WorldArenas {
        &self.active
    }

    /// A set; `None` if there is none.
    pub fn get(&self, set: SetSlot) -> Option<&WorldArenas> {
        match set {
            SetSlot::Active => Some(&self.active),
            SetSlot::Staging => self.staging.as_ref(),
        }
    }

    pub fn begin_staging(&mut self, origin: [i64; 4], lens: ArenaLens) {
        let mut staging = WorldArenas::new(origin);
        staging.nodes.reserve_exact(lens.nodes as usize);
        staging.leaves.reserve_exact(lens.leaves as usize);
        staging.payload.reserve_exact(lens.payload as usize);
        staging.palette.reserve_exact(lens.palette as usize);
        self.staging = Some(staging);
    }

    pub fn apply(&mut self, set: SetSlot, batch: &MutationBatch) -> Result<WorldApplied, BackendError> {
        let arenas = match set {
            SetSlot::Active => &mut self.active,
            SetSlot::Staging => self.staging.as_mut().ok_or(BackendError::NoStagingSet)?,
        };
        Ok(arenas.apply(batch)?)
    }

    pub fn swap(&mut self) -> Result<(), BackendError> {
        self.active = self.staging.take().ok_or(BackendError::NoStagingSet)?;
        Ok(())
    }

    pub fn drop_staging(&mut self) {
        self.staging = None;
    }

    pub fn bytes(&self, set: SetSlot) -> WorldBytes {
        self.get(set).map_or_else(WorldBytes::default, WorldArenas::bytes)
    }
}
