//! `orthant render`

use super::values::{Angles, SampleRange, Size, Vector, finite, not_negative, positive, tile};
use super::world::WorldViewArgs;
use clap::{Args, ValueEnum};
use orthant_resident::frame::{Aov, Estimator, Tile};
use orthant_resident::tonemap::ToneMapper;
use orthant_vulkan::raster::RasterView;
use std::path::PathBuf;

/// `orthant render`
#[derive(Args, Debug)]
#[command(after_help = "\
The same command and seed give the same bytes on the CPU, whatever --threads says.

Examples:
  orthant render helmet.glb -o helmet.png
  orthant render helmet.glb -o helmet.exr --size 1920x1080 --spp 1024 --aov albedo,normal
  orthant render helmet.glb -o normals.png --renderer raster --view normals
  orthant render helmet.glb -o helmet.png --eye 0,1,4 --target 0,0,0 --fov 30 --env studio.hdr
  orthant render city.glb -o part.share --samples 0..256 --spp 1024
  orthant render hills.orw -o hills.png --spp 16
  orthant render platforms.orw -o platforms.png --spp 4 --mode integral --pos 0,40,0,0.5 --yaw 30
  orthant render house.glb --world hills.orw -o both.png --eye 40,60,40 --target 0,30,0")]
pub struct RenderArgs {
    /// The scene: .gltf, .glb, .obj or .crts; or the world: .orw, .vox, .schem, .schematic or .litematic
    pub file: PathBuf,
    /// The image (.png tone-mapped, .exr or .hdr linear), or a .share of the work for `orthant merge`
    #[arg(short, long, value_name = "IMAGE")]
    pub output: PathBuf,

    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", help_heading = "Image")]
    pub size: Size,
    /// Samples per pixel
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 24),
        help_heading = "Image")]
    pub spp: u32,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Image")]
    pub seed: u32,
    /// Pixel filter
    #[arg(long, value_enum, default_value_t = FilterArg::BlackmanHarris, help_heading = "Image")]
    pub filter: FilterArg,
    /// Stops by which radiance is multiplied before tone mapping
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true,
        help_heading = "Image")]
    pub exposure: f32,
    /// Tone mapping of .png files
    #[arg(long, value_enum, default_value_t = TonemapArg::KhronosNeutral, help_heading = "Image")]
    pub tonemap: TonemapArg,
    /// Also write these as IMAGE-STEM.AOV.exr
    #[arg(long, value_enum, value_name = "LIST", value_delimiter = ',', help_heading = "Image")]
    pub aov: Vec<AovArg>,
    /// Render these pixels only: a cropped image, or a .share
    #[arg(long, value_name = "X,Y,W,H", value_parser = tile, help_heading = "Image")]
    pub tile: Option<Tile>,
    /// Take these samples only (half-open, in multiples of 16), into a .share
    #[arg(long, value_name = "A..B", help_heading = "Image")]
    pub samples: Option<SampleRange>,
    /// Write times, rays and memory as JSON
    #[arg(long, value_name = "FILE.json", help_heading = "Image")]
    pub stats: Option<PathBuf>,

    /// The camera of the file, by index or name [default: the first; without one, the whole scene is framed]
    #[arg(long, value_name = "INDEX|NAME", conflicts_with_all = ["eye", "target"], help_heading = "Camera")]
    pub camera: Option<String>,
    /// Where a camera of one's own stands
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, requires = "target", help_heading = "Camera")]
    pub eye: Option<Vector>,
    /// What it looks at
    #[arg(long, value_name = "x,y,z", allow_hyphen_values = true, requires = "eye", help_heading = "Camera")]
    pub target: Option<Vector>,
    /// What is up for it
    #[arg(
        long,
        value_name = "x,y,z",
        allow_hyphen_values = true,
        requires = "eye",
        default_value = "0,1,0",
        help_heading = "Camera"
    )]
    pub up: Vector,
    /// Its vertical field of view in degrees, or that of a world's camera [default: 45]
    #[arg(long, value_name = "DEG", value_parser = field_of_view, help_heading = "Camera")]
    pub fov: Option<f32>,
    /// Diameter of the lens in metres; 0 is a pinhole, everything in focus
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = not_negative, help_heading = "Camera")]
    pub aperture: f32,
    /// Distance of the plane in focus [default: the target, or the middle of the scene]
    #[arg(long, value_name = "METRES", value_parser = positive, help_heading = "Camera")]
    pub focus_distance: Option<f32>,

    /// The scene of the file [default: the file's own choice]
    #[arg(long, value_name = "INDEX", help_heading = "Scene")]
    pub scene: Option<usize>,
    /// Material variant
    #[arg(long, value_name = "NAME", help_heading = "Scene")]
    pub variant: Option<String>,
    /// Let the scene refer to files outside its own folder tree
    #[arg(long, help_heading = "Scene")]
    pub allow_external_files: bool,
    /// Time of the animation [default: the rest pose; with --animation, 0]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_hyphen_values = true, help_heading = "Scene")]
    pub time: Option<f64>,
    /// Which animation [default: with --time, the first]
    #[arg(long, value_name = "INDEX|NAME", help_heading = "Scene")]
    pub animation: Option<String>,
    /// A world in the same frame: its X, Y and Z are those of the scene
    #[arg(long, value_name = "W.orw", help_heading = "World")]
    pub world: Option<PathBuf>,
    /// Where the camera stands in a world, and how it looks
    #[command(flatten)]
    pub world_view: WorldViewArgs,
    /// Take what is intact of a damaged .orw file
    #[arg(long, help_heading = "World")]
    pub salvage: bool,

    /// What surrounds the scene: an .hdr or .exr file, sky, none, or one radiance all around [default: none for a scene with
    /// light of its own, else sky]
    #[arg(long, value_name = "FILE|sky|none|white|R,G,B", help_heading = "Light")]
    pub env: Option<EnvArg>,
    /// Turns it about the vertical, counter-clockwise from above
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true,
        help_heading = "Light")]
    pub env_rotation: f32,
    /// Multiplies it
    #[arg(long, value_name = "F", default_value_t = 1.0, value_parser = not_negative, help_heading = "Light")]
    pub env_intensity: f32,
    /// Sun of --env sky: degrees from +Z towards +X, and above the horizon
    #[arg(
        long,
        value_name = "AZIMUTH,ELEVATION",
        default_value = "-40,45",
        allow_hyphen_values = true,
        help_heading = "Light"
    )]
    pub sun: Angles,

    /// Most vertices of a path after the camera: 1 sees emission only, 2 direct light
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1024),
        help_heading = "Rendering")]
    pub max_depth: u32,
    /// Clamp what a path gathers after its first bounce, against fireflies (biased)
    #[arg(long, value_name = "RADIANCE", value_parser = positive, help_heading = "Rendering")]
    pub firefly_clamp: Option<f32>,
    /// How direct light is estimated; all converge to the same image
    #[arg(long, value_enum, default_value_t = EstimatorArg::Mis, help_heading = "Rendering")]
    pub estimator: EstimatorArg,
    /// Path tracer, or a preview by rasterizing, which takes a Vulkan device (else exit code 4)
    #[arg(long, value_enum, default_value_t = RendererArg::Path, help_heading = "Rendering")]
    pub renderer: RendererArg,
    /// What --renderer raster shows [default: shaded]
    #[arg(long, value_enum, help_heading = "Rendering")]
    pub view: Option<ViewArg>,
    /// What renders
    #[arg(long, value_enum, default_value_t = BackendArg::Auto, help_heading = "Rendering")]
    pub backend: BackendArg,
    /// Which device of it, as `orthant devices` lists them: its number or a part of its name
    #[arg(long, value_name = "INDEX|NAME", value_parser = super::values::device, help_heading = "Rendering")]
    pub device: Option<String>,
    /// How a Vulkan device traces rays; auto takes the pipeline where there is one
    #[arg(long, value_enum, default_value_t = TracerArg::Auto, help_heading = "Rendering")]
    pub tracer: TracerArg,
    /// Threads, at most 1024; 0 takes all
    #[arg(long, value_name = "N", value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(..=1024), default_value_t = 0, help_heading = "Rendering")]
    pub threads: usize,
    /// Compare what is resident in the backend with the scene, and end with exit code 5 where they differ
    #[arg(long, help_heading = "Rendering")]
    pub validate: bool,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "expected a finite number of seconds".into())
}

