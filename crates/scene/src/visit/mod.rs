//! The index visitor: the one place that names every slot of the document that refers to an object.
//!
//! A glTF file refers by index; the model refers by id. Whatever has to follow, check, renumber or mend references goes
//! through these walks: import (are all indices good?), export (ids to indices), [`ReferenceIndex`], [`unused`], and the
//! edits that delete, duplicate and merge. `walk` defines each walk once, for shared and for mutable use; `raw` is the
//! table of the slots inside extensions that the model keeps as JSON.
//!
//! Indices inside extensions that nobody here knows stay as the file has them. They remain valid as long as the objects
//! that they mean keep their place: export keeps every order.

mod raw;
mod references;
mod unused;
mod used;
mod walk;

pub use references::{Owner, ReferenceIndex};
pub use unused::unused;
pub use used::extensions_in_use;
pub use walk::{visit, visit_object};

pub(crate) use raw::{connect, has_links, pointer_index, write_index};
pub(crate) use used::declared_extensions;
pub(crate) use walk::{visit_mut, visit_object_mut, visit_root as visit_document};

use crate::model::{AnyId, Children, Extra, Id, NodeId};
pub use crate::place::At;

/// Sees every reference of a document.
pub trait Visitor {
    /// A reference, and where the document has it. For an index inside an extension that is kept as JSON the place is
    /// that of the index, or of the JSON pointer that holds it.
    fn slot<K: Id>(&mut self, id: K, at: &At<'_>);

    /// The children of a node, or the roots of a scene. The default sees each as a reference.
    fn children(&mut self, children: &Children, at: &At<'_>) {
        children.each(|i, &id| self.slot(id, &at.index(i)));
    }

    /// What an object carries besides what is modelled. The default sees the references in it.
    fn extra(&mut self, extra: &Extra, at: &At<'_>) {
        links(self, extra, at);
    }

    /// An extension that the object has and the model types.
    fn extension(&mut self, _name: &'static str) {}

    /// A node's parent: the same edge as the parent's slot for the child, which is a reference of its own.
    fn parent(&mut self, _id: NodeId) {}
}

/// Sees every reference of a document, and may change it.
pub trait VisitorMut {
    /// A reference, and where the document has it.
    fn slot<K: Id>(&mut self, id: &mut K, at: &At<'_>);

    /// The children of a node, or the roots of a scene. The default sees each as a reference.
    fn children(&mut self, children: &mut Children, at: &At<'_>) {
        children.each_mut(|i, id| self.slot(id, &at.index(i)));
    }

    /// What an object carries besides what is modelled. The default sees the references in it.
    fn extra(&mut self, extra: &mut Extra, at: &At<'_>) {
        links_mut(self, extra, at);
    }

    /// An extension that the object has and the model types.
    fn extension(&mut self, _name: &'static str) {}

    /// A node's parent. It has to change as the parent's slot for the child does.
    fn parent(&mut self, id: &mut NodeId);
}

macro_rules! each_kind {
    ($target:expr, $id:ident => $do:expr) => {
        match $target {
            AnyId::Scene($id) => $do,
            AnyId::Node($id) => $do,
            AnyId::Mesh($id) => $do,
            AnyId::Material($id) => $do,
            AnyId::Texture($id) => $do,
            AnyId::Image($id) => $do,
            AnyId::Sampler($id) => $do,
            AnyId::Accessor($id) => $do,
            AnyId::BufferView($id) => $do,
            AnyId::Buffer($id) => $do,
            AnyId::Skin($id) => $do,
            AnyId::Animation($id) => $do,
            AnyId::Camera($id) => $do,
            AnyId::Light($id) => $do,
            AnyId::Variant($id) => $do,
            AnyId::Packet($id) => $do,
        }
    };
}

/// The references inside extensions that are kept as JSON.
pub fn links<V: Visitor + ?Sized>(visitor: &mut V, extra: &Extra, at: &At<'_>) {
    for link in extra.links() {
        let extensions = &at.key("extensions");
        let at = &extensions.path(&link.path);
        each_kind!(link.target, id => visitor.slot(id, at));
    }
}

/// [`links`], to be changed.
pub fn links_mut<V: VisitorMut + ?Sized>(visitor: &mut V, extra: &mut Extra, at: &At<'_>) {
    for link in extra.links_mut() {
        let extensions = &at.key("extensions");
        let at = &extensions.path(&link.path);
        each_kind!(&mut link.target, id => visitor.slot(id, at));
    }
}

#[cfg(test)]
mod tests;
