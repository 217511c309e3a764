//! The same content as uniform leaves, uniform chunks and dense chunks; shared payload; palettes.

use super::content::{equal_within, shapes};
use super::interpreter::Interpreter;
use super::patches::Random;
use orthant_render::world::{BuildOptions, DerivedWorld, Leaf, LeafContent, OpLimits, WorldError};
use orthant_resident::world::rows::{LeafRow, NO_PAYLOAD, flags, kind, pattern};
use orthant_resident::world::{ArenaLens, payload};
use orthant_world::edit::fill_box;
use orthant_world::{
    Aabb4, Block, BlockId, Chunk, Lattice, Material, OnConflict, Palette, PaletteEntry, Pattern, RegionTree, Scale,
    Texture3, Transparency, World, WorldPatch,
};
use std::sync::Arc;

fn block(id: u16) -> Block {
    Block::of(BlockId(id), Scale::UNIT)
}

fn cells(bounds: &Aabb4, edge: i64) -> Vec<Aabb4> {
    let count: [i64; 4] = bounds.extent_raw().map(|extent| extent / edge);
    let total: i64 = count.iter().product();
    (0..total)
        .map(|i| {
            let at = [
                i % count[0],
                i / count[0] % count[1],
                i / (count[0] * count[1]) % count[2],
                i / (count[0] * count[1] * count[2]),
            ];
            let min: [i64; 4] = std::array::from_fn(|a| bounds.min_raw()[a] + at[a] * edge);
            Aabb4::from_raw(min, min.map(|c| c + edge)).unwrap()
        })
        .collect()
}

fn rows(derived: &DerivedWorld) -> (Vec<LeafRow>, Interpreter) {
    derived.validate().unwrap();
    let arenas = Interpreter::after(derived.load_batches(1 << 16));
    arenas.check_mirror(derived.mirror());
    (arenas.reach(derived.origin()), arenas)
}

#[test]
fn one_region_is_a_uniform_leaf_uniform_chunks_or_dense_chunks_as_asked_for() {
    let bounds = Aabb4::from_ints([-16; 4], [16, 0, 8, 8]).unwrap();
    let mut world = World::new();
    world.apply(&fill_box(bounds, block(2))).unwrap();
    let lattice = Lattice::cube(Scale::UNIT);
    let uniform = Arc::new(Chunk::uniform(block(2)));
    let with = |content: &dyn Fn() -> LeafContent| {
        let leaves = cells(&bounds, 8 << 16).into_iter().map(|bounds| Leaf { bounds, content: content() });
        DerivedWorld::from_leaves(leaves, world.palette(), &BuildOptions::default()).unwrap()
    };
    let chunks = with(&|| LeafContent::Chunk { lattice, chunk: uniform.clone() });
    let dense = with(&|| LeafContent::Filled { lattice, block: block(2) });
    let one = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    for (derived, leaves, leaf_kind, has_payload) in [
        (&one, 1, kind::UNIFORM, false),
        (&chunks, 72, kind::CHUNK_ARRAY, false),
        (&dense, 72, kind::CHUNK_ARRAY, true),
    ] {
        let (rows, arenas) = rows(derived);
        assert_eq!(rows.len(), leaves);
        assert!(rows.iter().all(|row| row.kind() == leaf_kind && (row.payload != NO_PAYLOAD) == has_payload));
        assert!(equal_within(&rows, &arenas, &world, &Aabb4::from_ints([-50; 4], [50; 4]).unwrap()));
        assert_eq!(arenas.live_units.is_empty(), !has_payload);
    }
    assert_eq!((dense.stats().dense_chunks, dense.stats().shared_chunks), (1, 71), "equal chunks share a payload");

    // The planner takes any of them for what it says, and makes it regions.
    for mut derived in [chunks, dense] {
        let everything = Aabb4::from_ints([-50; 4], [50; 4]).unwrap();
        let plan = derived.plan(&world, &everything, &OpLimits::default()).unwrap();
        derived.commit(&plan.batch).unwrap();
        assert_eq!((derived.leaf_count(), derived.stats().payload.live), (1, 0));
        derived.validate().unwrap();
    }
}

