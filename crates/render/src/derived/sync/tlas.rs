//! When a TLAS is updated and when it is built anew.

use glam::Vec3;
use orthant_resident::batch::TlasAction;
use orthant_resident::rows::{MeshDesc, NodeFlags, RenderNodeRow};

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

#[derive(Clone, Copy, Debug)]
struct Box3 {
    lower: Vec3,
    upper: Vec3,
}

impl Box3 {
    const EMPTY: Self = Self { lower: Vec3::INFINITY, upper: Vec3::NEG_INFINITY };

    fn of(row: &RenderNodeRow, descs: &[MeshDesc]) -> Self {
        const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
        let Some(desc) = descs.get(row.primitive as usize).filter(|_| row.flags & SEEN == SEEN) else {
            return Self::EMPTY;
        };
        let (lower, upper) = (Vec3::from_array(desc.bounds_min), Vec3::from_array(desc.bounds_max));
        (0..8).fold(Self::EMPTY, |b, corner| {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { lower[axis] } else { upper[axis] };
            let p = row.world.transform_point(Vec3::new(pick(0), pick(1), pick(2)));
            Self { lower: b.lower.min(p), upper: b.upper.max(p) }
        })
    }

    fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    fn area(self) -> f64 {
        let d = self.upper - self.lower;
        if d.cmplt(Vec3::ZERO).any() { 0.0 } else { f64::from(d.x * d.y + d.y * d.z + d.z * d.x) }
    }
}

/// What has become of the instances since the last build.
#[derive(Clone, Debug, Default)]
pub struct TlasState {
    /// How much is allowed.
    pub policy: TlasPolicy,
    built: Vec<Box3>,
    /// By instance: the area of its box at the last build united with that of now.
    grown: Vec<f64>,
    built_area: f64,
    grown_area: f64,
    updates: u32,
    moved: bool,
    active_changed: bool,
}

impl TlasState {
    /// As after a build over all rows.
    pub fn built(policy: TlasPolicy, rows: &[RenderNodeRow], descs: &[MeshDesc]) -> Self {
        let built: Vec<Box3> = rows.iter().map(|row| Box3::of(row, descs)).collect();
        let grown: Vec<f64> = built.iter().map(|b| b.area()).collect();
        let area = grown.iter().sum();
        Self { policy, built, grown, built_area: area, grown_area: area, ..Self::default() }
    }

    /// Notes that a row becomes another. O(1).
    pub fn change(&mut self, index: u32, old: &RenderNodeRow, new: &RenderNodeRow, descs: &[MeshDesc]) {
        const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
        let is_seen = |row: &RenderNodeRow| row.flags & SEEN == SEEN;
        let i = index as usize;
        if i >= self.built.len() {
            self.built.resize(i + 1, Box3::EMPTY);
            self.grown.resize(i + 1, 0.0);
        }
        if is_seen(old) != is_seen(new) || is_seen(new) && old.primitive != new.primitive {
            self.active_changed = true;
            let (was, now) = (self.built[i].area(), Box3::of(new, descs));
            self.built_area += now.area() - was;
            self.grown_area += now.area() - self.grown[i];
            (self.built[i], self.grown[i]) = (now, now.area());
            return;
        }
        if !is_seen(new) || old.world == new.world {
            return;
        }
        self.moved = true;
        let grown = self.built[i].union(Box3::of(new, descs)).area();
        self.grown_area += grown - self.grown[i];
        self.grown[i] = grown;
    }

    /// Notes that a row may be what it was, and the geometry in its primitive's slot is another. O(1).
    pub fn reshaped(&mut self, index: u32, row: &RenderNodeRow, descs: &[MeshDesc]) {
        let i = index as usize;
        if i < self.built.len() {
            let grown = self.built[i].union(Box3::of(row, descs)).area();
            self.grown_area += grown - self.grown[i];
            self.grown[i] = grown;
        }
        self.moved = true;
    }

    /// Notes that the geometry of instances has changed in its place: their boxes are others.
    pub fn deformed(&mut self) {
        self.moved = true;
    }

    /// What the TLAS needs now, and begins to count anew. A rebuild that the policy asks for looks at all instances.
    pub fn take(&mut self, rows: &[RenderNodeRow], descs: &[MeshDesc]) -> TlasAction {
        if !self.moved && !self.active_changed {
            return TlasAction::None;
        }
        let degraded = self.updates + 1 > self.policy.max_updates
            || self.grown_area > self.policy.max_growth * self.built_area && self.built_area > 0.0;
        if self.active_changed || degraded {
            if degraded {
                *self = Self::built(self.policy, rows, descs);
            }
            (self.moved, self.active_changed) = (false, false);
            return TlasAction::Rebuild;
        }
        self.updates += 1;
        self.moved = false;
        TlasAction::Update
    }

    /// Updates since the last build, and the growth.
    pub fn degradation(&self) -> (u32, f64) {
        (self.updates, if self.built_area > 0.0 { self.grown_area / self.built_area } else { 1.0 })
    }
}
