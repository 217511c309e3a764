//! Wavefront OBJ with MTL materials: what `import::obj` reads, written so that other programs read it too.
//!
//! The format knows no hierarchy: every visible node with a mesh is an object, its vertices in the world; instances and
//! meshes of several nodes are written once for each. Deformed meshes are written as the nodes pose them. Textures are
//! copied beside the file, as they are encoded. First the OBJ file is written, beside its name, so that nothing is left of it
//! if the geometry cannot be read; then the textures and the MTL file, none of them over a file of other content, so that
//! the old OBJ file is whole until the new one takes its place.

mod geometry;
mod materials;

use super::beside::{self, Output};
use super::placed::{Placed, Poses, flatten, instances};
use super::surface::Surface;
use super::{ExportError, ExportFault, ExportOptions, ExportReport, Images, Note, VARIANTS, atomic, names};
use crate::Scene;
use crate::accessor::AccessorError;
use crate::model::*;
use geometry::Geometry;
use glam::DAffine3;
use materials::Library;
use std::collections::HashSet;
use std::io::Write;
use std::path::Path;

/// Exports to `path`, and the materials to files beside it.
pub(super) fn export(scene: &Scene, path: &Path, options: &ExportOptions) -> Result<ExportReport, ExportError> {
    let failed = |fault| ExportError { file: path.to_owned(), fault };
    let stem = names::stem(path);
    let mut notes = Notes::default();
    notes.left_out(scene, options);

    let mut output = Output::new(path);
    let mut library = Library::new(scene, &stem, path, &mut notes);
    let images = library.place_images(&output)?;
    let text = library.text(scene, &mut notes).map_err(failed)?;
    let mut library_file = None;
    if !library.is_empty() {
        let mut name = format!("{stem}.mtl");
        // An image may have the name of the library, which is not on the disk yet.
        if images.iter().any(|image| image.path.eq_ignore_ascii_case(&name)) {
            name = names::with_hash(&name, [&text[..]]);
        }
        library_file = Some(output.free_name(name, [&text[..]].into_iter()).map_err(failed)?);
    }

    let mut bytes = 0;
    let written = atomic::write(path, |w| {
        let mut w = Counted { inner: w, bytes: &mut bytes };
        let library_name = library_file.as_ref().map(|name| &*name.path);
        write(scene, library_name, &library, &mut w, &mut notes)?;
        // All geometry could be read: only now comes what is beside it.
        library.write_images(images, &mut output).map_err(Stopped::Beside)?;
        library_file.map_or(Ok(()), |name| output.write(name, [&text[..]])).map_err(Stopped::Beside)
    });
    written.map_err(|stopped| match stopped {
        Stopped::Document(fault) => failed(fault),
        Stopped::Beside(error) => error,
    })?;
    let mut report = output.report;
    report.bytes_written += bytes;
    report.superseded = beside::superseded(path, &stem, "mtl", &report);
    report.files.push(path.to_owned());
    report.notes = notes.list;
    Ok(report)
}

/// What went wrong, and where.
enum Stopped {
    Document(ExportFault),
    Beside(ExportError),
}

impl From<ExportFault> for Stopped {
    fn from(fault: ExportFault) -> Self {
        Self::Document(fault)
    }
}

impl From<std::io::Error> for Stopped {
    fn from(error: std::io::Error) -> Self {
        Self::Document(error.into())
    }
}

/// What the format does not hold, each once.
#[derive(Default)]
struct Notes {
    list: Vec<Note>,
}

impl Notes {
    fn add(&mut self, pointer: String, what: &str) {
        if !self.list.iter().any(|note| note.what == what) {
            self.list.push(Note { pointer, what: what.to_owned() });
        }
    }

    /// What no part of the format has to do with.
    fn left_out(&mut self, scene: &Scene, options: &ExportOptions) {
        let any_node = |is_so: fn(&Node) -> bool| scene.nodes().iter().any(|(_, node)| is_so(node));
        let list = [
            (any_node(|n| n.parent.is_some()), "/nodes", "OBJ has no hierarchy; objects are written in world space"),
            (any_node(|n| n.camera.is_some()), "/nodes", "OBJ has no cameras"),
            (any_node(|n| n.light.is_some()), "/nodes", "OBJ has no punctual lights"),
            (!scene.animations().is_empty(), "/animations", "OBJ has no animations; the pose of the nodes is written"),
            (!scene.skins().is_empty(), "/skins", "OBJ has no skins; meshes are written in the pose of their nodes"),
            (scene.scenes().len() > 1, "/scenes", "OBJ has one scene; the default one is written"),
            (
                options.images == Images::Embed && !scene.images().is_empty(),
                "/images",
                "OBJ cannot embed images; they are files beside it",
            ),
        ];
        if let Some(what) = super::variants_left_out(scene, "OBJ") {
            self.add(VARIANTS.to_owned(), &what);
        }
        for (_, pointer, what) in list.into_iter().filter(|(is_there, ..)| *is_there) {
            self.add(pointer.to_owned(), what);
        }
    }
}

