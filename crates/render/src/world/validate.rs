//! Every invariant of a derived world.

use super::leaves::{ChunkBlocks, Draft};
use super::payload::encode;
use super::{DerivedWorld, closure, space, splice};
use orthant_bvh::Child;
use orthant_resident::world::rows::Root;
use rustc_hash::FxHashMap;

impl DerivedWorld {
    /// Checks every invariant: the tree is sound and has every leaf once, under its box; leaves share no point, and are tight;
    /// every payload is what its leaf needs, with as many users as it counts; spans do not overlap; and, if every batch that
    /// was planned is committed, the mirror is all of this, row for row.
    ///
    /// # Errors
    /// The first that is broken, in words.
    pub fn validate(&self) -> Result<(), String> {
        self.tree.validate().map_err(|fault| fault.to_string())?;
        if self.tree.len() != self.leaves.len() {
            return Err(format!("the tree has {} leaves, the set {}", self.tree.len(), self.leaves.len()));
        }
        self.validate_leaves()?;
        self.validate_payload()?;
        if self.head.revision == self.mirror.revision { self.validate_mirror() } else { Ok(()) }
    }

    fn validate_leaves(&self) -> Result<(), String> {
        let mut chunks = 0;
        for (slot, record) in self.leaves.iter() {
            let bounds = record.bounds();
            if self.tree.bounds_of(slot) != Some(space::outward(&bounds, self.origin)) {
                return Err(format!("leaf {slot} is not in the tree under its box"));
            }
            let over = closure::leaves_in(self, &bounds, usize::MAX).unwrap_or_default();
            if let Some(other) = over.into_iter().find(|&other| other != slot) {
                return Err(format!("leaves {slot} and {other} overlap"));
            }
            if !self.clip.contains(&bounds) {
                return Err(format!("leaf {slot} leaves the clip"));
            }
            let Some(draft) = Draft::new(&record.leaf(), &self.clip) else {
                return Err(format!("leaf {slot} is air"));
            };
            if (orthant_resident::world::LeafRow { payload: record.row.payload, ..draft.row }) != record.row {
                return Err(format!("leaf {slot} is not tight, or its row is not that of its content"));
            }
            chunks += usize::from(record.part.is_some());
        }
        if chunks == self.leaves.chunk_count() {
            Ok(())
        } else {
            Err(format!("{chunks} leaves have chunks, counted are {}", self.leaves.chunk_count()))
        }
    }

    fn validate_payload(&self) -> Result<(), String> {
        let mut users: FxHashMap<u32, u32> = FxHashMap::default();
        for (slot, record) in self.leaves.iter() {
            let dense = match record.part.as_ref().map(|part| &part.blocks) {
                Some(ChunkBlocks::Dense(dense)) => Some(dense),
                Some(ChunkBlocks::One(_)) | None => None,
            };
            if dense.is_some() != record.entry.is_some() {
                return Err(format!("leaf {slot} has a payload that it does not need, or needs one"));
            }
            let (Some(dense), Some(id)) = (dense, record.entry) else { continue };
            *users.entry(id).or_default() += 1;
            if self.payloads.entry(id).map(|(dense, _)| dense) != Some(dense) {
                return Err(format!("leaf {slot} has the payload of other blocks"));
            }
            if self.payloads.first_word(id) != Some(record.row.payload) {
                return Err(format!("leaf {slot} does not lead to its payload"));
            }
        }
        if users.len() != self.payloads.chunk_count() {
            return Err(format!("{} dense chunks, of which {} are in use", self.payloads.chunk_count(), users.len()));
        }
        for (id, users) in users {
            if self.payloads.entry(id).map(|(_, counted)| counted) != Some(users) {
                return Err(format!("payload {id} has {users} users and counts others"));
            }
        }
        let chunks = self.payloads.placed().map(|(first, count, _)| first..first + count);
        let aligned = |count: u32| count.next_multiple_of(orthant_resident::world::payload::ALIGN);
        let textures = self.palette.textures().map(|(first, count)| first..first + aligned(count));
        let mut spans: Vec<_> = chunks.chain(textures).collect();
        spans.sort_unstable_by_key(|span| span.start);
        let mut joined: Vec<std::ops::Range<u32>> = Vec::new();
        for span in spans {
            match joined.last_mut() {
                Some(last) if span.start < last.end => return Err(format!("payload spans overlap at {span:?}")),
                Some(last) if span.start == last.end => last.end = span.end,
                _ => joined.push(span),
            }
        }
        if joined == self.payloads.live() {
            Ok(())
        } else {
            Err(format!("payload in use is {joined:?}, the allocator says {:?}", self.payloads.live()))
        }
    }

    fn validate_mirror(&self) -> Result<(), String> {
        let mirror = &self.mirror;
        if (mirror.root, mirror.lens(), mirror.origin) != (self.head.root, self.head.lens, self.origin) {
            return Err("the mirror has another root, origin, or other lengths".to_owned());
        }
        if mirror.root != self.tree.root().map_or(Root::EMPTY, |id| Root::node(id.0)) {
            return Err("the root is not that of the tree".to_owned());
        }
        for (slot, node) in self.tree.nodes().iter().enumerate().filter(|(_, node)| node.child[0] != Child::EMPTY) {
            if mirror.nodes.get(slot) != Some(&splice::node_row(node)) {
                return Err(format!("node {slot} of the mirror is not that of the tree"));
            }
        }
        for (slot, record) in self.leaves.iter() {
            if mirror.leaves.get(slot as usize) != Some(&record.row) {
                return Err(format!("leaf {slot} of the mirror is not that of the set"));
            }
        }
        for (first, count, dense) in self.payloads.placed() {
            if mirror.payload.get(first as usize..(first + count) as usize) != Some(&*encode(dense)) {
                return Err(format!("the payload at word {first} is not that of its chunk"));
            }
        }
        Ok(())
    }
}
