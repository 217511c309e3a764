//! `orthant world` and what its commands share with `orthant render`.

use super::fly::FlyArgs;
use super::values::{WorldPoint, finite_f64, not_negative, positive};
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// `orthant world`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant world new --generator platforms --seed 7 --half-extent 704 -o w.orw
  orthant world info w.orw --json
  orthant world apply w.orw --patches edits.jsonl -o edited.orw --report report.jsonl --verify
  orthant world fly w.orw --scenario churn --frames 240 --diagnostics frames.jsonl
  orthant render w.orw -o w.png --size 960x540 --spp 4")]
pub struct WorldArgs {
    /// What to do with a world
    #[command(subcommand)]
    pub command: WorldCommand,
}

/// The commands for worlds.
#[derive(Subcommand, Debug)]
pub enum WorldCommand {
    /// Generate a world
    New(NewArgs),
    /// Change a world by patches
    Apply(ApplyArgs),
    /// Count what a world holds
    Info(WorldInfoArgs),
    /// Run the frame loop without a window
    Fly(Box<FlyArgs>),
}

/// `orthant world new`
#[derive(Args, Debug)]
#[command(after_help = "\
Generators:
  flat       ground, -8 <= y < 0, everywhere
  platforms  boxes scattered in four dimensions
  terrain    hills, seas, caves and trees in 0 <= w < 1
  empty      air

The world holds what the generator makes of the cube of the half extent about the origin.

Examples:
  orthant world new --generator terrain --seed 3 --half-extent 128 -o hills.orw
  orthant world new --generator platforms --half-extent 1040 -o platforms.orw")]
pub struct NewArgs {
    /// What makes the world
    #[arg(long, value_name = "NAME", value_parser = clap::builder::PossibleValuesParser::new(orthant_world::Generator::NAMES))]
    pub generator: String,
    /// Which of its worlds: `platforms` and `terrain` have many
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Half the edge of the cube, in units
    #[arg(long, value_name = "U", default_value = "256", value_parser = half_extent, allow_hyphen_values = true)]
    pub half_extent: orthant_world::Fixed,
    /// The world: .orw
    #[arg(short, long, value_name = "W.orw")]
    pub output: PathBuf,
}