/// Counts the bytes that are written.
struct Counted<'w> {
    inner: &'w mut dyn Write,
    bytes: &'w mut u64,
}

impl Write for Counted<'_> {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        let written = self.inner.write(data)?;
        *self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.inner.flush()
    }
}

fn write(
    scene: &Scene,
    library_name: Option<&str>,
    library: &Library,
    out: &mut dyn Write,
    notes: &mut Notes,
) -> Result<(), ExportFault> {
    writeln!(out, "# Written by Orthant: metres, right-handed, Y up")?;
    if let Some(copyright) = &scene.asset().copyright {
        copyright.lines().try_for_each(|line| writeln!(out, "# {line}"))?;
    }
    if let Some(name) = library_name {
        writeln!(out, "mtllib {name}")?;
    }
    // How every file begins anyway; an empty scene is known as an OBJ by it.
    writeln!(out, "s off")?;
    let placed = flatten(scene);
    if placed.len() < scene.nodes().len() {
        notes.add("/nodes".to_owned(), "nodes that are hidden or in no scene are left out");
    }
    let mut poses = Poses::new(scene);
    let mut geometry = Geometry::new(out);
    let mut shown = HashSet::new();
    for Placed { node: id, world } in placed {
        let node = &scene.nodes()[id];
        let Some(mesh_id) = node.mesh else { continue };
        let pointer = format!("/nodes/{}", Store::<NodeId, Node>::slot(id));
        let fault = |fault: AccessorError| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
        let pose = poses.of(node).map_err(fault)?;
        let worlds = match &pose {
            // A skin puts the vertices into the world.
            Some(pose) if !pose.joints.is_empty() => vec![DAffine3::IDENTITY],
            _ => instances(scene, node, world).map_err(fault)?,
        };
        if worlds.len() > 1 || !shown.insert(mesh_id) {
            notes.add(pointer.clone(), "OBJ has no instances; each is written as geometry of its own");
        }
        let mesh = &scene.meshes()[mesh_id];
        let mesh_pointer = format!("/meshes/{}", Store::<MeshId, Mesh>::slot(mesh_id));
        let mut surfaces = Vec::with_capacity(mesh.primitives.len());
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let pointer = format!("{mesh_pointer}/primitives/{p}");
            let Some(positions) = primitive.attributes.get("POSITION") else {
                notes.add(pointer, "a primitive without positions is left out");
                continue;
            };
            what_vertices_lose(primitive, &pointer, notes);
            let read = Surface::read(scene, primitive, positions).and_then(|mut surface| {
                pose.as_ref().map_or(Ok(()), |pose| surface.deform(scene, primitive, pose))?;
                Ok(surface)
            });
            let fault = |fault| ExportFault::Geometry { pointer: pointer.clone(), fault: Box::new(fault) };
            surfaces.push((primitive, read.map_err(fault)?));
        }
        let name = node.name.as_deref().or(mesh.name.as_deref()).unwrap_or_default();
        for world in worlds {
            geometry.object(name, Store::<NodeId, Node>::slot(id))?;
            for (primitive, surface) in &surfaces {
                geometry.primitive(primitive.mode, surface, &world, library.name(scene.shown_material(primitive)))?;
            }
        }
    }
    if geometry.left_out > 0 {
        let what = format!("{} elements have positions that are not finite, and are left out", geometry.left_out);
        notes.add("/meshes".to_owned(), &what);
    }
    if geometry.has_alpha {
        notes.add("/meshes".to_owned(), "vertex colours of OBJ have no alpha");
    }
    Ok(())
}

fn what_vertices_lose(primitive: &Primitive, pointer: &str, notes: &mut Notes) {
    if !primitive.targets.is_empty() {
        notes.add(pointer.to_owned(), "OBJ has no morph targets; the shape of the default weights is written");
    }
    let is_lost = |semantic: &str| {
        let kept = ["POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0"].contains(&semantic);
        // Tangents follow from the rest, and what a skin reads is in the positions.
        !kept && semantic != "TANGENT" && !semantic.starts_with("JOINTS_") && !semantic.starts_with("WEIGHTS_")
    };
    if let Some((semantic, _)) = primitive.attributes.0.iter().find(|(s, _)| is_lost(s)) {
        let what = match semantic.starts_with("TEXCOORD_") {
            true => "OBJ has one set of texture coordinates; the others are left out".to_owned(),
            false => format!("OBJ has no attribute {semantic}"),
        };
        notes.add(pointer.to_owned(), &what);
    }
}

#[cfg(test)]
mod tests;
