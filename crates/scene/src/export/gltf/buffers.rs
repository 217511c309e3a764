//! All buffers become one: where each view's bytes go, and what the one buffer consists of. Nothing is copied.

use crate::Scene;
use crate::model::{Blob, BufferId, BufferViewId};
use std::collections::{BTreeMap, HashSet};
use std::io::{self, Write};
use std::ops::Range;

/// Each run of bytes keeps its offset modulo this, so that what was aligned stays aligned: no component of an accessor is
/// larger.
const ALIGNMENT: usize = 4;
/// Bytes between two views that may be padding: a gap of fewer is kept, so that a buffer without holes stays as it is.
const PADDING: usize = 16;

/// The one buffer of the document.
#[derive(Default)]
pub struct Packed {
    pieces: Vec<Piece>,
    length: usize,
    /// By old buffer: where runs of its bytes begin, in ascending order, and where these bytes are now.
    runs: BTreeMap<BufferId, Vec<(usize, usize)>>,
}

enum Piece {
    Bytes(Blob),
    Zeros(usize),
}

impl Packed {
    /// Packs what views refer to, or, with `keep_all`, everything. Views that are left out do not count.
    pub fn new(scene: &Scene, left_out: &HashSet<BufferViewId>, keep_all: bool) -> Self {
        let mut used: BTreeMap<BufferId, Vec<Range<usize>>> = BTreeMap::new();
        for (id, view) in scene.buffer_views.iter().filter(|(id, _)| !left_out.contains(id)) {
            debug_assert!(scene.view_bytes(id).is_some(), "views lie in their buffers");
            used.entry(view.buffer).or_default().push(view.offset..view.offset + view.length);
        }
        let mut packed = Self { pieces: Vec::new(), length: 0, runs: BTreeMap::new() };
        for (id, buffer) in scene.buffers.iter() {
            let whole = 0..buffer.data.len();
            let runs = match used.remove(&id) {
                _ if keep_all => vec![whole],
                Some(used) => merged(used, whole.end),
                None => continue,
            };
            for run in runs {
                let Some(bytes) = buffer.data.slice(run.clone()) else { continue };
                packed.align(run.start);
                packed.runs.entry(id).or_default().push((run.start, packed.length));
                packed.push(bytes);
            }
        }
        // Views of no bytes refer to a buffer as well, and a buffer has a byte at least.
        if packed.length == 0 && scene.buffer_views.ids().any(|id| !left_out.contains(&id)) {
            packed.pieces.push(Piece::Zeros(1));
            packed.length = 1;
        }
        packed
    }

    fn align(&mut self, like: usize) {
        let zeros = (like + ALIGNMENT - self.length % ALIGNMENT) % ALIGNMENT;
        if zeros > 0 {
            self.pieces.push(Piece::Zeros(zeros));
            self.length += zeros;
        }
    }

    fn push(&mut self, bytes: Blob) {
        self.length += bytes.len();
        self.pieces.push(Piece::Bytes(bytes));
    }

    /// Appends bytes of their own, and says where they are.
    pub fn append(&mut self, bytes: Blob) -> usize {
        self.align(0);
        let offset = self.length;
        self.push(bytes);
        offset
    }

    /// Where a byte of an old buffer is now.
    pub fn offset(&self, buffer: BufferId, offset: usize) -> usize {
        let runs = self.runs.get(&buffer).map_or(&[][..], Vec::as_slice);
        match runs.partition_point(|&(start, _)| start <= offset).checked_sub(1) {
            Some(i) => runs[i].1 + (offset - runs[i].0),
            // An empty view of an empty buffer.
            None => 0,
        }
    }

    /// Bytes.
    pub fn len(&self) -> usize {
        self.length
    }

    /// The bytes, piece by piece.
    pub fn pieces(&self) -> impl Iterator<Item = &[u8]> + Clone {
        self.pieces.iter().map(|piece| match piece {
            Piece::Bytes(bytes) => bytes.as_slice(),
            Piece::Zeros(count) => &[0; ALIGNMENT][..*count],
        })
    }

    /// Writes the bytes.
    pub fn write(&self, w: &mut dyn Write) -> io::Result<()> {
        self.pieces().try_for_each(|piece| w.write_all(piece))
    }
}

