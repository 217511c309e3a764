//! What to render: a [`Frame`].

use crate::camera::Camera;
use crate::world::WorldView;
use std::ops::Range;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Which estimator of direct light is used. All converge to the same image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Estimator {
    /// Next event estimation and BSDF sampling, combined by the power heuristic.
    #[default]
    Mis,
    /// BSDF sampling only (punctual lights, which no ray can hit, are still sampled).
    BsdfOnly,
    /// Next event estimation only.
    LightOnly,
}

/// The pixel filter, sampled by importance: a sample's offset from the pixel's centre is drawn from the filter, and all
/// weights are 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelFilter {
    /// Uniform over the pixel.
    Box,
    /// Tent over -radius..radius pixels.
    Tent {
        /// In pixels.
        radius: f32,
    },
    /// Blackman-Harris over -radius..radius pixels (the usual radius is 1.5, a width of about a pixel).
    BlackmanHarris {
        /// In pixels.
        radius: f32,
    },
}

/// Arbitrary output variables: what a pixel shows besides colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aov {
    /// Albedo of the first surface (white for metals is their base colour), averaged over the samples; background 0.
    Albedo,
    /// World-space shading normal of the first surface, averaged over the samples, not normalised again.
    Normal,
    /// Distance along the camera's forward axis, of the ray through the pixel's centre; infinity where nothing is hit.
    Depth,
    /// World-space position relative to the scene's origin, of the ray through the pixel's centre.
    Position,
    /// [`crate::rows::RenderNodeRow::node`], of the ray through the pixel's centre; -1 where nothing is hit.
    Node,
    /// RenderPrimitive index, likewise.
    Primitive,
    /// [`crate::rows::MaterialRow::id`], likewise; -1 for the default material too, and for blocks of a world.
    Material,
    /// Number of the block's material in a world, likewise; -1 where no block is hit.
    Block,
    /// Face of the block that is hit, likewise: `2 axis`, plus 1 if its outward normal points to the axis' positive end; -1 where
    /// no block is hit. Axes are those of the world, in its own directions.
    Face,
    /// Cell of the block that is hit, likewise: its place in the lattice of its own scale less the anchor's. 0 where no block is
    /// hit.
    Cell,
}

impl Aov {
    /// Channels of the AOV.
    pub fn channels(self) -> usize {
        match self {
            Self::Albedo | Self::Normal | Self::Position => 3,
            Self::Depth | Self::Node | Self::Primitive | Self::Material | Self::Block | Self::Face => 1,
            Self::Cell => 4,
        }
    }
}

/// One image, or a share of one.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The camera.
    pub camera: Camera,
    /// Size of the whole image in pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// The part that is rendered.
    pub tile: Tile,
    /// The samples that are taken of every pixel. `start` is a multiple of [`crate::film::BLOCK`]; `end` is one, or the
    /// end of the whole image.
    pub samples: Range<u32>,
    /// Keep the sum of every block of samples by itself in the film, for a share.
    pub keep_blocks: bool,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most path vertices after the camera: 1 sees emission only, 2 direct light.
    pub max_depth: u32,
    /// Path vertices before Russian roulette may end a path.
    pub roulette_depth: u32,
    /// Clamp a path's indirect contribution to this radiance (biased), against fireflies.
    pub firefly_clamp: Option<f32>,
    /// The estimator.
    pub estimator: Estimator,
    /// The pixel filter.
    pub filter: PixelFilter,
    /// What to record besides colour.
    pub aovs: Vec<Aov>,
    /// Threads; 0 takes all. The result does not depend on it.
    pub threads: usize,
    /// What is seen of the backend's world; `None` leaves it out.
    pub world: Option<WorldView>,
}
