//! The world: disjoint regions, found by an index of their boxes, changed by patches.
//!
//! # The index
//!
//! Regions are items of a four-dimensional [`orthant_bvh::Bvh`] over their exact boxes. A region has no place in a hierarchy
//! of its own, so how many lie beside it does not matter: taking one in or out writes the nodes on one path, at most 64
//! and of the order of log n, and a search for the regions of a box reads the paths that lead to what it finds. (The boxes of
//! nodes may overlap, so the bound of a search is that of all bounding volume hierarchies: expected, not worst case.)
//!
//! # From a patch to regions
//!
//! [`World::apply`] first compares (`diff`): where nothing differs, nothing is written. Then it splices (`splice`): what the
//! patch touches is carved, small content is gathered in chunks (`cell`), and boxes of one block are joined (`merge`).

mod cell;
mod diff;
mod merge;
mod patch;
mod query;
mod region;
mod splice;
mod stats;

pub use patch::{Applied, ApplyError, Limits, Work, WorldPatch};
pub use query::InvalidWorld;
pub(crate) use query::tree_of;
pub(crate) use region::block_box;
pub use region::{Content, Region, RegionId};
pub use stats::WorldStats;

use crate::block::{Block, BlockId};
use crate::file::BodySection;
use crate::generate::Generator;
use crate::palette::{OnConflict, Palette, PaletteEntry};
use crate::space::{Aabb4, Point4};
use crate::tree::{RegionNode, RegionTree, flatten};
use orthant_bvh::{Builder, Bvh};
use region::Regions;
use rustc_hash::FxHashMap;
use std::ops::ControlFlow;

/// A moving body: the place for bodies of tetrahedra with a rigid pose, of which there are none yet.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Body {}

/// An authoritative voxel world.
#[derive(Clone, Debug, Default)]
pub struct World {
    palette: Palette,
    regions: Regions,
    /// Items are slots of `regions`.
    index: Bvh<i64, 4>,
    bodies: Vec<Body>,
    /// Bodies that only newer programs understand, as their file had them.
    pub(crate) body_sections: Vec<BodySection>,
    revision: u64,
}

impl World {
    /// Air.
    pub fn new() -> Self {
        Self::default()
    }

    /// The materials.
    pub const fn palette(&self) -> &Palette {
        &self.palette
    }

    /// The moving bodies.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }

    /// Whether the world's file has moving bodies, which are kept and written back, and not shown.
    pub fn keeps_unknown_bodies(&self) -> bool {
        !self.body_sections.is_empty()
    }

    /// A number that every patch that changes something makes greater by one.
    pub const fn revision(&self) -> u64 {
        self.revision
    }

    /// How many regions there are.
    pub fn region_count(&self) -> usize {
        self.regions.len()
    }

    /// One more than the highest slot that a region ever had ([`RegionId::slot`]).
    pub fn slot_count(&self) -> usize {
        self.regions.slot_count()
    }

    /// A region; `None` for an id whose region is gone.
    pub fn region(&self, id: RegionId) -> Option<&Region> {
        self.regions.get(id)
    }

