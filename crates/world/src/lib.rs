//! The authoritative voxel world of Orthant, in four dimensions.
//!
//! A [`World`] holds disjoint regions, each a box of one block or a part of a chunk of 4,096 blocks. It changes by
//! [`WorldPatch`] and nothing else; applying one says exactly what changed ([`Applied`]), at a cost by what it touches. The
//! crate knows nothing of rendering.
//!
//! ```
//! use orthant_world::{Aabb4, Block, Material, Point4, RegionTree, Scale, World, WorldPatch, WorldStats};
//!
//! let mut world = World::new();
//! // A platform: one region, however large.
//! let bounds = Aabb4::from_ints([-1000, 0, -1000, -1000], [1000, 16, 1000, 1000])?;
//! let mut patch = WorldPatch::of_tree(RegionTree::uniform(bounds, serde_json::from_str("1")?));
//! patch.palette = serde_json::from_str(r#"[{"id": 1, "material": {"name": "stone", "color": [0.3, 0.3, 0.3]}}]"#)?;
//! world.apply(&patch)?;
//! assert_eq!(world.region_count(), 1);
//!
//! // Take one block out of its middle.
//! let hole = Aabb4::from_ints([3, 4, 5, 6], [4, 5, 6, 7])?;
//! let applied = world.apply(&WorldPatch::of_tree(RegionTree::empty(hole)))?;
//! assert_eq!(applied.changed, [hole]);
//! assert!(world.block_at(Point4::from_ints([3, 4, 5, 6])).is_air());
//! assert!(!world.block_at(Point4::from_ints([4, 4, 5, 6])).is_air());
//!
//! // What changes nothing writes nothing.
//! assert!(world.apply(&WorldPatch::of_tree(RegionTree::empty(hole)))?.is_noop());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod block;
mod chunk;
pub mod edit;
pub mod file;
pub mod generate;
pub mod import;
mod palette;
mod space;
pub mod stream;
mod tree;
mod world;

pub use block::{Block, BlockError, BlockId, Orientation, OrientationError};
pub use chunk::Chunk;
pub use generate::Generator;
pub use palette::{
    Material, MaterialError, OnConflict, Palette, PaletteEntry, PaletteError, PalettePlan, Pattern, Texture3,
    Transparency,
};
pub use space::{
    Aabb4, Aabb4Error, CHUNK_BLOCKS, Cells, ChunkShape, Fixed, FixedError, Lattice, Point4, Scale, ScaleError, Slabs,
};
pub use tree::{ChunkArray, RegionNode, RegionTree, TreeError};
pub use world::{
    Applied, ApplyError, Body, Content, InvalidWorld, Limits, Region, RegionId, Work, World, WorldPatch, WorldStats,
};
