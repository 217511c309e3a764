//! EXT_meshopt_compression and KHR_meshopt_compression: compressed buffer views become plain ones.
//!
//! A buffer that nothing but compressed views refers to (a fallback, whether it is marked as one or not) is not read: it
//! becomes the buffer of what these views decode to. Where a compressed view lies in a buffer that has other uses, what
//! it decodes to goes to a buffer of its own behind the others. After this, the scene has plain data only, and the
//! extension is gone from it.

use super::{Converter, Members, Result, invalid, size};
use crate::codec::meshopt::{self, Filter, MeshoptError, Mode};
use crate::import::ImportFault;
use crate::import::gltf::extensions::COMPRESSED_VIEWS;
use crate::import::gltf::schema::{self, Rest};
use crate::model::*;
use crate::place::At;
use rayon::prelude::*;

/// A compressed view: what the extension object says, and where its bytes will be.
pub(super) struct CompressedView {
    /// Which view of the document.
    index: usize,
    extension: &'static str,
    what: meshopt::View,
    /// Index of the buffer with the compressed bytes.
    source: usize,
    source_offset: u64,
    source_length: u64,
    /// Index of the buffer that the bytes go to, and their offset in it.
    target: usize,
    offset: usize,
}

/// The compressed views of a document, in order.
#[derive(Default)]
pub(super) struct CompressedViews {
    views: Vec<CompressedView>,
    /// By buffer: whether it holds nothing but what compressed views decode to.
    pub decoded_only: Vec<bool>,
    /// Bytes by target buffer; one more than the document has buffers if some go to a buffer of their own.
    lengths: Vec<usize>,
}

impl CompressedViews {
    /// Where the bytes of view `index` are: buffer, offset, length.
    pub(super) fn place(&self, index: usize) -> Option<(BufferId, usize, usize)> {
        let i = self.views.binary_search_by_key(&index, |v| v.index).ok()?;
        let view = &self.views[i];
        // The length was found to fit when the view was read.
        Some((Store::<BufferId, ()>::nth_id(view.target), view.offset, view.what.count * view.what.stride))
    }
}

