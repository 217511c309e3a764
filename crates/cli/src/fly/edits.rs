//! Blocks that come and go: what a player, or a thousand of them, would do to a world.

use orthant_render::world::live::LiveWorld;
use orthant_world::edit::fill_box;
use orthant_world::{Aabb4, Block, BlockId, Fixed, Point4, Scale};
use std::collections::VecDeque;

/// Edits near the camera and far from it in a frame, each.
const EACH: u32 = 2;
/// Frames between two bursts.
const BURST_EVERY: u64 = 60;
/// Edits of a burst.
const BURST: u32 = 200;
/// Edits that are in the world at once; older ones are taken back.
const KEPT: usize = 2_000;
/// How far from the camera is near, in units.
const NEAR: i64 = 24;
/// Regions of the world that edits aim at.
const TARGETS: usize = 4_096;

/// SplitMix64.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// A number below `end`, which is above 0.
    pub fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }

    fn about(&mut self, half: i64) -> i64 {
        self.below(2 * half.max(1) as u64) as i64 - half.max(1)
    }
}

/// Edits of single blocks, and how they are taken back.
pub struct Churn {
    random: Random,
    /// Solid boxes to break blocks of.
    targets: Vec<Aabb4>,
    /// What was there before each edit, oldest first.
    undo: VecDeque<(Aabb4, Block)>,
    materials: Vec<BlockId>,
}

impl Churn {
    /// Of a world as it is now.
    pub fn new(live: &LiveWorld, seed: u64) -> Self {
        let world = live.world();
        let every = world.region_count().div_ceil(TARGETS).max(1);
        let near = |bounds: &Aabb4| bounds.overlaps(live.derived().clip());
        let targets = world.regions().filter(|(_, region)| near(&region.bounds)).step_by(every);
        let materials: Vec<BlockId> = world.palette().iter().map(|(id, _)| id).collect();
        Self {
            random: Random(seed),
            targets: targets.filter_map(|(_, region)| region.solid_bounds()).collect(),
            undo: VecDeque::new(),
            // A number without a material is drawn in the warning colour: better than nothing to place.
            materials: if materials.is_empty() { vec![BlockId(1)] } else { materials },
        }
    }

    /// The edits of a frame.
    pub fn step(&mut self, frame: u64, camera: Point4, live: &mut LiveWorld) {
        for _ in 0..EACH {
            self.place_near(camera, live);
            self.break_far(live);
        }
        if frame.is_multiple_of(BURST_EVERY) {
            for _ in 0..BURST / 2 {
                self.place_near(camera, live);
                self.break_far(live);
            }
        }
        while self.undo.len() > KEPT {
            let Some((bounds, before)) = self.undo.pop_front() else { break };
            live.offer_patch(fill_box(bounds, before));
        }
    }

    /// A block of any material near the camera.
    fn place_near(&mut self, camera: Point4, live: &mut LiveWorld) {
        let at = camera.0.map(|c| Fixed::from_raw((c.floor() + self.random.about(NEAR)) << Fixed::FRACTION_BITS));
        let material = self.materials[self.random.below(self.materials.len() as u64) as usize];
        self.edit(Point4(at), Block::of(material, Scale::UNIT), live)
    }

    /// Takes a block out of something solid, wherever it is.
    fn break_far(&mut self, live: &mut LiveWorld) {
        if self.targets.is_empty() {
            return;
        }
        let target = self.targets[self.random.below(self.targets.len() as u64) as usize];
        let (min, max) = (target.min_raw(), target.max_raw());
        let at = std::array::from_fn(|a| {
            let inside = min[a] + self.random.below((max[a] - min[a]) as u64) as i64;
            inside >> Fixed::FRACTION_BITS << Fixed::FRACTION_BITS
        });
        self.edit(Point4::from_raw(at), Block::AIR, live)
    }

    fn edit(&mut self, at: Point4, block: Block, live: &mut LiveWorld) {
        let max = at.raw().map(|c| c.saturating_add(Fixed::ONE.raw()));
        // At the end of space there is no room for a block.
        let Ok(bounds) = Aabb4::from_raw(at.raw(), max) else { return };
        let before = live.world().block_at(at);
        live.offer_patch(fill_box(bounds, block));
        self.undo.push_back((bounds, before));
    }
}
