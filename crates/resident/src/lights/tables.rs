//! [`LightTables`].

use super::changes::{LightChanges, LightWrites};
use super::{LightRows, Quad};
use crate::Environment;
use crate::environment::{EnvironmentMap, Sun};
use crate::math::{safe_normalize, sin_cos_turns};
use crate::rows::NONE;
use crate::sampling::light_tree::{LightBounds, LightTree};
use crate::sampling::lights::{distant_power, sun_integral};
use crate::sampling::{EnvironmentDistribution, LightKinds, PunctualDistribution};
use crate::slot_tree::SlotTree;
use glam::Vec3;
use std::collections::BTreeSet;
use std::f32::consts::TAU;
use std::sync::Arc;

/// What shines, prepared for sampling.
#[derive(Clone, Debug)]
pub struct LightTables {
    /// Probabilities of the kinds of light with a size.
    pub kinds: LightKinds,
    /// The choice among emitters.
    pub emitters: LightTree,
    /// What they emit together, in watts.
    pub(super) power: SlotTree<f64>,
    /// The emitters that are quads, by row of the emitter buffer; it ends after the last one that was ever a quad.
    quads: Vec<Option<Quad>>,
    /// The primitive of each emitter, or [`NONE`].
    pub(super) primitives: Vec<u32>,
    /// The same as (primitive, emitter).
    pub(super) by_primitive: BTreeSet<(u32, u32)>,
    /// Radius of the scene in metres: what distant lights shine on.
    pub(super) radius: f32,
    /// The choice among punctual lights.
    pub punctual: PunctualDistribution,
    /// The environment's map.
    pub map: Option<Arc<EnvironmentMap>>,
    /// The choice of its directions; `None` for a black one.
    pub distribution: Option<EnvironmentDistribution>,
    /// Sine and cosine of its rotation.
    pub rotation: [f32; 2],
    /// What multiplies it.
    pub intensity: f32,
    /// The sun, rotated and multiplied by the intensity.
    pub sun: Option<Sun>,
}

impl Default for LightTables {
    /// The dark, about nothing.
    fn default() -> Self {
        Self {
            kinds: LightKinds::default(),
            emitters: LightTree::default(),
            power: SlotTree::default(),
            quads: Vec::new(),
            primitives: Vec::new(),
            by_primitive: BTreeSet::new(),
            radius: 1.0,
            punctual: PunctualDistribution::default(),
            map: None,
            distribution: None,
            rotation: [0.0, 1.0],
            intensity: 0.0,
            sun: None,
        }
    }
}

impl LightTables {
    /// Takes over what surrounds the scene; [`Self::weigh_kinds`] is to follow.
    pub fn set_environment(&mut self, environment: &Environment) {
        let (sin, cos) = sin_cos_turns(environment.rotation / TAU);
        self.rotation = [sin, cos];
        self.intensity = environment.intensity;
        let unchanged = match (&self.map, &environment.map) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        if !unchanged {
            self.distribution = environment.map.as_deref().and_then(EnvironmentDistribution::build);
            self.map = environment.map.clone();
        }
        self.sun = environment.sun.map(|sun| {
            let direction = crate::sampling::environment::rotate_y(Vec3::from(sun.direction), sin, cos);
            Sun {
                direction: safe_normalize(direction, Vec3::Y).to_array(),
                radiance: sun.radiance.map(|c| c * environment.intensity),
                cos_radius: sun.cos_radius,
            }
        });
    }

    /// Follows a batch that has been applied; [`Self::weigh_kinds`] is to follow. It costs O(log n) for each light that the
    /// batch may have changed, and nothing for others.
    pub fn update(&mut self, scene: &impl LightRows, changes: &LightChanges) -> LightWrites {
        self.radius = changes.scene_radius;
        let mut writes = LightWrites::default();
        if !changes.lights.is_empty() || changes.lights_len != scene.lights().len() {
            self.punctual.update(scene.lights(), changes.lights.iter().copied());
            writes.punctual = Some(writes.work.count(changes.lights.len(), &mut self.punctual.tree));
        }
        let emitters = self.touched_emitters(scene, changes);
        if !emitters.is_empty() {
            self.update_emitters(scene, &emitters);
            writes.emitter_tree = Some(writes.work.count(emitters.len(), &mut self.emitters));
        }
        writes.emitters = emitters;
        writes
    }