#[test]
fn a_snapshot_becomes_the_same_leaves_in_packed_arenas() {
    let mut random = Random(9);
    let mut world = World::new();
    for i in 0..30 {
        let bounds = Aabb4::from_ints([16 * i, 0, 0, 0], [16 * i + 8, 8, 8, 8]).unwrap();
        let blocks = std::array::from_fn(|_| block(random.below(1 + i as u64) as u16));
        let chunk = Arc::new(Chunk::from_blocks(&blocks));
        let tree = RegionTree::chunk_array(bounds, Lattice::cube(Scale::UNIT), vec![chunk]).unwrap();
        world.apply(&WorldPatch::of_tree(tree)).unwrap();
    }
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let snapshot = derived.snapshot();
    let (before, before_arenas) = rows(&derived);
    let hole = Aabb4::from_ints([0; 4], [150, 5, 5, 5]).unwrap();
    world.apply(&fill_box(hole, Block::AIR)).unwrap();
    let plan = derived.plan(&world, &hole, &OpLimits::default()).unwrap();
    derived.commit(&plan.batch).unwrap();
    assert_ne!(derived.snapshot().leaves().count(), 0);
    assert_eq!(snapshot.len(), before.len());
    let again = DerivedWorld::from_leaves(snapshot.leaves(), world.palette(), &BuildOptions::default()).unwrap();
    let (after, after_arenas) = rows(&again);
    assert!(shapes(&before, &before_arenas) == shapes(&after, &after_arenas));
    assert_eq!((again.stats().payload.free, again.stats().leaves.free), (0, 0));
}

#[test]
fn chunks_that_are_equal_share_one_payload_until_the_last_goes() {
    let chunk =
        || Arc::new(Chunk::from_blocks(&std::array::from_fn(|i| block(if i % 7 < 3 { 1 + i as u16 % 3 } else { 0 }))));
    let cell = |i: i32| Aabb4::from_ints([8 * i, 0, 0, 0], [8 * i + 8, 8, 8, 8]).unwrap();
    let put = |i: i32| RegionTree::chunk_array(cell(i), Lattice::cube(Scale::UNIT), vec![chunk()]).unwrap();
    let mut world = World::new();
    world.apply(&WorldPatch::of_tree(put(0))).unwrap();
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let one = derived.stats().payload.live;
    let mut follow = |world: &mut World, tree: RegionTree| {
        let bounds = tree.bounds;
        world.apply(&WorldPatch::of_tree(tree)).unwrap();
        let plan = derived.plan(world, &bounds, &OpLimits::default()).unwrap();
        derived.commit(&plan.batch).unwrap();
        derived.validate().unwrap();
        (plan.batch.payload_writes.len(), plan.batch.freed_payload_spans.len(), derived.stats().payload.live)
    };
    assert!(one > 0);
    // Made anew, so that no pointer tells that it is the same.
    assert_eq!(follow(&mut world, put(3)), (0, 0, one));
    assert_eq!(follow(&mut world, put(-2)), (0, 0, one));
    assert_eq!(follow(&mut world, RegionTree::empty(cell(0))), (0, 0, one));
    assert_eq!(follow(&mut world, RegionTree::empty(cell(-2))), (0, 0, one));
    // Moved in one operation: the span stays.
    let both = cell(3).hull(&cell(6));
    assert_eq!(follow(&mut world, RegionTree::branch(both, vec![put(6)])), (0, 0, one));
    assert_eq!(follow(&mut world, RegionTree::empty(cell(6))), (0, 1, 0));
}

#[test]
fn leaves_that_no_set_has_are_refused() {
    let lattice = Lattice::cube(Scale::UNIT);
    let chunk = Arc::new(Chunk::uniform(block(1)));
    let leaf = |min: [i32; 4], max: [i32; 4], lattice| Leaf {
        bounds: Aabb4::from_ints(min, max).unwrap(),
        content: LeafContent::Chunk { lattice, chunk: chunk.clone() },
    };
    let make = |leaf: Leaf| {
        DerivedWorld::from_leaves([leaf], &Palette::new(), &BuildOptions::default()).map(|d| d.leaf_count())
    };
    assert_eq!(make(leaf([1; 4], [8; 4], lattice)), Ok(1));
    assert!(matches!(make(leaf([1; 4], [8, 8, 8, 9], lattice)), Err(WorldError::Leaf { index: 0, .. })));
    assert!(matches!(make(leaf([0; 4], [1, 1, 1, 2], Lattice::flat(Scale::UNIT))), Err(WorldError::Leaf { .. })));
}

#[test]
fn a_dense_chunk_of_sixteen_kinds_takes_less_than_four_and_a_half_kilobytes() {
    let mut random = Random(4);
    let mut world = World::new();
    let blocks = std::array::from_fn(|_| block(random.below(16) as u16));
    let bounds = Aabb4::from_ints([0; 4], [8; 4]).unwrap();
    let chunk = Arc::new(Chunk::from_blocks(&blocks));
    let tree = RegionTree::chunk_array(bounds, Lattice::cube(Scale::UNIT), vec![chunk]).unwrap();
    world.apply(&WorldPatch::of_tree(tree)).unwrap();
    let derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let bytes = derived.mirror().bytes();
    assert!(bytes.payload + bytes.leaves + bytes.nodes <= 4608, "{bytes:?}");
}

