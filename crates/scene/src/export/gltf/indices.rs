//! From ids to indices: the place of an object in the document that is written.

use crate::Scene;
use crate::export::ExportFault;
use crate::model::{AnyId, BufferViewId, Id, Kind, Store};
use crate::place::At;
use crate::visit::{self, Visitor};
use std::collections::HashSet;

/// The index that each object will have. Every reference of the scene has one: that has been checked.
pub struct Indices {
    /// By [`Kind`], by slot.
    by_kind: Vec<Vec<u32>>,
}

/// No object.
const NONE: u32 = u32::MAX;

impl Indices {
    /// Objects keep their order. Buffers become one; views that are left out have no index.
    pub fn new(scene: &Scene, left_out: &HashSet<BufferViewId>) -> Result<Self, ExportFault> {
        let is_left_out = |id| matches!(id, AnyId::BufferView(id) if left_out.contains(&id));
        let by_kind = Kind::ALL.iter().map(|&kind| {
            let ids = scene.ids_of(kind);
            let slots = ids.iter().map(|id| id.slot() + 1).max().unwrap_or(0);
            let mut indices = vec![NONE; slots];
            let mut next = 0;
            for id in ids.into_iter().filter(|&id| !is_left_out(id)) {
                indices[id.slot()] = next;
                next += u32::from(kind != Kind::Buffer);
            }
            indices
        });
        let indices = Self { by_kind: by_kind.collect() };
        let mut check = Check { scene, dangling: None };
        visit::visit(scene, &mut check);
        check.dangling.map_or(Ok(indices), |pointer| Err(ExportFault::Dangling { pointer }))
    }

    /// Each object's slot for its index: what one object looks like in a document in which nothing has been taken out.
    pub fn slots() -> Self {
        Self { by_kind: Vec::new() }
    }

    /// The index of an object that the scene refers to.
    pub fn of<K: Id>(&self, id: K) -> u64 {
        self.of_any(id.into())
    }

    /// [`Indices::of`] for an id of any kind.
    pub fn of_any(&self, id: AnyId) -> u64 {
        match self.by_kind.get(id.kind() as usize) {
            Some(indices) => u64::from(indices[id.slot()]),
            None => id.slot() as u64,
        }
    }

    /// Whether the document has the view.
    pub fn has(&self, id: BufferViewId) -> bool {
        self.of(id) != u64::from(NONE)
    }

    /// How many objects of a kind there are.
    pub fn count(&self, kind: Kind) -> u64 {
        self.by_kind[kind as usize].iter().filter(|&&index| index != NONE).count() as u64
    }
}

struct Check<'s> {
    scene: &'s Scene,
    dangling: Option<String>,
}

impl Visitor for Check<'_> {
    fn slot<K: Id>(&mut self, id: K, at: &At<'_>) {
        if self.dangling.is_none() && !self.scene.contains(id) {
            self.dangling = Some(at.pointer());
        }
    }
}

/// The views that nothing but images refers to, if all these images are to leave them.
pub fn views_of_images_only(scene: &Scene) -> HashSet<BufferViewId> {
    struct Views(Vec<u32>);
    impl Visitor for Views {
        fn slot<K: Id>(&mut self, id: K, at: &At<'_>) {
            let is_image = || at.pointer().starts_with(Kind::Image.array());
            if let AnyId::BufferView(id) = id.into()
                && let Some(count) = self.0.get_mut(Store::<BufferViewId, ()>::slot(id))
                && !is_image()
            {
                *count += 1;
            }
        }
    }
    let mut views = Views(vec![0; scene.buffer_views.slot_bound()]);
    visit::visit(scene, &mut views);
    let of_images = scene.images.values().filter_map(|image| match image.source {
        crate::model::ImageSource::View(id) if image.data.is_some() => Some(id),
        _ => None,
    });
    of_images.filter(|&id| views.0[Store::<BufferViewId, ()>::slot(id)] == 0).collect()
}
