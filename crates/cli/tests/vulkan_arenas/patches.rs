//! Random patches: voxels, boxes and balls of all scales, air among them, on platforms of a generator; materials that come and
//! change, with textures.

use orthant_world::edit::{EditLimits, Sphere, fill_box, fill_sphere, set_voxel};
use orthant_world::{
    Aabb4, Block, BlockId, Fixed, Material, OnConflict, PaletteEntry, Pattern, Point4, Scale, Texture3, World,
    WorldPatch,
};

/// Half of the world's edge, in units.
const HALF: i32 = 40;

pub struct Patches {
    state: u64,
}

impl Patches {
    pub fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Splitmix64.
    fn random(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    fn between(&mut self, low: i32, end: i32) -> i32 {
        low + (self.random() % (end - low) as u64) as i32
    }

    /// A floor, and some of everything above it.
    pub fn world(&mut self) -> World {
        let mut world = World::new();
        let floor = Aabb4::from_ints([-HALF, -8, -HALF, -HALF], [HALF, 0, HALF, HALF]).expect("a box");
        world.apply(&self.materials()).expect("the patch is sound");
        world.apply(&fill_box(floor, Block::of(BlockId(1), Scale::UNIT))).expect("the patch is sound");
        for _ in 0..30 {
            for patch in self.next(&world) {
                world.apply(&patch).expect("the patch is sound");
            }
        }
        world
    }

    pub fn next(&mut self, world: &World) -> Vec<WorldPatch> {
        let scale = Scale::new(self.between(-3, 3) as i8).expect("a scale");
        let block = match self.random() % 3 {
            0 => Block::AIR,
            _ => Block::of(BlockId(self.between(1, 9) as u16), scale),
        };
        let near = [self.between(-9, 9), self.between(-4, 6), self.between(-9, 9), self.between(-3, 3)];
        match self.random() % 12 {
            0 => vec![self.materials()],
            1 | 2 => {
                let center = Point4::from_ints(near);
                let radius = Fixed::from_raw((1 << 16) + (self.random() % (3 << 16)) as i64);
                let sphere = Sphere { center, radius, scale: Scale::new(-1).expect("a scale") };
                let block = if block.is_air() { block } else { Block::of(block.id(), sphere.scale) };
                fill_sphere(world, &sphere, block, &EditLimits::default()).expect("the ball is small")
            }
            3 | 4 => {
                let size: [i32; 4] = std::array::from_fn(|_| self.between(1, 12));
                let bounds = Aabb4::from_ints(near, std::array::from_fn(|a| near[a] + size[a])).expect("a box");
                vec![fill_box(bounds, Block::of(block.id(), Scale::UNIT))]
            }
            _ => vec![set_voxel(near.map(i64::from), scale, block).expect("it lies in space")],
        }
    }

    /// Some of the materials, with other colours, patterns and textures.
    fn materials(&mut self) -> WorldPatch {
        let nothing = Aabb4::from_ints([9999; 4], [10000; 4]).expect("a box");
        let mut patch = fill_box(nothing, Block::AIR);
        patch.on_conflict = OnConflict::Replace;
        for id in 1..9 {
            if self.random().is_multiple_of(2) {
                patch.palette.push(PaletteEntry { id: BlockId(id), material: self.material(id) });
            }
        }
        patch
    }

    fn material(&mut self, id: u16) -> Material {
        let mut part = || (self.random() % 1000) as f32 / 1000.0;
        let plain = Material {
            name: format!("material {id}").into(),
            color: [part(), part(), part()],
            emission: [0.0; 3],
            transparency: None,
            roughness: part(),
            metallic: 0.0,
            pattern: Pattern::None,
            weight: 1.0,
        };
        match self.random() % 3 {
            0 => {
                let size = [self.between(1, 9) as u16, self.between(1, 9) as u16, self.between(1, 4) as u16];
                let bytes = 4 * size.iter().map(|&edge| usize::from(edge)).product::<usize>();
                let rgba = (0..bytes).map(|_| self.random() as u8).collect();
                Material { pattern: Pattern::Texture(Texture3 { size, rgba }), ..plain }
            }
            1 => Material { pattern: Pattern::Checker { cells: 4, contrast: 0.5 }, ..plain },
            _ => plain,
        }
    }
}
