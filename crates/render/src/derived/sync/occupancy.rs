//! Every slot is in use, or free once: what is neither would be lost, and buffers would only grow.

use super::Live;
use crate::derived::DerivedScene;
use crate::geometry::GeometryStore;
use orthant_resident::rows::NONE;

/// Compares what is in use with the free lists.
///
/// # Errors
/// The first slot that is neither in use nor free, or both.
pub(super) fn check(derived: &DerivedScene, live: &Live) -> Result<(), String> {
    let nodes = &derived.hierarchy.nodes;
    let used = || (0..).zip(nodes).filter(|(_, node)| node.is_used());
    slots("entry of the hierarchy", nodes.len(), used().map(|(entry, _)| entry), &live.free_entries)?;
    let lights = used().map(|(_, node)| node.light).filter(|&light| light != NONE);
    slots("light", derived.lights.len(), lights, &live.free_lights)?;
    let emitters = derived.render_nodes.iter().map(|row| row.emitter).filter(|&emitter| emitter != NONE);
    slots("emitter", derived.emitters.len(), emitters, &live.free_emitters)?;
    slots("RenderPrimitive", derived.primitives.len(), live.registry.in_use(), live.registry.free())?;

    let rows = |name: &str, used: u32, should: u32| {
        if used == should { Ok(()) } else { Err(format!("{used} rows of {name} are taken, and {should} are in use")) }
    };
    rows("render nodes", live.node_spans.used(), used().map(|(_, node)| node.render_node_count).sum())?;
    let needed = GeometryStore::of(&derived.mesh_descs);
    let spans = live.store.occupancy().into_iter().zip(needed.occupancy());
    for ((taken, needed), name) in spans.zip(["vertices", "indices", "tangents", "area tables"]) {
        rows(name, taken.used(), needed.used())?;
    }
    Ok(())
}

fn slots(what: &str, count: usize, used: impl Iterator<Item = u32>, free: &[u32]) -> Result<(), String> {
    let mut known = vec![false; count];
    for slot in used {
        *known.get_mut(slot as usize).ok_or_else(|| format!("{what} {slot} is in use, and there are {count}"))? = true;
    }
    for &slot in free {
        match known.get_mut(slot as usize) {
            Some(known) if !*known => *known = true,
            _ => return Err(format!("{what} {slot} is free, and free once more or in use")),
        }
    }
    match known.iter().position(|&known| !known) {
        Some(slot) => Err(format!("{what} {slot} is neither in use nor free")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_that_is_lost_free_twice_or_free_and_in_use_is_found() {
        let check = |used: &[u32], free: &[u32]| slots("light", 4, used.iter().copied(), free);
        assert_eq!(check(&[0, 2, 2], &[3, 1]), Ok(()));
        for (used, free, what) in [
            (&[0, 2][..], &[3][..], "light 1 is neither in use nor free"),
            (&[0, 2], &[3, 1, 3], "light 3 is free, and free once more or in use"),
            (&[0, 1, 2], &[3, 2], "light 2 is free, and free once more or in use"),
            (&[0, 1, 2, 3], &[4], "light 4 is free, and free once more or in use"),
            (&[0, 1, 2, 4], &[3], "light 4 is in use, and there are 4"),
        ] {
            assert_eq!(check(used, free), Err(what.to_owned()));
        }
    }
}
