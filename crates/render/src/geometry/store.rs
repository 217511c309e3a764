//! [`GeometryStore`]: where geometry lies in the global streams, while it comes and goes.
//!
//! The streams themselves are resident in the backend, and exist there alone: the store knows which spans are in use, and
//! keeps what is new until it is taken as writes. Inserting and removing move nothing else, so that the MeshDescs of all
//! other geometry stay as they are, and so do their BLAS.

use super::GeometryStreams;
use bytemuck::Pod;
use orthant_resident::batch::{RowRange, RowWrites};
use orthant_resident::rows::{EmitterTriangle, MeshDesc, NONE, VertexRow};
use orthant_resident::spans::SpanAllocator;
use std::collections::BTreeMap;

/// More rows than `u32` can number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the global streams hold at most {} rows; remove geometry first", u32::MAX - 1)]
pub struct StoreFull;

/// Decoded geometry of one primitive.
#[derive(Clone, Copy, Debug)]
pub struct Piece<'p> {
    /// Object-space positions in metres.
    pub positions: &'p [[f32; 3]],
    /// Attributes, parallel to `positions`.
    pub vertices: &'p [VertexRow],
    /// Local indices, three a triangle.
    pub indices: &'p [u32],
    /// One tangent per index, or none at all.
    pub tangents: &'p [u32],
    /// Its area table, or nothing.
    pub emitter_triangles: &'p [EmitterTriangle],
    /// Flags, bounds and area. Its ranges do not count.
    pub desc: MeshDesc,
}

impl<'p> Piece<'p> {
    /// A primitive of streams that have just been decoded.
    ///
    /// # Panics
    /// If `desc` leads outside the streams; those that were decoded with them do not.
    pub fn of(streams: &'p GeometryStreams, desc: &MeshDesc) -> Self {
        let vertices = range(desc.first_vertex, desc.vertex_count);
        let triangles = range(desc.first_emitter_triangle, emitter_count(desc));
        Self {
            positions: &streams.positions[vertices.clone()],
            vertices: &streams.vertices[vertices],
            indices: &streams.indices[range(desc.first_index, desc.index_count)],
            tangents: &streams.tangents[range(desc.first_tangent, tangent_count(desc))],
            emitter_triangles: &streams.emitter_triangles[triangles],
            desc: *desc,
        }
    }
}

fn range(first: u32, count: u32) -> std::ops::Range<usize> {
    if count == 0 { 0..0 } else { first as usize..first as usize + count as usize }
}

fn tangent_count(desc: &MeshDesc) -> u32 {
    if desc.first_tangent == NONE { 0 } else { desc.index_count }
}

fn emitter_count(desc: &MeshDesc) -> u32 {
    if desc.first_emitter_triangle == NONE { 0 } else { desc.triangle_count() }
}

/// What is to be written to one stream.
#[derive(Clone, Debug)]
struct Pending<T> {
    /// By first row. Spans that are in use together never overlap.
    spans: BTreeMap<u32, Vec<T>>,
    /// Rows that the resident stream has.
    resident: u32,
}

impl<T: Pod> Pending<T> {
    fn new(resident: u32) -> Self {
        Self { spans: BTreeMap::new(), resident }
    }

    fn write(&mut self, first: u32, rows: &[T]) {
        if !rows.is_empty() {
            self.spans.insert(first, rows.to_vec());
        }
    }

    fn take(&mut self, len: u32) -> RowWrites<T> {
        let mut ranges: Vec<RowRange<T>> = Vec::new();
        let mut end = 0u32;
        let push = |first: u32, rows: Vec<T>, ranges: &mut Vec<RowRange<T>>| match ranges.last_mut() {
            Some(last) if last.first + last.rows.len() as u32 == first => last.rows.extend(rows),
            _ => ranges.push(RowRange { first, rows }),
        };
        for (first, rows) in std::mem::take(&mut self.spans) {
            fill(end.max(self.resident), first, &mut ranges, push);
            end = first + rows.len() as u32;
            push(first, rows, &mut ranges);
        }
        fill(end.max(self.resident), len, &mut ranges, push);
        self.resident = len;
        RowWrites { len, ranges }
    }
}

/// Rows that are new, but in no span, are written as zeros: a batch covers all that is new.
fn fill<T: Pod>(from: u32, to: u32, ranges: &mut Vec<RowRange<T>>, push: impl Fn(u32, Vec<T>, &mut Vec<RowRange<T>>)) {
    if from < to {
        push(from, vec![T::zeroed(); (to - from) as usize], ranges);
    }
}

