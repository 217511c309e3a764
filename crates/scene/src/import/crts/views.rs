//! Buffer views, and what is made anew.

use super::schema::{self, Dtype};
use super::{Converter, Result, at, index, invalid, nth};
use crate::model::*;

/// The buffer of what is made anew; the blob is buffer 0.
pub const GENERATED_BUFFER: usize = 1;

/// What is made anew: the bytes of buffer 1, which is there once everything is imported.
#[derive(Default)]
pub struct Generated {
    pub bytes: Vec<u8>,
    /// Images whose bytes are there.
    pub images: Vec<(ImageId, BufferViewId)>,
}

impl Converter<'_> {
    /// View number i of the file becomes view number i of the scene.
    pub(super) fn views(&mut self, views: &[schema::BufferView]) -> Result<()> {
        let blob = Buffer { name: None, uri: None, data: self.blob.clone(), extra: Extra::default() };
        self.scene.buffers.insert_nth(0, blob);
        self.scene.buffer_views.reserve(views.len());
        for (i, view) in views.iter().enumerate() {
            let available = self.blob.len();
            let place = || at("buffer_views", i, "");
            let Some(end) = view.byte_offset.checked_add(view.byte_length) else {
                let what = format!(
                    "byte_offset {} and byte_length {} overflow; the file is damaged",
                    view.byte_offset, view.byte_length
                );
                return invalid(place(), what);
            };
            if end > available as u64 {
                let what = format!("the view ends at byte {end}, but the blob has {available} bytes; it is truncated");
                return invalid(place(), what);
            }
            let size = view.dtype.size() as u64;
            if !view.byte_length.is_multiple_of(size) {
                let what =
                    format!("byte_length {} is no multiple of the {size} bytes of {}", view.byte_length, view.dtype);
                return invalid(at("buffer_views", i, "byte_length"), what);
            }
            // Both lie in a blob that is in memory.
            let (offset, length) = (view.byte_offset as usize, view.byte_length as usize);
            self.scene.buffer_views.insert_nth(i, plain_view(nth(0), offset, length));
        }
        Ok(())
    }

    /// The bytes of a view of the file.
    pub(super) fn view_bytes(&self, view: usize) -> &[u8] {
        // A view that was sent to buffer 1 is not read again.
        let view = &self.scene.buffer_views[nth(view)];
        &self.blob[view.offset..view.offset + view.length]
    }

    /// Makes room in buffer 1 for bytes that are about to be written, at a multiple of 4.
    pub(super) fn make_room(&mut self, length: usize, place: impl FnOnce() -> crate::import::Place) -> Result<usize> {
        let offset = self.generated.bytes.len().next_multiple_of(4);
        // The vector doubles, and holds the old and the new block meanwhile.
        self.charge(3 * (length as u64 + 4), place)?;
        self.generated.bytes.resize(offset, 0);
        Ok(offset)
    }

    /// A new view of the last `length` bytes of buffer 1, which begin at `offset`.
    pub(super) fn generated_view(&mut self, offset: usize) -> BufferViewId {
        let length = self.generated.bytes.len() - offset;
        self.scene.buffer_views.insert(plain_view(nth(GENERATED_BUFFER), offset, length))
    }

    /// Sends a view of the file to buffer 1, where its bytes have just been written from `offset` on.
    pub(super) fn redirect(&mut self, view: usize, offset: usize) {
        let length = self.generated.bytes.len() - offset;
        if let Some(view) = self.scene.buffer_views.get_mut(nth(view)) {
            *view = plain_view(nth(GENERATED_BUFFER), offset, length);
        }
    }

    /// Follows the index of a view of a type.
    pub(super) fn view_of(
        &self,
        value: i64,
        wanted: Dtype,
        dtypes: &[Dtype],
        list: &'static str,
        i: usize,
        key: &'static str,
    ) -> Result<usize> {
        let view = index(value, "buffer view", dtypes.len(), || at(list, i, key))?;
        match dtypes[view] {
            dtype if dtype == wanted => Ok(view),
            other => invalid(at(list, i, key), format!("buffer view {view} is {other}, but {key} must be {wanted}")),
        }
    }
}

fn plain_view(buffer: BufferId, offset: usize, length: usize) -> BufferView {
    BufferView::new(buffer, offset, length, None)
}
