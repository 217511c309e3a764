//! Scenes that the program makes itself, for tests, benchmarks and documentation. The same arguments give the same
//! bytes.
//!
//! A scene is a function that builds a [`document::Document`]; [`SCENES`] names them all.

pub mod document;
pub mod random;
pub mod shapes;
pub mod textures;

mod chain;
mod city;
mod cornell;
mod crowd;
mod forest;
mod grid;
mod instances;
mod material_grid;
mod sky_dome;

use document::Document;

/// A scene that can be generated.
pub struct Generator {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it shows, in a line.
    pub about: &'static str,
    /// How its size is given, if it has one.
    pub size: Option<Size>,
    /// Builds it from a size (0 where there is none) and a seed.
    pub build: fn(u32, u64) -> Document,
}

/// The size of a generated scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// The option's name, without dashes.
    pub option: &'static str,
    /// What it is if it is not given.
    pub default: u32,
    /// The least that makes sense.
    pub min: u32,
    /// The most.
    pub max: u32,
}

/// All scenes.
pub const SCENES: [Generator; 8] = [
    Generator { name: "cornell", about: "the Cornell box", size: None, build: |_, _| cornell::cornell() },
    Generator {
        name: "material-grid",
        about: "spheres that show one material property a row",
        size: None,
        build: |_, _| material_grid::material_grid(),
    },
    Generator {
        name: "forest",
        about: "trees of shared meshes in a deep hierarchy, alpha-masked leaves, a sun",
        size: Some(Size { option: "trees", default: 200, min: 1, max: 1_000_000 }),
        build: forest::forest,
    },
    Generator {
        name: "city",
        about: "buildings of shared boxes in blocks and districts, exactly N nodes",
        size: Some(Size { option: "nodes", default: 10_000, min: city::MIN_NODES, max: 10_000_000 }),
        build: city::city,
    },
    Generator {
        name: "chain",
        about: "a spring of nodes, each the child of the one before",
        size: Some(Size { option: "depth", default: 100, min: 1, max: 10_000_000 }),
        build: |size, _| chain::chain(size),
    },
    Generator {
        name: "grid",
        about: "a landscape as one mesh of N x N vertices",
        size: Some(Size { option: "side", default: 256, min: 2, max: 8_192 }),
        build: grid::grid,
    },
    Generator {
        name: "instances",
        about: "a spiral of beads by EXT_mesh_gpu_instancing",
        size: Some(Size { option: "count", default: 2_000, min: 1, max: 50_000_000 }),
        build: |size, _| instances::instances(size),
    },
    Generator {
        name: "animated-crowd",
        about: "walking figures, each with a skin of its own, and an animation",
        size: Some(Size { option: "count", default: 40, min: 1, max: 1_000_000 }),
        build: crowd::animated_crowd,
    },
];

/// A scene by its name.
pub fn find(name: &str) -> Option<&'static Generator> {
    SCENES.iter().find(|s| s.name == name)
}

/// What `orthant generate --help` says after the options.
pub fn help() -> String {
    let mut text = String::from("Scenes:\n");
    for scene in &SCENES {
        let size = scene.size.map_or(String::new(), |s| format!(" (--{} N, default {})", s.option, s.default));
        text.push_str(&format!("  {:<15} {}{size}\n", scene.name, scene.about));
    }
    text.push_str(
        "\nExamples:\n  orthant generate cornell -o cornell.glb\n  orthant generate forest --trees 1000 -o forest.gltf",
    );
    text
}
