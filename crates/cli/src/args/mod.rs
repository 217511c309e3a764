//! The command line: commands, options, their values, and help with examples.

mod fly;
mod render;
pub mod values;
mod world;

pub use fly::{FlyArgs, ScenarioArg};
pub use render::{
    AovArg, BackendArg, EnvArg, EstimatorArg, FilterArg, RenderArgs, RendererArg, TonemapArg, TracerArg, ViewArg,
};
pub use world::{ApplyArgs, ModeArg, NewArgs, ShadeArg, WorldArgs, WorldCommand, WorldInfoArgs, WorldViewArgs};

use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;
use values::{ByteSize, Threshold};

/// The program.
#[derive(Parser, Debug)]
#[command(name = "orthant", version, about = "Open, render, compare and generate scenes", max_term_width = 100)]
#[command(arg_required_else_help = true, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do
    #[command(subcommand)]
    pub command: Command,
    /// Options of every command
    #[command(flatten)]
    pub common: Common,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 internal fault; 2 wrong usage; 3 bad input; 4 the device or a required feature is missing; \
5 a check that was asked for failed.

Examples:
  orthant generate cornell -o cornell.glb
  orthant render cornell.glb -o cornell.png --size 720x720 --spp 256
  orthant info cornell.glb --json";

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub struct Common {
    /// No progress bars and no warnings on stderr
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Most memory that an input may make the program take: bytes, or with KiB, MiB, GiB, TiB [default: half of the
    /// machine's]
    #[arg(long, global = true, value_name = "BYTES")]
    pub max_memory: Option<ByteSize>,
}

impl Common {
    /// The bound on memory, in bytes.
    pub fn max_memory(&self) -> u64 {
        self.max_memory.map_or_else(|| crate::machine::memory() / 2, |b| b.0)
    }
}

/// The commands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Count what a scene or a world holds
    Info(InfoArgs),
    /// Render a scene or a world to an image
    Render(Box<RenderArgs>),
    /// Put shares of a rendering together
    Merge(MergeArgs),
    /// Edit a scene by a script of operations
    Edit(EditArgs),
    /// Write a scene or a world in another format
    Convert(ConvertArgs),
    /// Measure how far two images are apart
    Compare(CompareArgs),
    /// Write a scene that the program makes itself
    Generate(GenerateArgs),
    /// Make, change, count and fly through voxel worlds
    World(WorldArgs),
    /// Measure the program beside its peers
    Bench(BenchArgs),
    /// List what can render
    Devices(DevicesArgs),
}

/// `orthant info`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant info helmet.glb
  orthant info helmet.glb --json
  orthant info helmet.glb --json --mesh-descs
  orthant info world.orw --json")]
pub struct InfoArgs {
    /// The scene: .gltf, .glb, .obj or .crts; or the world: .orw, .vox, .schem, .schematic or .litematic
    pub file: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Also list every distinct piece of geometry with its ranges in the global buffers
    #[arg(long)]
    pub mesh_descs: bool,
    /// Let the scene refer to files outside its own folder tree
    #[arg(long)]
    pub allow_external_files: bool,
    /// Take what is intact of a damaged .orw file
    #[arg(long)]
    pub salvage: bool,
}

/// `orthant merge`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant render city.glb -o left.share  --tile 0,0,640,720
  orthant render city.glb -o right.share --tile 640,0,640,720
  orthant merge right.share left.share -o city.png")]
pub struct MergeArgs {
    /// The shares, in any order; together they cover the image exactly once
    #[arg(required = true, value_name = "SHARE")]
    pub shares: Vec<PathBuf>,
    /// The image: .png, .exr or .hdr
    #[arg(short, long, value_name = "IMAGE")]
    pub output: PathBuf,
}

