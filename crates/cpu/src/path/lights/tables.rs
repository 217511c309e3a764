use super::quad::Quad;
use crate::scene::ResidentScene;
use glam::Vec3;
use orthant_resident::Environment;
use orthant_resident::environment::{EnvironmentMap, Sun};
use orthant_resident::math::{safe_normalize, sin_cos_turns};
use orthant_resident::sampling::light_tree::{LightBounds, LightTree};
use orthant_resident::sampling::lights::{distant_power, sun_integral};
use orthant_resident::sampling::{EnvironmentDistribution, LightKinds, PunctualDistribution};
use std::f32::consts::TAU;
use std::sync::Arc;

/// What shines, prepared for sampling.
#[derive(Clone, Debug, Default)]
pub struct LightTables {
    /// Probabilities of the kinds of light with a size.
    pub kinds: LightKinds,
    /// The choice among emitters.
    pub emitters: LightTree,
    /// What they emit together.
    emitter_power: f32,
    /// The emitters that are quads, by row of the emitter buffer; none at all where no emitter is one.
    pub quads: Vec<Option<Quad>>,
    /// Radius of the scene in metres: what distant lights shine on.
    pub radius: f32,
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
            let direction = orthant_resident::sampling::environment::rotate_y(Vec3::from(sun.direction), sin, cos);
            Sun {
                direction: safe_normalize(direction, Vec3::Y).to_array(),
                radiance: sun.radiance.map(|c| c * environment.intensity),
                cos_radius: sun.cos_radius,
            }
        });
    }

    /// Takes over the punctual lights.
    pub fn update_punctual(&mut self, scene: &ResidentScene) {
        self.punctual = PunctualDistribution::build(&scene.lights);
    }

    /// Takes over the emitters. It visits all of them: to be called when they or instances have changed.
    pub fn update_emitters(&mut self, scene: &ResidentScene) {
        self.quads.clear();
        let mut any = false;
        let mut bounds = Vec::with_capacity(scene.emitters.len());
        for row in &scene.emitters {
            let node = scene.render_nodes.get(row.render_node as usize);
            let geometry = node.and_then(|node| Some((node, scene.mesh_descs.get(node.primitive as usize)?)));
            let quad = geometry.and_then(|(node, desc)| Quad::new(scene, node, desc));
            any |= quad.is_some();
            bounds.push(geometry.and_then(|(node, desc)| {
                let front = quad.map(|quad| quad.front(node));
                LightBounds::of_emitter(row, node, desc, front)
            }));
            self.quads.push(quad);
        }
        if !any {
            self.quads.clear();
        }
        self.emitter_power = scene.emitters.iter().map(|row| f64::from(row.power)).sum::<f64>() as f32;
        self.emitters = LightTree::build(&bounds);
    }

    /// The quad that a row of the emitter buffer is.
    #[inline]
    pub fn quad(&self, emitter: u32) -> Option<&Quad> {
        self.quads.get(emitter as usize)?.as_ref()
    }

    /// Weighs the emitters, the environment and the sun against each other.
    pub fn weigh_kinds(&mut self) {
        let map = self.distribution.as_ref().map_or(0.0, |d| distant_power(d.integral * self.intensity, self.radius));
        let sun = self.sun.as_ref().map_or(0.0, |sun| distant_power(sun_integral(sun), self.radius));
        self.kinds = LightKinds::from_powers(self.emitter_power, map, sun);
    }
}
