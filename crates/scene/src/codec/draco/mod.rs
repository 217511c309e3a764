//! Draco: compressed triangle meshes, as KHR_draco_mesh_compression puts them into glTF.
//!
//! The bitstream is decoded by the crate `draco-core`, which has no unsafe code and bounds what it reads; this module
//! is the only one that knows it. What is added here is the contract that importers need: how much memory decoding may
//! take is known from the header ([`Header::peak_bytes`]) before it is taken, metadata is skipped unread, errors say the
//! byte, and the result is plain: one index list, and tightly packed values per vertex for each attribute.

mod error;
#[cfg(test)]
pub(crate) mod fixtures;
mod header;
#[cfg(test)]
mod tests;

pub use error::{DracoError, DracoFault};
pub use header::{Header, Method};

use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::{GeometryAttributeType, PointAttribute};
use draco_core::{DecodeLimits as CoreLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder};
use std::borrow::Cow;
use std::panic::{AssertUnwindSafe, catch_unwind};

type Result<T> = std::result::Result<T, DracoError>;

/// What decoding one mesh may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DecodeLimits {
    /// Bytes of memory at the height of the work, result included.
    pub max_bytes: u64,
    /// Bytes of the decoded values of all attributes together. Less than what `max_bytes` leaves is a tighter limit.
    pub max_value_bytes: u64,
    /// Attributes that may have seams. Time is proportional to triangles times attributes.
    pub max_seam_attributes: u32,
}

impl DecodeLimits {
    /// 64 attributes, and any size that fits into the memory.
    pub fn new(max_bytes: u64) -> Self {
        Self { max_bytes, max_value_bytes: u64::MAX, max_seam_attributes: 64 }
    }
}

/// A decoded mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct DracoMesh {
    /// Three per triangle, each less than `vertex_count`.
    pub indices: Vec<u32>,
    /// Vertices.
    pub vertex_count: usize,
    /// In the order of the data.
    pub attributes: Vec<DracoAttribute>,
}

impl DracoMesh {
    /// The attribute with an id, as glTF refers to it.
    pub fn attribute(&self, unique_id: u32) -> Option<&DracoAttribute> {
        self.attributes.iter().find(|a| a.unique_id == unique_id)
    }
}

/// The values of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct DracoAttribute {
    /// The number that names it in this mesh.
    pub unique_id: u32,
    /// What it is for.
    pub kind: AttributeKind,
    /// The type of each component.
    pub component: Component,
    /// Components of a value, 1 to 255.
    pub components: u8,
    /// Integers stand for 0..1 or -1..1.
    pub normalized: bool,
    /// `vertex_count` values in the order of the vertices, tightly packed, little-endian.
    pub data: Vec<u8>,
}

/// What an attribute is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttributeKind {
    /// Positions.
    Position,
    /// Normals.
    Normal,
    /// Colours.
    Color,
    /// Texture coordinates.
    TexCoord,
    /// Anything else: joints, weights, tangents.
    Generic,
}

/// The type of an attribute's components.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Component {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
    Bool,
}

/// Decodes a triangle mesh: sequential or edgebreaker (standard, valence or predictive), bitstream 1.1 to 2.2.
///
/// # Errors
/// The data is damaged, is no triangle mesh, or would take more than the limits allow. Nothing is allocated for counts
/// that the limits do not cover.
pub fn decode(bytes: &[u8], limits: &DecodeLimits) -> Result<DracoMesh> {
    let header = Header::read(bytes)?;
    let at_connectivity = |fault| DracoError { offset: header.connectivity_offset, fault };
    let (count, limit) = (u32::from(header.seam_attributes), limits.max_seam_attributes);
    if count > limit {
        return Err(at_connectivity(DracoFault::TooManyAttributes { count, limit }));
    }
    let needed = header.connectivity_bytes();
    let Some(left) = limits.max_bytes.checked_sub(needed) else {
        return Err(at_connectivity(DracoFault::OverBudget { needed, limit: limits.max_bytes }));
    };
    let max_value_bytes = limits.max_value_bytes.min(left / header::VALUE_FACTOR);

    let (stream, skipped) = without_metadata(bytes, &header);
    let core_limits = CoreLimits::default()
        .with_max_faces(u64::from(header.triangles))
        .with_max_points(3 * u64::from(header.triangles) + u64::from(header.vertices))
        .with_max_decoded_bytes(max_value_bytes);
    let mut buffer = DecoderBuffer::new(&stream).with_limits(core_limits);
    let mut mesh = Mesh::new();
    // A fault of the decoder costs this mesh, not the process with its unsaved work.
    let outcome = catch_unwind(AssertUnwindSafe(|| MeshDecoder::new().decode(&mut buffer, &mut mesh)));
    let at_end = |fault| {
        let position = buffer.position();
        let offset = if position < header::FIXED_LENGTH { position } else { position + skipped };
        DracoError { offset, fault }
    };
    match outcome {
        Ok(Ok(())) => plain(&mesh).map_err(at_end),
        Ok(Err(error)) if error.kind() == ErrorKind::LimitExceeded => {
            Err(at_end(DracoFault::Limit(error.message().to_owned())))
        }
        Ok(Err(error)) => Err(at_end(DracoFault::Malformed(error.message().to_owned()))),
        Err(_) => Err(at_end(DracoFault::Malformed(PANICKED.to_owned()))),
    }
}