/// `orthant edit`
#[derive(Args, Debug)]
#[command(after_help = "\
The script has one JSON object a line, such as {\"op\": \"set_transform\", \"node\": 3, \"translation\": [0, 1, 0]}. \
Operations: set_transform, add_node, add_shape, add_light, delete, duplicate, reparent, rename, set_visible, set_mesh, \
set_camera, set_skin, assign_material, duplicate_material, set_material, set_light, set_camera_params, split_mesh, \
merge_mesh, select_variant, merge_scene, remove_unused, undo, redo, set_time. A reference is an index of the loaded file, \
\"name:TEXT\" (first of that name), or \"$label\", set by an earlier operation's \"as\".

Examples:
  orthant edit city.glb --ops script.jsonl -o new.glb
  orthant edit city.glb --ops script.jsonl --report report.jsonl --verify --backend cpu
  orthant edit city.glb --ops script.jsonl --report report.jsonl --backend vulkan --device 1")]
pub struct EditArgs {
    /// The scene: .gltf, .glb, .obj or .crts
    pub scene: PathBuf,
    /// The script
    #[arg(long, value_name = "FILE.jsonl")]
    pub ops: PathBuf,
    /// The edited scene: .gltf, .glb, .obj or .crts
    #[arg(short, long, value_name = "SCENE")]
    pub output: Option<PathBuf>,
    /// What each operation cost, one JSON object a line [default: stdout, if there is no output either]
    #[arg(long, value_name = "FILE.jsonl")]
    pub report: Option<PathBuf>,
    /// Compare the incremental state with a full derivation after every operation, and what is resident with what a load
    /// makes resident; exit code 5 at the first difference
    #[arg(long)]
    pub verify: bool,
    /// Leave refused operations out instead of ending
    #[arg(long)]
    pub keep_going: bool,
    /// Keep a backend up to date as well
    #[arg(long, value_enum)]
    pub backend: Option<BackendArg>,
    /// Which device of it, as `orthant devices` lists them: its number or a part of its name; alone it takes any backend
    #[arg(long, value_name = "INDEX|NAME", value_parser = values::device)]
    pub device: Option<String>,
    /// Let the scene refer to files outside its own folder tree
    #[arg(long)]
    pub allow_external_files: bool,
}

/// `orthant convert`
#[derive(Args, Debug)]
#[command(after_help = "\
Names, order, extensions and extras are kept, and images are never encoded again. What the target cannot hold is listed \
on stdout, one line each.

Examples:
  orthant convert helmet.gltf helmet.glb --images embed
  orthant convert city.glb city.gltf
  orthant convert scene.glb scene.obj
  orthant convert city.glb city.gltf --images external
  orthant convert castle.schem castle.orw")]
pub struct ConvertArgs {
    /// The scene: .gltf, .glb, .obj or .crts; or the world: .orw, .vox, .schem, .schematic or .litematic
    #[arg(value_name = "IN")]
    pub input: PathBuf,
    /// The new file: .gltf (with a .bin beside it), .glb, .obj (with a .mtl and textures beside it) or .crts; of a world: .orw
    #[arg(value_name = "OUT")]
    pub output: PathBuf,
    /// Where images go: where they are (files are copied beside the new file), into the document, or into files
    #[arg(long, value_enum, default_value_t = ImagesArg::Keep)]
    pub images: ImagesArg,
    /// Let the scene refer to files outside its own folder tree
    #[arg(long)]
    pub allow_external_files: bool,
    /// Take what is intact of a damaged .orw file
    #[arg(long)]
    pub salvage: bool,
}

/// `--images`
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImagesArg {
    /// Where they are
    Keep,
    /// Into the document
    Embed,
    /// Into files beside the document
    External,
}

/// `orthant compare`
#[derive(Args, Debug)]
#[command(after_help = "\
Metrics: rmse, rel_mse ((a - b)^2 / (b^2 + 0.01)), max (largest difference of a channel), flip (mean FLIP error, 0..1). \
Two PNG files are compared by their encoded values in 0..1 and by LDR-FLIP; with an .exr or .hdr file both are compared \
as linear values and by HDR-FLIP.

Examples:
  orthant compare new.png reference.png
  orthant compare new.exr reference.exr --json
  orthant compare new.png reference.png --fail-above flip=0.02 --fail-above max=0.5")]
pub struct CompareArgs {
    /// The image to judge: .png, .exr or .hdr
    pub a: PathBuf,
    /// The reference, of the same size
    pub b: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// End with exit code 5 if the metric (rmse, rel_mse, max, flip) exceeds the value; may be given several times
    #[arg(long, value_name = "METRIC=VALUE")]
    pub fail_above: Vec<Threshold>,
}

/// `orthant generate`
#[derive(Args, Debug)]
#[command(after_help = crate::generate::help())]
pub struct GenerateArgs {
    /// Which scene
    #[arg(value_parser = clap::builder::PossibleValuesParser::new(crate::generate::SCENES.map(|s| s.name)))]
    pub name: String,
    /// The scene file: .glb, or .gltf with a .bin beside it
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// forest: number of trees
    #[arg(long, value_name = "N")]
    pub trees: Option<u32>,
    /// city: number of nodes
    #[arg(long, value_name = "N")]
    pub nodes: Option<u32>,
    /// chain: number of nodes below one another
    #[arg(long, value_name = "N")]
    pub depth: Option<u32>,
    /// grid: number of vertices along a side
    #[arg(long, value_name = "N")]
    pub side: Option<u32>,
    /// instances, animated-crowd: number of instances or figures
    #[arg(long, value_name = "N")]
    pub count: Option<u32>,
    /// Seed of what is random in the scene
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// `orthant bench`
#[derive(Args, Debug)]
#[command(after_help = "\
Suites:
  load FILE    from the file to decoded arenas, images included, beside the `gltf` crate
  derive       model to rows, from 1,000 to 1,000,000 render nodes, beside copying the rows
  trace FILE   primary, shadow and incoherent rays, beside crate `obvhs`
  render FILE  whole frames of 960x540 with 16 samples; with --renderer raster, passes over it
  resident     from a derived scene (of FILE, or 100,000 and 1,000,000 instances) to a resident one
  edit         edit, sync and apply, from 1,000 to 1,000,000 nodes
  bvh          bounding volume hierarchies, beside crate `obvhs`
  world-edit   edits of a live world of 27 to a million platforms: plan and apply, full build, compaction
  world-frame  frames of 14,500 platforms that see 80 to 2,560 units far

Examples:
  orthant bench derive
  orthant bench load helmet.glb --json
  orthant bench trace forest.glb --threads 1 --runs 9")]
pub struct BenchArgs {
    /// What to measure
    pub suite: BenchSuite,
    /// The scene, for the suites that take one
    #[arg(required_if_eq_any([("suite", "load"), ("suite", "trace"), ("suite", "render")]))]
    pub file: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Repetitions of each measurement; the figure is their median
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    pub runs: u16,
    /// Threads, at most 1024; 0 takes all
    #[arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(..=1024), default_value_t = 0)]
    pub threads: usize,
    /// What renders or follows, for `render`, `resident`, `edit`, `world-edit` and `world-frame`
    #[arg(long, value_enum, default_value_t = BackendArg::Auto)]
    pub backend: BackendArg,
    /// The device, by its number in `orthant devices` or a part of its name, likewise
    #[arg(long, value_name = "INDEX|NAME", value_parser = values::device)]
    pub device: Option<String>,
    /// How a Vulkan device traces rays
    #[arg(long, value_enum, default_value_t = TracerArg::Auto)]
    pub tracer: TracerArg,
    /// What renders, for `render`: raster measures its passes, with and without culling
    #[arg(long, value_enum, default_value_t = RendererArg::Path)]
    pub renderer: RendererArg,
    /// The one size to measure at, for `edit` (nodes), `resident` (instances), `bvh` (boxes), `world-edit` (platforms) and
    /// `world-frame` (view distance)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub size: Option<u32>,
}

/// The suites of `orthant bench`.
#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum BenchSuite {
    /// From the file to decoded arenas
    Load,
    /// Model to rows
    Derive,
    /// Rays
    Trace,
    /// Frames
    Render,
    /// Batches
    Resident,
    /// Edits
    Edit,
    /// Bounding volume hierarchies
    Bvh,
    /// Edits of worlds
    WorldEdit,
    /// Frames of worlds
    WorldFrame,
}

/// `orthant devices`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant devices
  orthant devices --json")]
pub struct DevicesArgs {
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent_and_every_command_has_examples() {
        let command = Cli::command();
        command.clone().debug_assert();
        for sub in command.get_subcommands() {
            let help = sub.get_after_help().map(ToString::to_string).unwrap_or_default();
            assert!(help.contains(&format!("orthant {} ", sub.get_name())), "{}", sub.get_name());
        }
    }
}
