//! What the camera and the patches do, frame by frame.

use super::edits::Churn;
use crate::failure::Failure;
use orthant_render::world::live::LiveWorld;
use orthant_render::world::view::{Steps, Turns, WorldCamera};
use orthant_world::stream::{PatchStream, StreamOptions, StreamSource};
use orthant_world::{Aabb4, Fixed, Point4, World};
use std::sync::Arc;

/// Frames in a second of the scenario: motion is by frames, so that a slow machine flies the same way.
const RATE: f64 = 60.0;
/// The least speed of a flight, in units a second.
const SPEED: f64 = 50.0;
/// Patches that a stream sends in a frame.
const STREAM_PATCHES: usize = 16;
/// Why the compaction in the middle of `churn` is begun.
const ASKED: &str = "asked for by the scenario";

/// What happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scenario {
    /// The camera looks around, in all of its axes.
    Look,
    /// The camera flies in circles, faster and faster: from 50 to 500 units a second.
    Fly,
    /// Blocks are placed near the camera and broken anywhere, with bursts, while the camera flies; a compaction is asked for half-way.
    Churn,
    /// A source streams the world into a box about the camera, which flies.
    Stream,
}

/// A scenario as it runs.
pub struct Script {
    scenario: Scenario,
    frame: u64,
    frames: u64,
    half_extent: f64,
    churn: Option<Churn>,
    stream: Option<Box<Stream>>,
}

/// What streams, and about where.
struct Stream {
    source: PatchStream,
    about: Option<Point4>,
}

impl Script {
    /// Of so many frames, in a world of which so much is resident about the camera. `live` is what [`Self::worlds`] gave.
    pub fn new(
        scenario: Scenario,
        frames: u32,
        half_extent: f64,
        seed: u64,
        live: &LiveWorld,
        source: Option<Arc<World>>,
    ) -> Self {
        let stream = |world| Stream {
            source: PatchStream::new(StreamSource::World(world), StreamOptions::default()),
            about: None,
        };
        Self {
            scenario,
            frame: 0,
            frames: u64::from(frames),
            half_extent,
            churn: (scenario == Scenario::Churn).then(|| Churn::new(live, seed)),
            stream: source.map(|world| Box::new(stream(world))),
        }
    }

    /// The world that is resident at the beginning, and the one that is streamed, if one is.
    pub fn worlds(scenario: Scenario, world: World) -> (World, Option<Arc<World>>) {
        match scenario {
            Scenario::Stream => (World::new(), Some(Arc::new(world))),
            _ => (world, None),
        }
    }

    /// Moves the camera and patches the world.
    ///
    /// # Errors
    /// A box of interest that is too large (usage); a patch that the world refuses (bad input).
    pub fn step(&mut self, camera: &mut WorldCamera, live: &mut LiveWorld) -> Result<(), Failure> {
        self.frame += 1;
        match self.scenario {
            Scenario::Look => self.look(camera),
            _ => self.fly(camera),
        }
        if let Some(churn) = &mut self.churn {
            churn.step(self.frame, camera.position, live);
            if self.frame == self.frames / 2 {
                live.request_compaction(ASKED);
            }
        }
        if let Some(stream) = &mut self.stream {
            stream.step(camera.position, self.half_extent, live)?;
        }
        Ok(())
    }

    fn look(&self, camera: &mut WorldCamera) {
        let phase = self.frame as f64 / RATE;
        camera.steer(&Turns { yaw: 3.0, pitch: 0.5 * phase.cos(), xw: 0.7, zw: 0.3 });
    }

    /// A circle whose diameter is the half extent, with waves in height and along the hidden axis.
    fn fly(&self, camera: &mut WorldCamera) {
        let speed = SPEED * (1.0 + 9.0 * self.frame as f64 / self.frames.max(1) as f64);
        let step = speed / RATE;
        let phase = self.frame as f64 / RATE;
        camera.steer(&Turns { yaw: (step / (self.half_extent / 2.0)).to_degrees(), ..Turns::default() });
        camera.advance(&Steps {
            right: 0.0,
            up: 0.1 * step * phase.cos(),
            forward: step,
            hidden: 0.2 * step * phase.sin(),
        });
    }
}

impl Stream {
    fn step(&mut self, position: Point4, half_extent: f64, live: &mut LiveWorld) -> Result<(), Failure> {
        let half = Fixed::from_f64(half_extent).map_err(|e| Failure::usage(format!("--half-extent: {e}")))?.raw();
        let at = position.raw();
        // The cells that are of interest change when the camera has gone a part of one.
        let moved = |about: &Point4| (0..4).any(|a| (at[a] - about.raw()[a]).abs() > Fixed::ONE.raw() * 16);
        if self.about.as_ref().is_none_or(moved) {
            let (low, high) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
            let min = std::array::from_fn(|a| at[a].saturating_sub(half).max(low[a]));
            let max = std::array::from_fn(|a| at[a].saturating_add(half).min(high[a]));
            let interest = Aabb4::from_raw(min, max)
                .map_err(|e| Failure::usage(format!("the camera left the space of worlds: {e}")))?;
            self.source
                .set_interest(&interest)
                .map_err(|e| Failure::usage(e.to_string()).remedy("give a smaller --half-extent"))?;
            self.about = Some(position);
        }
        for _ in 0..STREAM_PATCHES {
            if live.offered() >= STREAM_PATCHES {
                break;
            }
            let Some(patch) = self.source.next_patch() else { break };
            live.offer_patch(patch);
        }
        Ok(())
    }
}
