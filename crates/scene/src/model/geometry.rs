use super::{AccessorId, Blob, BufferId, BufferViewId, Extra, MaterialId, VariantId};
use serde::{Deserialize, Serialize};

/// A buffer: bytes that views refer to.
#[derive(Clone, Debug, PartialEq)]
pub struct Buffer {
    /// `name`.
    pub name: Option<String>,
    /// `uri` as the file has it (a data URI is dropped: the bytes are in `data`); `None` for the GLB's BIN chunk.
    pub uri: Option<String>,
    /// `byteLength` bytes (padding of a GLB chunk is cut off).
    pub data: Blob,
    /// The rest.
    pub extra: Extra,
}

/// A part of a buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct BufferView {
    /// `name`.
    pub name: Option<String>,
    /// The buffer.
    pub buffer: BufferId,
    /// `byteOffset`; offset + length is inside the buffer.
    pub offset: usize,
    /// `byteLength`.
    pub length: usize,
    /// `byteStride`.
    pub stride: Option<usize>,
    /// `target`, as the file has it.
    pub target: Option<u32>,
    /// The rest.
    pub extra: Extra,
}

impl BufferView {
    /// A part of a buffer, and nothing that may be left out.
    pub(crate) fn new(buffer: BufferId, offset: usize, length: usize, target: Option<u32>) -> Self {
        Self { name: None, buffer, offset, length, stride: None, target, extra: Extra::default() }
    }
}

/// `componentType`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u32)]
pub enum ComponentType {
    /// 5120.
    I8 = 5120,
    /// 5121.
    U8 = 5121,
    /// 5122.
    I16 = 5122,
    /// 5123.
    U16 = 5123,
    /// 5125.
    U32 = 5125,
    /// 5126.
    F32 = 5126,
}

impl ComponentType {
    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// `type`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ElementType {
    /// `SCALAR`.
    Scalar,
    /// `VEC2`.
    Vec2,
    /// `VEC3`.
    Vec3,
    /// `VEC4`.
    Vec4,
    /// `MAT2`.
    Mat2,
    /// `MAT3`.
    Mat3,
    /// `MAT4`.
    Mat4,
}

impl ElementType {
    /// Components, without the padding of matrix columns.
    pub fn components(self) -> usize {
        match self {
            Self::Scalar => 1,
            Self::Vec2 => 2,
            Self::Vec3 => 3,
            Self::Vec4 | Self::Mat2 => 4,
            Self::Mat3 => 9,
            Self::Mat4 => 16,
        }
    }

    /// Bytes of one element as it is stored: matrix columns begin at multiples of 4 bytes.
    pub fn stored_size(self, component: ComponentType) -> usize {
        self.stored_size_of(component.size())
    }

    /// [`ElementType::stored_size`] for components of a number of bytes.
    pub(crate) fn stored_size_of(self, component: usize) -> usize {
        let (columns, rows) = match self {
            Self::Mat2 => (2, 2),
            Self::Mat3 => (3, 3),
            Self::Mat4 => (4, 4),
            _ => return self.components() * component,
        };
        columns * (rows * component).next_multiple_of(4)
    }
}

/// A typed view of a buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct Accessor {
    /// `name`.
    pub name: Option<String>,
    /// Where the elements are; `None` is all zeros.
    pub view: Option<BufferViewId>,
    /// `byteOffset` inside the view.
    pub offset: usize,
    /// The component type.
    pub component_type: ComponentType,
    /// Integers stand for 0..1 or -1..1.
    pub normalized: bool,
    /// Elements.
    pub count: usize,
    /// The element type.
    pub element_type: ElementType,
    /// `min` as the file has it.
    pub min: Option<Vec<f64>>,
    /// `max` as the file has it.
    pub max: Option<Vec<f64>>,
    /// Elements that are replaced.
    pub sparse: Option<Box<Sparse>>,
    /// The rest.
    pub extra: Extra,
}

impl Accessor {
    /// All elements of a view, one after the other, and nothing that may be left out.
    pub(crate) fn packed(
        view: BufferViewId,
        component_type: ComponentType,
        element_type: ElementType,
        count: usize,
    ) -> Self {
        Self {
            name: None,
            view: Some(view),
            offset: 0,
            component_type,
            normalized: false,
            count,
            element_type,
            min: None,
            max: None,
            sparse: None,
            extra: Extra::default(),
        }
    }
}

/// Elements of an accessor that are replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct Sparse {
    /// How many.
    pub count: usize,
    /// Ascending element indices.
    pub indices_view: BufferViewId,
    /// Byte offset inside the view.
    pub indices_offset: usize,
    /// U8, U16 or U32.
    pub indices_type: ComponentType,
    /// The rest of the `indices` object.
    pub indices_extra: Extra,
    /// The new elements, of the accessor's type, tightly packed.
    pub values_view: BufferViewId,
    /// Byte offset inside the view.
    pub values_offset: usize,
    /// The rest of the `values` object.
    pub values_extra: Extra,
    /// The rest of the `sparse` object.
    pub extra: Extra,
}

/// `mode`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[repr(u32)]
pub enum PrimitiveMode {
    /// 0.
    Points = 0,
    /// 1.
    Lines = 1,
    /// 2.
    LineLoop = 2,
    /// 3.
    LineStrip = 3,
    /// 4.
    #[default]
    Triangles = 4,
    /// 5.
    TriangleStrip = 5,
    /// 6.
    TriangleFan = 6,
}

/// The attributes of a primitive or of a morph target, by semantic, in file order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Attributes(pub Vec<(String, AccessorId)>);

impl Attributes {
    /// The accessor of a semantic, such as `POSITION` or `TEXCOORD_0`.
    pub fn get(&self, semantic: &str) -> Option<AccessorId> {
        self.0.iter().find(|(s, _)| s == semantic).map(|&(_, a)| a)
    }
}

/// KHR_materials_variants: a material for some of the variants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariantMapping {
    /// The material.
    pub material: MaterialId,
    /// The variants that use it.
    pub variants: Vec<VariantId>,
    /// `name`.
    pub name: Option<String>,
    /// The rest.
    pub extra: Extra,
}

/// One geometry of a mesh with its material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Primitive {
    /// Vertex attributes.
    pub attributes: Attributes,
    /// Indices; without them, vertices in order.
    pub indices: Option<AccessorId>,
    /// Topology.
    pub mode: PrimitiveMode,
    /// Morph targets.
    pub targets: Vec<Attributes>,
    /// The material; `None` is the default one.
    pub material: Option<MaterialId>,
    /// KHR_materials_variants.
    pub variants: Vec<VariantMapping>,
    /// The rest.
    pub extra: Extra,
}

/// A mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// `name`.
    pub name: Option<String>,
    /// Its geometries.
    pub primitives: Vec<Primitive>,
    /// Default morph weights.
    pub weights: Vec<f64>,
    /// The rest.
    pub extra: Extra,
}

/// KHR_materials_variants: a variant.
#[derive(Clone, Debug, PartialEq)]
pub struct Variant {
    /// `name`.
    pub name: String,
    /// The rest.
    pub extra: Extra,
}