impl Converter<'_> {
    /// Takes the extension out of all views that have it, and lays out what they decode to.
    pub(super) fn compressed_views(&mut self, root: &mut schema::Root<'_>) -> Result<CompressedViews> {
        let at = &At::Root.key("bufferViews");
        let buffers = root.buffers.len();
        let mut compressed = CompressedViews { decoded_only: vec![false; buffers], ..CompressedViews::default() };
        let mut plain = vec![false; buffers];
        let mut parents = Vec::new();
        for (index, view) in root.buffer_views.iter_mut().enumerate() {
            let at = &at.index(index);
            let parent = usize::try_from(view.buffer.0).ok().filter(|&b| b < buffers);
            let mut members = Members::new(view.extensions.take(), Rest::default());
            let taken = self.compressed_view(index, view, &mut members, at)?;
            view.extensions = members.into_extensions();
            match (taken, parent) {
                (Some(taken), Some(parent)) => {
                    plain[taken.source] = true;
                    compressed.decoded_only[parent] = true;
                    parents.push(parent);
                    compressed.views.push(taken);
                }
                (None, Some(parent)) => plain[parent] = true,
                // Refused where the views are converted.
                (_, None) => {}
            }
        }
        for (decoded, plain) in compressed.decoded_only.iter_mut().zip(&plain) {
            *decoded &= !plain;
        }
        compressed.lengths = vec![0; buffers + 1];
        for (view, parent) in compressed.views.iter_mut().zip(parents) {
            view.target = if compressed.decoded_only[parent] { parent } else { buffers };
            let length = &mut compressed.lengths[view.target];
            view.offset = *length;
            let end = view.what.byte_length().and_then(|n| n.checked_next_multiple_of(4)?.checked_add(*length));
            let Some(end) = end else {
                return invalid(&at.index(view.index), "the decoded views are too large for this machine");
            };
            *length = end;
        }
        Ok(compressed)
    }

    fn compressed_view(
        &mut self,
        index: usize,
        view: &schema::BufferView<'_>,
        members: &mut Members<'_>,
        at: &At<'_>,
    ) -> Result<Option<CompressedView>> {
        let mut found = None;
        for &extension in COMPRESSED_VIEWS {
            let Some(object) = members.take::<schema::MeshoptView>(extension, at)? else { continue };
            if found.is_some() {
                self.tolerate("a view may be compressed by one extension only; the first is used", at);
                continue;
            }
            found = Some((extension, object));
        }
        let Some((extension, object)) = found else { return Ok(None) };
        let extensions = at.key("extensions");
        let at = &extensions.key(extension);
        let Some(mode) = Mode::from_name(&object.mode) else {
            return invalid(&at.key("mode"), format!("{:?} is no mode that is known", object.mode));
        };
        let filter = match &object.filter {
            None => Filter::None,
            Some(name) => match Filter::from_name(name) {
                Some(filter) => filter,
                None => return invalid(&at.key("filter"), format!("{name:?} is no filter that is known")),
            },
        };
        let stride = size(object.byte_stride, &at.key("byteStride"))?;
        let what = meshopt::View { mode, filter, count: size(object.count, &at.key("count"))?, stride };
        what.check().map_err(|e| fault(e, at))?;
        let Some(length) = what.byte_length() else {
            return invalid(&at.key("count"), "the decoded view is too large for this machine");
        };
        if view.byte_length.0 != length as u64 {
            self.tolerate("the byteLength is not that of the decoded view, which is used", at);
        }
        if view.byte_stride.is_some_and(|s| s.0 != stride as u64) && extension.starts_with("EXT") {
            self.tolerate("the byteStride of the view and that of its compressed form are not the same", at);
        }
        self.counts.buffer(object.buffer, &at.key("buffer"))?;
        let source = size(object.buffer, &at.key("buffer"))?;
        Ok(Some(CompressedView {
            index,
            extension,
            what,
            source,
            source_offset: object.byte_offset.0,
            source_length: object.byte_length.0,
            target: 0,
            offset: 0,
        }))
    }

    /// Decodes all views, in parallel, into their buffers. The buffers that are read have been.
    pub(super) fn decode_views(&mut self, compressed: &CompressedViews) -> Result<()> {
        let at = &At::Root.key("bufferViews");
        let mut sources = Vec::with_capacity(compressed.views.len());
        for view in &compressed.views {
            let (at, extensions) = (&at.index(view.index), "extensions");
            let at = &at.key(extensions);
            let at = &at.key(view.extension);
            let buffer = &self.scene.buffers[Store::<BufferId, ()>::nth_id(view.source)];
            let end = view.source_offset.checked_add(view.source_length).and_then(|end| usize::try_from(end).ok());
            let range = end.and_then(|end| Some(usize::try_from(view.source_offset).ok()?..end));
            let Some(source) = range.and_then(|range| buffer.data.slice(range)) else {
                let available = buffer.data.len();
                return invalid(at, format!("the compressed view ends behind its buffer, which has {available} bytes"));
            };
            // What the data cannot hold takes no memory.
            meshopt::check(view.what, &source).map_err(|e| fault(e, at))?;
            sources.push(source);
        }
        let mut by_target = vec![Vec::new(); compressed.lengths.len()];
        for (view, source) in compressed.views.iter().zip(&sources) {
            by_target[view.target].push((view, source));
        }
        for ((target, views), &length) in by_target.into_iter().enumerate().zip(&compressed.lengths) {
            if views.is_empty() {
                continue;
            }
            self.budget.charge(length as u64).map_err(|over| (at.place(), over.into()))?;
            let mut bytes = vec![0; length];
            let mut jobs = Vec::new();
            let mut rest = &mut bytes[..];
            for (view, source) in views {
                let decoded = view.what.count * view.what.stride;
                // Views were laid out in this order, each padded to four bytes.
                let (out, behind) = rest.split_at_mut(decoded.next_multiple_of(4));
                rest = behind;
                jobs.push((view, source, &mut out[..decoded]));
            }
            let failed = jobs
                .into_par_iter()
                .filter_map(|(view, source, out)| Some((view, meshopt::decode_into(view.what, source, out).err()?)));
            if let Some((view, error)) = failed.min_by_key(|(view, _)| view.index) {
                let at = at.index(view.index);
                return Err(fault(error, &at.key("extensions").key(view.extension)));
            }
            match self.scene.buffers.get_mut(Store::<BufferId, ()>::nth_id(target)) {
                Some(buffer) => buffer.data = Blob::new(bytes),
                None => {
                    let buffer = Buffer { name: None, uri: None, data: Blob::new(bytes), extra: Extra::default() };
                    self.scene.buffers.insert_nth(target, buffer);
                }
            }
        }
        if !compressed.views.is_empty() {
            for list in [&mut self.scene.extensions_used, &mut self.scene.extensions_required] {
                list.retain(|name| !COMPRESSED_VIEWS.contains(&name.as_str()));
            }
        }
        Ok(())
    }
}

fn fault(error: MeshoptError, at: &At<'_>) -> crate::import::gltf::Fault {
    (at.place(), ImportFault::Meshopt(error))
}