/// Told when the decoder panics, which its tests have never seen.
const PANICKED: &str = "the decoder has failed on this data";

/// The data without its metadata, of which glTF has no use and which may nest without end; and how many bytes it was.
fn without_metadata<'a>(bytes: &'a [u8], header: &Header) -> (Cow<'a, [u8]>, usize) {
    let skipped = header.connectivity_offset - header::FIXED_LENGTH;
    if skipped == 0 {
        return (Cow::Borrowed(bytes), 0);
    }
    let mut stream = Vec::with_capacity(bytes.len() - skipped);
    stream.extend_from_slice(&bytes[..header::FLAGS_OFFSET]);
    stream.extend_from_slice(&[0, 0]);
    stream.extend_from_slice(&bytes[header.connectivity_offset..]);
    (Cow::Owned(stream), skipped)
}

fn plain(mesh: &Mesh) -> std::result::Result<DracoMesh, DracoFault> {
    let vertex_count = mesh.num_points();
    let mut indices = Vec::with_capacity(3 * mesh.num_faces());
    indices.extend(mesh.faces().iter().flatten().map(|point| point.0));
    if indices.iter().max().is_some_and(|&index| index as usize >= vertex_count) {
        return Err(DracoFault::Malformed("a triangle has a vertex that does not exist".to_owned()));
    }
    let attributes = (0..mesh.num_attributes())
        .map(|i| attribute(mesh.attribute(i), vertex_count))
        .collect::<std::result::Result<_, _>>()?;
    Ok(DracoMesh { indices, vertex_count, attributes })
}

fn attribute(attribute: &PointAttribute, vertex_count: usize) -> std::result::Result<DracoAttribute, DracoFault> {
    let component = component(attribute.data_type())?;
    let components = attribute.num_components();
    let size = component.size() * usize::from(components);
    let stored = attribute.buffer().data();
    let missing = || DracoFault::Malformed("a vertex has no value of an attribute".to_owned());
    let data = match attribute.explicit_mapping() {
        None => stored.get(..vertex_count * size).ok_or_else(missing)?.to_vec(),
        Some(map) => {
            let map = map.get(..vertex_count).ok_or_else(missing)?;
            let mut data = Vec::with_capacity(vertex_count * size);
            for entry in map {
                let start = (entry.0 as usize).checked_mul(size).ok_or_else(missing)?;
                data.extend_from_slice(
                    start.checked_add(size).and_then(|end| stored.get(start..end)).ok_or_else(missing)?,
                );
            }
            data
        }
    };
    let kind = match attribute.attribute_type() {
        GeometryAttributeType::Position => AttributeKind::Position,
        GeometryAttributeType::Normal => AttributeKind::Normal,
        GeometryAttributeType::Color => AttributeKind::Color,
        GeometryAttributeType::TexCoord => AttributeKind::TexCoord,
        GeometryAttributeType::Generic | GeometryAttributeType::Invalid => AttributeKind::Generic,
    };
    Ok(DracoAttribute {
        unique_id: attribute.unique_id(),
        kind,
        component,
        components,
        normalized: attribute.normalized(),
        data,
    })
}

fn component(data_type: DataType) -> std::result::Result<Component, DracoFault> {
    Ok(match data_type {
        DataType::Int8 => Component::I8,
        DataType::Uint8 => Component::U8,
        DataType::Int16 => Component::I16,
        DataType::Uint16 => Component::U16,
        DataType::Int32 => Component::I32,
        DataType::Uint32 => Component::U32,
        DataType::Int64 => Component::I64,
        DataType::Uint64 => Component::U64,
        DataType::Float32 => Component::F32,
        DataType::Float64 => Component::F64,
        DataType::Bool => Component::Bool,
        DataType::Invalid => return Err(DracoFault::Malformed("an attribute has no type".to_owned())),
    })
}

impl Component {
    /// Bytes.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 | Self::Bool => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}
