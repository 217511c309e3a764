//! Voxel files of other programs: made here, from third parties, and damaged.

mod common;

use common::Random;
use orthant_world::import::{ImportFault, ImportOptions, Imported, VoxelFormat, import, import_bytes};
use orthant_world::{Aabb4, Point4, World};
use std::path::PathBuf;

fn read(format: VoxelFormat, bytes: &[u8]) -> Imported {
    import_bytes("test", format, bytes, &ImportOptions::default()).unwrap()
}

fn name_at(world: &World, at: [i32; 3]) -> String {
    let block = world.block_at(Point4::from_ints([at[0], at[1], at[2], 0]));
    if block.is_air() {
        return "air".to_owned();
    }
    world.palette().get(block.id()).expect("a block of an import has a material").name.to_string()
}

// MagicaVoxel files.

fn chunk(id: &[u8; 4], content: &[u8]) -> Vec<u8> {
    let mut bytes = id.to_vec();
    bytes.extend((content.len() as u32).to_le_bytes());
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(content);
    bytes
}

fn ints(numbers: &[i32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

fn dict(entries: &[(&str, &str)]) -> Vec<u8> {
    let mut bytes = ints(&[entries.len() as i32]);
    for (key, value) in entries {
        for text in [key, value] {
            bytes.extend(ints(&[text.len() as i32]));
            bytes.extend(text.as_bytes());
        }
    }
    bytes
}

fn vox(chunks: &[Vec<u8>]) -> Vec<u8> {
    let children = chunks.concat();
    let mut bytes = b"VOX ".to_vec();
    bytes.extend(ints(&[200]));
    bytes.extend(b"MAIN");
    bytes.extend(ints(&[0, children.len() as i32]));
    bytes.extend(children);
    bytes
}

fn model(size: [i32; 3], voxels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = chunk(b"SIZE", &ints(&size));
    bytes.extend(chunk(b"XYZI", &[ints(&[voxels.len() as i32]), voxels.concat()].concat()));
    bytes
}

fn transform_node(id: i32, child: i32, layer: i32, attributes: &[(&str, &str)], frames: &[&[(&str, &str)]]) -> Vec<u8> {
    let mut bytes = [ints(&[id]), dict(attributes), ints(&[child, -1, layer, frames.len() as i32])].concat();
    frames.iter().for_each(|frame| bytes.extend(dict(frame)));
    chunk(b"nTRN", &bytes)
}

fn group_node(id: i32, children: &[i32]) -> Vec<u8> {
    chunk(b"nGRP", &[ints(&[id]), dict(&[]), ints(&[children.len() as i32]), ints(children)].concat())
}

fn shape_node(id: i32, models: &[i32]) -> Vec<u8> {
    let shown = models.iter().flat_map(|&model| [ints(&[model]), dict(&[])].concat()).collect();
    chunk(b"nSHP", &[ints(&[id]), dict(&[]), ints(&[models.len() as i32]), shown].concat())
}

#[test]
fn a_vox_file_stands_upright() {
    // MagicaVoxel's z is up, and its y points away.
    let world = read(VoxelFormat::Vox, &vox(&[model([3, 3, 3], &[[0, 1, 2, 7]])])).into_world().unwrap();
    assert!(name_at(&world, [0, 2, -2]).starts_with("vox-7-"));
    assert_eq!(world.bounds(), Some(Aabb4::from_ints([0, 2, -2, 0], [1, 3, -1, 1]).unwrap()));
}

#[test]
fn a_vox_scene_graph_is_followed() {
    // A row of three in x, in a box of 3 x 1 x 1, whose pivot is its middle voxel's corner.
    let row = model([3, 1, 1], &[[0, 0, 0, 1], [1, 0, 0, 2], [2, 0, 0, 3]]);
    let other = model([1, 1, 1], &[[0, 0, 0, 9]]);
    // x turned into y: rows (0 -1 0), (1 0 0), (0 0 1).
    let quarter = (1 | (1 << 4)).to_string();
    let file = vox(&[
        row,
        other,
        transform_node(0, 1, 0, &[], &[&[]]),
        group_node(1, &[2, 4, 6, 8]),
        transform_node(2, 3, 0, &[], &[&[("_t", "10 20 30")], &[("_t", "99 99 99")]]),
        shape_node(3, &[0, 1]),
        transform_node(4, 5, 0, &[], &[&[("_r", &quarter), ("_t", "-10 0 0")]]),
        shape_node(5, &[0]),
        transform_node(6, 7, 0, &[("_hidden", "1")], &[&[]]),
        shape_node(7, &[1]),
        transform_node(8, 9, 5, &[], &[&[]]),
        shape_node(9, &[1]),
        chunk(b"LAYR", &[ints(&[5]), dict(&[("_hidden", "1")]), ints(&[-1])].concat()),
    ]);
    let imported = read(VoxelFormat::Vox, &file);
    assert_eq!((imported.blocks, imported.warnings.len()), (6, 0));
    let world = imported.into_world().unwrap();
    // The first: x from 9 to 12, y from 20 to 21, z at 30; the first frame and its model.
    for (i, color) in [1, 2, 3].into_iter().enumerate() {
        assert!(name_at(&world, [9 + i as i32, 30, -21]).starts_with(&format!("vox-{color}-")));
    }
    // The second: a voxel from x = -1 to 0 comes to y from -1 to 0; y from 0 to 1 to x from -1 to 0.
    for (i, color) in [1, 2, 3].into_iter().enumerate() {
        assert!(name_at(&world, [-11, 0, -(i as i32)]).starts_with(&format!("vox-{color}-")), "{i}");
    }
}

#[test]
fn vox_palettes_and_materials_are_read() {
    let mut palette = vec![0; 1024];
    palette[..4].copy_from_slice(&[255, 0, 0, 255]);
    let material = |id, entries: &[(&str, &str)]| chunk(b"MATL", &[ints(&[id]), dict(entries)].concat());
    let file = vox(&[
        model([4, 1, 1], &[[0, 0, 0, 1], [1, 0, 0, 2], [2, 0, 0, 3], [3, 0, 0, 4]]),
        chunk(b"RGBA", &palette),
        material(2, &[("_type", "_metal"), ("_metal", "0.75"), ("_rough", "0.25")]),
        material(3, &[("_type", "_glass"), ("_trans", "0.5")]),
        material(1, &[("_type", "_emit"), ("_emit", "0.5"), ("_flux", "1")]),
        chunk(b"WHAT", b"ever"),
    ]);
    let imported = read(VoxelFormat::Vox, &file);
    assert_eq!(imported.warnings.len(), 1);
    let materials: Vec<_> = imported.patch.unwrap().palette.into_iter().map(|entry| entry.material).collect();
    assert_eq!(materials[0].color, [1.0, 0.0, 0.0]);
    assert_eq!(materials[0].emission, [5.0, 0.0, 0.0]);
    assert_eq!((materials[1].metallic, materials[1].roughness), (0.75, 0.25));
    assert!(materials[2].transparency.is_some() && materials[3].transparency.is_none());
}

#[test]
fn groups_that_share_children_without_end_are_refused() {
    // Each of 40 groups shows the next twice.
    let mut chunks = vec![model([1, 1, 1], &[[0, 0, 0, 1]]), transform_node(0, 1, 0, &[], &[&[]])];
    chunks.extend((1..41).map(|id| group_node(id, &[id + 1, id + 1])));
    chunks.push(shape_node(41, &[0]));
    let bad = import_bytes("test", VoxelFormat::Vox, &vox(&chunks), &ImportOptions::default()).unwrap_err();
    assert!(matches!(bad.fault, ImportFault::Content(_)), "{bad}");
    let cycle = vox(&[transform_node(0, 1, 0, &[], &[&[]]), group_node(1, &[0])]);
    assert!(import_bytes("test", VoxelFormat::Vox, &cycle, &ImportOptions::default()).is_err());
}

// Schematics.

enum Nbt {
    Short(i16),
    Int(i32),
    Bytes(Vec<u8>),
    Longs(Vec<u64>),
    Text(&'static str),
    List(Vec<Nbt>),
    Compound(Vec<(&'static str, Nbt)>),
}

impl Nbt {
    fn kind(&self) -> u8 {
        match self {
            Self::Short(_) => 2,
            Self::Int(_) => 3,
            Self::Bytes(_) => 7,
            Self::Text(_) => 8,
            Self::List(_) => 9,
            Self::Compound(_) => 10,
            Self::Longs(_) => 12,
        }
    }

    fn write(&self, out: &mut Vec<u8>) {
        match self {
            Self::Short(n) => out.extend(n.to_be_bytes()),
            Self::Int(n) => out.extend(n.to_be_bytes()),
            Self::Bytes(bytes) => {
                out.extend((bytes.len() as i32).to_be_bytes());
                out.extend(bytes);
            }
            Self::Longs(longs) => {
                out.extend((longs.len() as i32).to_be_bytes());
                longs.iter().for_each(|long| out.extend(long.to_be_bytes()));
            }
            Self::Text(text) => {
                out.extend((text.len() as u16).to_be_bytes());
                out.extend(text.as_bytes());
            }
            Self::List(list) => {
                out.push(list.first().map_or(0, Self::kind));
                out.extend((list.len() as i32).to_be_bytes());
                list.iter().for_each(|item| item.write(out));
            }
            Self::Compound(fields) => {
                for (name, value) in fields {
                    out.push(value.kind());
                    Self::Text(name).write(out);
                    value.write(out);
                }
                out.push(0);
            }
        }
    }

    fn file(self) -> Vec<u8> {
        let mut out = vec![10, 0, 0];
        self.write(&mut out);
        out
    }
}

/// A box of 2 x 3 x 2: stone below, oak in the middle, one lamp above.
fn sponge(version: i32) -> Vec<u8> {
    let palette = Nbt::Compound(vec![
        ("minecraft:air", Nbt::Int(0)),
        ("minecraft:stone", Nbt::Int(1)),
        ("minecraft:oak_log[axis=x]", Nbt::Int(2)),
        ("minecraft:glowstone", Nbt::Int(300)),
    ]);
    // 300 is the bytes 0xac 0x02.
    let data = Nbt::Bytes(vec![1, 1, 1, 1, 2, 2, 2, 2, 0, 0xac, 2, 0, 0]);
    let size = [("Width", Nbt::Short(2)), ("Height", Nbt::Short(3)), ("Length", Nbt::Short(2))];
    let mut fields = vec![("Version", Nbt::Int(version))];
    fields.extend(size);
    if version < 3 {
        fields.extend([("Palette", palette), ("BlockData", data)]);
        return Nbt::Compound(fields).file();
    }
    fields.push(("Blocks", Nbt::Compound(vec![("Palette", palette), ("Data", data)])));
    Nbt::Compound(vec![("Schematic", Nbt::Compound(fields))]).file()
}

#[test]
fn sponge_schematics_of_all_versions_are_read() {
    for version in 1..=3 {
        let imported = read(VoxelFormat::Schem, &sponge(version));
        assert_eq!((imported.blocks, imported.warnings.len()), (9, 0));
        let world = imported.into_world().unwrap();
        assert_eq!(name_at(&world, [1, 0, 1]), "stone");
        assert_eq!(name_at(&world, [0, 1, 1]), "oak_log");
        assert_eq!(name_at(&world, [1, 2, 0]), "glowstone");
        assert_eq!(name_at(&world, [0, 2, 0]), "air");
    }
    assert!(import_bytes("test", VoxelFormat::Schem, &sponge(4), &ImportOptions::default()).is_err());
}

#[test]
fn mcedit_schematics_are_read() {
    let file = Nbt::Compound(vec![
        ("Width", Nbt::Short(3)),
        ("Height", Nbt::Short(1)),
        ("Length", Nbt::Short(2)),
        ("Materials", Nbt::Text("Alpha")),
        ("Blocks", Nbt::Bytes(vec![1, 35, 0, 5, 20, 1])),
        ("Data", Nbt::Bytes(vec![0, 14, 0, 1, 0, 3])),
        ("AddBlocks", Nbt::Bytes(vec![0, 0, 0x10])),
    ])
    .file();
    let imported = read(VoxelFormat::Schematic, &file);
    assert_eq!(imported.warnings.len(), 1, "{:?}", imported.warnings);
    let world = imported.into_world().unwrap();
    let names: Vec<String> = (0..6).map(|i| name_at(&world, [i % 3, 0, i / 3])).collect();
    assert_eq!(names, ["stone", "red_wool", "air", "spruce_planks", "glass", "legacy_257"]);
}

#[test]
fn litematics_with_indices_across_words_and_negative_sizes_are_read() {
    // 5 states: 3 bits each; 2 x 3 x 5 blocks are 90 bits, and the 22nd block lies across two words.
    let states = ["minecraft:air", "minecraft:stone", "minecraft:dirt", "minecraft:sand", "minecraft:gravel"];
    let (size, count) = ([2, 3, 5], 30_u32);
    let mut words = vec![0_u64; 2];
    for i in 0..count {
        let bits = u128::from(i % 5) << (3 * i);
        words[0] |= bits as u64;
        words[1] |= (bits >> 64) as u64;
    }
    let vector = |v: [i32; 3]| Nbt::Compound(vec![("x", Nbt::Int(v[0])), ("y", Nbt::Int(v[1])), ("z", Nbt::Int(v[2]))]);
    let palette = states.map(|name| Nbt::Compound(vec![("Name", Nbt::Text(name))]));
    let region = Nbt::Compound(vec![
        ("Position", vector([10, 20, 30])),
        ("Size", vector([-size[0], size[1], -size[2]])),
        ("BlockStatePalette", Nbt::List(palette.into())),
        ("BlockStates", Nbt::Longs(words)),
    ]);
    let file = Nbt::Compound(vec![("Regions", Nbt::Compound(vec![("main", region)]))]).file();
    let world = read(VoxelFormat::Litematic, &file).into_world().unwrap();
    for i in 0..count as i32 {
        let at = [9 + i % 2, 20 + i / 10, 26 + i / 2 % 5];
        assert_eq!(format!("minecraft:{}", name_at(&world, at)), states[i as usize % 5], "block {i}");
    }
}

#[test]
fn damaged_files_are_errors_and_never_panics() {
    let scene = vox(&[
        model([3, 1, 1], &[[0, 0, 0, 1], [1, 0, 0, 2]]),
        transform_node(0, 1, 0, &[], &[&[("_r", "17"), ("_t", "1 2 3")]]),
        shape_node(1, &[0]),
    ]);
    let mut random = Random(1);
    for (format, good) in [(VoxelFormat::Vox, scene), (VoxelFormat::Schem, sponge(2)), (VoxelFormat::Schem, sponge(3))]
    {
        let options = ImportOptions { max_memory: 64 << 20 };
        for length in 0..good.len() {
            let _ = import_bytes("test", format, &good[..length], &options);
        }
        for _ in 0..20_000 {
            let mut bad = good.clone();
            for _ in 0..1 + random.below(3) {
                let at = random.below(good.len() as u64) as usize;
                bad[at] = random.next() as u8;
            }
            if let Ok(imported) = import_bytes("test", format, &bad, &options) {
                imported.into_world().unwrap().validate().unwrap();
            }
        }
        let error = import_bytes("test", format, &good, &ImportOptions { max_memory: 2000 }).unwrap_err();
        assert!(matches!(error.fault, ImportFault::OverBudget { .. }), "{error}");
    }
}

// Files of third parties.

fn assets() -> Option<PathBuf> {
    let Some(folder) = std::env::var_os("ORTHANT_ASSETS") else {
        println!("skipped: ORTHANT_ASSETS is not set");
        return None;
    };
    let folder = PathBuf::from(folder);
    assert!(folder.is_dir(), "{} is no folder", folder.display());
    Some(folder)
}

#[test]
fn files_of_third_parties_are_imported() {
    let Some(assets) = assets() else { return };
    // Blocks, and the extent of what is there at most.
    let files = [
        ("vox/mini-mikes-metro-minis/scene_house6.vox", Some(207_466), [126, 64, 126]),
        ("vox/mini-mikes-metro-minis/chr_army1.vox", Some(341), [8, 12, 7]),
        ("vox/opengametools/chr_knight.vox", Some(398), [20, 20, 21]),
        ("vox/opengametools/test_meta_chunk.vox", Some(64_000), [40, 40, 40]),
        ("vox/opengametools/test_groups.vox", None, [600, 600, 600]),
        ("vox/opengametools/test_multiple_model_scene.vox", None, [600, 600, 600]),
        ("vox/dot_vox/axes.vox", None, [600, 600, 600]),
        ("vox/dot_vox/placeholder.vox", Some(4), [2, 2, 2]),
        ("vox/vengi-tests/8ontop.vox", None, [600, 600, 600]),
        ("vox/vengi-tests/test-transform.vox", None, [600, 600, 600]),
        ("vox/vengi-tests/test_material.vox", None, [600, 600, 600]),
        ("vox/vengi-tests/robo.vox", None, [600, 600, 600]),
        ("minecraft/prismarine/smallhouse1.schem", None, [21, 28, 20]),
        ("minecraft/prismarine/viking-house1.schematic", None, [23, 35, 23]),
        ("minecraft/hollow-cube/2x2_chunk_vert.schem", None, [32, 384, 32]),
        ("minecraft/hollow-cube/regression/1_20_1_read_fail.schem", None, [15, 16, 20]),
        ("minecraft/vengi/test.litematic", None, [79, 29, 70]),
    ];
    for (path, blocks, most) in files {
        let imported = import(&assets.join(path), &ImportOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        println!("{path}: {} blocks, {:?}", imported.blocks, imported.warnings);
        assert!(imported.blocks > 0, "{path}");
        assert!(blocks.is_none_or(|blocks| blocks == imported.blocks), "{path}: {} blocks", imported.blocks);
        let world = imported.into_world().unwrap();
        world.validate().unwrap();
        let extent = world.solid_bounds().unwrap().extent();
        println!("  {extent:?}, {} regions, {} materials", world.region_count(), world.palette().len());
        assert!((0..3).all(|a| extent[a] <= f64::from(most[a])), "{path}: {extent:?}");
    }
    for path in ["vox/dot_vox/not_a.vox", "vox/vengi-tests/slab6_vox_test.vox"] {
        let error = import(&assets.join(path), &ImportOptions::default()).unwrap_err();
        assert!(matches!(error.fault, ImportFault::Content(_)), "{error}");
    }
}

#[test]
fn every_vox_file_of_third_parties_is_read_or_refused() {
    let Some(assets) = assets() else { return };
    let mut waiting = vec![assets.join("vox"), assets.join("minecraft")];
    let mut read = 0;
    while let Some(path) = waiting.pop() {
        if path.is_dir() {
            waiting.extend(std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
        } else if path.extension().and_then(|e| e.to_str()).and_then(VoxelFormat::by_extension).is_some() {
            match import(&path, &ImportOptions::default()) {
                Ok(imported) => {
                    read += 1;
                    if imported.warnings.len() > 1 || imported.blocks == 0 {
                        println!("{}: {} blocks, {:?}", path.display(), imported.blocks, imported.warnings);
                    }
                }
                Err(error) => println!("{error}"),
            }
        }
    }
    assert!(read >= 40, "{read} files");
}
