//! When a TLAS is updated and when it is built anew.

use glam::DVec3;
use orthant_resident::batch::TlasAction;
use orthant_resident::extent::Extent;
use orthant_resident::rows::{MeshDesc, NodeFlags, RenderNodeRow};
use orthant_resident::slot_tree::Join;

/// How much updates may degrade a TLAS before it is built anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TlasPolicy {
    /// Updates in a row, at most.
    pub max_updates: u32,
    /// Growth, at most: the sum over instances of the area of (box at the last build united with box now) over the sum of
    /// the areas at the last build.
    pub max_growth: f64,
}

impl Default for TlasPolicy {
    fn default() -> Self {
        Self { max_updates: 256, max_growth: 1.5 }
    }
}

/// Half the area of a box, as a multiple of 2^-40 square metres. Sums of integers are exact: what an instance brought goes
/// with it, however large it was.
fn area(of: Extent) -> i128 {
    let d = (of.upper - of.lower).as_dvec3();
    let area = if d.cmplt(DVec3::ZERO).any() { 0.0 } else { d.x * d.y + d.y * d.z + d.z * d.x };
    (area.min(LARGEST_AREA) * UNITS) as i128
}

const UNITS: f64 = (1u64 << 40) as f64;
/// 2^32 such instances do not overflow a sum.
const LARGEST_AREA: f64 = (1u64 << 50) as f64;

/// An instance, by its row.
#[derive(Clone, Copy, Debug)]
struct Instance {
    /// Its box at the last build, if `build` is the last one; else that is `now`.
    built: Extent,
    now: Extent,
    build: u32,
}

/// What has become of the instances since the last build.
#[derive(Clone, Debug, Default)]
pub struct TlasState {
    /// How much is allowed.
    pub policy: TlasPolicy,
    instances: Vec<Instance>,
    /// Counts the builds.
    build: u32,
    /// Sums over the instances of the areas of their boxes at the last build, of those united with the boxes now, and of the
    /// boxes now.
    built_area: i128,
    grown_area: i128,
    area: i128,
    updates: u32,
    moved: bool,
    active_changed: bool,
}

impl TlasState {
    /// As after a build over all rows.
    pub fn built(policy: TlasPolicy, rows: &[RenderNodeRow], descs: &[MeshDesc]) -> Self {
        let instance = |row: &RenderNodeRow| {
            let now = Extent::of_instance(row, descs);
            Instance { built: now, now, build: 0 }
        };
        let mut instances = Vec::with_capacity(rows.len() + super::slack(rows.len()));
        instances.extend(rows.iter().map(instance));
        let area = instances.iter().map(|instance: &Instance| area(instance.now)).sum();
        Self { policy, instances, built_area: area, grown_area: area, area, ..Self::default() }
    }

    /// Notes that a row becomes another. O(1).
    pub fn change(&mut self, index: u32, old: &RenderNodeRow, new: &RenderNodeRow, descs: &[MeshDesc]) {
        const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
        let is_seen = |row: &RenderNodeRow| row.flags & SEEN == SEEN;
        if is_seen(old) != is_seen(new) || is_seen(new) && old.primitive != new.primitive {
            self.active_changed = true;
        } else if is_seen(new) && (old.world != new.world || old.flags != new.flags) {
            // A device's instances hold the matrix, and whether they are opaque and culled.
            self.moved = true;
        } else {
            return;
        }
        self.set_box(index, Extent::of_instance(new, descs));
    }

    /// Notes that a row may be what it was, and the geometry in its primitive's slot is another. O(1).
    pub fn reshaped(&mut self, index: u32, row: &RenderNodeRow, descs: &[MeshDesc]) {
        self.moved = true;
        self.set_box(index, Extent::of_instance(row, descs));
    }

    /// Notes that the geometry of instances has changed in its place: their boxes are others.
    pub fn deformed(&mut self) {
        self.moved = true;
    }

    fn set_box(&mut self, index: u32, now: Extent) {
        if index as usize >= self.instances.len() {
            let none = Instance { built: Extent::NOTHING, now: Extent::NOTHING, build: self.build };
            self.instances.resize(index as usize + 1, none);
        }
        let instance = &mut self.instances[index as usize];
        if instance.build != self.build {
            (instance.built, instance.build) = (instance.now, self.build);
        }
        self.grown_area += area(instance.built.join(now)) - area(instance.built.join(instance.now));
        self.area += area(now) - area(instance.now);
        instance.now = now;
    }

