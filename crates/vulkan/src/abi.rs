//! What crosses between the host and the shaders, besides the rows of [`orthant_resident`]: every struct has a twin of the
//! same name and layout in `shaders/abi.slang`. A test compares the offsets with the compiled modules by reflection.
//!
//! Buffers are reached by their device addresses. Struct members are scalars, or arrays of scalars, so that their layout
//! is that of C; addresses come first.

use bytemuck::{Pod, Zeroable};
use orthant_resident::Frame;
use orthant_resident::camera::Projection;
use orthant_resident::energy::{AVERAGES, COSINES, ENERGY, ROUGHNESSES};
use orthant_resident::frame::{Aov, Estimator, PixelFilter};
use orthant_resident::math::SRGB8;
use orthant_resident::rows::MaterialRow;
use orthant_resident::sampling::pixel_filter::BLACKMAN_HARRIS;
use orthant_resident::sampling::sobol::reversed_sobol;

/// A device address; 0 where there is nothing.
pub type Address = u64;

/// Push constants of the ray tracing pipeline.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct TracePush {
    /// Of a [`FrameTable`].
    pub frame: Address,
    /// First row of the tile that this dispatch renders; its height is that of the dispatch.
    pub first_row: u32,
    /// First and end sample of this dispatch: one block, or a part of one.
    pub first_sample: u32,
    /// See `first_sample`.
    pub end_sample: u32,
    /// Which counters are this dispatch's: 64 times four (camera, bounce and shadow rays, discarded contributions), to be
    /// added up.
    pub counters: u32,
}

/// A frame: camera, image and limits, where the results go.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct FrameTable {
    /// Of a [`SceneTable`].
    pub scene: Address,
    /// Of a [`LightTable`].
    pub lights: Address,
    /// Four floats for each pixel of the tile, row by row: sums of radiance over the samples of the whole frame, and zero.
    pub film: Address,
    /// The same over the samples of the block under way.
    pub block: Address,
    /// Sums of the albedo: four floats for each pixel as in `film`, and then for each as in `block`; 0 where it is not asked
    /// for.
    pub albedo: Address,
    /// Sums of the shading normal, likewise.
    pub normal: Address,
    /// A [`CenterHit`] for each pixel; 0 where none is asked for.
    pub centers: Address,
    /// 64 times four 32-bit counters for each dispatch under way.
    pub counters: Address,
    /// Centre of the lens.
    pub position: [f32; 3],
    /// 0: perspective, 1: orthographic.
    pub projection: u32,
    /// See [`orthant_resident::Camera`].
    pub right: [f32; 3],
    /// Tangent of half the vertical field of view, or half the height.
    pub size: f32,
    /// See [`orthant_resident::Camera`].
    pub up: [f32; 3],
    /// Radius of the lens in metres.
    pub lens_radius: f32,
    /// See [`orthant_resident::Camera`].
    pub forward: [f32; 3],
    /// Distance of the plane in focus.
    pub focus_distance: f32,
    /// Nearest distance along `forward`.
    pub near: f32,
    /// Farthest.
    pub far: f32,
    /// Size of the whole image in pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// Left column of the tile.
    pub tile_x: u32,
    /// Top row.
    pub tile_y: u32,
    /// Columns of the tile.
    pub tile_width: u32,
    /// Rows.
    pub tile_height: u32,
    /// Seed of all random numbers.
    pub seed: u32,
    /// Most path vertices after the camera.
    pub max_depth: u32,
    /// Path vertices before Russian roulette.
    pub roulette_depth: u32,
    /// Limit of a path's indirect contribution; infinity for none.
    pub firefly_clamp: f32,
    /// [`orthant_resident::frame::Estimator`]: 0 both, 1 BSDF only, 2 lights only.
    pub estimator: u32,
    /// 0: box, 1: tent, 2: Blackman-Harris.
    pub filter: u32,
    /// In pixels.
    pub filter_radius: f32,
    /// One past the last sample of the frame: with it the last block ends, whole or not.
    pub end_sample: u32,
    /// Columns of four numbers of the paths under way (`stages.slang`); 0 where a frame is not traced in stages.
    pub paths: Address,
    /// Paths in a column.
    pub path_stride: u32,
    /// Zero.
    pub reserved: u32,
}

/// What the ray through a pixel's centre hits.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CenterHit {
    /// World-space position.
    pub position: [f32; 3],
    /// Distance along the camera's forward axis; infinity where nothing is hit.
    pub depth: f32,
    /// [`orthant_resident::rows::RenderNodeRow::node`], or -1.
    pub node: f32,
    /// RenderPrimitive, or -1.
    pub primitive: f32,
    /// [`orthant_resident::rows::MaterialRow::id`], or -1.
    pub material: f32,
    /// Number of the block's material, or -1.
    pub block: f32,
    /// Face of the block, or -1.
    pub face: f32,
    /// Place of the block less the anchor's; 0 where there is none.
    pub cell: [f32; 4],
    /// Zero.
    pub reserved: [f32; 3],
}

