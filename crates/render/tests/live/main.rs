//! Live worlds: queue and budgets, compaction, and faults, on a backend that is nothing but arenas.

mod backend;
mod camera;
mod compaction;
mod faults;
mod offered;
mod oracle;
mod queue;
mod stream;

use backend::Arenas;
use oracle::{Shadow, content};
use orthant_render::world::live::{Budget, Diagnostics, LiveOptions, LiveWorld};
use orthant_world::{Aabb4, Block, BlockId, Generator, Point4, RegionNode, RegionTree, Scale, World, WorldPatch, edit};

/// A live world on a backend, beside its shadow.
struct Rig {
    live: LiveWorld,
    backend: Arenas,
    shadow: Shadow,
    camera: Point4,
}

impl Rig {
    fn new(world: World, options: LiveOptions) -> Self {
        let mut live = LiveWorld::new(world, options).expect("a small world");
        let mut backend = Arenas::default();
        live.load(&mut backend).expect("arenas take what is loaded");
        let shadow = Shadow::new(live.world());
        Self { live, backend, shadow, camera: Point4::from_ints([0; 4]) }
    }

    fn set(&mut self, at: [i64; 4], id: u16) {
        self.patch(&edit::set_voxel(at, Scale::UNIT, block(id)).expect("a voxel"));
    }

    fn patch(&mut self, patch: &WorldPatch) {
        self.live.apply_patch(patch).expect("a patch");
    }

    /// A tick after which the set shows what the shadow says.
    fn tick(&mut self, budget: &Budget) -> Diagnostics {
        let frame = self.tick_unchecked(budget);
        self.check();
        frame
    }

    fn tick_unchecked(&mut self, budget: &Budget) -> Diagnostics {
        let frame = self.live.tick(&mut self.backend, self.camera, budget).expect("a backend that lives");
        self.shadow.follow(&self.live);
        frame
    }

    fn check(&self) {
        let shown = content(&self.backend.active);
        assert!(shown.same_content(&nameless(&self.shadow.active)), "the set shows what it should");
    }

    /// Ticks until nothing is left to do; every frame's diagnostics.
    fn settle(&mut self, budget: &Budget) -> Vec<Diagnostics> {
        let mut frames = Vec::new();
        while !self.live.is_settled() {
            assert!(frames.len() < 100_000, "it never settles");
            if self.live.is_compacting() {
                // The other thread needs some time.
                std::thread::sleep(std::time::Duration::from_micros(200));
            }
            frames.push(self.tick_unchecked(budget));
        }
        self.check();
        assert!(content(&self.backend.active).same_content(&nameless(self.live.world())), "all was done");
        self.live.derived().validate().expect("every invariant holds");
        frames
    }
}

/// The world without the names of its materials: numbers are compared.
fn nameless(world: &World) -> World {
    let mut bare = World::new();
    bare.apply(&WorldPatch::of_tree(world.extract(&Aabb4::SPACE))).expect("content of a world");
    bare
}

fn block(id: u16) -> Block {
    if id == 0 { Block::AIR } else { Block::of(BlockId(id), Scale::UNIT) }
}

fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
    Aabb4::from_ints(min, max).expect("a box")
}

fn platforms(half_extent: i32) -> World {
    let bounds = ints([-half_extent; 4], [half_extent; 4]);
    let mut world = World::new();
    let node = RegionNode::Procedural(Generator::Platforms { seed: 1 });
    world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).expect("platforms");
    world
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }

    /// A coordinate in `-half..half`.
    fn about(&mut self, half: i64) -> i64 {
        self.below(2 * half as u64) as i64 - half
    }
}
