//! What blocks look like, by name: colours chosen by eye, a few rules for families, and a colour made from the name for the rest.

use crate::palette::{Material, Pattern, Transparency};

/// The sixteen dyes.
const DYES: [(&str, [u8; 3]); 16] = [
    ("light_blue", [86, 164, 214]),
    ("light_gray", [148, 148, 142]),
    ("white", [228, 232, 232]),
    ("orange", [226, 118, 34]),
    ("magenta", [182, 74, 172]),
    ("yellow", [240, 196, 52]),
    ("lime", [118, 182, 38]),
    ("pink", [232, 142, 168]),
    ("gray", [70, 76, 80]),
    ("cyan", [30, 136, 146]),
    ("purple", [122, 50, 168]),
    ("blue", [56, 64, 156]),
    ("brown", [116, 76, 46]),
    ("green", [90, 112, 34]),
    ("red", [156, 46, 40]),
    ("black", [28, 28, 32]),
];

/// Woods: planks, then bark.
const WOODS: [(&str, [u8; 3], [u8; 3]); 11] = [
    ("dark_oak", [70, 46, 26], [62, 48, 32]),
    ("pale_oak", [226, 216, 212], [90, 80, 78]),
    ("oak", [166, 134, 82], [110, 86, 54]),
    ("spruce", [116, 86, 50], [62, 42, 24]),
    ("birch", [196, 180, 124], [216, 214, 208]),
    ("jungle", [164, 118, 82], [88, 70, 28]),
    ("acacia", [170, 94, 54], [106, 98, 88]),
    ("mangrove", [120, 56, 50], [86, 70, 44]),
    ("cherry", [228, 182, 174], [58, 34, 46]),
    ("crimson", [104, 50, 72], [94, 28, 34]),
    ("warped", [46, 106, 102], [60, 60, 80]),
];