impl FrameTable {
    /// That of a frame, without the addresses.
    pub(crate) fn new(frame: &Frame) -> Self {
        let c = &frame.camera;
        let (projection, size) = match c.projection {
            Projection::Perspective { tan_half_fov_y } => (0, tan_half_fov_y),
            Projection::Orthographic { half_height } => (1, half_height),
        };
        let (filter, filter_radius) = match frame.filter {
            PixelFilter::Box => (0, 0.0),
            PixelFilter::Tent { radius } => (1, radius),
            PixelFilter::BlackmanHarris { radius } => (2, radius),
        };
        Self {
            position: c.position,
            projection,
            right: c.right,
            size,
            up: c.up,
            lens_radius: c.lens_radius,
            forward: c.forward,
            focus_distance: c.focus_distance,
            near: c.near,
            far: c.far,
            width: frame.width,
            height: frame.height,
            tile_x: frame.tile.x,
            tile_y: frame.tile.y,
            tile_width: frame.tile.width,
            tile_height: frame.tile.height,
            seed: frame.seed,
            max_depth: frame.max_depth,
            roulette_depth: frame.roulette_depth,
            firefly_clamp: frame.firefly_clamp.unwrap_or(f32::INFINITY),
            estimator: match frame.estimator {
                Estimator::Mis => 0,
                Estimator::BsdfOnly => 1,
                Estimator::LightOnly => 2,
            },
            filter,
            filter_radius,
            end_sample: frame.samples.end,
            ..Self::zeroed()
        }
    }
}

impl CenterHit {
    /// The channels of an AOV of a pixel's centre.
    pub(crate) fn channels(&self, aov: Aov) -> Vec<f32> {
        match aov {
            Aov::Depth => vec![self.depth],
            Aov::Position => self.position.to_vec(),
            Aov::Node => vec![self.node],
            Aov::Primitive => vec![self.primitive],
            Aov::Material => vec![self.material],
            Aov::Albedo | Aov::Normal => Vec::new(),
            Aov::Block => vec![self.block],
            Aov::Face => vec![self.face],
            Aov::Cell => self.cell.to_vec(),
        }
    }
}

/// Where the arenas of the resident scene are.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneTable {
    /// Three floats a vertex.
    pub positions: Address,
    /// [`orthant_resident::rows::VertexRow`].
    pub vertices: Address,
    /// 32-bit local indices.
    pub indices: Address,
    /// 32 bits a corner.
    pub tangents: Address,
    /// [`orthant_resident::rows::MeshDesc`].
    pub mesh_descs: Address,
    /// [`orthant_resident::rows::MaterialRow`].
    pub materials: Address,
    /// [`orthant_resident::batch::TextureRow`].
    pub textures: Address,
    /// [`ImageRow`], by slot of the image table.
    pub images: Address,
    /// [`orthant_resident::rows::LightRow`].
    pub lights: Address,
    /// [`orthant_resident::rows::EmitterTriangle`].
    pub emitter_triangles: Address,
    /// [`orthant_resident::rows::EmitterRow`].
    pub emitters: Address,
    /// [`orthant_resident::rows::RenderNodeRow`].
    pub render_nodes: Address,
    /// Of [`Constants`].
    pub constants: Address,
    /// Rows of the buffer of that name.
    pub material_count: u32,
    /// Rows of the buffer of that name.
    pub texture_count: u32,
    /// Rows of the buffer of that name.
    pub image_count: u32,
    /// Rows of the buffer of that name.
    pub emitter_count: u32,
    /// Rows of the buffer of that name.
    pub emitter_triangle_count: u32,
    /// Elements of the tangent stream.
    pub tangent_count: u32,
}

/// Tables that never change: those that the Rust code computes with.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Constants {
    /// What a row of the render-node buffer has whose material is in no row.
    pub default_material: MaterialRow,
    /// [`ENERGY`], row by row.
    pub energy: [u32; COSINES * ROUGHNESSES],
    /// Bit-reversed Sobol points by dimension, byte of the index, and value of the byte.
    pub reversed_sobol: [[[u32; 256]; 2]; 4],
    /// [`SRGB8`].
    pub srgb8: [f32; 256],
    /// [`AVERAGES`].
    pub averages: [[f32; 2]; ROUGHNESSES],
    /// [`BLACKMAN_HARRIS`].
    pub blackman_harris: [f32; 33],
    /// Zero.
    pub reserved: [u32; 3],
}

