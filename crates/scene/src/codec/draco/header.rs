//! What Draco data says of itself before the compressed part: enough to know how much memory decoding it may take.

use super::{DracoError, DracoFault};

type Result<T> = std::result::Result<T, DracoError>;

/// Bit of the flags: metadata follows the header.
const METADATA: u16 = 0x8000;

/// Length of the fixed part: magic, version, kind, method, flags.
pub(super) const FIXED_LENGTH: usize = 11;

/// Offset of the flags, a little-endian u16.
pub(super) const FLAGS_OFFSET: usize = 9;

/// How the connectivity of a mesh is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Triangles as lists of indices.
    Sequential,
    /// Triangles by how each meets those before it.
    Edgebreaker,
}

/// The header of a mesh and the counts at the start of its connectivity (Draco bitstream specification, sections
/// "Draco Header", "Metadata Decoder", "Sequential Connectivity Decoder" and "EdgeBreaker Decoder").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Bitstream version, major and minor.
    pub version: (u8, u8),
    /// How the connectivity is coded.
    pub method: Method,
    /// Triangles.
    pub triangles: u32,
    /// Vertices; an edgebreaker mesh has more of them where attributes have seams.
    pub vertices: u32,
    /// Attributes that may have seams, each with a connectivity of its own. 0 for a sequential mesh.
    pub seam_attributes: u8,
    /// Where the connectivity begins, behind the metadata.
    pub connectivity_offset: usize,
}

impl Header {
    /// Reads it. Nothing is allocated.
    ///
    /// # Errors
    /// The data is no Draco mesh of a version from 1.1 to 2.2, or ends too soon, or has no triangle.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        let mut reader = Reader { bytes, offset: 0 };
        if reader.take(5, "the magic")? != b"DRACO" {
            return Err(DracoError { offset: 0, fault: DracoFault::Magic });
        }
        let version = (reader.u8("the version")?, reader.u8("the version")?);
        if !((1, 1)..=(2, 2)).contains(&version) {
            let (major, minor) = version;
            return Err(DracoError { offset: 5, fault: DracoFault::Version { major, minor } });
        }
        match reader.u8("the kind of geometry")? {
            1 => {}
            kind => return Err(DracoError { offset: 7, fault: DracoFault::NotAMesh(kind) }),
        }
        let method = match reader.u8("the method")? {
            0 => Method::Sequential,
            1 => Method::Edgebreaker,
            method => return Err(DracoError { offset: 8, fault: DracoFault::Method(method) }),
        };
        let flags = reader.take(2, "the flags")?;
        let has_metadata = u16::from_le_bytes([flags[0], flags[1]]) & METADATA != 0;
        if has_metadata && version >= (1, 3) {
            skip_metadata(&mut reader)?;
        }
        let connectivity_offset = reader.offset;
        let (triangles, vertices, seam_attributes) = match method {
            Method::Sequential => sequential_counts(&mut reader, version)?,
            Method::Edgebreaker => edgebreaker_counts(&mut reader, version)?,
        };
        for (count, what) in [(triangles, "triangles"), (vertices, "vertices")] {
            if count == 0 {
                return Err(DracoError { offset: connectivity_offset, fault: DracoFault::Empty(what) });
            }
        }
        Ok(Self { version, method, triangles, vertices, seam_attributes, connectivity_offset })
    }

    /// An upper bound for the memory that decoding takes at its height, the result included, if the values of all
    /// attributes are `value_bytes` long together. In bytes; measured, and held to by a test.
    pub fn peak_bytes(&self, value_bytes: u64) -> u64 {
        self.connectivity_bytes().saturating_add(value_bytes.saturating_mul(VALUE_FACTOR))
    }

    /// The part of [`Header::peak_bytes`] that does not depend on the values.
    pub(super) fn connectivity_bytes(&self) -> u64 {
        u64::from(self.triangles) * (BYTES_PER_TRIANGLE + BYTES_PER_SEAM_TRIANGLE * u64::from(self.seam_attributes))
    }
}

/// Corner table, traversal and the result's indices.
const BYTES_PER_TRIANGLE: u64 = 96;