/// Parts of names with their colours. The first that the name contains holds, so longer ones come first.
const PARTS: &[(&str, [u8; 3])] = &[
    ("deepslate_diamond", [84, 106, 110]),
    ("redstone_block", [174, 26, 8]),
    ("redstone_lamp", [214, 160, 96]),
    ("redstone", [172, 20, 10]),
    ("diamond_block", [104, 222, 214]),
    ("emerald_block", [44, 190, 86]),
    ("lapis_block", [34, 68, 142]),
    ("coal_block", [18, 18, 18]),
    ("gold_block", [246, 206, 62]),
    ("iron_block", [218, 218, 218]),
    ("netherite_block", [66, 60, 64]),
    ("copper", [192, 108, 80]),
    ("raw_iron", [166, 136, 106]),
    ("diamond", [120, 142, 142]),
    ("emerald", [108, 136, 116]),
    ("lapis", [104, 116, 140]),
    ("coal", [106, 106, 104]),
    ("gold", [150, 136, 108]),
    ("iron", [180, 176, 172]),
    ("mossy", [108, 122, 92]),
    ("cobblestone", [126, 126, 126]),
    ("cobbled_deepslate", [78, 78, 80]),
    ("deepslate", [80, 80, 84]),
    ("blackstone", [42, 36, 40]),
    ("sandstone", [214, 202, 154]),
    ("glowstone", [172, 132, 84]),
    ("end_stone", [220, 222, 158]),
    ("dripstone", [134, 108, 92]),
    ("grindstone", [140, 140, 140]),
    ("stonecutter", [122, 118, 112]),
    ("stone_brick", [122, 122, 122]),
    ("stone", [126, 126, 126]),
    ("andesite", [136, 136, 138]),
    ("diorite", [188, 188, 190]),
    ("granite", [150, 104, 86]),
    ("tuff", [108, 110, 102]),
    ("calcite", [224, 226, 222]),
    ("basalt", [74, 74, 78]),
    ("bedrock", [84, 84, 84]),
    ("obsidian", [18, 12, 28]),
    ("prismarine", [100, 160, 146]),
    ("sea_lantern", [172, 200, 190]),
    ("purpur", [170, 126, 170]),
    ("quartz", [236, 230, 222]),
    ("nether_brick", [44, 22, 26]),
    ("netherrack", [98, 38, 38]),
    ("nether_wart", [116, 2, 2]),
    ("soul", [78, 60, 48]),
    ("magma", [144, 64, 32]),
    ("mud_brick", [138, 104, 80]),
    ("mud", [60, 58, 62]),
    ("brick", [150, 98, 84]),
    ("terracotta", [152, 94, 68]),
    ("clay", [160, 166, 178]),
    ("gravel", [132, 128, 126]),
    ("red_sand", [190, 102, 34]),
    ("sand", [220, 208, 162]),
    ("grass", [112, 158, 70]),
    ("mycelium", [112, 100, 102]),
    ("podzol", [92, 64, 24]),
    ("farmland", [130, 88, 58]),
    ("dirt", [134, 96, 66]),
    ("path", [148, 122, 66]),
    ("snow", [248, 254, 254]),
    ("packed_ice", [142, 180, 250]),
    ("blue_ice", [116, 168, 252]),
    ("ice", [146, 184, 254]),
    ("water", [52, 94, 198]),
    ("lava", [212, 92, 18]),
    ("leaves", [74, 118, 44]),
    ("moss", [90, 110, 46]),
    ("vine", [82, 118, 48]),
    ("fern", [96, 134, 62]),
    ("cactus", [86, 128, 44]),
    ("bamboo", [144, 158, 62]),
    ("kelp", [86, 130, 42]),
    ("lily", [32, 128, 48]),
    ("sugar_cane", [148, 192, 100]),
    ("wheat", [166, 150, 72]),
    ("hay", [166, 138, 12]),
    ("melon", [114, 146, 30]),
    ("pumpkin", [198, 118, 24]),
    ("carrots", [160, 130, 40]),
    ("potatoes", [120, 150, 60]),
    ("beetroots", [120, 110, 60]),
    ("mushroom_stem", [202, 184, 178]),
    ("red_mushroom", [200, 46, 44]),
    ("mushroom", [148, 112, 80]),
    ("poppy", [168, 48, 36]),
    ("dandelion", [236, 206, 50]),
    ("tulip", [196, 96, 80]),
    ("orchid", [48, 162, 208]),
    ("rose", [158, 46, 42]),
    ("lilac", [154, 126, 148]),
    ("peony", [206, 166, 190]),
    ("sunflower", [246, 196, 54]),
    ("azalea", [102, 124, 48]),
    ("sapling", [78, 108, 40]),
    ("bush", [106, 84, 50]),
    ("flower", [190, 120, 130]),
    ("coral", [190, 80, 130]),
    ("sponge", [196, 192, 74]),
    ("honey", [250, 186, 60]),
    ("slime", [112, 192, 92]),
    ("wool", [228, 232, 232]),
    ("bookshelf", [118, 96, 58]),
    ("lectern", [174, 138, 84]),
    ("crafting_table", [122, 76, 46]),
    ("chest", [162, 112, 40]),
    ("barrel", [134, 100, 58]),
    ("furnace", [110, 110, 110]),
    ("smoker", [96, 86, 74]),
    ("hopper", [74, 74, 76]),
    ("cauldron", [74, 74, 76]),
    ("anvil", [70, 70, 72]),
    ("chain", [52, 58, 74]),
    ("bars", [136, 138, 136]),
    ("rail", [124, 110, 88]),
    ("ladder", [126, 98, 56]),
    ("torch", [234, 190, 94]),
    ("lantern", [240, 176, 96]),
    ("campfire", [180, 110, 50]),
    ("fire", [232, 140, 40]),
    ("beacon", [118, 220, 214]),
    ("end_rod", [230, 220, 206]),
    ("candle", [226, 200, 152]),
    ("tnt", [180, 66, 54]),
    ("note_block", [90, 60, 42]),
    ("jukebox", [94, 64, 46]),
    ("piston", [150, 130, 96]),
    ("dispenser", [118, 118, 118]),
    ("dropper", [118, 118, 118]),
    ("observer", [98, 98, 98]),
    ("repeater", [160, 150, 150]),
    ("comparator", [160, 150, 150]),
    ("lever", [110, 92, 64]),
    ("tripwire", [130, 130, 130]),
    ("scaffolding", [172, 134, 76]),
    ("flower_pot", [124, 68, 52]),
    ("potted", [124, 68, 52]),
    ("skull", [200, 196, 180]),
    ("head", [110, 90, 70]),
    ("bone_block", [228, 224, 204]),
    ("bell", [252, 228, 96]),
    ("cobweb", [228, 232, 232]),
    ("spawner", [36, 46, 62]),
    ("bed", [150, 40, 34]),
    ("banner", [228, 232, 232]),
    ("carpet", [228, 232, 232]),
    ("cake", [248, 222, 214]),
    ("composter", [112, 70, 32]),
    ("loom", [142, 118, 90]),
    ("table", [120, 90, 60]),
    ("beehive", [180, 146, 90]),
    ("bee_nest", [202, 160, 74]),
    ("door", [140, 108, 66]),
    ("fence", [166, 134, 82]),
    ("sign", [166, 134, 82]),
];

