//! Cutting leaves at a box and putting the world in within it: what is outside stays as it was.

use super::leaves::{Draft, LeafRecord};
use super::{DerivedWorld, closure};
use orthant_world::{Aabb4, Region, World};
use rustc_hash::{FxHashMap, FxHashSet};

/// Leaves that go and leaves that come so that the set equals the world within the box and is unchanged outside of it.
pub(super) fn cut(derived: &DerivedWorld, world: &World, bounds: &Aabb4) -> (Vec<u32>, Vec<Draft>) {
    let leaves = closure::leaves_in(derived, bounds, usize::MAX).unwrap_or_default();
    let regions = closure::regions_in(derived, world, bounds, usize::MAX).unwrap_or_default();
    let mut kept = FxHashSet::default();
    let mut wanted = Vec::new();
    for (id, part) in regions {
        let Some(region) = world.region(id) else { continue };
        let is_same = |slot: &&u32| derived.leaves.get(**slot).is_some_and(|leaf| leaf.is_of(region, &part));
        if let Some(&slot) = leaves.iter().find(is_same) {
            kept.insert(slot);
        } else if let Some(within) = part.intersection(bounds) {
            wanted.extend(Draft::of_region(&Region { bounds: within, content: region.content.clone() }, &derived.clip));
        }
    }
    let mut stale: Vec<u32> = leaves.into_iter().filter(|slot| !kept.contains(slot)).collect();
    for leaf in stale.iter().filter_map(|&slot| derived.leaves.get(slot)) {
        wanted.extend(remains(leaf, bounds));
    }
    keep_equal(derived, &mut stale, &mut wanted);
    (stale, wanted)
}

/// Takes out what would go and come as it is: a box that was cut before has such pieces.
fn keep_equal(derived: &DerivedWorld, stale: &mut Vec<u32>, wanted: &mut Vec<Draft>) {
    let mut by_min: FxHashMap<[i64; 4], u32> = FxHashMap::default();
    by_min.extend(stale.iter().filter_map(|&slot| Some((derived.leaves.get(slot)?.row.min, slot))));
    let mut kept = FxHashSet::default();
    wanted.retain(|draft| {
        let same = by_min
            .get(&draft.row.min)
            .filter(|&&slot| derived.leaves.get(slot).is_some_and(|leaf| leaf.is_draft(draft)));
        same.is_none_or(|&slot| !kept.insert(slot))
    });
    stale.retain(|slot| !kept.contains(slot));
}

/// What is left of a leaf outside of a box.
fn remains(leaf: &LeafRecord, hole: &Aabb4) -> Vec<Draft> {
    leaf.bounds().subtract(hole).iter().filter_map(|slab| Draft::clipped(leaf, slab)).collect()
}