fn field_of_view(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|v| *v > 0.0 && *v < 180.0).ok_or_else(|| "expected degrees between 0 and 180".into())
}

/// `--env`
#[derive(Clone, Debug, PartialEq)]
pub enum EnvArg {
    /// The built-in sky.
    Sky,
    /// Black.
    None,
    /// The same radiance from everywhere.
    Constant([f32; 3]),
    /// A latitude-longitude image.
    File(PathBuf),
}

impl std::str::FromStr for EnvArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(match text {
            "sky" => Self::Sky,
            "none" => Self::None,
            "white" => Self::Constant([1.0; 3]),
            _ => match text.parse::<Vector>() {
                Ok(Vector(radiance)) => {
                    let radiance = radiance.map(|x| x as f32);
                    if !radiance.iter().all(|&x| (0.0..f32::INFINITY).contains(&x)) {
                        return Err("expected three finite numbers, 0 or more, such as 1,0.5,0".into());
                    }
                    Self::Constant(radiance)
                }
                Err(_) => Self::File(text.into()),
            },
        })
    }
}

/// `--backend`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BackendArg {
    /// Vulkan where there is a GPU that can trace rays, else the CPU
    Auto,
    /// The CPU
    Cpu,
    /// Vulkan ray tracing; exit code 4 where no device can
    Vulkan,
}

