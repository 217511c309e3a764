//! Where each image goes. Its bytes stay what they are.

use super::buffers::Packed;
use super::indices::Indices;
use crate::Scene;
use crate::export::beside::{Output, SideFile};
use crate::export::{ExportError, Images, Note, names};
use crate::import::files::local_path;
use crate::model::{Blob, Image, ImageSource, Kind, media_type};
use std::collections::{HashMap, HashSet};

/// How the document gives an image.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// By a URI: of the side file of that number, if there is one.
    Uri { uri: String, file: Option<usize> },
    /// By a data URI of its bytes.
    DataUri { media_type: String },
    /// By a view that the scene has.
    View(u64),
    /// By a view that is added for it, with its media type, which a view needs.
    NewView { index: u64, media_type: String },
}

/// Where all images go.
#[derive(Default)]
pub struct Plan {
    /// By the order of the images.
    pub placements: Vec<Placement>,
    pub files: Vec<SideFile>,
    /// Offset and length of the views that are added, behind those of the scene.
    pub new_views: Vec<(usize, usize)>,
    pub notes: Vec<Note>,
    /// The files by their name, without regard to case: some file systems have none.
    by_name: HashMap<String, Option<usize>>,
}

impl Plan {
    /// `stem` is the document's; files may not have a name of `reserved`.
    pub fn new(
        scene: &Scene,
        indices: &Indices,
        images: Images,
        stem: &str,
        reserved: &[String],
        packed: &mut Packed,
    ) -> Self {
        let mut plan = Self::default();
        plan.by_name.extend(reserved.iter().map(|name| (name.to_lowercase(), None)));
        let views = indices.count(Kind::BufferView);
        let core_sources: HashSet<usize> =
            scene.textures.values().filter_map(|texture| Some(indices.of(texture.source?) as usize)).collect();
        for (i, image) in scene.images.values().enumerate() {
            let placement = match images {
                Images::Keep => plan.keep(i, image, stem, indices),
                Images::Embed => plan
                    .embed(i, image, views, &core_sources, packed)
                    .unwrap_or_else(|| plan.keep(i, image, stem, indices)),
                Images::External => plan.external(i, image, stem, indices),
            };
            plan.placements.push(placement);
        }
        plan
    }

    fn keep(&mut self, i: usize, image: &Image, stem: &str, indices: &Indices) -> Placement {
        match (&image.source, &image.data) {
            (ImageSource::View(id), _) => Placement::View(indices.of(*id)),
            (ImageSource::DataUri(media_type), Some(_)) => Placement::DataUri { media_type: media_type.clone() },
            // A data URI always has its bytes; should it not, there is nothing to write.
            (ImageSource::DataUri(media_type), None) => {
                Placement::Uri { uri: format!("data:{media_type},"), file: None }
            }
            (ImageSource::Uri(uri), None) => {
                self.note(i, "its file was not there when the scene was loaded, and is not written");
                Placement::Uri { uri: uri.clone(), file: None }
            }
            (ImageSource::Uri(uri), Some(data)) => match local_path(uri) {
                Some(path) => self.file(path, data, Some(uri)),
                None => {
                    self.note(i, "its file was not below the scene's folder; it is copied beside the new document");
                    let last = uri.rsplit(['/', '\\']).next().unwrap_or_default();
                    let last = percent_encoding::percent_decode_str(last).decode_utf8_lossy();
                    self.file(names::file_name(&last, stem), data, None)
                }
            },
        }
    }

    fn embed(
        &mut self,
        i: usize,
        image: &Image,
        views: u64,
        core_sources: &HashSet<usize>,
        packed: &mut Packed,
    ) -> Option<Placement> {
        let data = image.data.as_ref().filter(|_| !matches!(image.source, ImageSource::View(_)))?;
        let stated = match &image.source {
            ImageSource::DataUri(media_type) if media_type.starts_with("image/") => Some(media_type.as_str()),
            _ => None,
        };
        let Some(media_type) = image.mime_type.as_deref().or(media_type(data)).or(stated) else {
            self.note(i, "it is of no known kind, and a view has to say which; it is not embedded");
            return None;
        };
        // Core glTF has PNG and JPEG in views; a file beside the document says nothing of its kind.
        if core_sources.contains(&i) && !matches!(media_type, "image/png" | "image/jpeg") {
            self.note(
                i,
                "textures use it without an extension, and a document may not embed its kind then; it stays a file",
            );
            return None;
        }
        let index = views + self.new_views.len() as u64;
        self.new_views.push((packed.append(data.clone()), data.len()));
        Some(Placement::NewView { index, media_type: media_type.to_owned() })
    }

    fn external(&mut self, i: usize, image: &Image, stem: &str, indices: &Indices) -> Placement {
        match (&image.source, &image.data) {
            (ImageSource::View(_) | ImageSource::DataUri(_), Some(data)) => {
                let name = match image.name.as_deref() {
                    Some(name) if !name.is_empty() => names::file_name(name, stem),
                    _ => format!("{stem}-image{i}"),
                };
                let extension = names::image_extension(data);
                let has_extension = name.to_ascii_lowercase().ends_with(&format!(".{extension}"));
                let name = if has_extension { name } else { format!("{name}.{extension}") };
                self.file(name, data, None)
            }
            _ => self.keep(i, image, stem, indices),
        }
    }

    /// A file of that path; if another file has the path already, of one that follows from its content.
    fn file(&mut self, path: String, data: &Blob, uri: Option<&String>) -> Placement {
        let mut path = path;
        for hashed in [false, true] {
            if hashed {
                path = names::with_hash(&path, [data.as_slice()]);
            }
            let number = match self.by_name.get(&path.to_lowercase()) {
                Some(Some(number)) if self.files[*number].data == *data => *number,
                Some(_) => continue,
                None => {
                    self.by_name.insert(path.to_lowercase(), Some(self.files.len()));
                    self.files.push(SideFile { path: path.clone(), data: data.clone() });
                    self.files.len() - 1
                }
            };
            let uri = uri.filter(|_| !hashed).cloned().unwrap_or_else(|| names::uri(&self.files[number].path));
            return Placement::Uri { uri, file: Some(number) };
        }
        unreachable!("a name that has the hash of its content belongs to no other content");
    }

    fn note(&mut self, image: usize, what: &str) {
        self.notes.push(Note { pointer: format!("/images/{image}"), what: what.to_owned() });
    }

    /// Writes the files, and takes over the paths that they get.
    pub fn write(&mut self, output: &mut Output<'_>) -> Result<(), ExportError> {
        for number in 0..self.files.len() {
            let path = output.side_file(&self.files[number])?;
            if path != self.files[number].path {
                self.renamed(number, path);
            }
        }
        Ok(())
    }

    /// A side file has got another path.
    fn renamed(&mut self, number: usize, path: String) {
        let new = names::uri(&path);
        self.files[number].path = path;
        for placement in &mut self.placements {
            if let Placement::Uri { uri, file } = placement
                && *file == Some(number)
            {
                uri.clone_from(&new);
            }
        }
    }
}
