//! Everything at once: from a world, or from explicit leaves.

use super::leaves::{Draft, Leaf, LeafContent, LeafRecord, LeafSet};
use super::palette::PaletteStore;
use super::payload::{PayloadEdit, PayloadStore, encode};
use super::{DerivedWorld, Head, WorldError, full, space, splice};
use orthant_bvh::{Builder, Bvh, NodeWrites};
use orthant_resident::world::arenas::slack;
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, Root, WorldNode};
use orthant_resident::world::{ArenaLens, WorldArenas};
use orthant_world::{Aabb4, Lattice, Palette, Point4, Region, World};
use rayon::prelude::*;

/// How good the root BVH of a full build is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// By parallel locally-ordered clustering: a million leaves in half a second on one core, a tree that costs a ray a tenth more. For a
    /// set that has to be there again soon; the next compaction makes it better.
    Fast,
    /// By the surface area heuristic, its upper levels by samples.
    #[default]
    Best,
}

/// How a derived world is made.
#[derive(Clone, Copy, Debug)]
pub struct BuildOptions {
    /// What node bounds are relative to; without it the middle of the leaves, in whole units.
    pub origin: Option<Point4>,
    /// What lies outside of this box is left out, now and later. Regions without bounds end here.
    pub clip: Aabb4,
    /// How good the root BVH of a full build is.
    pub quality: Quality,
    /// The most rows that arenas may have; below 2^31.
    pub max: ArenaLens,
}

impl Default for BuildOptions {
    fn default() -> Self {
        const MAX: u32 = (1 << 31) - 1;
        Self {
            origin: None,
            clip: Aabb4::SPACE,
            quality: Quality::Best,
            max: ArenaLens { nodes: MAX, leaves: MAX, payload: MAX, palette: MAX },
        }
    }
}

impl DerivedWorld {
    /// Derives a world: a leaf for every region, a root BVH by the surface area heuristic, packed arenas. The mirror is what an empty
    /// set is after [`Self::load_batches`].
    ///
    /// Works on the current pool of threads; the result does not depend on how many there are.
    ///
    /// # Errors
    /// [`WorldError::ArenaFull`].
    pub fn build(world: &World, options: &BuildOptions) -> Result<Self, WorldError> {
        let regions: Vec<&Region> = world.regions().map(|(_, region)| region).collect();
        let drafts = regions.into_par_iter().with_min_len(256);
        let drafts = drafts.filter_map(|region| Draft::of_region(region, &options.clip)).collect();
        Self::assemble(
            drafts,
            world.palette(),
            options,
            match options.quality {
                Quality::Fast => Builder::fastest(),
                Quality::Best => Builder::large(),
            },
        )
    }

    /// A derived world of these leaves, which share no point; [`Quality::Best`] is the best tree that there is: for compaction,
    /// and for comparing encodings. Leaves that are air or lie outside of the clip are left out.
    ///
    /// # Errors
    /// [`WorldError::Leaf`] for a leaf that leaves the cell of its chunk; [`WorldError::ArenaFull`].
    pub fn from_leaves(
        leaves: impl IntoIterator<Item = Leaf>,
        palette: &Palette,
        options: &BuildOptions,
    ) -> Result<Self, WorldError> {
        let leaves: Vec<Leaf> = leaves.into_iter().collect();
        for (index, leaf) in leaves.iter().enumerate() {
            check_leaf(leaf).map_err(|fault| WorldError::Leaf { index, fault })?;
        }
        let drafts = leaves.par_iter().with_min_len(256);
        Self::assemble(
            drafts.filter_map(|leaf| Draft::new(leaf, &options.clip)).collect(),
            palette,
            options,
            match options.quality {
                Quality::Fast => Builder::fastest(),
                Quality::Best => Builder::best(),
            },
        )
    }

