//! What the suites for worlds share: worlds of platforms, and a live world on a backend.

use crate::failure::{Exit, Failure};
use crate::fly::live_failure;
use crate::job::backend::AnyBackend;
use orthant_render::world::live::{Budget, Diagnostics, LiveWorld};
use orthant_world::{Aabb4, Generator, Point4, RegionNode, RegionTree, World, WorldPatch};

/// Worlds of scattered boxes.
pub struct Platforms;

impl Platforms {
    /// Platforms in a cube of half extent 2,080 units.
    const DENSITY: f64 = 14_500.0;

    /// The half extent of a cube with about so many platforms.
    pub fn half_extent_of(platforms: u32) -> i32 {
        (2080.0 * (f64::from(platforms) / Self::DENSITY).powf(0.25)).ceil().max(16.0) as i32
    }

    /// The platforms of a cube about the origin.
    ///
    /// # Errors
    /// Too many of them (usage).
    pub fn world(half_extent: i32) -> Result<World, Failure> {
        let bounds = Aabb4::from_ints([-half_extent; 4], [half_extent; 4]).map_err(internal)?;
        let node = RegionNode::Procedural(Generator::Platforms { seed: 0 });
        let mut world = World::new();
        let patch = WorldPatch::of_tree(RegionTree { bounds, node });
        let refused = |e: orthant_world::ApplyError| Failure::usage(e.to_string()).remedy("give a smaller --size");
        world.apply(&patch).map_err(refused)?;
        Ok(world)
    }
}

/// A live world on a backend.
pub struct Rig {
    /// The world.
    pub live: LiveWorld,
    /// Where it is resident.
    pub backend: AnyBackend,
}

impl Rig {
    /// Makes the world resident.
    ///
    /// # Errors
    /// Of the backend.
    pub fn new(mut live: LiveWorld, mut backend: AnyBackend) -> Result<Self, Failure> {
        live.load(&mut *backend).map_err(live_failure)?;
        Ok(Self { live, backend })
    }

    /// Applies a patch to the world.
    ///
    /// # Errors
    /// A fault of the benchmark.
    pub fn patch(&mut self, patch: &WorldPatch) -> Result<(), Failure> {
        self.live.apply_patch(patch).map(|_| ()).map_err(internal)
    }

    /// One frame's edits, seen from the origin.
    ///
    /// # Errors
    /// Of the backend.
    pub fn tick(&mut self, budget: &Budget) -> Result<Diagnostics, Failure> {
        self.live.tick(&mut *self.backend, Point4::from_ints([0; 4]), budget).map_err(live_failure)
    }

    /// Ticks until nothing waits.
    ///
    /// # Errors
    /// Of the backend.
    pub fn settle(&mut self) -> Result<(), Failure> {
        while !self.live.is_settled() {
            self.tick(&Budget::UNLIMITED)?;
        }
        Ok(())
    }
}

/// Runs on a pool of so many threads.
///
/// # Errors
/// If the system gives no threads.
pub fn on_pool<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(internal)?;
    Ok(pool.install(work))
}

/// A fault of the program.
pub fn internal(what: impl ToString) -> Failure {
    Failure::new(Exit::Internal, what.to_string())
}
