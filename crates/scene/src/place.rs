//! A place in the document, as a chain on the stack: it costs nothing until somebody asks for its JSON pointer.

use crate::import::Place;
use std::fmt::Write;

/// A place in the document.
#[derive(Clone, Copy)]
pub enum At<'a> {
    /// The document.
    Root,
    /// A member.
    Key(&'a At<'a>, &'a str),
    /// An element of an array.
    Index(&'a At<'a>, usize),
    /// A JSON pointer below a place.
    Path(&'a At<'a>, &'a str),
}

impl<'a> At<'a> {
    /// A member of what is here.
    pub fn key(&'a self, key: &'a str) -> Self {
        Self::Key(self, key)
    }

    /// An element of what is here.
    pub fn index(&'a self, index: usize) -> Self {
        Self::Index(self, index)
    }

    /// What lies at a JSON pointer below.
    pub fn path(&'a self, path: &'a str) -> Self {
        Self::Path(self, path)
    }

    /// As a JSON pointer (RFC 6901).
    pub fn pointer(&self) -> String {
        let mut out = match self {
            Self::Root => return String::new(),
            Self::Key(parent, _) | Self::Index(parent, _) | Self::Path(parent, _) => parent.pointer(),
        };
        match self {
            Self::Root => {}
            Self::Key(_, key) => push_key(&mut out, key),
            Self::Index(_, index) => {
                let _ = write!(out, "/{index}");
            }
            Self::Path(_, path) => out.push_str(path),
        }
        out
    }

    /// As the place of an error.
    pub fn place(&self) -> Place {
        Place::Pointer(self.pointer())
    }
}

/// Appends `/key`, escaped.
pub fn push_key(pointer: &mut String, key: &str) {
    pointer.push('/');
    pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pointers_are_escaped() {
        assert_eq!(At::Root.pointer(), "");
        assert_eq!(At::Root.key("nodes").index(3).key("a/b~c").pointer(), "/nodes/3/a~1b~0c");
    }
}
