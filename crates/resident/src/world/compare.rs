//! Whether resident arenas are what the mirror says: byte for byte over everything that rays can reach. What is free may
//! hold anything.

use super::WorldArenas;
use super::payload;
use super::rows::{BlockRow, NO_PAYLOAD, Root, kind, pattern};
use bytemuck::{NoUninit, Pod, bytes_of, pod_collect_to_vec};
use std::collections::HashSet;
use std::fmt::Debug;
use std::ops::Range;

/// What was compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LiveRows {
    /// Nodes of the tree.
    pub nodes: u64,
    /// Leaves.
    pub leaves: u64,
    /// Words of dense chunks and of textures.
    pub payload: u64,
    /// Rows of the palette, all of them.
    pub palette: u64,
}

/// The first difference.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WorldMismatch {
    /// Of the set as a whole.
    #[error("{field} of the world is {resident}, and should be {mirror}")]
    Set {
        /// Origin, root, revision or a length.
        field: &'static str,
        /// What is resident.
        resident: String,
        /// What should be.
        mirror: String,
    },
    /// Of a row.
    #[error("{arena} {slot}: {field} is {resident}, and should be {mirror}")]
    Row {
        /// `world node`, `world leaf`, `block material` or `payload word`.
        arena: &'static str,
        /// Its place in the arena.
        slot: u32,
        /// Which part of the row.
        field: &'static str,
        /// What is resident, in words of 32 bits.
        resident: String,
        /// What should be.
        mirror: String,
    },
    /// The mirror itself leads out of its arenas.
    #[error("the mirror is wrong: {0}")]
    Mirror(String),
}

/// Compares a set as it is resident with its mirror.
///
/// # Errors
/// The first difference: of the set, then down the tree from the root, then of the palette.
pub fn compare_live(mirror: &WorldArenas, resident: &WorldArenas) -> Result<LiveRows, WorldMismatch> {
    set("the origin", &resident.origin, &mirror.origin)?;
    set("the root", &resident.root, &mirror.root)?;
    set("the revision", &resident.revision, &mirror.revision)?;
    set("the lengths", &resident.lens(), &mirror.lens())?;
    let mut compared = LiveRows::default();
    let mut seen = vec![false; mirror.nodes.len()];
    let mut spans = HashSet::new();
    let mut waiting = vec![mirror.root];
    while let Some(next) = waiting.pop() {
        if let Some(slot) = next.as_node() {
            let node = row("world node", slot, &mirror.nodes, &resident.nodes, &NODE)?;
            // A tree leads everywhere once; a mirror that does not must not lead us in circles.
            if std::mem::replace(&mut seen[slot as usize], true) {
                return Err(WorldMismatch::Mirror(format!("two children lead to node {slot}")));
            }
            waiting.extend(node.children);
            compared.nodes += 1;
        } else if let Some(slot) = next.as_leaf() {
            let leaf = row("world leaf", slot, &mirror.leaves, &resident.leaves, &LEAF)?;
            compared.leaves += 1;
            if leaf.kind() == kind::CHUNK_ARRAY && leaf.payload != NO_PAYLOAD && spans.insert(leaf.payload) {
                let header = mirror.payload.get(leaf.payload as usize).copied().unwrap_or(0);
                let words = payload::words((header >> 8) as usize, header & 0xff);
                compared.payload += stretch(leaf.payload, words as u64, mirror, resident)?;
            }
        } else if next != Root::EMPTY {
            return Err(WorldMismatch::Mirror(format!("a child is {next:?}")));
        }
    }
    for slot in 0..mirror.palette.len() as u32 {
        let material = row("block material", slot, &mirror.palette, &resident.palette, &BLOCK)?;
        compared.palette += 1;
        // Of other patterns `cells` is no place.
        if let texels @ 1.. = texels(material) {
            compared.payload += stretch(material.cells, texels, mirror, resident)?;
        }
    }
    Ok(compared)
}

/// Texels of a material, one a word.
fn texels(material: &BlockRow) -> u64 {
    let size = |axis: u32| u64::from(material.texture_size >> (8 * axis) & 0xff) + 1;
    if material.pattern == pattern::TEXTURE { size(0) * size(1) * size(2) } else { 0 }
}

type Fields = [(&'static str, Range<usize>)];

/// The words of the rows, by what they are.
const NODE: [(&str, Range<usize>); 3] = [("bounds", 0..16), ("children", 16..18), ("reserved", 18..20)];
const LEAF: [(&str, Range<usize>); 6] = [
    ("lower corner", 0..8),
    ("upper corner", 8..16),
    ("kind", 16..17),
    ("block", 17..18),
    ("payload", 18..19),
    ("coarse occupancy", 19..20),
];
const BLOCK: [(&str, Range<usize>); 6] = [
    ("colour", 0..3),
    ("flags", 3..4),
    ("emission and weight", 4..8),
    ("absorption, roughness and metallic", 8..13),
    ("pattern", 13..18),
    ("reserved", 18..20),
];

fn set<T: PartialEq + Debug>(field: &'static str, resident: &T, mirror: &T) -> Result<(), WorldMismatch> {
    if resident == mirror {
        return Ok(());
    }
    Err(WorldMismatch::Set { field, resident: format!("{resident:?}"), mirror: format!("{mirror:?}") })
}

/// The row of the mirror, if the resident one is the same.
fn row<'m, T: Pod>(
    arena: &'static str,
    slot: u32,
    mirror: &'m [T],
    resident: &[T],
    fields: &Fields,
) -> Result<&'m T, WorldMismatch> {
    let (Some(should), Some(is)) = (mirror.get(slot as usize), resident.get(slot as usize)) else {
        return Err(WorldMismatch::Mirror(format!("it leads to {arena} {slot}, of {}", mirror.len())));
    };
    if bytes_of(should) == bytes_of(is) {
        return Ok(should);
    }
    let [is, should] = [words(is), words(should)];
    let differs = |(_, range): &&(&str, Range<usize>)| is[range.clone()] != should[range.clone()];
    let (field, range) = fields.iter().find(differs).cloned().unwrap_or(("a word", 0..is.len()));
    let [resident, mirror] = [&is, &should].map(|words| format!("{:x?}", &words[range.clone()]));
    Err(WorldMismatch::Row { arena, slot, field, resident, mirror })
}

