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

    /// Nothing is reserved: the first batch brings the lengths, and arenas take them at once, see [`WorldArenas::apply`].
    pub fn begin_staging(&mut self, origin: [i64; 4], _lens: ArenaLens) {
        self.drop_staging();
        self.staging = Some(WorldArenas::new(origin));
    }

    pub fn apply(&mut self, set: SetSlot, batch: &MutationBatch) -> Result<WorldApplied, BackendError> {
        let arenas = match set {
            SetSlot::Active => &mut self.active,
            SetSlot::Staging => self.staging.as_mut().ok_or(BackendError::NoStagingSet)?,
        };
        Ok(arenas.apply(batch)?)
    }

    pub fn swap(&mut self) -> Result<(), BackendError> {
        let staging = self.staging.take().ok_or(BackendError::NoStagingSet)?;
        drop_elsewhere(std::mem::replace(&mut self.active, staging));
        Ok(())
    }

    pub fn drop_staging(&mut self) {
        if let Some(staging) = self.staging.take() {
            drop_elsewhere(staging);
        }
    }

    pub fn bytes(&self, set: SetSlot) -> WorldBytes {
        self.get(set).map_or_else(WorldBytes::default, WorldArenas::bytes)
    }
}

/// Gives the memory of a large set back on a thread of its own: that takes the system milliseconds, which no frame has.
fn drop_elsewhere(old: WorldArenas) {
    const SMALL: u64 = 4 << 20;
    let bytes = old.bytes();
    if bytes.nodes + bytes.leaves + bytes.payload > SMALL {
        // Where there is no thread, the set was dropped with the closure.
        drop(std::thread::Builder::new().name("orthant-drop".into()).spawn(move || drop(old)));
    }
}
