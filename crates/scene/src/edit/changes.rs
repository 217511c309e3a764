//! What edits touched, for whoever has to follow.

use crate::model::{AnyId, NodeId};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::collections::VecDeque;
use std::ops::{BitOr, BitOrAssign};

/// What of an object was touched.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Facets(u16);

impl Facets {
    /// It came into the document.
    pub const ADDED: Self = Self(1 << 0);
    /// It left the document.
    pub const REMOVED: Self = Self(1 << 1);
    /// A node's place in the hierarchy: its parent, its place among its siblings, the scenes whose root it is.
    pub const PLACE: Self = Self(1 << 2);
    /// A node's local transform.
    pub const TRANSFORM: Self = Self(1 << 3);
    /// A node's own visibility.
    pub const VISIBILITY: Self = Self(1 << 4);
    /// What a node shows: mesh, skin, weights, instances.
    pub const SHAPE: Self = Self(1 << 5);
    /// A node's light.
    pub const LIGHT: Self = Self(1 << 6);
    /// A node's camera.
    pub const CAMERA: Self = Self(1 << 7);
    /// A name.
    pub const NAME: Self = Self(1 << 8);
    /// What the object itself holds, for all kinds but nodes.
    pub const CONTENT: Self = Self(1 << 9);

    /// Whether any of these is touched.
    #[inline]
    pub fn has(self, any: Self) -> bool {
        self.0 & any.0 != 0
    }
}

impl BitOr for Facets {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Facets {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

/// What was touched, in order of first touch. It says where to look, not what is there: who follows compares what it has
/// with what the document says now, so that a change set which says too much costs time and nothing else, and sets merge
/// by union.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChangeSet {
    objects: Vec<(AnyId, Facets)>,
    /// Whether what belongs to no object was touched: the default scene, the variant that is shown.
    pub document: bool,
}

impl ChangeSet {
    /// The objects and what of them was touched. An object may come several times.
    pub fn objects(&self) -> &[(AnyId, Facets)] {
        &self.objects
    }

    /// The nodes of [`ChangeSet::objects`].
    pub fn nodes(&self) -> impl Iterator<Item = (NodeId, Facets)> + '_ {
        self.objects.iter().filter_map(|&(id, facets)| match id {
            AnyId::Node(id) => Some((id, facets)),
            _ => None,
        })
    }

    /// Whether nothing was touched.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty() && !self.document
    }

    /// Notes that something was touched.
    pub fn touch(&mut self, id: impl Into<AnyId>, facets: Facets) {
        let id = id.into();
        match self.objects.last_mut() {
            Some((last, has)) if *last == id => *has |= facets,
            _ => self.objects.push((id, facets)),
        }
    }

    /// Adds what another set touched.
    pub fn merge(&mut self, other: &Self) {
        self.objects.extend_from_slice(&other.objects);
        self.document |= other.document;
    }

    /// The same with each object once, in order of first touch.
    pub fn compact(&mut self) {
        let mut places: FxHashMap<AnyId, usize> =
            FxHashMap::with_capacity_and_hasher(self.objects.len(), FxBuildHasher);
        let mut kept: Vec<(AnyId, Facets)> = Vec::with_capacity(self.objects.len());
        for &(id, facets) in &self.objects {
            match places.get(&id) {
                Some(&at) => kept[at].1 |= facets,
                None => {
                    places.insert(id, kept.len());
                    kept.push((id, facets));
                }
            }
        }
        self.objects = kept;
    }
}

/// Touched objects that a log keeps, at most, before it forgets the oldest: a consumer that lags so far behind is quicker
/// with a full derivation.
const LONGEST_LOG: usize = 1 << 20;

/// What edits touched, by revision, for any number of consumers, each with a cursor of its own.
#[derive(Clone, Debug, Default)]
pub struct ChangeLog {
    /// The revision of the document: edits that it has seen, undone and redone ones among them.
    revision: u64,
    /// The sets that lead to the last revisions, in order.
    sets: VecDeque<ChangeSet>,
    /// Objects in all sets.
    touched: usize,
}

/// How far a consumer of a [`ChangeLog`] has followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cursor(u64);

impl Cursor {
    /// The revision up to which it has followed.
    pub fn revision(self) -> u64 {
        self.0
    }
}

impl ChangeLog {
    /// The revision of the document.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// A cursor that has seen everything so far.
    pub fn cursor(&self) -> Cursor {
        Cursor(self.revision)
    }

    /// What was touched since a cursor was here last, merged, each object once; the cursor moves on. `None` if the log has
    /// forgotten a part of it: then only a full derivation helps, and the cursor has moved on as well.
    pub fn take(&self, cursor: &mut Cursor) -> Option<ChangeSet> {
        let behind = (self.revision - cursor.0.min(self.revision)) as usize;
        *cursor = self.cursor();
        let first = self.sets.len().checked_sub(behind)?;
        let mut all = ChangeSet::default();
        for set in self.sets.range(first..) {
            all.merge(set);
        }
        if behind > 1 {
            all.compact();
        }
        Some(all)
    }

    pub(super) fn push(&mut self, set: &ChangeSet) {
        self.revision += 1;
        self.touched += set.objects.len();
        self.sets.push_back(set.clone());
        while self.touched > LONGEST_LOG && self.sets.len() > 1 || self.sets.len() > LONGEST_LOG {
            let oldest = self.sets.pop_front().unwrap_or_default();
            self.touched -= oldest.objects.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Store;

    fn node(i: usize) -> NodeId {
        Store::<NodeId, ()>::nth_id(i)
    }

    #[test]
    fn every_consumer_sees_every_change_once() {
        let mut log = ChangeLog::default();
        let mut early = log.cursor();
        for i in [1, 2, 1] {
            let mut set = ChangeSet::default();
            set.touch(node(i), if i == 1 { Facets::TRANSFORM } else { Facets::NAME });
            log.push(&set);
        }
        let mut late = log.cursor();
        let mut last = ChangeSet { document: true, ..ChangeSet::default() };
        last.touch(node(1), Facets::LIGHT);
        log.push(&last);
        let seen = log.take(&mut early).unwrap();
        let expected = [(node(1).into(), Facets::TRANSFORM | Facets::LIGHT), (node(2).into(), Facets::NAME)];
        assert_eq!(seen.objects(), expected);
        assert!(seen.document && early == log.cursor());
        assert_eq!(log.take(&mut late).unwrap(), last);
        assert!(log.take(&mut late).unwrap().is_empty());
    }

    #[test]
    fn what_the_log_has_forgotten_it_says() {
        let mut log = ChangeLog::default();
        let mut cursor = log.cursor();
        let mut many = ChangeSet::default();
        (0..LONGEST_LOG / 2 + 1).for_each(|i| many.touch(node(i), Facets::PLACE));
        log.push(&many);
        log.push(&many);
        assert_eq!(log.take(&mut cursor), None);
        log.push(&ChangeSet::default());
        assert!(log.take(&mut cursor).unwrap().is_empty());
    }
}
