use super::Place;
use std::collections::HashMap;
use std::fmt;

/// Something that was loaded although it is not as it should be, or that is not shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The first place.
    pub place: Place,
    /// What it is.
    pub kind: WarningKind,
    /// How many places have it.
    pub count: usize,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.place, self.kind)?;
        match self.count {
            1 => Ok(()),
            2 => write!(f, " (and in 1 more place)"),
            n => write!(f, " (and in {} more places)", n - 1),
        }
    }
}

/// What a warning is about.
#[derive(Clone, Debug, PartialEq, Eq, Hash, thiserror::Error)]
#[non_exhaustive]
pub enum WarningKind {
    /// An extension that is not known: kept, not interpreted.
    #[error("extension {0} is not known; its data is kept, but has no effect")]
    UnknownExtension(String),
    /// The image of a texture exists only through an extension that is not supported.
    #[error("its image is only given by {0}, which is not supported; the texture has no image")]
    NoImage(String),
    /// An image of a kind that no renderer decodes.
    #[error("the image is {0}, which cannot be decoded; the texture has no image")]
    UndecodableImage(&'static str),
    /// `mimeType` says one thing and the content another.
    #[error("mimeType says {declared}, but the image is {content}")]
    MimeType {
        /// What the file says.
        declared: String,
        /// What the bytes are.
        content: &'static str,
    },
    /// The file of an image could not be read.
    #[error("{0}; the texture has no image")]
    MissingImage(String),
    /// Something that is broken has a stand-in.
    #[error("{0}")]
    Replaced(String),
    /// A library of materials could not be read.
    #[error("{0}; materials that no other file defines are matte")]
    MissingMaterialLibrary(String),
    /// A material that no library defines.
    #[error("material {0:?} is not defined; it is matte")]
    UndefinedMaterial(String),
    /// Something in a library of materials that is not as it should be, or is not shown. The place is in that file.
    #[error("in {file}: {what}")]
    MaterialLibrary {
        /// The library.
        file: String,
        /// What it is.
        what: String,
    },
    /// A rule of the format is broken in a way that harms nothing.
    #[error("{0}")]
    Tolerated(&'static str),
}

/// Collects warnings; equal ones are counted, so that a million nodes with one flaw make one warning.
#[derive(Clone, Default)]
pub(crate) struct Warnings {
    list: Vec<Warning>,
    known: HashMap<WarningKind, usize>,
}

impl Warnings {
    /// `place` is only asked for at the first occurrence.
    pub fn push(&mut self, kind: WarningKind, place: impl FnOnce() -> Place) {
        self.push_many(kind, 1, place);
    }

    /// As many occurrences, the first of them at `place`.
    pub fn push_many(&mut self, kind: WarningKind, count: usize, place: impl FnOnce() -> Place) {
        if let Some(&i) = self.known.get(&kind) {
            self.list[i].count += count;
            return;
        }
        self.known.insert(kind.clone(), self.list.len());
        self.list.push(Warning { place: place(), kind, count });
    }

    /// Warnings that were collected about what comes later.
    pub fn append(&mut self, later: Self) {
        for warning in later.list {
            self.push_many(warning.kind, warning.count, || warning.place);
        }
    }

    pub fn into_list(self) -> Vec<Warning> {
        self.list
    }
}
