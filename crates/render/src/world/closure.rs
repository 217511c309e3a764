//! Which leaves and regions are to be exchanged so that a box is up to date and leaves are whole regions.
//!
//! Leaves of the set and regions of the world that share points with the box are compared. Pairs that are equal drop out. What is
//! left is joined by every region and every leaf that overlaps it, until nothing new comes: then the leaves can be replaced by the
//! regions, and no two of the new set overlap.

use super::leaves::Draft;
use super::plan::OpLimits;
use super::{DerivedWorld, space};
use orthant_world::{Aabb4, Content, RegionId, World};
use rustc_hash::FxHashSet;
use std::ops::ControlFlow;

/// What is to be exchanged.
#[derive(Debug, Default)]
pub(super) struct Closure {
    /// Leaves that go.
    pub stale: Vec<u32>,
    /// Leaves that come.
    pub wanted: Vec<Draft>,
    /// Boxes of both, in which the set then equals the world.
    pub covered: Vec<Aabb4>,
}

/// What the search came to.
#[derive(Debug)]
pub(super) enum Found {
    /// All of it, within the limits.
    Closed(Closure),
    /// The box alone is within the limits, with what it drags along it is not.
    TooLargeAround,
    /// The box alone is too much.
    TooLargeWithin,
}

/// Leaves and regions that may be looked at, for every one that may be exchanged.
const LOOKS: usize = 4;

/// What is to be looked at. A hint is the only one on the other side that it overlaps.
enum Open {
    Leaf(u32, Option<RegionId>),
    Region(RegionId, Option<u32>),
}

struct Search<'a> {
    derived: &'a DerivedWorld,
    world: &'a World,
    seen_leaves: FxHashSet<u32>,
    seen_regions: FxHashSet<RegionId>,
    open: Vec<Open>,
    stale: Vec<u32>,
    wanted: Vec<(RegionId, Aabb4)>,
    wanted_chunks: usize,
    /// Leaves or regions that may be looked at for one of the other kind.
    most: usize,
    /// Whether one overlaps more of them than that.
    is_over: bool,
}

/// Searches from a box.
pub(super) fn find(
    derived: &DerivedWorld,
    world: &World,
    bounds: &Aabb4,
    limits: &OpLimits,
    looked_at: &mut usize,
) -> Found {
    let (leaves, regions) =
        (leaves_in(derived, bounds, limits.leaves), regions_in(derived, world, bounds, limits.leaves));
    let (Some(leaves), Some(regions)) = (leaves, regions) else { return Found::TooLargeWithin };
    *looked_at += leaves.len() + regions.len();
    if differing_chunks(derived, world, &leaves, &regions, limits.chunks) > limits.chunks {
        return Found::TooLargeWithin;
    }
    let mut search = Search {
        derived,
        world,
        seen_leaves: FxHashSet::default(),
        seen_regions: FxHashSet::default(),
        open: Vec::new(),
        stale: Vec::new(),
        wanted: Vec::new(),
        wanted_chunks: 0,
        most: LOOKS * limits.leaves,
        is_over: false,
    };
    // A region within one leaf overlaps no other.
    let only_leaf = |bounds: &Aabb4| match leaves.as_slice() {
        [slot] if derived.leaves.get(*slot).is_some_and(|leaf| leaf.bounds().contains(bounds)) => Some(*slot),
        _ => None,
    };
    search.open.extend(leaves.iter().map(|&slot| Open::Leaf(slot, None)));
    search.open.extend(regions.iter().map(|(id, bounds)| Open::Region(*id, only_leaf(bounds))));
    let closed = search.run(limits);
    *looked_at += search.seen_leaves.len() + search.seen_regions.len();
    if closed { Found::Closed(search.finish()) } else { Found::TooLargeAround }
}