#[test]
fn an_arena_that_is_full_is_an_error_that_changes_nothing() {
    let mut world = World::new();
    let one = Aabb4::from_ints([0; 4], [8; 4]).unwrap();
    world.apply(&fill_box(one, block(1))).unwrap();
    let max = ArenaLens { nodes: 4, leaves: 4, payload: 1000, palette: 10 };
    let mut derived = DerivedWorld::build(&world, &BuildOptions { max, ..BuildOptions::default() }).unwrap();
    let before = derived.mirror().clone();
    let hole = Aabb4::from_ints([3; 4], [4; 4]).unwrap();
    world.apply(&fill_box(hole, Block::AIR)).unwrap();
    // A chunk in the place of a leaf: it fits.
    assert!(derived.clone().plan(&world, &hole, &OpLimits::default()).is_ok());
    let far = Aabb4::from_ints([-50; 4], [50; 4]).unwrap();
    world.apply(&fill_box(far, block(2))).unwrap();
    world.apply(&fill_box(hole, Block::AIR)).unwrap();
    let refused = derived.plan(&world, &far, &OpLimits::default());
    assert!(matches!(refused, Err(WorldError::ArenaFull { arena: "leaves", .. })), "{refused:?}");
    assert_eq!((derived.mirror().lens(), derived.revision()), (before.lens(), before.revision));
    derived.validate().unwrap();
}

#[test]
fn materials_become_rows_and_a_replaced_texture_frees_its_texels() {
    let texture = |size: [u16; 3], value: u8| {
        let count = size.iter().map(|&n| usize::from(n)).product::<usize>() * 4;
        Pattern::Texture(Texture3 { size, rgba: (0..count).map(|i| value.wrapping_add(i as u8)).collect() })
    };
    let glass = Material {
        transparency: Some(Transparency { absorption: [0.1, 0.2, 0.3] }),
        emission: [1.0, 2.0, 3.0],
        weight: 0.5,
        ..Material::colored("glass", [0.7, 0.8, 0.9])
    };
    let carpet = Material { pattern: texture([3, 2, 5], 7), ..Material::colored("carpet", [1.0; 3]) };
    let tiles =
        Material { pattern: Pattern::Checker { cells: 4, contrast: 0.25 }, ..Material::colored("tiles", [0.5; 3]) };
    let entry = |id, material: &Material| PaletteEntry { id: BlockId(id), material: material.clone() };
    let mut world = World::new();
    let mut patch = fill_box(Aabb4::from_ints([0; 4], [1; 4]).unwrap(), block(5));
    patch.palette = vec![entry(2, &glass), entry(5, &carpet), entry(3, &tiles)];
    world.apply(&patch).unwrap();
    let mut derived = DerivedWorld::build(&world, &BuildOptions::default()).unwrap();
    let mirror = derived.mirror();
    assert_eq!((mirror.palette.len(), mirror.palette[4].flags, mirror.palette[1].flags), (6, 0, 0));
    let row = mirror.palette[2];
    assert_eq!(row.flags, flags::KNOWN | flags::TRANSPARENT);
    assert_eq!((row.absorption, row.emission, row.weight), ([0.1, 0.2, 0.3], [1.0, 2.0, 3.0], 0.5));
    assert_eq!((mirror.palette[3].pattern, mirror.palette[3].cells), (pattern::CHECKER, 4));
    let row = mirror.palette[5];
    assert_eq!((row.pattern, row.texture_size), (pattern::TEXTURE, 2 | 1 << 8 | 4 << 16));
    assert_eq!(mirror.payload[row.cells as usize], u32::from_le_bytes([7, 8, 9, 10]));
    assert_eq!(mirror.payload[row.cells as usize + 29], u32::from_le_bytes([123, 124, 125, 126]));
    let mut arenas = Interpreter::after(derived.load_batches(90));

    let known = derived.plan_palette(&world, &[BlockId(2), BlockId(5), BlockId(9)]).unwrap();
    assert!(known.is_empty(), "nothing differs");
    let larger = Material { pattern: texture([9, 9, 9], 1), ..carpet };
    patch.palette = vec![entry(5, &larger)];
    patch.on_conflict = OnConflict::Replace;
    let applied = world.apply(&patch).unwrap();
    assert_eq!(applied.palette, [BlockId(5)]);
    let batch = derived.plan_palette(&world, &applied.palette).unwrap();
    assert_eq!((batch.palette_writes.len(), batch.leaf_writes.len(), batch.node_writes.len()), (1, 0, 0));
    arenas.apply(&batch);
    derived.commit(&batch).unwrap();
    arenas.check_mirror(derived.mirror());
    arenas.reach(derived.origin());
    derived.validate().unwrap();
    assert_eq!(derived.stats().payload.live, 9_u64.pow(3).next_multiple_of(u64::from(payload::ALIGN)));
}
