//! The frame loop of worlds without a window: patches, a tick of the live world, a frame, a line of diagnostics.
//!
//! * [`scenario`]: what the camera and the patches do;
//! * [`edits`]: blocks that come and go;
//! * [`frame`]: rendering what is resident;
//! * [`line`]: diagnostics as JSON.

pub mod edits;
pub mod frame;
pub mod line;
pub mod scenario;

pub use frame::Camera;
pub use scenario::{Scenario, Script};

use crate::failure::Failure;
use crate::job::backend::{AnyBackend, backend_failure};
use crate::job::world_view::world_failure;
use orthant_render::world::live::{Budget, Diagnostics, LiveError, LiveWorld};
use orthant_resident::Film;
use std::time::Instant;

/// A world that is edited while it is shown.
pub struct Flight {
    /// The world.
    pub live: LiveWorld,
    /// What renders it.
    pub backend: AnyBackend,
    /// Who looks at it.
    pub camera: Camera,
    /// What a frame may spend on edits.
    pub budget: Budget,
    /// Whether what is resident is compared with the mirror after every frame.
    pub validate: bool,
}

impl Flight {
    /// One frame: the script moves the camera and patches the world, the edits that the budget allows are applied, and what is
    /// resident is rendered. Gives what it did, and the picture if that is wanted.
    ///
    /// # Errors
    /// A backend that is gone or cannot follow (missing), a frame that it does not render (usage); a difference between the
    /// mirror and what is resident (check failed).
    pub fn frame(&mut self, script: &mut Script, has_picture: bool) -> Result<(Diagnostics, Option<Film>), Failure> {
        let start = Instant::now();
        script.step(&mut self.camera.shot.camera, &mut self.live)?;
        let position = self.camera.shot.camera.position;
        let mut diagnostics = self.live.tick(&mut *self.backend, position, &self.budget).map_err(live_failure)?;
        let (film, status) = self.camera.render(&mut self.backend, has_picture)?;
        diagnostics.frame_ms = start.elapsed().as_secs_f64() * 1e3;
        diagnostics.rays = status.world;
        if self.validate && self.live.is_following() {
            self.backend.validate_world(self.live.derived()).map_err(|failure| {
                let what = format!("frame {}: {}", diagnostics.frame, failure.what);
                Failure { what, ..failure }
            })?;
        }
        Ok((diagnostics, film))
    }
}

/// Why the frame loop ended.
pub fn live_failure(error: LiveError) -> Failure {
    match error {
        LiveError::World(error) => world_failure(error),
        LiveError::Patch(error) => Failure::new(crate::failure::Exit::BadInput, error.to_string()),
        LiveError::Backend(error) => backend_failure(error),
        rebuild @ LiveError::Rebuild { .. } => Failure::missing(rebuild.to_string()),
    }
}
