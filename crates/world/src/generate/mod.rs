//! Generators: worlds from a seed, any box on demand, at a cost by the box asked for.
//!
//! Whatever boxes are asked for, they agree where they overlap: content is a function of place and seed alone.

mod flat;
mod hash;
mod platforms;
mod terrain;

use crate::block::Block;
use crate::palette::Material;
use crate::space::Aabb4;
use crate::world::Region;
use serde::{Deserialize, Serialize};

/// A world that is computed.
#[derive(Clone, PartialEq, Eq, Hash, Debug, Serialize, Deserialize)]
#[serde(tag = "generator", rename_all = "lowercase", deny_unknown_fields)]
pub enum Generator {
    /// Air.
    Empty,
    /// Ground: `-8 <= y < 0`, unbounded in x, z and w.
    Flat,
    /// Boxes scattered in four dimensions.
    Platforms {
        /// Which scatter.
        #[serde(default)]
        seed: u64,
    },
    /// Hills, seas, caves and trees in `0 <= w < 1`.
    Terrain {
        /// Which landscape.
        #[serde(default)]
        seed: u64,
    },
}

/// The box has more regions than are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box has more than {limit} regions; ask for smaller boxes")]
pub struct TooManyRegions {
    /// The limit.
    pub limit: usize,
}

impl Generator {
    /// Every name that [`Self::by_name`] knows.
    pub const NAMES: [&str; 4] = ["flat", "platforms", "terrain", "empty"];

    /// The generator of a name; those without a seed ignore it.
    pub fn by_name(name: &str, seed: u64) -> Option<Self> {
        match name {
            "empty" => Some(Self::Empty),
            "flat" => Some(Self::Flat),
            "platforms" => Some(Self::Platforms { seed }),
            "terrain" => Some(Self::Terrain { seed }),
            _ => None,
        }
    }

    /// The materials of its blocks: block number `n` is entry `n - 1`.
    pub fn materials(&self) -> Vec<Material> {
        match self {
            Self::Empty => Vec::new(),
            Self::Flat => flat::materials(),
            Self::Platforms { .. } => platforms::materials(),
            Self::Terrain { .. } => terrain::materials(),
        }
    }

    /// What is in the box: disjoint regions that lie in it, whose blocks are numbered as in [`Self::materials`].
    ///
    /// # Errors
    /// [`TooManyRegions`] if there are more than `limit`; found out before they are made.
    pub fn regions(&self, bounds: &Aabb4, limit: usize) -> Result<Vec<Region>, TooManyRegions> {
        let regions = match self {
            Self::Empty => Vec::new(),
            Self::Flat => flat::regions(bounds),
            Self::Platforms { seed } => platforms::regions(*seed, bounds, limit)?,
            Self::Terrain { seed } => terrain::regions(*seed, bounds, limit)?,
        };
        if regions.len() > limit { Err(TooManyRegions { limit }) } else { Ok(regions) }
    }
}

/// The block of an entry of [`Generator::materials`], at unit scale.
fn block(entry: u16) -> Block {
    Block::of(crate::block::BlockId(entry + 1), crate::space::Scale::UNIT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{RegionNode, RegionTree, World, WorldPatch};

    fn world_of(generator: &Generator, boxes: &[Aabb4]) -> World {
        let mut world = World::new();
        for &bounds in boxes {
            let node = RegionNode::Procedural(generator.clone());
            world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).unwrap();
        }
        world.validate().unwrap();
        world
    }

    fn ints(min: [i32; 4], max: [i32; 4]) -> Aabb4 {
        Aabb4::from_ints(min, max).unwrap()
    }

    #[test]
    fn any_boxes_give_the_same_content_where_they_overlap() {
        let cases = [
            (Generator::Flat, ints([-50; 4], [50; 4])),
            (Generator::Platforms { seed: 5 }, ints([-900; 4], [800; 4])),
            (Generator::Terrain { seed: 5 }, ints([-40, -70, -40, -3], [40, 100, 40, 5])),
        ];
        for (generator, whole) in cases {
            let (min, max) = (whole.min_raw(), whole.max_raw());
            let middle: [i64; 4] = std::array::from_fn(|a| min[a] / 3 + max[a] / 5 + 7 * a as i64);
            let hole = Aabb4::from_raw(middle, std::array::from_fn(|a| (middle[a] + (1 << 22)).min(max[a]))).unwrap();
            // All at once; in slabs about a hole, and the hole; and twice with overlaps.
            let once = world_of(&generator, &[whole]);
            let mut parts = whole.subtract(&hole).to_vec();
            parts.push(hole);
            let pieces = world_of(&generator, &parts);
            assert!(once == pieces, "{generator:?}");
            let mut again = parts.clone();
            again.extend(parts);
            let twice = world_of(&generator, &again);
            assert_eq!(twice.revision(), pieces.revision(), "{generator:?}: what is there already is no change");
        }
    }

    #[test]
    fn names_and_seeds_lead_to_generators() {
        for name in Generator::NAMES {
            let generator = Generator::by_name(name, 3).unwrap();
            let json = serde_json::to_string(&generator).unwrap();
            assert!(json.contains(name), "{json}");
            assert_eq!(serde_json::from_str::<Generator>(&json).unwrap(), generator);
        }
        assert_eq!(Generator::by_name("moon", 0), None);
        let bounds = ints([-600; 4], [600; 4]);
        let seeds = [1, 2].map(|seed| world_of(&Generator::Platforms { seed }, &[bounds]));
        assert!(seeds[0] != seeds[1]);
    }
}