    /// Every region, in the order of slots.
    pub fn regions(&self) -> impl Iterator<Item = (RegionId, &Region)> + '_ {
        self.regions.iter()
    }

    /// The block at a point.
    pub fn block_at(&self, point: Point4) -> Block {
        self.region_at(point).map_or(Block::AIR, |(_, region)| region.block_at(point))
    }

    /// Applies a patch.
    ///
    /// # Errors
    /// [`ApplyError`]; the world is then unchanged.
    pub fn apply(&mut self, patch: &WorldPatch) -> Result<Applied, ApplyError> {
        self.apply_within(patch, &Limits::default())
    }

    /// [`Self::apply`] with limits of one's own.
    ///
    /// # Errors
    /// As [`Self::apply`].
    pub fn apply_within(&mut self, patch: &WorldPatch, limits: &Limits) -> Result<Applied, ApplyError> {
        let bounds = patch.authoritative_bounds;
        if !bounds.contains(&patch.subtree.bounds) {
            let subtree = Box::new(patch.subtree.bounds);
            return Err(ApplyError::Outside { subtree, bounds: Box::new(bounds) });
        }
        let new_palette = self.plan_palette(patch)?;
        let pieces = match &new_palette {
            None => flatten(&patch.subtree, limits.regions, |block| block, |_, block| block)?,
            Some(plan) => flatten(
                &patch.subtree,
                limits.regions,
                |block| plan.patch.translate(block),
                |generator, block| plan.generators[generator].get(&block.id()).map_or(block, |&id| block.with_id(id)),
            )?,
        };
        let mut applied = Applied { revision_before: self.revision, revision: self.revision, ..Applied::default() };
        applied.changed = self.diff(&bounds, &pieces, &mut applied.work);
        if let Some(plan) = new_palette.filter(|plan| !plan.written.is_empty()) {
            self.palette = plan.palette;
            applied.palette = plan.written;
        }
        if !applied.changed.is_empty() {
            self.splice(&bounds, pieces, &mut applied)?;
        }
        if !(applied.changed.is_empty() && applied.palette.is_empty()) {
            self.revision += 1;
            applied.revision = self.revision;
        }
        Ok(applied)
    }

    /// The palette with what the patch and its generators bring; `None` if they bring nothing.
    fn plan_palette(&self, patch: &WorldPatch) -> Result<Option<NewPalette>, ApplyError> {
        let generators = generators_of(&patch.subtree);
        if patch.palette.is_empty() && generators.is_empty() {
            return Ok(None);
        }
        let mut palette = self.palette.clone();
        let plan = palette.plan(&patch.palette, patch.on_conflict)?;
        palette.commit(&plan);
        let mut written: Vec<BlockId> = plan.written().collect();
        let mut translations = FxHashMap::default();
        for generator in generators {
            let entry = |(i, material)| PaletteEntry { id: BlockId(i as u16 + 1), material };
            let entries: Vec<_> = generator.materials().into_iter().enumerate().map(entry).collect();
            let ids: FxHashMap<_, _> = {
                // A material that the world has under the name of a generator's is what the generator builds with.
                let plan = palette.plan(&entries, OnConflict::Keep)?;
                palette.commit(&plan);
                written.extend(plan.written());
                let named = |entry: &PaletteEntry| palette.id_of(&entry.material.name).map(|id| (entry.id, id));
                entries.iter().filter_map(named).collect()
            };
            translations.insert(generator, ids);
        }
        written.sort_unstable();
        written.dedup();
        Ok(Some(NewPalette { palette, patch: plan, generators: translations, written }))
    }

    /// A world of these regions, and those of them that overlap one before them, which are left out.
    pub(crate) fn from_regions(palette: Palette, regions: Vec<Region>) -> (Self, Vec<Region>) {
        let boxes: Vec<_> = regions.iter().map(|region| region.bounds.closed()).collect();
        let index = Bvh::build(&boxes, Builder::fast()).expect("boxes of the space are good bounds");
        let overlaps = |i: u32| {
            let before = |item, _: &_| if item < i { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            index.overlap(&boxes[i as usize], before).is_break()
        };
        let bad: Vec<bool> = (0..regions.len() as u32).map(overlaps).collect();
        let mut world = Self { palette, ..Self::default() };
        let (mut items, mut dropped) = (Vec::with_capacity(regions.len()), Vec::new());
        for (region, bad) in regions.into_iter().zip(bad) {
            if bad {
                dropped.push(region);
            } else {
                items.push(region.bounds.closed());
                world.regions.insert(region);
            }
        }
        // Slots are given in order.
        world.index = if dropped.is_empty() { index } else { Bvh::build(&items, Builder::fast()).expect("as above") };
        world.index.take_writes();
        (world, dropped)
    }

    /// The smallest box about all blocks that are not air; `None` if there are none. Looks at every region.
    pub fn solid_bounds(&self) -> Option<Aabb4> {
        let solid = self.regions().filter_map(|(_, region)| region.solid_bounds());
        solid.reduce(|about, bounds| about.hull(&bounds))
    }

    /// The smallest box about all regions; `None` if there are none. Chunk regions have air in them: see
    /// [`Self::solid_bounds`].
    pub fn bounds(&self) -> Option<Aabb4> {
        let bounds = self.index.bounds();
        (!self.index.is_empty()).then(|| Aabb4::from_raw_unchecked(bounds.min, bounds.max.map(|max| max + 1)))
    }
}

/// The world's palette after a patch, and how the patch's numbers translate.
struct NewPalette {
    palette: Palette,
    patch: crate::palette::PalettePlan,
    generators: FxHashMap<Generator, FxHashMap<BlockId, BlockId>>,
    written: Vec<BlockId>,
}

/// The distinct generators of a tree.
fn generators_of(tree: &RegionTree) -> Vec<Generator> {
    let mut found = Vec::new();
    let mut waiting = vec![tree];
    while let Some(part) = waiting.pop() {
        match &part.node {
            RegionNode::Procedural(generator) if !found.contains(generator) => found.push(generator.clone()),
            RegionNode::Branch(parts) => waiting.extend(parts),
            _ => {}
        }
    }
    found
}
