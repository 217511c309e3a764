//! Which material, smoothing group and names hold for which elements.

use super::parse::{Change, Parsed, line_place};
use super::text;
use crate::import::Place;
use std::collections::HashMap;
use std::ops::Range;

/// A run of elements with the same material and smoothing group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Span {
    /// Index into [`Parsed::pieces`].
    pub piece: usize,
    /// Elements of the piece.
    pub elements: Range<usize>,
    /// Their first corner.
    pub corner: usize,
    /// Index into [`Statements::materials`].
    pub material: Option<usize>,
    /// 0 is off.
    pub smoothing: u32,
}

/// A name and where the file uses it first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    pub name: String,
    pub place: Place,
}

/// What the statements between the elements say.
#[derive(Debug, Default)]
pub struct Statements {
    pub spans: Vec<Span>,
    /// Names of `usemtl` that elements follow, in order of first use.
    pub materials: Vec<Named>,
    /// Distinct `mtllib` statements, as the lines have them.
    pub libraries: Vec<(Box<[u8]>, Place)>,
    /// Distinct names of `o` and of `g`, in order.
    pub objects: Vec<String>,
    pub groups: Vec<String>,
}

/// Distinct byte strings in order of first use.
#[derive(Default)]
struct Distinct<'p> {
    known: HashMap<&'p [u8], usize>,
    list: Vec<&'p [u8]>,
}

impl<'p> Distinct<'p> {
    /// Its number, and whether it is new.
    fn insert(&mut self, bytes: &'p [u8]) -> (usize, bool) {
        let next = self.list.len();
        let number = *self.known.entry(bytes).or_insert(next);
        if number == next {
            self.list.push(bytes);
        }
        (number, number == next)
    }

    fn names(&self) -> Vec<String> {
        self.list.iter().map(|bytes| text::name(bytes)).collect()
    }
}

/// What holds while the elements are followed.
#[derive(Default)]
struct Walk<'p> {
    spans: Vec<Span>,
    places: Vec<Place>,
    materials: Distinct<'p>,
    /// `usemtl` that no element has followed yet, and its line.
    pending: Option<(&'p [u8], usize)>,
    material: Option<usize>,
    smoothing: u32,
    /// Where the open span begins.
    element: usize,
    corner: usize,
}

impl Walk<'_> {
    /// Ends the open span before an element.
    fn close(&mut self, piece: usize, element: usize, corner: usize) {
        if element == self.element {
            return;
        }
        if let Some((name, line)) = self.pending.take() {
            let (index, is_new) = self.materials.insert(name);
            if is_new {
                self.places.push(line_place(line));
            }
            self.material = Some(index);
        }
        self.spans.push(Span {
            piece,
            elements: self.element..element,
            corner: self.corner,
            material: self.material,
            smoothing: self.smoothing,
        });
        (self.element, self.corner) = (element, corner);
    }
}

/// Follows the statements in file order.
pub fn statements(parsed: &Parsed<'_>) -> Statements {
    let (mut objects, mut groups, mut known) = (Distinct::default(), Distinct::default(), Distinct::default());
    let mut libraries = Vec::new();
    let mut walk = Walk::default();
    for (number, piece) in parsed.pieces.iter().enumerate() {
        (walk.element, walk.corner) = (0, 0);
        for event in piece.events.iter() {
            walk.close(number, event.element, event.corner);
            match &event.change {
                Change::Material(name) => walk.pending = Some((name, event.line)),
                Change::Smoothing(group) => walk.smoothing = *group,
                Change::Object(name) => _ = objects.insert(name),
                Change::Group(names) => _ = groups.insert(names),
                Change::Library(line) => {
                    if known.insert(line).1 {
                        libraries.push((line.clone(), line_place(event.line)));
                    }
                }
            }
        }
        walk.close(number, piece.elements.len(), piece.corners.len());
    }
    let named = walk.materials.names().into_iter().zip(walk.places);
    Statements {
        spans: walk.spans,
        materials: named.map(|(name, place)| Named { name, place }).collect(),
        libraries,
        objects: objects.names(),
        groups: groups.names(),
    }
}
