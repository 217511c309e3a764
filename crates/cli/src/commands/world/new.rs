//! `orthant world new`: what a generator makes of a cube.

use crate::args::{Common, NewArgs};
use crate::failure::Failure;
use crate::job::Progress;
use crate::job::world::{check_extension, write_world};
use crate::output::check_outputs;
use orthant_world::{
    Aabb4, ApplyError, Fixed, Generator, Point4, RegionNode, RegionTree, TreeError, World, WorldPatch,
};

/// Memory of a region while it is made: in the tree, in the patch, in the world and in its index.
const REGION_BYTES: u64 = 1 << 10;
/// Memory of a chunk besides, at most: 4,096 blocks of four bytes while it is made, and packed.
const CHUNK_BYTES: u64 = 24 << 10;
/// Terrain is made by columns of this edge, in units: whole chunks, which have 16.
const COLUMN: i64 = 64;

/// Generates, and writes the world.
///
/// # Errors
/// An output that is no .orw file (usage); a world that takes more memory than is allowed (usage); an I/O error.
pub fn run(args: &NewArgs, common: &Common) -> Result<(), Failure> {
    check_extension("-o", &args.output)?;
    check_outputs(&[("-o", &args.output)], &[])?;
    let generator = Generator::by_name(&args.generator, args.seed)
        .ok_or_else(|| Failure::usage(format!("there is no generator {:?}", args.generator)))?;
    let (low, high) = (Fixed::from_raw(-args.half_extent.raw()), args.half_extent);
    let cube =
        Aabb4::new(Point4([low; 4]), Point4([high; 4])).map_err(|e| Failure::usage(format!("--half-extent: {e}")))?;
    let mut builder = Builder { world: World::new(), generator, max_memory: common.max_memory() };
    let columns = builder.columns(&cube)?;
    let mut progress = Progress::new(common.quiet);
    for (done, column) in columns.iter().enumerate() {
        builder.add(column)?;
        progress.step("generating", done as u64 + 1, columns.len() as u64);
    }
    progress.finish();
    write_world(&args.output, &builder.world)
}

struct Builder {
    world: World,
    generator: Generator,
    max_memory: u64,
}

impl Builder {
    /// The boxes that are made one by one. Content that has no chunks is made at once: its boxes are whole then.
    fn columns(&self, cube: &Aabb4) -> Result<Vec<Aabb4>, Failure> {
        if !matches!(self.generator, Generator::Terrain { .. }) {
            return Ok(vec![*cube]);
        }
        let unit = Fixed::ONE.raw();
        let (min, max) = (cube.min_raw(), cube.max_raw());
        let edge = COLUMN * unit;
        let first = min[0].div_euclid(edge);
        let count = (max[0] - 1).div_euclid(edge) - first + 1;
        // Each column has one chunk at least; before a list of them is made, they are counted.
        if (count as u128).pow(2) * u128::from(CHUNK_BYTES) > u128::from(self.max_memory) {
            return Err(self.too_large());
        }
        let mut columns = Vec::new();
        for z in first..first + count {
            for x in first..first + count {
                let mut low = min;
                let mut high = max;
                for (axis, at) in [(0, x), (2, z)] {
                    low[axis] = low[axis].max(at * edge);
                    high[axis] = high[axis].min((at + 1) * edge);
                }
                columns.extend(Aabb4::from_raw(low, high).ok());
            }
        }
        Ok(columns)
    }

    fn add(&mut self, bounds: &Aabb4) -> Result<(), Failure> {
        let taken = self.world.region_count() as u64 * self.bytes_per_region();
        let regions = (self.max_memory.saturating_sub(taken) / self.bytes_per_region()).min(1 << 31) as usize;
        let limits = orthant_world::Limits { regions };
        let node = RegionNode::Procedural(self.generator.clone());
        let patch = WorldPatch::of_tree(RegionTree { bounds: *bounds, node });
        match self.world.apply_within(&patch, &limits) {
            Ok(_) => Ok(()),
            Err(ApplyError::Tree(TreeError::TooLarge { .. }) | ApplyError::WorldFull(_)) => Err(self.too_large()),
            Err(error) => Err(Failure::usage(error.to_string())),
        }
    }

    fn bytes_per_region(&self) -> u64 {
        if matches!(self.generator, Generator::Terrain { .. }) { REGION_BYTES + CHUNK_BYTES } else { REGION_BYTES }
    }

    fn too_large(&self) -> Failure {
        let what = format!("the world takes more memory than the limit of {} bytes", self.max_memory);
        Failure::usage(what).remedy("give a smaller --half-extent, or raise --max-memory")
    }
}