/// A corner table and a map of each attribute that may have seams.
const BYTES_PER_SEAM_TRIANGLE: u64 = 64;

/// A value is held as 32-bit symbols and integers before it becomes what it is: for bytes, ten times its size.
pub(super) const VALUE_FACTOR: u64 = 10;

/// Triangles and vertices. Before 2.2 they were fixed 32-bit numbers.
fn sequential_counts(reader: &mut Reader<'_>, version: (u8, u8)) -> Result<(u32, u32, u8)> {
    let is_fixed = version < (2, 2);
    let triangles = reader.count(is_fixed, "the number of triangles")?;
    let vertices = reader.count(is_fixed, "the number of vertices")?;
    Ok((triangles, vertices, 0))
}

/// Triangles, vertices and attributes with seams. Before 2.0 the numbers were fixed, and before 2.2 one more came first.
fn edgebreaker_counts(reader: &mut Reader<'_>, version: (u8, u8)) -> Result<(u32, u32, u8)> {
    let is_fixed = version < (2, 0);
    reader.u8("the traversal")?;
    if version < (2, 2) {
        reader.count(is_fixed, "the number of new vertices")?;
    }
    let vertices = reader.count(is_fixed, "the number of vertices")?;
    let triangles = reader.count(is_fixed, "the number of triangles")?;
    let seam_attributes = reader.u8("the number of attributes")?;
    Ok((triangles, vertices, seam_attributes))
}

/// Metadata is a tree of named values for each attribute that has any and one for the mesh. Of a tree's elements each
/// is followed by its children, so that counting the ones still to come walks it without recursion.
fn skip_metadata(reader: &mut Reader<'_>) -> Result<()> {
    let attributes = reader.count(false, "the metadata")?;
    for _ in 0..attributes {
        reader.count(false, "the metadata")?;
        skip_metadata_tree(reader)?;
    }
    skip_metadata_tree(reader)
}

fn skip_metadata_tree(reader: &mut Reader<'_>) -> Result<()> {
    let mut pending = skip_metadata_element(reader)?;
    while pending > 0 {
        reader.skip_name()?;
        let children = skip_metadata_element(reader)?;
        // Each pending element needs a byte at least, so that what does not fit this type is not in the data.
        pending = (pending - 1).saturating_add(children);
    }
    Ok(())
}

/// The values of an element. Gives the number of its children.
fn skip_metadata_element(reader: &mut Reader<'_>) -> Result<u64> {
    let entries = reader.count(false, "the metadata")?;
    for _ in 0..entries {
        reader.skip_name()?;
        let length = reader.count(false, "the metadata")?;
        reader.take(length as usize, "the metadata")?;
    }
    reader.count(false, "the metadata").map(u64::from)
}

