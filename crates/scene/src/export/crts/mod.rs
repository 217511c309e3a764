//! CRTS: a JSON header and a blob, by the schema that import reads.
//!
//! The format knows no hierarchy: every node becomes an object in world space, one for each of its primitives. Geometry is
//! written as triangles of f32 and u32, images as they are encoded, materials by the Disney table. What does not fit is
//! noted.

mod geometry;
mod images;
mod materials;
mod objects;
mod rectangles;

use super::placed::flatten;
use super::{ExportFault, Note};
use crate::Scene;
use crate::import::crts::lights;
use crate::import::crts::schema::{BufferView, Dtype, Header};
use std::io::Write;

type Result<T> = std::result::Result<T, ExportFault>;

/// The header begins after the length, and the blob at a multiple of this.
const BLOB_ALIGNMENT: usize = 16;
const LENGTH_BYTES: usize = 8;

/// A file that is being made.
struct Writer<'s> {
    scene: &'s Scene,
    header: Header,
    blob: Vec<u8>,
    notes: Vec<Note>,
}

/// Writes a scene; how many bytes, and what the format does not hold.
///
/// # Errors
/// Geometry that cannot be read, numbers that are not finite, and whatever `out` fails with.
pub fn write(scene: &Scene, out: &mut (impl Write + ?Sized)) -> Result<(u64, Vec<Note>)> {
    let mut w = Writer { scene, header: Header::default(), blob: Vec::new(), notes: Vec::new() };
    lights::written_dialect(&mut w.header);
    let placed = flatten(scene);
    let posed = objects::posed(scene, &placed)?;
    let mut light_parts = objects::light_parts(scene, &placed);
    let rectangles = rectangles::find(scene, &placed, &posed, &mut light_parts)?;
    let meshes = w.meshes(&light_parts, &posed.meshes, &rectangles)?;
    let images = w.images(&light_parts);
    let materials = w.materials(&light_parts, &images)?;
    w.objects(&placed, &posed, &rectangles, &meshes, materials)?;
    w.left_out();

    let mut json = serde_json::to_vec(&w.header).map_err(std::io::Error::from)?;
    let padded = (LENGTH_BYTES + json.len()).next_multiple_of(BLOB_ALIGNMENT) - LENGTH_BYTES;
    json.resize(padded, b' ');
    out.write_all(&(json.len() as u64).to_le_bytes())?;
    out.write_all(&json)?;
    out.write_all(&w.blob)?;
    Ok(((LENGTH_BYTES + json.len() + w.blob.len()) as u64, w.notes))
}

impl Writer<'_> {
    /// Adds a view at a multiple of 4; its index.
    fn view(&mut self, dtype: Dtype, bytes: impl IntoIterator<Item = u8>) -> i64 {
        let start = self.blob.len().next_multiple_of(4);
        self.blob.resize(start, 0);
        self.blob.extend(bytes);
        let byte_length = (self.blob.len() - start) as u64;
        self.header.buffer_views.push(BufferView { byte_offset: start as u64, byte_length, dtype });
        self.header.buffer_views.len() as i64 - 1
    }

    /// Notes a thing once.
    fn note(&mut self, pointer: String, what: &str) {
        if !self.notes.iter().any(|note| note.what == what) {
            self.notes.push(Note { pointer, what: what.to_owned() });
        }
    }

    /// Notes what no part of the format has to do with.
    fn left_out(&mut self) {
        let scene = self.scene;
        let list = [
            (!scene.animations().is_empty(), "/animations", "CRTS has no animations; the rest pose is written"),
            (!scene.skins().is_empty(), "/skins", "CRTS has no skins; meshes are written in the pose of their nodes"),
            (scene.nodes().iter().any(|(_, n)| n.light.is_some()), "/nodes", "CRTS has no punctual lights"),
            (scene.nodes().iter().any(|(_, n)| n.parent.is_some()), "/nodes", "CRTS has no hierarchy; it is flattened"),
            (scene.scenes().len() > 1, "/scenes", "CRTS has one scene; the default one is written"),
        ];
        if let Some(what) = crate::export::variants_left_out(scene, "CRTS") {
            self.note(crate::export::VARIANTS.to_owned(), &what);
        }
        for (is_there, pointer, what) in list {
            if is_there {
                self.note(pointer.to_owned(), what);
            }
        }
    }
}

/// A number that JSON can write.
fn finite(value: f64, name: &'static str) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(ExportFault::NotFinite(name)) }
}