/// What shines, and how strongly.
const LIGHTS: &[(&str, f32)] = &[
    ("glowstone", 8.0),
    ("sea_lantern", 8.0),
    ("lava", 6.0),
    ("lantern", 6.0),
    ("torch", 5.0),
    ("campfire", 5.0),
    ("fire", 5.0),
    ("shroomlight", 8.0),
    ("beacon", 8.0),
    ("end_rod", 6.0),
    ("magma", 1.0),
    ("jack_o_lantern", 6.0),
    ("froglight", 8.0),
];

/// The material of a block, and whether its colour was made from the name.
pub fn material(name: &str) -> (Material, bool) {
    let known = color(name);
    let hashed = known.is_none();
    let srgb = known.unwrap_or_else(|| {
        let hash = blake3::hash(name.as_bytes());
        let bytes = hash.as_bytes();
        // Neither dark nor bright.
        [bytes[0], bytes[1], bytes[2]].map(|byte| 64 + byte / 2)
    });
    let mut material = Material::colored(name, Material::linear(srgb));
    let clear =
        |absorption: f32, color: [f32; 3]| Some(Transparency { absorption: color.map(|c| absorption * (1.05 - c)) });
    if name.contains("glass") || name == "ice" {
        material.transparency = clear(0.8, material.color);
        material.roughness = 0.05;
    } else if name.contains("water") {
        material.transparency = clear(0.4, material.color);
        material.roughness = 0.05;
    } else {
        material.pattern = Pattern::Noise { cells: 8, contrast: 0.85 };
    }
    let unlit = name.contains("redstone_torch") || name.contains("soul");
    if let Some((_, strength)) = LIGHTS.iter().find(|(part, _)| name.contains(part)).filter(|_| !unlit) {
        material.emission = material.color.map(|c| c * strength);
    }
    (material, hashed)
}

fn color(name: &str) -> Option<[u8; 3]> {
    const DYED: [&str; 11] = [
        "wool",
        "concrete",
        "terracotta",
        "stained_glass",
        "carpet",
        "bed",
        "banner",
        "shulker_box",
        "candle",
        "stained",
        "hardened_clay",
    ];
    if let Some((dye, color)) = DYES.iter().find(|(dye, _)| name.starts_with(dye))
        && DYED.iter().any(|kind| name[dye.len()..].contains(kind))
    {
        let baked = name.contains("terracotta") || name.contains("hardened_clay");
        // Terracotta is the dye upon clay.
        let clay = [152_u16, 94, 68];
        let mixed = std::array::from_fn(|i| ((u16::from(color[i]) + clay[i]) / 2) as u8);
        return Some(if baked && !name.contains("glazed") { mixed } else { *color });
    }
    if name.contains("glass") {
        return Some([216, 234, 238]);
    }
    if let Some((wood, planks, bark)) = WOODS.iter().find(|(wood, ..)| name.contains(wood)) {
        let rest = name.replace(wood, "");
        if rest.contains("leaves") {
            return Some(if *wood == "cherry" { [228, 170, 194] } else { [74, 118, 44] });
        }
        if rest.contains("sapling") {
            return Some([78, 108, 40]);
        }
        let stem = ["log", "wood", "stem", "hyphae", "roots"].iter().any(|part| rest.contains(part));
        return Some(if stem && !rest.contains("stripped") { *bark } else { *planks });
    }
    PARTS.iter().find(|(part, _)| name.contains(part)).map(|(_, color)| *color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn families_have_their_colours() {
        let of = |name: &str| color(name);
        assert_eq!(of("light_blue_wool"), Some([86, 164, 214]));
        assert_eq!(of("blue_concrete_powder"), Some([56, 64, 156]));
        assert_eq!(of("dark_oak_planks"), Some([70, 46, 26]));
        assert_eq!(of("stripped_oak_log"), of("oak_stairs"));
        assert_ne!(of("oak_log"), of("oak_stairs"));
        assert_eq!(of("stone_brick_stairs"), Some([122, 122, 122]));
        assert_eq!(of("polished_andesite_slab"), Some([136, 136, 138]));
        assert_eq!(of("red_sandstone"), of("sandstone"));
        assert_eq!(of("frobnicator"), None);
    }

    #[test]
    fn glass_is_clear_and_lamps_shine() {
        assert!(material("red_stained_glass_pane").0.transparency.is_some());
        assert!(material("glowstone").0.emission[0] > 1.0);
        assert_eq!(material("stone").0.emission, [0.0; 3]);
        let (one, hashed) = material("frobnicator");
        assert!(hashed && one == material("frobnicator").0 && one.color != material("frobnicator2").0.color);
        for name in ["stone", "water", "lava", "white_bed", "frobnicator"] {
            assert_eq!(material(name).0.check(), Ok(()));
        }
    }
}
