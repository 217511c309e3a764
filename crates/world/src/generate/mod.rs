//! Generators: worlds from a seed, any box on demand, at a cost by the box asked for.
//!
//! Whatever boxes are asked for, they agree where they overlap: content is a function of place and seed alone.

mod flat;

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
}

/// The box has more regions than are allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the box has more than {limit} regions; ask for smaller boxes")]
pub struct TooManyRegions {
    /// The limit.
    pub limit: usize,
}

impl Generator {
    /// The generator of a name, for those that have one.
    pub fn by_name(name: &str, _seed: u64) -> Option<Self> {
        match name {
            "empty" => Some(Self::Empty),
            "flat" => Some(Self::Flat),
            _ => None,
        }
    }

    /// The materials of its blocks: block number `n` is entry `n - 1`.
    pub fn materials(&self) -> Vec<Material> {
        match self {
            Self::Empty => Vec::new(),
            Self::Flat => flat::materials(),
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
        };
        if regions.len() > limit { Err(TooManyRegions { limit }) } else { Ok(regions) }
    }
}

/// The block of an entry of [`Generator::materials`], at unit scale.
fn block(entry: u16) -> Block {
    Block::of(crate::block::BlockId(entry + 1), crate::space::Scale::UNIT)
}