    /// The emitters that a batch may have changed, ascending.
    fn touched_emitters(&self, scene: &impl LightRows, changes: &LightChanges) -> Vec<u32> {
        let mut emitters = changes.emitters.clone();
        for &primitive in &changes.primitives {
            emitters.extend(self.by_primitive.range((primitive, 0)..=(primitive, NONE)).map(|&(_, emitter)| emitter));
        }
        emitters.extend(scene.emitters().len() as u32..self.primitives.len() as u32);
        emitters.sort_unstable();
        emitters.dedup();
        emitters
    }

    fn update_emitters(&mut self, scene: &impl LightRows, touched: &[u32]) {
        let mut bounds = Vec::with_capacity(touched.len());
        let mut primitives = Vec::with_capacity(touched.len());
        for &emitter in touched {
            let row = scene.emitters().get(emitter as usize);
            let node = row.and_then(|row| scene.emitting_node(row.render_node));
            let desc = node.and_then(|node| scene.mesh_desc(node.primitive));
            let (mut quad, mut light) = (None, None);
            if let (Some(row), Some(node), Some(desc)) = (row, node, desc) {
                quad = Quad::new(scene, node, desc);
                let front = quad.as_ref().map(|quad| quad.front(node));
                light = LightBounds::of_emitter(row, node, desc, front);
            }
            set_sparse(&mut self.quads, emitter as usize, quad);
            bounds.push((emitter, light));
            primitives.push((emitter, node.map_or(NONE, |node| node.primitive)));
        }
        self.emitters.update(&bounds);
        self.index_primitives(scene.emitters().len(), &primitives);
        self.power.update(scene.emitters().len(), touched.iter().copied(), |emitter| {
            f64::from(scene.emitters()[emitter].power)
        });
    }

    /// Keeps the emitters by primitive.
    fn index_primitives(&mut self, len: usize, changed: &[(u32, u32)]) {
        if self.primitives.len() < len {
            self.primitives.resize(len, NONE);
        }
        let was_empty = self.by_primitive.is_empty();
        for &(emitter, primitive) in changed {
            let Some(known) = self.primitives.get_mut(emitter as usize) else { continue };
            let before = std::mem::replace(known, primitive);
            if was_empty || before == primitive {
                continue;
            }
            self.by_primitive.remove(&(before, emitter));
            if primitive != NONE {
                self.by_primitive.insert((primitive, emitter));
            }
        }
        self.primitives.truncate(len);
        if was_empty {
            let known = (0..).zip(&self.primitives).filter(|&(_, &primitive)| primitive != NONE);
            self.by_primitive = known.map(|(emitter, &primitive)| (primitive, emitter)).collect();
        }
    }

    /// The emitters that are quads, by row of the emitter buffer; it ends after the last one that was ever a quad.
    pub fn quads(&self) -> &[Option<Quad>] {
        &self.quads
    }

    /// The quad that a row of the emitter buffer is.
    #[inline]
    pub fn quad(&self, emitter: u32) -> Option<&Quad> {
        self.quads.get(emitter as usize)?.as_ref()
    }

    /// The primitive of an emitter, or [`NONE`].
    pub(super) fn primitive(&self, emitter: u32) -> u32 {
        self.primitives.get(emitter as usize).copied().unwrap_or(NONE)
    }

    /// Weighs the emitters, the environment and the sun against each other.
    pub fn weigh_kinds(&mut self) {
        let map = self.distribution.as_ref().map_or(0.0, |d| distant_power(d.integral * self.intensity, self.radius));
        let sun = self.sun.as_ref().map_or(0.0, |sun| distant_power(sun_integral(sun), self.radius));
        self.kinds = LightKinds::from_powers(self.power.total() as f32, map, sun);
    }
}

/// Sets an element of a list that ends after its last element that ever was something.
fn set_sparse<T: Clone>(list: &mut Vec<Option<T>>, at: usize, value: Option<T>) {
    if at >= list.len() {
        if value.is_none() {
            return;
        }
        list.resize(at + 1, None);
    }
    list[at] = value;
}