/// The writes that bring the resident streams up to date, for a [`orthant_resident::SceneBatch`].
#[derive(Clone, Debug)]
pub struct GeometryWrites {
    /// Positions.
    pub positions: RowWrites<[f32; 3]>,
    /// Attributes.
    pub vertices: RowWrites<VertexRow>,
    /// Indices.
    pub indices: RowWrites<u32>,
    /// Tangents.
    pub tangents: RowWrites<u32>,
    /// Area tables.
    pub emitter_triangles: RowWrites<EmitterTriangle>,
}

impl GeometryWrites {
    /// Bytes that cross to the backend.
    pub fn bytes(&self) -> u64 {
        self.positions.bytes()
            + self.vertices.bytes()
            + self.indices.bytes()
            + self.tangents.bytes()
            + self.emitter_triangles.bytes()
    }
}

/// The spans of the global streams.
#[derive(Clone, Debug)]
pub struct GeometryStore {
    vertex_spans: SpanAllocator,
    index_spans: SpanAllocator,
    tangent_spans: SpanAllocator,
    emitter_spans: SpanAllocator,
    positions: Pending<[f32; 3]>,
    vertices: Pending<VertexRow>,
    indices: Pending<u32>,
    tangents: Pending<u32>,
    emitter_triangles: Pending<EmitterTriangle>,
}

impl Default for GeometryStore {
    fn default() -> Self {
        Self::packed(0, 0, 0, 0)
    }
}

impl GeometryStore {
    /// Streams of so many rows that are resident and in use, without gaps: what a full derivation has made.
    pub fn packed(vertices: u32, indices: u32, tangents: u32, emitter_triangles: u32) -> Self {
        Self {
            vertex_spans: SpanAllocator::packed(vertices),
            index_spans: SpanAllocator::packed(indices),
            tangent_spans: SpanAllocator::packed(tangents),
            emitter_spans: SpanAllocator::packed(emitter_triangles),
            positions: Pending::new(vertices),
            vertices: Pending::new(vertices),
            indices: Pending::new(indices),
            tangents: Pending::new(tangents),
            emitter_triangles: Pending::new(emitter_triangles),
        }
    }

    /// The streams of a full derivation whose geometry is resident: its MeshDescs have all rows in use, without gaps.
    pub fn of(mesh_descs: &[MeshDesc]) -> Self {
        let sum = |count: fn(&MeshDesc) -> u32| mesh_descs.iter().map(count).sum();
        Self::packed(sum(|d| d.vertex_count), sum(|d| d.index_count), sum(tangent_count), sum(emitter_count))
    }

    /// Gives a piece its place. The MeshDesc that comes back has its ranges; whoever holds it gives it to
    /// [`GeometryStore::remove`] in the end.
    ///
    /// # Errors
    /// [`StoreFull`]; nothing is changed then.
    ///
    /// # Panics
    /// If the parts of the piece do not fit each other.
    pub fn insert(&mut self, piece: &Piece<'_>) -> Result<MeshDesc, StoreFull> {
        let triangles = piece.indices.len() / 3;
        assert_eq!(piece.positions.len(), piece.vertices.len(), "attributes are parallel to positions");
        assert!([0, piece.indices.len()].contains(&piece.tangents.len()), "a tangent for each index, or none");
        assert!([0, triangles].contains(&piece.emitter_triangles.len()), "an area for each triangle, or none");
        let count = |rows: usize| u32::try_from(rows).map_err(|_| StoreFull);
        let lengths = [
            count(piece.positions.len())?,
            count(piece.indices.len())?,
            count(piece.tangents.len())?,
            count(piece.emitter_triangles.len())?,
        ];
        let mut firsts = [0; 4];
        for i in 0..4 {
            match self.spans()[i].allocate(lengths[i]) {
                Some(first) => firsts[i] = first,
                None => {
                    (0..i).for_each(|taken| self.spans()[taken].free(firsts[taken], lengths[taken]));
                    return Err(StoreFull);
                }
            }
        }
        self.positions.write(firsts[0], piece.positions);
        self.vertices.write(firsts[0], piece.vertices);
        self.indices.write(firsts[1], piece.indices);
        self.tangents.write(firsts[2], piece.tangents);
        self.emitter_triangles.write(firsts[3], piece.emitter_triangles);
        let if_any = |i: usize| if lengths[i] == 0 { NONE } else { firsts[i] };
        Ok(MeshDesc {
            first_vertex: firsts[0],
            vertex_count: lengths[0],
            first_index: firsts[1],
            index_count: lengths[1],
            first_tangent: if_any(2),
            first_emitter_triangle: if_any(3),
            ..piece.desc
        })
    }

