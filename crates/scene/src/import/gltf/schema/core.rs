//! The core of the specification.

use super::{Attributes, Extensions, Int, Rest, Text};
use serde::Deserialize;
use serde_json::value::RawValue;

/// A glTF object: its own members, the two that every object may have, and those that nobody knows.
macro_rules! object {
    ($(#[$outer:meta])* $name:ident { $($(#[$meta:meta])* $field:ident: $ty:ty),* $(,)? }) => {
        $(#[$outer])*
        #[derive(Debug, Deserialize)]
        #[serde(rename_all = "camelCase")]
        pub struct $name<'a> {
            $($(#[$meta])* pub $field: $ty,)*
            #[serde(borrow, default)]
            pub extensions: Option<Extensions<'a>>,
            #[serde(borrow, default)]
            pub extras: Option<&'a RawValue>,
            #[serde(flatten)]
            pub rest: Rest,
        }
    };
}
pub(super) use object;

object!(Root {
    #[serde(borrow)]
    asset: Asset<'a>,
    #[serde(default)]
    extensions_used: Vec<String>,
    #[serde(default)]
    extensions_required: Vec<String>,
    scene: Option<Int>,
    #[serde(borrow, default)]
    scenes: Vec<Scene<'a>>,
    #[serde(borrow, default)]
    nodes: Vec<Node<'a>>,
    #[serde(borrow, default)]
    meshes: Vec<Mesh<'a>>,
    #[serde(borrow, default)]
    materials: Vec<Material<'a>>,
    #[serde(borrow, default)]
    textures: Vec<Texture<'a>>,
    #[serde(borrow, default)]
    images: Vec<Image<'a>>,
    #[serde(borrow, default)]
    samplers: Vec<Sampler<'a>>,
    #[serde(borrow, default)]
    accessors: Vec<Accessor<'a>>,
    #[serde(borrow, default)]
    buffer_views: Vec<BufferView<'a>>,
    #[serde(borrow, default)]
    buffers: Vec<Buffer<'a>>,
    #[serde(borrow, default)]
    skins: Vec<Skin<'a>>,
    #[serde(borrow, default)]
    animations: Vec<Animation<'a>>,
    #[serde(borrow, default)]
    cameras: Vec<Camera<'a>>,
});

object!(Asset {
    version: String,
    min_version: Option<String>,
    generator: Option<String>,
    copyright: Option<String>,
});

object!(Scene {
    name: Option<String>,
    #[serde(default)]
    nodes: Vec<Int>,
});

// Documents have up to millions of nodes: what is rare is boxed.
object!(#[derive(Default)] Node {
    name: Option<String>,
    #[serde(default)]
    children: Vec<Int>,
    camera: Option<Int>,
    mesh: Option<Int>,
    skin: Option<Int>,
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    weights: Option<Vec<f64>>,
});

object!(Mesh {
    name: Option<String>,
    #[serde(borrow)]
    primitives: Vec<Primitive<'a>>,
    #[serde(default)]
    weights: Vec<f64>,
});

object!(Primitive {
    attributes: Attributes,
    indices: Option<Int>,
    material: Option<Int>,
    mode: Option<Int>,
    #[serde(default)]
    targets: Vec<Attributes>,
});

// Boxed, because most materials have few of them: the size of the largest object bounds what a text may take.
object!(Material {
    name: Option<String>,
    #[serde(borrow)]
    pbr_metallic_roughness: Option<Box<PbrMetallicRoughness<'a>>>,
    #[serde(borrow)]
    normal_texture: Option<Box<TextureInfo<'a>>>,
    #[serde(borrow)]
    occlusion_texture: Option<Box<TextureInfo<'a>>>,
    #[serde(borrow)]
    emissive_texture: Option<Box<TextureInfo<'a>>>,
    emissive_factor: Option<[f64; 3]>,
    alpha_mode: Option<AlphaMode>,
    alpha_cutoff: Option<f64>,
    double_sided: Option<bool>,
});

object!(PbrMetallicRoughness {
    base_color_factor: Option<[f64; 4]>,
    #[serde(borrow)]
    base_color_texture: Option<Box<TextureInfo<'a>>>,
    metallic_factor: Option<f64>,
    roughness_factor: Option<f64>,
    #[serde(borrow)]
    metallic_roughness_texture: Option<Box<TextureInfo<'a>>>,
});

object!(TextureInfo {
    index: Int,
    tex_coord: Option<Int>,
    scale: Option<f64>,
    strength: Option<f64>,
});

#[derive(Clone, Copy, Debug, Deserialize)]
pub enum AlphaMode {
    #[serde(rename = "OPAQUE")]
    Opaque,
    #[serde(rename = "MASK")]
    Mask,
    #[serde(rename = "BLEND")]
    Blend,
}

object!(Texture {
    name: Option<String>,
    sampler: Option<Int>,
    source: Option<Int>,
});

object!(Image {
    name: Option<String>,
    #[serde(borrow)]
    uri: Option<Text<'a>>,
    mime_type: Option<String>,
    buffer_view: Option<Int>,
});

object!(Sampler {
    name: Option<String>,
    mag_filter: Option<Int>,
    min_filter: Option<Int>,
    wrap_s: Option<Int>,
    wrap_t: Option<Int>,
});

object!(Accessor {
    name: Option<String>,
    buffer_view: Option<Int>,
    byte_offset: Option<Int>,
    component_type: Int,
    normalized: Option<bool>,
    count: Int,
    #[serde(rename = "type")]
    element_type: ElementType,
    min: Option<Vec<f64>>,
    max: Option<Vec<f64>>,
    #[serde(borrow)]
    sparse: Option<Sparse<'a>>,
});

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum ElementType {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

object!(Sparse {
    count: Int,
    #[serde(borrow)]
    indices: SparseIndices<'a>,
    #[serde(borrow)]
    values: SparseValues<'a>,
});

object!(SparseIndices {
    buffer_view: Int,
    byte_offset: Option<Int>,
    component_type: Int,
});

object!(SparseValues {
    buffer_view: Int,
    byte_offset: Option<Int>,
});

object!(BufferView {
    name: Option<String>,
    buffer: Int,
    byte_offset: Option<Int>,
    byte_length: Int,
    byte_stride: Option<Int>,
    target: Option<Int>,
});

object!(Buffer {
    name: Option<String>,
    #[serde(borrow)]
    uri: Option<Text<'a>>,
    byte_length: Int,
});

object!(Skin {
    name: Option<String>,
    inverse_bind_matrices: Option<Int>,
    skeleton: Option<Int>,
    joints: Vec<Int>,
});

object!(Animation {
    name: Option<String>,
    #[serde(borrow)]
    channels: Vec<AnimationChannel<'a>>,
    #[serde(borrow)]
    samplers: Vec<AnimationSampler<'a>>,
});

object!(AnimationChannel {
    sampler: Int,
    #[serde(borrow)]
    target: AnimationTarget<'a>,
});

object!(AnimationTarget {
    node: Option<Int>,
    path: String,
});

object!(AnimationSampler {
    input: Int,
    interpolation: Option<Interpolation>,
    output: Int,
});

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub enum Interpolation {
    Linear,
    Step,
    CubicSpline,
}

object!(Camera {
    name: Option<String>,
    #[serde(rename = "type")]
    kind: CameraType,
    #[serde(borrow)]
    perspective: Option<Perspective<'a>>,
    #[serde(borrow)]
    orthographic: Option<Orthographic<'a>>,
});

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraType {
    Perspective,
    Orthographic,
}

object!(Perspective {
    aspect_ratio: Option<f64>,
    yfov: f64,
    znear: f64,
    zfar: Option<f64>,
});

object!(Orthographic { xmag: f64, ymag: f64, znear: f64, zfar: f64 });