struct Reader<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize, what: &'static str) -> Result<&'a [u8]> {
        let rest = &self.bytes[self.offset..];
        match rest.split_at_checked(length) {
            Some((taken, _)) => {
                self.offset += length;
                Ok(taken)
            }
            None => Err(DracoError { offset: self.bytes.len(), fault: DracoFault::Truncated(what) }),
        }
    }

    fn u8(&mut self, what: &'static str) -> Result<u8> {
        self.take(1, what).map(|b| b[0])
    }

    /// A fixed little-endian number, or one in groups of 7 bits, the lowest first, each but the last with its top bit set.
    fn count(&mut self, is_fixed: bool, what: &'static str) -> Result<u32> {
        let offset = self.offset;
        if is_fixed {
            let b = self.take(4, what)?;
            return Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        }
        let mut value = 0_u64;
        for shift in (0..35).step_by(7) {
            let byte = self.u8(what)?;
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return u32::try_from(value).map_err(|_| DracoError { offset, fault: DracoFault::Range(what) });
            }
        }
        Err(DracoError { offset, fault: DracoFault::Range(what) })
    }

    fn skip_name(&mut self) -> Result<()> {
        let length = self.u8("the metadata")?;
        self.take(usize::from(length), "the metadata").map(drop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGEBREAKER_2_2: &[u8] = b"DRACO\x02\x02\x01\x01\x00\x00";

    fn bytes(head: &[u8], tail: &[u8]) -> Vec<u8> {
        [head, tail].concat()
    }

    fn fault(bytes: &[u8]) -> DracoError {
        Header::read(bytes).unwrap_err()
    }

    #[test]
    fn counts_of_edgebreaker_data_come_after_the_traversal() {
        // 300 = 0b10_0101100: 0xac, 0x02.
        let header = Header::read(&bytes(EDGEBREAKER_2_2, &[0, 0xac, 0x02, 12, 3])).unwrap();
        let expected = Header {
            version: (2, 2),
            method: Method::Edgebreaker,
            triangles: 12,
            vertices: 300,
            seam_attributes: 3,
            connectivity_offset: 11,
        };
        assert_eq!(header, expected);
    }

    #[test]
    fn counts_were_fixed_numbers_before_varints() {
        let sequential = Header::read(b"DRACO\x02\x01\x01\x00\x00\x00\x0c\0\0\0\x08\0\0\0").unwrap();
        assert_eq!((sequential.triangles, sequential.vertices), (12, 8));
        let edgebreaker = Header::read(b"DRACO\x01\x02\x01\x01\x00\x00\x00\x01\0\0\0\x08\0\0\0\x0c\0\0\0\x02").unwrap();
        assert_eq!((edgebreaker.triangles, edgebreaker.vertices, edgebreaker.seam_attributes), (12, 8, 2));
    }

    #[test]
    fn metadata_of_any_shape_is_skipped() {
        let metadata = [
            1, 0, // one attribute: its id is 0
            1, 1, b'k', 2, b'v', b'w', 0, // one value "k", no children
            0, 2, // the mesh: no values, two children
            1, b'a', 0, 1, 1, b'b', 0, 0, // "a" with a child "b"
            1, b'c', 0, 0, // "c"
        ];
        let tail = [&metadata[..], &[0, 8, 12, 1]].concat();
        let header = Header::read(&bytes(b"DRACO\x02\x02\x01\x01\x00\x80", &tail)).unwrap();
        assert_eq!(header.connectivity_offset, 11 + metadata.len());
        assert_eq!((header.vertices, header.triangles), (8, 12));
    }

    #[test]
    fn deeply_nested_metadata_is_walked_without_recursion() {
        // A million elements, each the only child of the one before.
        let mut tail = vec![0, 0, 1];
        for _ in 0..1_000_000 {
            tail.extend([0, 0, 1]);
        }
        tail.extend([0, 0, 0, 0, 8, 12, 1]);
        let header = Header::read(&bytes(b"DRACO\x02\x02\x01\x01\x00\x80", &tail)).unwrap();
        assert_eq!((header.vertices, header.triangles), (8, 12));
    }

    #[test]
    fn what_is_no_mesh_is_refused_with_the_place() {
        assert_eq!(fault(b"OBJ__\x02\x02").fault, DracoFault::Magic);
        assert_eq!(fault(b"DRA").fault, DracoFault::Truncated("the magic"));
        assert_eq!(
            fault(b"DRACO\x02\x03\x01\x01\0\0"),
            DracoError { offset: 5, fault: DracoFault::Version { major: 2, minor: 3 } }
        );
        assert_eq!(fault(b"DRACO\x02\x02\x00\x01\0\0"), DracoError { offset: 7, fault: DracoFault::NotAMesh(0) });
        assert_eq!(fault(b"DRACO\x02\x02\x01\x02\0\0"), DracoError { offset: 8, fault: DracoFault::Method(2) });
        assert_eq!(fault(&bytes(EDGEBREAKER_2_2, &[0, 8, 0, 1])).fault, DracoFault::Empty("triangles"));
        let endless = bytes(EDGEBREAKER_2_2, &[0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff]);
        assert_eq!(fault(&endless), DracoError { offset: 12, fault: DracoFault::Range("the number of vertices") });
    }

    #[test]
    fn every_truncation_is_an_error() {
        let whole = bytes(EDGEBREAKER_2_2, &[0, 8, 12, 1]);
        assert!(Header::read(&whole).is_ok());
        for length in 0..whole.len() {
            assert!(matches!(fault(&whole[..length]).fault, DracoFault::Truncated(_)), "{length}");
        }
    }
}