fn words(row: &impl NoUninit) -> Vec<u32> {
    pod_collect_to_vec(bytes_of(row))
}

/// Compares words of payload. How many there are.
fn stretch(first: u32, count: u64, mirror: &WorldArenas, resident: &WorldArenas) -> Result<u64, WorldMismatch> {
    let span = first as usize..first as usize + count as usize;
    let (Some(should), Some(is)) = (mirror.payload.get(span.clone()), resident.payload.get(span)) else {
        return Err(WorldMismatch::Mirror(format!(
            "it leads to {count} words of payload at {first}, beyond the arena"
        )));
    };
    if should == is {
        return Ok(count);
    }
    let at = should.iter().zip(is).position(|(should, is)| should != is).unwrap_or(0);
    Err(WorldMismatch::Row {
        arena: "payload word",
        slot: first + at as u32,
        field: "its value",
        resident: format!("{:x}", is[at]),
        mirror: format!("{:x}", should[at]),
    })
}

#[cfg(test)]
mod tests {
    use super::super::{BlockRow, LeafRow, WorldNode};
    use super::*;
    use bytemuck::Zeroable;

    /// Two leaves below a node, one of them a chunk of two blocks; a material with a texture; and a free slot of everything.
    fn arenas() -> WorldArenas {
        let chunk = LeafRow { kind: kind::CHUNK_ARRAY | 16 << 16, payload: 16, ..LeafRow::uniform([0; 4], [8; 4], 0) };
        let node = WorldNode { children: [Root::leaf(0), Root::leaf(2)], ..Zeroable::zeroed() };
        let texture =
            BlockRow { pattern: pattern::TEXTURE, cells: 600, texture_size: 1 | 2 << 8, ..Zeroable::zeroed() };
        let mut arenas = WorldArenas {
            root: Root::node(1),
            revision: 9,
            nodes: vec![Zeroable::zeroed(), node],
            leaves: vec![LeafRow::uniform([-1; 4], [0; 4], 1), Zeroable::zeroed(), chunk],
            payload: (0..700).collect(),
            // Cells of noise are no place of payload.
            palette: vec![BlockRow { pattern: pattern::NOISE, cells: 8000, ..Zeroable::zeroed() }, texture],
            ..WorldArenas::new([5; 4])
        };
        arenas.payload[16] = 1 | 2 << 8;
        arenas
    }

    #[test]
    fn what_is_free_does_not_count() {
        let (mirror, mut resident) = (arenas(), arenas());
        resident.nodes[0].reserved = [7; 2];
        resident.leaves[1].kind = 77;
        resident.payload[15] = 0;
        resident.payload[16 + payload::words(2, 1)] = 0;
        resident.payload[606] = 0;
        let payload = payload::words(2, 1) as u64 + 6;
        assert_eq!(compare_live(&mirror, &resident), Ok(LiveRows { nodes: 1, leaves: 2, payload, palette: 2 }));
    }

    #[test]
    fn every_difference_is_found_and_named() {
        let mirror = arenas();
        type Fault = fn(&mut WorldArenas);
        let faults: [(&str, Fault); 9] = [
            ("the root of the world is Root(2147483648), and should be Root(1)", |a| a.root = Root::leaf(0)),
            ("the revision", |a| a.revision = 8),
            ("the lengths", |a| a.payload.push(0)),
            ("node 1: children is [80000000, 80000001], and should be [80000000, 80000002]", |a| {
                a.nodes[1].children[1] = Root::leaf(1)
            }),
            ("leaf 0: upper corner", |a| a.leaves[0].max[3] = 1),
            ("leaf 2: payload", |a| a.leaves[2].payload = 32),
            ("payload word 20: its value is 0, and should be 14", |a| a.payload[20] = 0),
            ("payload word 605", |a| a.payload[605] = 0),
            ("block material 1: emission and weight", |a| a.palette[1].weight = 1.0),
        ];
        for (text, fault) in faults {
            let mut resident = arenas();
            fault(&mut resident);
            let said = compare_live(&mirror, &resident).map_err(|mismatch| mismatch.to_string());
            assert!(said.as_ref().is_err_and(|said| said.contains(text)), "{text}: {said:?}");
        }
    }

    #[test]
    fn a_mirror_that_leads_nowhere_is_an_error() {
        let faults: [fn(&mut WorldArenas); 4] = [
            |a| a.root = Root::node(9),
            |a| a.nodes[1].children[0] = Root::node(1),
            |a| a.leaves[2].payload = 699,
            |a| a.palette[1].cells = u32::MAX,
        ];
        for fault in faults {
            let mut arenas = arenas();
            fault(&mut arenas);
            let said = compare_live(&arenas, &arenas.clone());
            assert!(matches!(said, Err(WorldMismatch::Mirror(_))), "{said:?}");
        }
    }
}