    /// Frees the spans of a MeshDesc. What lies there stays resident until something else takes the place.
    ///
    /// # Panics
    /// If they are not in use: a MeshDesc is removed once.
    pub fn remove(&mut self, desc: &MeshDesc) {
        self.vertex_spans.free(desc.first_vertex, desc.vertex_count);
        self.index_spans.free(desc.first_index, desc.index_count);
        self.tangent_spans.free(desc.first_tangent, tangent_count(desc));
        self.emitter_spans.free(desc.first_emitter_triangle, emitter_count(desc));
        // What has not been written yet need not be.
        if desc.vertex_count > 0 {
            self.positions.spans.remove(&desc.first_vertex);
            self.vertices.spans.remove(&desc.first_vertex);
        }
        if desc.index_count > 0 {
            self.indices.spans.remove(&desc.first_index);
        }
        if tangent_count(desc) > 0 {
            self.tangents.spans.remove(&desc.first_tangent);
        }
        if emitter_count(desc) > 0 {
            self.emitter_triangles.spans.remove(&desc.first_emitter_triangle);
        }
    }

    /// Gives a primitive another area table (`emitter_triangles` empty: none), as its material begins or ends to emit. The
    /// MeshDesc gets the new range; its area is the caller's.
    ///
    /// # Errors
    /// [`StoreFull`]; nothing is changed then.
    pub fn set_emitter_triangles(&mut self, desc: &mut MeshDesc, rows: &[EmitterTriangle]) -> Result<(), StoreFull> {
        assert!([0, desc.triangle_count() as usize].contains(&rows.len()), "an area for each triangle, or none");
        let first = self.emitter_spans.allocate(rows.len() as u32).ok_or(StoreFull)?;
        self.emitter_spans.free(desc.first_emitter_triangle, emitter_count(desc));
        self.emitter_triangles.spans.remove(&desc.first_emitter_triangle);
        self.emitter_triangles.write(first, rows);
        desc.first_emitter_triangle = if rows.is_empty() { NONE } else { first };
        Ok(())
    }

    /// Writes rows of a span anew, as a pose changes: the ranges of the MeshDesc stay.
    ///
    /// # Panics
    /// If there is not one row for each vertex (and each index, where there are tangents).
    pub fn rewrite(&mut self, desc: &MeshDesc, positions: &[[f32; 3]], vertices: &[VertexRow], tangents: &[u32]) {
        assert_eq!([positions.len(), vertices.len()], [desc.vertex_count as usize; 2], "a row for each vertex");
        assert_eq!(tangents.len(), tangent_count(desc) as usize, "a tangent for each index, or none");
        self.positions.write(desc.first_vertex, positions);
        self.vertices.write(desc.first_vertex, vertices);
        self.tangents.write(desc.first_tangent, tangents);
    }

    /// What has been inserted and is not resident yet.
    pub fn take_writes(&mut self) -> GeometryWrites {
        GeometryWrites {
            positions: self.positions.take(self.vertex_spans.end()),
            vertices: self.vertices.take(self.vertex_spans.end()),
            indices: self.indices.take(self.index_spans.end()),
            tangents: self.tangents.take(self.tangent_spans.end()),
            emitter_triangles: self.emitter_triangles.take(self.emitter_spans.end()),
        }
    }

    /// Bytes of all that is in use.
    pub fn bytes(&self) -> u64 {
        let bytes = |spans: &SpanAllocator, row: usize| u64::from(spans.used()) * row as u64;
        bytes(&self.vertex_spans, size_of::<[f32; 3]>() + size_of::<VertexRow>())
            + bytes(&self.index_spans, size_of::<u32>())
            + bytes(&self.tangent_spans, size_of::<u32>())
            + bytes(&self.emitter_spans, size_of::<EmitterTriangle>())
    }

    /// The spans of vertices, indices, tangents and area tables.
    pub fn occupancy(&self) -> [&SpanAllocator; 4] {
        [&self.vertex_spans, &self.index_spans, &self.tangent_spans, &self.emitter_spans]
    }

    fn spans(&mut self) -> [&mut SpanAllocator; 4] {
        [&mut self.vertex_spans, &mut self.index_spans, &mut self.tangent_spans, &mut self.emitter_spans]
    }
}
