//! `orthant world fly`

use super::values::{self, Size, positive};
use super::world::WorldViewArgs;
use super::{BackendArg, values::ByteSize};
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// `orthant world fly`
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  orthant world fly w.orw --scenario look --frames 240 --diagnostics frames.jsonl
  orthant world fly w.orw --scenario churn --frames 480 --budget-ms 2 --images frames --every 60 --diagnostics frames.jsonl
  orthant world fly w.orw --scenario stream --half-extent 320 --frames 480 --diagnostics frames.jsonl")]
pub struct FlyArgs {
    /// The world: .orw, or .vox, .schem, .schematic or .litematic
    pub world: PathBuf,
    /// What happens
    #[arg(long, value_enum)]
    pub scenario: ScenarioArg,
    /// How many frames
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    pub frames: u32,
    /// Half the edge of what is resident about the camera, in units; of `stream`, its box of interest
    #[arg(long, value_name = "U", default_value_t = 512.0, value_parser = positive)]
    pub half_extent: f32,
    /// One line of JSON a frame
    #[arg(long, value_name = "FILE.jsonl")]
    pub diagnostics: PathBuf,
    /// Milliseconds of the processor that edits may take of a frame
    #[arg(long, value_name = "F", value_parser = positive, help_heading = "Budget")]
    pub budget_ms: Option<f32>,
    /// Bytes that edits may send in a frame
    #[arg(long, value_name = "N", help_heading = "Budget")]
    pub budget_bytes: Option<ByteSize>,
    /// Operations of a frame
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), help_heading = "Budget")]
    pub budget_ops: Option<u32>,
    /// Write frames into this folder, as frame-NNNNNN.png
    #[arg(long, value_name = "DIR", help_heading = "Images")]
    pub images: Option<PathBuf>,
    /// Every how many frames
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..), requires = "images",
        help_heading = "Images")]
    pub every: u32,
    /// Size of the frames in pixels
    #[arg(long, value_name = "WxH", default_value = "320x180", help_heading = "Images")]
    pub size: Size,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1 << 16), help_heading = "Images")]
    pub spp: u32,
    /// Seed of the scenario and of the frames
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,
    /// What renders
    #[arg(long, value_enum, default_value_t = BackendArg::Auto, help_heading = "Rendering")]
    pub backend: BackendArg,
    /// Which device of it, as `orthant devices` lists them: its number or a part of its name
    #[arg(long, value_name = "INDEX|NAME", value_parser = values::device, help_heading = "Rendering")]
    pub device: Option<String>,
    /// Threads, at most 1024; 0 takes all
    #[arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(..=1024), default_value_t = 0,
        help_heading = "Rendering")]
    pub threads: usize,
    /// Compare what is resident with the planner's mirror after every frame, and end with exit code 5 where they differ
    #[arg(long, help_heading = "Rendering")]
    pub validate: bool,
    /// Where the flight begins, and how it looks
    #[command(flatten)]
    pub view: WorldViewArgs,
}

/// `--scenario`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ScenarioArg {
    /// The camera looks around
    Look,
    /// The camera flies
    Fly,
    /// Blocks are broken and placed while the camera flies
    Churn,
    /// A source streams the world about the camera
    Stream,
}
