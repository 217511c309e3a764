//! Rendering what is resident: a frame knows nothing of the live world, and cannot change it.

use crate::failure::Failure;
use crate::job::backend::{AnyBackend, backend_failure};
use crate::job::world_view::WorldShot;
use orthant_render::world::light::preview_light;
use orthant_render::world::view::Look;
use orthant_resident::backend::TicketStatus;
use orthant_resident::frame::{Estimator, PixelFilter, Tile};
use orthant_resident::world::Shade;
use orthant_resident::{Environment, Film, Frame};
use std::time::Duration;

/// Who looks at the world, and how.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Position, turns, layers.
    pub shot: WorldShot,
    /// The light in which hits are shaded.
    pub shade: Shade,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples of a pixel.
    pub spp: u32,
    /// Seed of the samples.
    pub seed: u32,
    /// Threads; 0 takes all.
    pub threads: usize,
}

/// Path vertices after the camera.
const MAX_DEPTH: u32 = 8;
/// Path vertices before Russian roulette may end a path.
const ROULETTE_DEPTH: u32 = 4;
/// How long the backend works between two looks.
const SLICE: Duration = Duration::from_millis(100);

impl Camera {
    /// How hits are shaded in an environment. To be found once, not for every frame: the preview's light is a mean over all directions.
    pub fn shade(shot: &WorldShot, environment: &Environment) -> Shade {
        if shot.path { Shade::Path } else { preview_light(environment) }
    }

    /// The frame that is seen now.
    pub fn frame(&self) -> Frame {
        let WorldShot { camera, mode, distance, edges, .. } = &self.shot;
        let view = camera.view(mode, &Look { shade: self.shade, distance: *distance, edges: *edges });
        let (width, height) = (self.width, self.height);
        Frame {
            camera: self.shot.frame_camera(&view),
            width,
            height,
            tile: Tile { x: 0, y: 0, width, height },
            samples: 0..self.spp,
            keep_blocks: false,
            seed: self.seed,
            max_depth: MAX_DEPTH,
            roulette_depth: ROULETTE_DEPTH,
            firefly_clamp: None,
            estimator: Estimator::Mis,
            filter: PixelFilter::Box,
            aovs: Vec::new(),
            threads: self.threads,
            world: Some(view),
        }
    }

    /// Renders it, and gives the picture if that is wanted.
    ///
    /// # Errors
    /// Of the backend.
    pub fn render(&self, backend: &mut AnyBackend, has_picture: bool) -> Result<(Option<Film>, TicketStatus), Failure> {
        let ticket = backend.submit(self.frame()).map_err(backend_failure)?;
        let status = loop {
            let status = backend.poll(ticket, SLICE).map_err(backend_failure)?;
            if status.is_done() {
                break status;
            }
        };
        let film = has_picture.then(|| backend.read_film(ticket).map_err(backend_failure)).transpose()?;
        Ok((film, status))
    }
}