impl Search<'_> {
    /// Whether it came to an end within the limits.
    fn run(&mut self, limits: &OpLimits) -> bool {
        while let Some(open) = self.open.pop() {
            match open {
                Open::Leaf(slot, hint) => self.leaf(slot, hint),
                Open::Region(id, hint) => self.region(id, hint),
            }
            let looked_at = self.seen_leaves.len() + self.seen_regions.len();
            if self.stale.len() + self.wanted.len() > limits.leaves
                || self.wanted_chunks > limits.chunks
                || looked_at > self.most
                || self.is_over
            {
                return false;
            }
        }
        true
    }

    fn leaf(&mut self, slot: u32, hint: Option<RegionId>) {
        let Some(leaf) = self.derived.leaves.get(slot) else { return };
        if !self.seen_leaves.insert(slot) {
            return;
        }
        let bounds = leaf.bounds();
        let regions = match hint.and_then(|id| region_bounds(self.derived, self.world, id)) {
            Some(only) => vec![only],
            None => match regions_in(self.derived, self.world, &bounds, self.most) {
                Some(regions) => regions,
                None => return self.is_over = true,
            },
        };
        for (id, part) in &regions {
            if self.world.region(*id).is_some_and(|region| leaf.is_of(region, part)) {
                self.seen_regions.insert(*id);
                return;
            }
        }
        self.stale.push(slot);
        for (id, part) in regions {
            let hint = bounds.contains(&part).then_some(slot);
            self.open.push(Open::Region(id, hint));
        }
    }

    fn region(&mut self, id: RegionId, hint: Option<u32>) {
        let Some((_, bounds)) = region_bounds(self.derived, self.world, id) else { return };
        if !self.seen_regions.insert(id) {
            return;
        }
        let Some(region) = self.world.region(id) else { return };
        let leaves = match hint {
            Some(only) => vec![only],
            None => match leaves_in(self.derived, &bounds, self.most) {
                Some(leaves) => leaves,
                None => return self.is_over = true,
            },
        };
        for &slot in &leaves {
            if self.derived.leaves.get(slot).is_some_and(|leaf| leaf.is_of(region, &bounds)) {
                self.seen_leaves.insert(slot);
                return;
            }
        }
        self.wanted.push((id, bounds));
        self.wanted_chunks += usize::from(matches!(region.content, Content::Chunk { .. }));
        for slot in leaves {
            let within = self.derived.leaves.get(slot).is_some_and(|leaf| bounds.contains(&leaf.bounds()));
            self.open.push(Open::Leaf(slot, within.then_some(id)));
        }
    }

    fn finish(self) -> Closure {
        let mut covered: Vec<Aabb4> =
            self.stale.iter().filter_map(|&slot| self.derived.leaves.get(slot)).map(|leaf| leaf.bounds()).collect();
        let mut wanted = Vec::with_capacity(self.wanted.len());
        for (id, bounds) in self.wanted {
            covered.push(bounds);
            wanted.extend(self.world.region(id).and_then(|region| Draft::of_region(region, &self.derived.clip)));
        }
        Closure { stale: self.stale, wanted, covered }
    }
}

/// Chunk regions that are no leaf as they are; counted up to one more than the limit.
fn differing_chunks(
    derived: &DerivedWorld,
    world: &World,
    leaves: &[u32],
    regions: &[(RegionId, Aabb4)],
    limit: usize,
) -> usize {
    let mut differing = 0;
    if regions.len() <= limit {
        return 0;
    }
    let starts: rustc_hash::FxHashMap<[i64; 4], u32> = leaves
        .iter()
        .filter_map(|&slot| Some((derived.leaves.get(slot)?.part.as_ref()?.bounds.min_raw(), slot)))
        .collect();
    for (id, bounds) in regions {
        let Some(region) = world.region(*id) else { continue };
        if matches!(region.content, Content::Uniform(_)) {
            continue;
        }
        let leaf = starts.get(&bounds.min_raw()).and_then(|&slot| derived.leaves.get(slot));
        differing += usize::from(!leaf.is_some_and(|leaf| leaf.is_of(region, bounds)));
        if differing > limit {
            break;
        }
    }
    differing
}

/// A region with its bounds within the clip.
fn region_bounds(derived: &DerivedWorld, world: &World, id: RegionId) -> Option<(RegionId, Aabb4)> {
    Some((id, world.region(id)?.bounds.intersection(&derived.clip)?))
}

/// The leaves that share points with a box; `None` if there are more than `limit`.
pub(super) fn leaves_in(derived: &DerivedWorld, bounds: &Aabb4, limit: usize) -> Option<Vec<u32>> {
    let mut found = Vec::new();
    let about = space::outward(bounds, derived.origin);
    let flow = derived.tree.overlap(&about, |slot, _| {
        if derived.leaves.get(slot).is_some_and(|leaf| leaf.bounds().overlaps(bounds)) {
            found.push(slot);
        }
        if found.len() > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    flow.is_continue().then_some(found)
}

/// The regions that share points with a box, with their bounds within the clip; `None` if there are more than `limit`.
pub(super) fn regions_in(
    derived: &DerivedWorld,
    world: &World,
    bounds: &Aabb4,
    limit: usize,
) -> Option<Vec<(RegionId, Aabb4)>> {
    let mut found = Vec::new();
    let flow = world.query(bounds, |id, region| {
        found.extend(region.bounds.intersection(&derived.clip).map(|within| (id, within)));
        if found.len() > limit { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    flow.is_continue().then_some(found)
}