/// Ranges, sorted and united where they touch or only padding is between them. At the ends of the buffer too padding
/// stays.
fn merged(mut ranges: Vec<Range<usize>>, end: usize) -> Vec<Range<usize>> {
    ranges.sort_unstable_by_key(|range| (range.start, range.end));
    let mut runs: Vec<Range<usize>> = Vec::new();
    for range in ranges {
        match runs.last_mut() {
            Some(last) if range.start < last.end.saturating_add(PADDING) => last.end = last.end.max(range.end),
            _ => runs.push(range),
        }
    }
    if let Some(first) = runs.first_mut()
        && first.start < PADDING
    {
        first.start = 0;
    }
    if let Some(last) = runs.last_mut()
        && end - last.end < PADDING
    {
        last.end = end;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Buffer, BufferView, Extra};

    fn scene(buffers: &[&[u8]], views: &[(usize, Range<usize>)]) -> Scene {
        let mut scene = Scene::default();
        let add = |data: &&[u8]| {
            scene.buffers.insert(Buffer {
                name: None,
                uri: None,
                data: Blob::new(data.to_vec()),
                extra: Extra::default(),
            })
        };
        let ids: Vec<BufferId> = buffers.iter().map(add).collect();
        for (buffer, range) in views {
            scene.buffer_views.insert(BufferView {
                name: None,
                buffer: ids[*buffer],
                offset: range.start,
                length: range.len(),
                stride: None,
                target: None,
                extra: Extra::default(),
            });
        }
        scene
    }

    fn bytes(packed: &Packed) -> Vec<u8> {
        let mut bytes = Vec::new();
        packed.write(&mut bytes).unwrap();
        assert_eq!(bytes.len(), packed.len());
        bytes
    }

    fn check_views(scene: &Scene, packed: &Packed) {
        let bytes = bytes(packed);
        for (id, view) in scene.buffer_views.iter() {
            let offset = packed.offset(view.buffer, view.offset);
            assert_eq!(&bytes[offset..offset + view.length], scene.view_bytes(id).unwrap());
            assert_eq!(offset % ALIGNMENT, view.offset % ALIGNMENT);
        }
    }

    #[test]
    fn a_buffer_without_holes_stays_as_it_is() {
        let data: Vec<u8> = (0..100).collect();
        let scene = scene(&[&data], &[(0, 60..99), (0, 4..30), (0, 31..58), (0, 10..40)]);
        let packed = Packed::new(&scene, &HashSet::new(), false);
        assert_eq!(bytes(&packed), data);
        check_views(&scene, &packed);
    }

    #[test]
    fn bytes_that_no_view_refers_to_are_left_out_unless_they_are_to_stay() {
        let data: Vec<u8> = (0..200).collect();
        let scene = scene(&[&data, &[9; 50], &data], &[(0, 30..41), (0, 102..104), (2, 0..200)]);
        let packed = Packed::new(&scene, &HashSet::new(), false);
        assert!(packed.len() < 11 + 2 + 200 + 3 * ALIGNMENT, "{}", packed.len());
        check_views(&scene, &packed);
        let all = Packed::new(&scene, &HashSet::new(), true);
        check_views(&scene, &all);
        assert_eq!(all.len(), 200 + 50 + 2 + 200);
    }

    #[test]
    fn views_that_are_left_out_take_their_bytes_with_them() {
        let scene = scene(&[&[1; 100]], &[(0, 0..40), (0, 40..100)]);
        let second = scene.buffer_views.ids().nth(1).unwrap();
        let packed = Packed::new(&scene, &[second].into(), false);
        assert_eq!(packed.len(), 40);
    }

    #[test]
    fn appended_bytes_are_aligned() {
        let scene = scene(&[&[1; 5]], &[(0, 0..5)]);
        let mut packed = Packed::new(&scene, &HashSet::new(), false);
        assert_eq!(packed.append(Blob::new(vec![2; 3])), 8);
        assert_eq!(bytes(&packed), [1, 1, 1, 1, 1, 0, 0, 0, 2, 2, 2]);
    }
}