impl Constants {
    /// The tables.
    pub fn new() -> Self {
        let sobol = |dimension: usize, byte: u32| {
            std::array::from_fn(|value| reversed_sobol((value as u32) << (8 * byte), dimension))
        };
        Self {
            default_material: MaterialRow::DEFAULT,
            energy: ENERGY,
            reversed_sobol: std::array::from_fn(|dimension| [sobol(dimension, 0), sobol(dimension, 1)]),
            srgb8: SRGB8,
            averages: AVERAGES,
            blackman_harris: BLACKMAN_HARRIS,
            reserved: [0; 3],
        }
    }
}

impl Default for Constants {
    fn default() -> Self {
        Self::new()
    }
}

/// An image of the image table. A slot without an image has zero levels.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct ImageRow {
    /// Width of level 0 in texels.
    pub width: u32,
    /// Height of level 0.
    pub height: u32,
    /// Levels.
    pub levels: u32,
    /// Whether the colour channels are sRGB-encoded, to be decoded after the texel is loaded: 1 for 8 bits, 2 for 16.
    pub srgb: u32,
    /// Its place in the array of images.
    pub descriptor: u32,
    /// Zero.
    pub reserved: u32,
}

/// How lights are chosen.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LightTable {
    /// [`orthant_resident::sampling::light_tree::LightNode`] of the tree over emitters.
    pub emitter_nodes: Address,
    /// Its leaf of each emitter.
    pub emitter_leaves: Address,
    /// [`QuadRow`] of each emitter.
    pub quads: Address,
    /// Nodes of the tree over local punctual lights.
    pub punctual_nodes: Address,
    /// Rows of the directional lights that shine.
    pub directional: Address,
    /// Rows of the local lights that shine.
    pub local: Address,
    /// Three floats a texel of the environment's map, rows from the top.
    pub map: Address,
    /// See [`orthant_resident::sampling::EnvironmentDistribution`].
    pub marginal: Address,
    /// Likewise.
    pub conditional: Address,
    /// Likewise.
    pub cos_edges: Address,
    /// Nodes of the tree over emitters.
    pub emitter_node_count: u32,
    /// Elements of `emitter_leaves`.
    pub emitter_leaf_count: u32,
    /// Elements of `quads`.
    pub quad_count: u32,
    /// Nodes of the tree over local lights; 0 where all are candidates.
    pub punctual_node_count: u32,
    /// Elements of `directional`.
    pub directional_count: u32,
    /// Elements of `local`.
    pub local_count: u32,
    /// Size of the map; 0 without one.
    pub map_width: u32,
    /// See `map_width`.
    pub map_height: u32,
    /// 1 if there is a distribution over the map: 0 for a black one.
    pub has_distribution: u32,
    /// 1 if there is a sun.
    pub has_sun: u32,
    /// Probability of the kind ([`orthant_resident::sampling::LightKinds`]).
    pub kind_emitters: f32,
    /// Likewise.
    pub kind_environment: f32,
    /// Likewise.
    pub kind_sun: f32,
    /// What multiplies the map.
    pub intensity: f32,
    /// Sine of the map's rotation.
    pub rotation_sin: f32,
    /// Cosine of the map's rotation.
    pub rotation_cos: f32,
    /// [`orthant_resident::sampling::EnvironmentDistribution::integral`].
    pub map_integral: f32,
    /// Unit vector to the sun.
    pub sun_direction: [f32; 3],
    /// Its radiance, the intensity multiplied in.
    pub sun_radiance: [f32; 3],
    /// Cosine of its radius.
    pub sun_cos_radius: f32,
}

/// An emitter that is a parallelogram. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct QuadRow {
    /// Corner of the rectangle.
    pub corner: [f32; 3],
    /// Length of its first side.
    pub width: f32,
    /// Unit vector along the first side.
    pub x: [f32; 3],
    /// Length of its second side.
    pub height: f32,
    /// Unit vector along the second side.
    pub y: [f32; 3],
    /// Bit 0: it is a parallelogram; bit 1: a rectangle (else all but `flags` is meaningless); bits 2-3 and 4-5: see
    /// [`orthant_resident::rows::MeshDesc::parallelogram`].
    pub flags: u32,
    /// Unit vector across both.
    pub z: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

/// Push constants of the pass that writes TLAS instances from render-node rows.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct InstancePush {
    /// [`orthant_resident::rows::RenderNodeRow`].
    pub render_nodes: Address,
    /// The device address of the BLAS of each RenderPrimitive, or 0.
    pub blas: Address,
    /// `VkAccelerationStructureInstanceKHR`, by row.
    pub instances: Address,
    /// [`RowSpan`]s, ascending.
    pub spans: Address,
    /// Elements of `spans`.
    pub span_count: u32,
    /// Rows in all of them: threads with work.
    pub row_count: u32,
    /// Elements of `blas`.
    pub blas_count: u32,
    /// Zero.
    pub reserved: u32,
}

/// Consecutive rows to be written anew.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
pub struct RowSpan {
    /// The first row.
    pub first: u32,
    /// Rows in all earlier spans.
    pub before: u32,
}
