//! CRTS, the format of ChameleonRT: a JSON header and a blob.
//!
//! The header is parsed to `schema`, and its parts become those of the scene in the order of the file. The blob is buffer
//! 0 and stays as it was read; what has to differ is made anew in buffer 1: texture coordinates (CRTS has its origin at
//! the bottom left, glTF at the top left), elements at unaligned offsets (which glTF forbids), the geometry of quad
//! lights, and images whose channels are where a glTF material wants them.
//!
//! Encoded images stay as they are. CRTS reads their rows from bottom to top, and measures v from the bottom: together
//! that is the image upright with v from the top, so turning v alone is all there is to do.

mod container;
pub mod disney;
pub mod images;
pub mod lights;
mod materials;
mod meshes;
mod objects;
mod packing;
pub mod schema;
#[cfg(test)]
mod tests;
mod views;

pub use container::is_crts;
pub use objects::{fit, written_fov_y};

use super::budget::{Budget, OverBudget};
use super::warning::{Warning, WarningKind, Warnings};
use super::{ImportFault, Place};
use crate::Scene;
use crate::model::{Blob, Buffer, BufferView, Image, Mesh, Node, Primitive, Store};
use schema::Header;
use views::Generated;

/// What is wrong, and where.
type Fault = (Place, ImportFault);
type Result<T> = std::result::Result<T, Fault>;

/// What every conversion needs.
struct Converter<'c> {
    scene: Scene,
    blob: Blob,
    generated: Generated,
    warnings: Warnings,
    budget: &'c Budget,
}

/// Imports a CRTS file. Its own bytes have been charged already.
pub fn import(bytes: Vec<u8>, budget: &Budget) -> Result<(Scene, Vec<Warning>)> {
    let mut warnings = Warnings::default();
    let file = Blob::new(bytes);
    let range = container::header_range(&file)?;
    let end = range.end;
    let (header, charged) =
        container::parse_header::<Header>(&file, range, budget, &mut warnings, schema::parsed_bound)?;
    let blob = file.slice(end..file.len()).unwrap_or_else(|| Blob::new(Vec::new()));
    budget.charge(scene_bound(&header)).map_err(|e: OverBudget| (Place::Whole, e.into()))?;
    let mut c = Converter { scene: Scene::default(), blob, generated: Generated::default(), warnings, budget };
    c.views(&header.buffer_views)?;
    let dtypes: Vec<_> = header.buffer_views.iter().map(|view| view.dtype).collect();
    c.images(&header.images, &dtypes)?;
    c.materials(&header)?;
    let geometries = c.geometries(&header.meshes, &dtypes)?;
    c.objects(&header, &geometries)?;
    c.finish();
    budget.release(charged);
    Ok((c.scene, c.warnings.into_list()))
}

/// An upper bound of what the header's objects take in the scene, besides geometry and images.
fn scene_bound(header: &Header) -> u64 {
    /// Members of a map, strings and boxes of an object that has extensions or extras.
    const JSON: usize = 4096;
    /// Stores and vectors hold the old and the new block while they grow.
    const GROWTH: usize = 3;
    const MESH: usize = GROWTH * (size_of::<Mesh>() + 512) + size_of::<Primitive>();
    const LIGHT: usize = JSON + GROWTH * (size_of::<crate::model::Material>() + 4 * size_of::<BufferView>()) + 512;
    let count = |list: usize, bytes: usize| list as u64 * bytes as u64;
    let lights = header.objects.iter().filter(|o| o.kind == schema::ObjectKind::Light).count();
    let cameras = header.objects.iter().filter(|o| o.kind == schema::ObjectKind::Camera).count();
    count(header.buffer_views.len(), GROWTH * size_of::<BufferView>() + 256)
        + count(header.meshes.len(), MESH)
        + count(header.images.len(), GROWTH * size_of::<Image>() + JSON)
        + count(header.materials.len() + 1, GROWTH * size_of::<crate::model::Material>() + JSON)
        + count(header.objects.len(), GROWTH * size_of::<Node>() + MESH + 64)
        + count(cameras, GROWTH * size_of::<crate::model::Camera>() + JSON)
        + count(lights, LIGHT)
}

impl Converter<'_> {
    /// Puts buffer 1 in its place, and lists the extensions that the materials use.
    fn finish(&mut self) {
        if !self.generated.bytes.is_empty() {
            let data = Blob::new(std::mem::take(&mut self.generated.bytes));
            let buffer = Buffer { name: None, uri: None, data, extra: Default::default() };
            self.scene.buffers.insert_nth(views::GENERATED_BUFFER, buffer);
            for (image, view) in std::mem::take(&mut self.generated.images) {
                let data = self.scene.view_blob(view);
                if let Some(image) = self.scene.images.get_mut(image) {
                    image.data = data;
                }
            }
        }
        self.scene.extensions_used = crate::visit::extensions_in_use(&self.scene).into_iter().collect();
    }

    fn charge(&self, bytes: u64, place: impl FnOnce() -> Place) -> Result<()> {
        self.budget.charge(bytes).map_err(|e| (place(), e.into()))
    }

    fn tolerate(&mut self, what: &'static str, place: impl FnOnce() -> Place) {
        self.warnings.push(WarningKind::Tolerated(what), place);
    }
}

/// The place of a member of an object of a list.
fn at(list: &str, index: usize, key: &str) -> Place {
    Place::Pointer(match key {
        "" => format!("/{list}/{index}"),
        key => format!("/{list}/{index}/{key}"),
    })
}

fn invalid<T>(place: Place, what: impl Into<String>) -> Result<T> {
    Err((place, ImportFault::Value(what.into())))
}

/// Follows an index.
fn index(value: i64, kind: &'static str, count: usize, place: impl FnOnce() -> Place) -> Result<usize> {
    match usize::try_from(value) {
        Ok(index) if index < count => Ok(index),
        Ok(index) => Err((place(), ImportFault::Index { kind, index: index as u64, count })),
        Err(_) => invalid(place(), format!("{value} is no index of a {kind}; it must be 0 to {}", count as i64 - 1)),
    }
}

/// The id of object number `index` of the file.
fn nth<K: slotmap::Key>(index: usize) -> K {
    Store::<K, ()>::nth_id(index)
}

/// A name; an empty one is none.
fn name(name: &Option<String>) -> Option<String> {
    name.clone().filter(|n| !n.is_empty())
}
