//! `--validate`: what is resident, read back, is what the derived scene says.

use orthant_cpu::ResidentScene;
use orthant_render::DerivedScene;
use orthant_resident::rows::NodeFlags;
use orthant_resident::world::rows::{NO_PAYLOAD, kind, pattern};
use orthant_resident::world::{WorldArenas, payload};
use orthant_vulkan::ResidentRows;
use std::collections::BTreeSet;
use std::fmt::Debug;
use std::ops::Range;

/// Compares every row of the resident scene with the derived one, byte for byte, and looks whether every visible RenderNode has
/// a BLAS and the TLAS is that of the rows.
///
/// # Errors
/// The first row and the field that differ.
pub fn validate(derived: &DerivedScene, resident: &ResidentScene) -> Result<(), String> {
    derived.rows().compare(&resident.rows()).map_err(|mismatch| mismatch.to_string())?;
    for (index, node) in derived.render_nodes.iter().enumerate() {
        let has_blas = resident.blas.get(node.primitive as usize).is_some_and(Option::is_some);
        if node.flags & NodeFlags::VISIBLE != 0 && !has_blas {
            return Err(format!("render node {index} has no BLAS (primitive {})", node.primitive));
        }
    }
    resident.validate()
}

/// The same for what was read back from a Vulkan device: every row, and every TLAS instance.
///
/// # Errors
/// The first row and the field that differ.
pub fn validate_vulkan(derived: &DerivedScene, resident: &ResidentRows) -> Result<(), String> {
    derived.rows().compare(&resident.rows()).map_err(|mismatch| mismatch.to_string())?;
    for (index, node) in derived.render_nodes.iter().enumerate() {
        let has_blas = resident.blas.get(node.primitive as usize).is_some_and(|&address| address != 0);
        if node.flags & NodeFlags::VISIBLE != 0 && !has_blas {
            return Err(format!("render node {index} has no BLAS (primitive {})", node.primitive));
        }
    }
    resident.check_instances()
}

/// Compares two sets of arenas in all that rays can come to: the tree, leaves, chunks, materials and their texels, byte for byte.
/// Free slots may differ.
///
/// # Errors
/// The first row and what differs.
pub fn compare_arenas(expected: &WorldArenas, resident: &WorldArenas) -> Result<(), String> {
    let heads = |arenas: &WorldArenas| (arenas.origin, arenas.root, arenas.revision, arenas.lens());
    if heads(expected) != heads(resident) {
        let (expected, resident) = (heads(expected), heads(resident));
        return Err(format!("the world's origin, root, revision and lengths are {resident:?} instead of {expected:?}"));
    }
    let differs = |what: String, expected: &dyn Debug, resident: &dyn Debug| {
        Err(format!("{what} is {resident:?} instead of {expected:?}"))
    };
    let mut waiting = vec![expected.root];
    let mut seen_words = BTreeSet::new();
    let mut spans: Vec<Range<usize>> = Vec::new();
    while let Some(at) = waiting.pop() {
        if let Some(slot) = at.as_node() {
            let (a, b) = (&expected.nodes[slot as usize], &resident.nodes[slot as usize]);
            if bytemuck::bytes_of(a) != bytemuck::bytes_of(b) {
                return differs(format!("world node {slot}"), a, b);
            }
            waiting.extend(a.children);
        } else if let Some(slot) = at.as_leaf() {
            let (a, b) = (&expected.leaves[slot as usize], &resident.leaves[slot as usize]);
            if a != b {
                return differs(format!("world leaf {slot}"), a, b);
            }
            if a.kind() == kind::CHUNK_ARRAY && a.payload != NO_PAYLOAD && seen_words.insert(a.payload) {
                let first = a.payload as usize;
                let head = expected.payload[first];
                spans.push(first..first + payload::words((head >> 8) as usize, head & 0xff));
            }
        }
    }
    for (number, (a, b)) in expected.palette.iter().zip(&resident.palette).enumerate() {
        if bytemuck::bytes_of(a) != bytemuck::bytes_of(b) {
            return differs(format!("block material {number}"), a, b);
        }
        if a.pattern == pattern::TEXTURE {
            let size = |axis: u32| (a.texture_size >> (8 * axis) & 0xff) as usize + 1;
            let first = a.cells as usize;
            spans.push(first..first + size(0) * size(1) * size(2));
        }
    }
    for span in spans {
        let (a, b) = (&expected.payload[span.clone()], &resident.payload[span.clone()]);
        if let Some(at) = (0..a.len()).find(|&i| a[i] != b[i]) {
            return differs(format!("payload word {} of {span:?}", span.start + at), &a[at], &b[at]);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_render::world::{BuildOptions, DerivedWorld};
    use orthant_world::{Aabb4, Generator, RegionNode, RegionTree, World, WorldPatch};

    #[test]
    fn a_wrong_bit_anywhere_is_found_and_named() {
        let mut world = World::new();
        let bounds = Aabb4::from_ints([-40; 4], [40; 4]).expect("a box");
        let node = RegionNode::Procedural(Generator::Terrain { seed: 1 });
        world.apply(&WorldPatch::of_tree(RegionTree { bounds, node })).expect("applied");
        let derived = DerivedWorld::build(&world, &BuildOptions::default()).expect("derived");
        let good = derived.mirror();
        assert_eq!(compare_arenas(good, &good.clone()), Ok(()));
        type Fault = fn(&mut WorldArenas);
        let faults: [(&str, Fault); 6] = [
            ("revision", |a| a.revision += 1),
            ("root", |a| a.root = orthant_resident::world::Root::EMPTY),
            ("world node", |a| a.nodes[3].bounds[1][0][3] += 1.0),
            ("world leaf", |a| a.leaves.last_mut().expect("a leaf").coarse ^= 1),
            ("block material", |a| a.palette[2].weight += 1.0),
            ("payload word", |a| {
                let first = a.leaves.iter().find(|l| l.payload != NO_PAYLOAD).expect("a chunk").payload as usize;
                a.payload[first + 140] ^= 1;
            }),
        ];
        for (word, fault) in faults {
            let mut bad = good.clone();
            fault(&mut bad);
            let found = compare_arenas(good, &bad).expect_err(word);
            assert!(found.contains(word), "{found}");
        }
    }
}