/// `--tracer`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TracerArg {
    /// What the device has
    #[default]
    Auto,
    /// The ray tracing pipeline
    Pipeline,
    /// Ray queries in a compute shader
    Query,
}

/// `--renderer`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum RendererArg {
    /// Path tracer
    Path,
    /// Rasterizer
    Raster,
}

/// `--view`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ViewArg {
    /// Lit surfaces before the environment
    Shaded,
    /// Base colour
    BaseColour,
    /// Metalness
    Metallic,
    /// Perceptual roughness
    Roughness,
    /// World-space shading normals
    Normals,
    /// World-space tangents
    Tangents,
    /// The first UV set
    Uvs,
    /// Emission
    Emissive,
    /// A colour for each node
    Node,
    /// A colour for each RenderPrimitive
    Primitive,
    /// A colour for each material
    Material,
    /// Edges of triangles
    Wireframe,
}

impl From<ViewArg> for RasterView {
    fn from(arg: ViewArg) -> Self {
        match arg {
            ViewArg::Shaded => Self::Shaded,
            ViewArg::BaseColour => Self::BaseColor,
            ViewArg::Metallic => Self::Metallic,
            ViewArg::Roughness => Self::Roughness,
            ViewArg::Normals => Self::Normals,
            ViewArg::Tangents => Self::Tangents,
            ViewArg::Uvs => Self::Uvs,
            ViewArg::Emissive => Self::Emissive,
            ViewArg::Node => Self::Node,
            ViewArg::Primitive => Self::Primitive,
            ViewArg::Material => Self::Material,
            ViewArg::Wireframe => Self::Wireframe,
        }
    }
}

/// `--filter`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FilterArg {
    /// Uniform over the pixel
    Box,
    /// Tent of radius 1
    Tent,
    /// Blackman-Harris of radius 1.5
    BlackmanHarris,
}

/// `--tonemap`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TonemapArg {
    /// Khronos PBR Neutral
    KhronosNeutral,
    /// ACES, Stephen Hill's fit
    Aces,
    /// AgX, base look
    Agx,
    /// Clipping
    None,
}

impl From<TonemapArg> for ToneMapper {
    fn from(arg: TonemapArg) -> Self {
        match arg {
            TonemapArg::KhronosNeutral => Self::KhronosNeutral,
            TonemapArg::Aces => Self::Aces,
            TonemapArg::Agx => Self::Agx,
            TonemapArg::None => Self::None,
        }
    }
}

/// `--estimator`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum EstimatorArg {
    /// Light and BSDF sampling, combined
    Mis,
    /// BSDF sampling only
    Bsdf,
    /// Light sampling only
    Light,
}

impl From<EstimatorArg> for Estimator {
    fn from(arg: EstimatorArg) -> Self {
        match arg {
            EstimatorArg::Mis => Self::Mis,
            EstimatorArg::Bsdf => Self::BsdfOnly,
            EstimatorArg::Light => Self::LightOnly,
        }
    }
}

/// `--aov`
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AovArg {
    /// Albedo of the first surface
    Albedo,
    /// World-space shading normal of the first surface
    Normal,
    /// Distance along the camera's axis
    Depth,
    /// World-space position
    Position,
    /// glTF node index, -1 where nothing is hit
    Node,
    /// RenderPrimitive index, -1 where nothing is hit
    Primitive,
    /// glTF material index, -1 where nothing is hit
    Material,
    /// Of a world: number of the block's material, -1 where no block is hit
    Block,
    /// Of a world: face of the block, 2 axis + 1 if its normal points to the axis' positive end, -1 where no block is hit
    Face,
    /// Of a world: place of the block in the lattice of its scale, less the camera's
    Cell,
}

impl AovArg {
    /// What the frame calls it.
    pub fn aov(self) -> Aov {
        match self {
            Self::Albedo => Aov::Albedo,
            Self::Normal => Aov::Normal,
            Self::Depth => Aov::Depth,
            Self::Position => Aov::Position,
            Self::Node => Aov::Node,
            Self::Primitive => Aov::Primitive,
            Self::Material => Aov::Material,
            Self::Block => Aov::Block,
            Self::Face => Aov::Face,
            Self::Cell => Aov::Cell,
        }
    }
}