    /// The box of a row's instance.
    pub fn extent(&self, row: usize) -> Extent {
        self.instances.get(row).map_or(Extent::NOTHING, |instance| instance.now)
    }

    /// What the TLAS needs now. After a build, whatever asked for it, counting begins anew. O(1).
    pub fn take(&mut self) -> TlasAction {
        if !self.moved && !self.active_changed {
            return TlasAction::None;
        }
        let has_grown = self.built_area > 0 && self.grown_area as f64 > self.policy.max_growth * self.built_area as f64;
        let is_due = self.active_changed || self.updates + 1 > self.policy.max_updates || has_grown;
        (self.moved, self.active_changed) = (false, false);
        if !is_due {
            self.updates += 1;
            return TlasAction::Update;
        }
        self.build = self.build.wrapping_add(1);
        (self.built_area, self.grown_area, self.updates) = (self.area, self.area, 0);
        TlasAction::Rebuild
    }

    /// Updates since the last build, and the growth.
    pub fn degradation(&self) -> (u32, f64) {
        let growth = if self.built_area > 0 { self.grown_area as f64 / self.built_area as f64 } else { 1.0 };
        (self.updates, growth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DAffine3;
    use orthant_resident::rows::Mat3x4;

    fn desc() -> MeshDesc {
        MeshDesc { bounds_min: [0.0; 3], bounds_max: [1.0; 3], ..bytemuck::Zeroable::zeroed() }
    }

    fn at(x: f64) -> RenderNodeRow {
        let world = DAffine3::from_translation(glam::DVec3::new(x, 0.0, 0.0));
        RenderNodeRow {
            world: Mat3x4::from_affine(&world),
            primitive: 0,
            flags: NodeFlags::OCCUPIED | NodeFlags::VISIBLE,
            ..RenderNodeRow::HOLE
        }
    }

    fn state(rows: &[RenderNodeRow]) -> TlasState {
        TlasState::built(TlasPolicy::default(), rows, &[desc()])
    }

    fn replace(state: &mut TlasState, rows: &mut [RenderNodeRow], index: usize, new: RenderNodeRow) {
        state.change(index as u32, &rows[index], &new, &[desc()]);
        rows[index] = new;
    }

    #[test]
    fn growth_is_counted_from_the_last_build_whatever_asked_for_it() {
        let mut rows = [at(0.0), at(10.0), at(20.0)];
        let mut state = state(&rows);
        replace(&mut state, &mut rows, 0, at(1.0));
        assert_eq!(state.take(), TlasAction::Update);
        // Boxes of half areas 3 and 5 (2 x 1 x 1), of three instances.
        assert_eq!(state.degradation(), (1, 11.0 / 9.0));
        // One that appears has the TLAS built anew, where all are now.
        replace(&mut state, &mut rows, 2, RenderNodeRow::HOLE);
        assert_eq!(state.take(), TlasAction::Rebuild);
        assert_eq!(state.degradation(), (0, 1.0));
        // The first is counted from where it was at that build.
        replace(&mut state, &mut rows, 0, at(2.0));
        assert_eq!(state.take(), TlasAction::Update);
        assert_eq!(state.degradation(), (1, 8.0 / 6.0));
        replace(&mut state, &mut rows, 0, at(4.0));
        assert_eq!(state.take(), TlasAction::Rebuild, "grown by 12 / 6");
    }

    #[test]
    fn updates_are_counted_too() {
        let mut rows = [at(0.0), at(10.0)];
        let mut state = state(&rows);
        state.policy.max_updates = 3;
        let mut actions = Vec::new();
        for i in 0..5 {
            replace(&mut state, &mut rows, 0, at(0.01 * f64::from(i + 1)));
            actions.push(state.take());
        }
        use TlasAction::{Rebuild, Update};
        assert_eq!(actions, [Update, Update, Update, Rebuild, Update]);
        assert_eq!(state.take(), TlasAction::None);
    }

    #[test]
    fn what_a_huge_or_broken_instance_brought_goes_with_it() {
        let mut rows = [at(0.0), at(10.0)];
        let mut state = state(&rows);
        let before = state.degradation();
        for x in [1e30, f64::MAX, f64::NAN, f64::INFINITY, 0.0] {
            replace(&mut state, &mut rows, 1, at(x));
            state.take();
        }
        replace(&mut state, &mut rows, 1, at(10.0));
        replace(&mut state, &mut rows, 0, RenderNodeRow::HOLE);
        assert_eq!((state.take(), state.degradation()), (TlasAction::Rebuild, before));
        assert_eq!(state.area, 3 << 40);
    }
}