    fn assemble(
        drafts: Vec<Draft>,
        palette: &Palette,
        options: &BuildOptions,
        builder: Builder,
    ) -> Result<Self, WorldError> {
        full("leaves", drafts.len() as u64, options.max.leaves)?;
        full("nodes", drafts.len() as u64, options.max.nodes)?;
        let hull = drafts.par_iter().map(Draft::bounds).reduce_with(|about, bounds| about.hull(&bounds));
        let origin = match options.origin {
            Some(origin) => origin.raw(),
            None => hull.as_ref().map_or([0; 4], space::middle),
        };
        let (records, payloads, payload) = place_chunks(drafts, options.max.payload)?;

        let boxes: Vec<_> =
            records.par_iter().with_min_len(1024).map(|record| space::outward(&record.bounds(), origin)).collect();
        let mut tree = Bvh::build(&boxes, builder).expect("boxes of the space, each with an item of its own");
        drop(boxes);
        tree.take_writes();
        // Edits that come later are to move nothing as a whole.
        tree.reserve(slack(records.len()));
        let mut nodes: Vec<WorldNode> = tree.nodes().par_iter().with_min_len(1024).map(splice::node_row).collect();
        let mut leaves: Vec<LeafRow> = records.iter().map(|record| record.row).collect();
        nodes.reserve(slack(nodes.len()));
        leaves.reserve(slack(leaves.len()));
        let root = tree.root().map_or(Root::EMPTY, |id| Root::node(id.0));
        let mirror = WorldArenas { origin, root, revision: 1, nodes, leaves, payload, palette: Vec::new() };
        let mut derived = Self {
            origin,
            clip: options.clip,
            max: options.max,
            leaves: LeafSet::from_records(records),
            tree,
            payloads,
            palette: PaletteStore::default(),
            head: Head { root, revision: 1, lens: mirror.lens() },
            mirror,
            writes: NodeWrites::default(),
        };
        let ids: Vec<_> = palette.iter().map(|(id, _)| id).collect();
        let batch = derived.plan_palette_of(palette, &ids)?;
        derived.commit(&batch).expect("it starts at the revision that the mirror was given");
        // What was built is one filling of an empty set.
        derived.head.revision = 1;
        derived.mirror.revision = 1;
        Ok(derived)
    }
}

/// Finds places for dense chunks: the records of the leaves, and the payload arena.
fn place_chunks(drafts: Vec<Draft>, max: u32) -> Result<(Vec<LeafRecord>, PayloadStore, Vec<u32>), WorldError> {
    let mut store = PayloadStore::default();
    let mut edit = PayloadEdit::default();
    let entries: Vec<Option<u32>> =
        drafts.iter().map(|draft| draft.dense_blocks().map(|dense| store.acquire(dense, &mut edit))).collect();
    store.check_room(edit.fresh_units(&store), max)?;
    let placed = store.place(&mut edit);
    let encoded: Vec<_> = placed.par_iter().with_min_len(16).map(|(first, dense)| (*first, encode(dense))).collect();
    let mut payload = Vec::new();
    payload.reserve_exact(store.end_words() as usize + slack(store.end_words() as usize));
    payload.resize(store.end_words() as usize, 0);
    for (first, words) in encoded {
        payload[first as usize..first as usize + words.len()].copy_from_slice(&words);
    }
    let record = |(draft, entry): (Draft, Option<u32>)| {
        let payload = entry.and_then(|id| store.first_word(id)).unwrap_or(NO_PAYLOAD);
        LeafRecord { row: LeafRow { payload, ..draft.row }, part: draft.part, entry }
    };
    let records = drafts.into_iter().zip(entries).map(record).collect();
    Ok((records, store, payload))
}

fn check_leaf(leaf: &Leaf) -> Result<(), &'static str> {
    let lattice: Lattice = match &leaf.content {
        LeafContent::Uniform(_) => return Ok(()),
        LeafContent::Chunk { lattice, .. } | LeafContent::Filled { lattice, .. } => *lattice,
    };
    if !lattice.admits(&leaf.bounds) {
        return Err("a flat chunk lies in 0 <= w < 1 alone");
    }
    let extent = lattice.chunk_extent().map(|extent| extent.raw());
    let (min, max) = (leaf.bounds.min_raw(), leaf.bounds.max_raw());
    if (0..4).any(|a| min[a].div_euclid(extent[a]) != (max[a] - 1).div_euclid(extent[a])) {
        return Err("a chunk leaf lies in one cell of its lattice; give one for every chunk");
    }
    Ok(())
}