/// `orthant world apply`
#[derive(Args, Debug)]
#[command(after_help = "\
The script has one JSON object a line: {\"set\": [x,y,z,w], \"scale\": 0, \"block\": 5} (indices of the lattice of that scale), \
{\"fill\": {\"min\": [4], \"max\": [4]}, \"block\": \"stone\"}, {\"sphere\": {\"center\": [4], \"radius\": r}, \"scale\": 0, \
\"block\": \"air\"} (world units, half-open), or {\"patch\": {\"authoritative_bounds\": {...}, \"subtree\": {...}}}. A block is a \
number, the name of a material of the world, or \"air\".

Examples:
  orthant world apply w.orw --patches edits.jsonl -o edited.orw
  orthant world apply w.orw --patches edits.jsonl -o edited.orw --report report.jsonl --verify")]
pub struct ApplyArgs {
    /// The world: .orw, or .vox, .schem, .schematic or .litematic
    pub world: PathBuf,
    /// The script
    #[arg(long, value_name = "FILE.jsonl")]
    pub patches: PathBuf,
    /// The changed world: .orw
    #[arg(short, long, value_name = "OUT.orw")]
    pub output: PathBuf,
    /// What each patch cost, one JSON object a line
    #[arg(long, value_name = "FILE.jsonl")]
    pub report: Option<PathBuf>,
    /// Compare leaves, arenas and world after every patch; exit code 5 at the first difference
    #[arg(long)]
    pub verify: bool,
    /// Leave refused patches out instead of ending
    #[arg(long)]
    pub keep_going: bool,
    /// Take what is intact of a damaged .orw file
    #[arg(long)]
    pub salvage: bool,
}

/// `orthant world info`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant world info w.orw
  orthant world info castle.schem --json")]
pub struct WorldInfoArgs {
    /// The world: .orw, or .vox, .schem, .schematic or .litematic
    pub file: PathBuf,
    /// Print one JSON document
    #[arg(long)]
    pub json: bool,
    /// Take what is intact of a damaged .orw file
    #[arg(long)]
    pub salvage: bool,
}

/// Where a view of a world is taken from, and how.
#[derive(Args, Clone, Debug, Default)]
pub struct WorldViewArgs {
    /// Where the camera stands [default: w = 0.5, the rest framed]
    #[arg(long, value_name = "x,y,z,w", allow_hyphen_values = true, help_heading = "World")]
    pub pos: Option<WorldPoint>,
    /// Turns forward to the left, first of the four turns [default: 0; without --pos, --pitch and --yaw, a little from the right]
    #[arg(long, value_name = "DEG", value_parser = finite_f64, allow_hyphen_values = true, help_heading = "World")]
    pub yaw: Option<f64>,
    /// Turns forward up, last of the four turns [default: 0; without --pos, --pitch and --yaw, a little down]
    #[arg(long, value_name = "DEG", value_parser = finite_f64, allow_hyphen_values = true, help_heading = "World")]
    pub pitch: Option<f64>,
    /// Turns right towards the hidden axis, after the yaw [default: 0]
    #[arg(long, value_name = "DEG", value_parser = finite_f64, allow_hyphen_values = true, help_heading = "World")]
    pub xw: Option<f64>,
    /// Turns forward towards the hidden axis, after --xw [default: 0]
    #[arg(long, value_name = "DEG", value_parser = finite_f64, allow_hyphen_values = true, help_heading = "World")]
    pub zw: Option<f64>,
    /// How four dimensions become an image [default: slice for a world within 0 <= w < 1 and with a scene, else integral]
    #[arg(long, value_enum, help_heading = "World")]
    pub mode: Option<ModeArg>,
    /// Layers of `integral` (1 to 4096) and of `thick` (odd) [default: 128; 9]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096), help_heading = "World")]
    pub layers: Option<u32>,
    /// `integral` sweeps 90 degrees divided by this [default: 1]
    #[arg(long, value_name = "F", value_parser = hidden_zoom, allow_hyphen_values = true, help_heading = "World")]
    pub hidden_zoom: Option<f64>,
    /// `integral` mixes hits and sky by log(1 + K p) / log(1 + K), p being the share of hits; 0 mixes by p [default: 8]
    #[arg(long, value_name = "K", value_parser = not_negative, allow_hyphen_values = true, help_heading = "World")]
    pub mix: Option<f32>,
    /// Degrees between the layers of `thick` [default: 0.5]
    #[arg(long, value_name = "DEG", value_parser = positive, allow_hyphen_values = true, help_heading = "World")]
    pub thickness: Option<f32>,
    /// Nothing farther is seen, in units [default: all that is solid]
    #[arg(long, value_name = "UNITS", value_parser = distance, allow_hyphen_values = true, help_heading = "World")]
    pub distance: Option<f32>,
    /// How hits are shaded [default: path for slice, else preview]
    #[arg(long, value_enum, help_heading = "World")]
    pub shade: Option<ShadeArg>,
    /// Dark lines along the edges of blocks, as a fraction of the edge, 0 to 0.5 [default: 0]
    #[arg(long, value_name = "F", value_parser = edges, allow_hyphen_values = true, help_heading = "World")]
    pub edges: Option<f32>,
}

impl WorldViewArgs {
    /// The options that are given, by name.
    pub fn given(&self) -> Vec<&'static str> {
        let Self { pos, yaw, pitch, xw, zw, mode, layers, hidden_zoom, mix, thickness, distance, shade, edges } = self;
        [
            ("--pos", pos.is_some()),
            ("--yaw", yaw.is_some()),
            ("--pitch", pitch.is_some()),
            ("--xw", xw.is_some()),
            ("--zw", zw.is_some()),
            ("--mode", mode.is_some()),
            ("--layers", layers.is_some()),
            ("--hidden-zoom", hidden_zoom.is_some()),
            ("--mix", mix.is_some()),
            ("--thickness", thickness.is_some()),
            ("--distance", distance.is_some()),
            ("--shade", shade.is_some()),
            ("--edges", edges.is_some()),
        ]
        .into_iter()
        .filter_map(|(name, is_given)| is_given.then_some(name))
        .collect()
    }
}

/// `--mode`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModeArg {
    /// The three dimensions of right, up and forward
    Slice,
    /// Layers that sweep the hidden axis, hits and sky averaged apart
    Integral,
    /// The mean of layers about the slice
    Thick,
}

impl ModeArg {
    /// As the command line has it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slice => "slice",
            Self::Integral => "integral",
            Self::Thick => "thick",
        }
    }
}

/// `--shade`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ShadeArg {
    /// One sun and ambient light, no shadows
    Preview,
    /// Path tracing
    Path,
}

fn half_extent(text: &str) -> Result<orthant_world::Fixed, String> {
    use orthant_world::{Aabb4, Fixed};
    let value: Fixed = text.parse().map_err(|e: orthant_world::FixedError| e.to_string())?;
    let most = Fixed::from_raw(Aabb4::SPACE.max_raw()[0]);
    if value.raw() <= 0 || value > most {
        return Err(format!("a half extent is above 0 and at most {most} units"));
    }
    Ok(value)
}

fn hidden_zoom(text: &str) -> Result<f64, String> {
    // Below 0.25 the layers go round more than once.
    finite_f64(text)
        .ok()
        .filter(|z| (0.25..=1e6).contains(z))
        .ok_or_else(|| "expected a number from 0.25 to 1e6".into())
}

fn distance(text: &str) -> Result<f32, String> {
    let most = orthant_resident::world::view::MAX_DISTANCE;
    positive(text).ok().filter(|d| *d <= most).ok_or_else(|| format!("expected a number above 0, at most {most:e}"))
}

fn edges(text: &str) -> Result<f32, String> {
    not_negative(text).ok().filter(|e| *e <= 0.5).ok_or_else(|| "expected a fraction from 0 to 0.5".into())
}
