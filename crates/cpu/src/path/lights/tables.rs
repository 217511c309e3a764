use crate::scene::ResidentScene;
use glam::Vec3;
use orthant_resident::Environment;
use orthant_resident::environment::{EnvironmentMap, Sun};
use orthant_resident::math::{safe_normalize, sin_cos_turns};
use orthant_resident::rows::NodeFlags;
use orthant_resident::sampling::lights::{distant_power, sun_integral};
use orthant_resident::sampling::{EnvironmentDistribution, LightKinds, PunctualDistribution};
use std::f32::consts::TAU;
use std::sync::Arc;

/// What shines, prepared for sampling.
#[derive(Clone, Debug, Default)]
pub struct LightTables {
    /// Probabilities of the kinds of light with a size.
    pub kinds: LightKinds,
    /// Sum of the emitters' powers: the scale of their cumulative table.
    pub emitter_power: f32,
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
    /// Takes over what surrounds the scene; [`Self::update_scene`] is to follow.
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

    /// Weighs the lights of the scene and of the environment against each other.
    pub fn update_scene(&mut self, scene: &ResidentScene) {
        let radius = scene_radius(scene);
        self.emitter_power = scene.emitters.last().map_or(0.0, |row| row.cumulative_power);
        let map = self.distribution.as_ref().map_or(0.0, |d| distant_power(d.integral * self.intensity, radius));
        let sun = self.sun.as_ref().map_or(0.0, |sun| distant_power(sun_integral(sun), radius));
        self.kinds = LightKinds::from_powers(self.emitter_power, map, sun);
        self.punctual = PunctualDistribution::build(&scene.lights, radius);
    }
}

/// Radius in metres of a sphere about what is seen; 1 for an empty scene.
fn scene_radius(scene: &ResidentScene) -> f32 {
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for node in scene.render_nodes.iter().filter(|n| n.flags & NodeFlags::VISIBLE != 0) {
        let Some(desc) = scene.mesh_descs.get(node.primitive as usize) else { continue };
        let (a, b) = (Vec3::from(desc.bounds_min), Vec3::from(desc.bounds_max));
        let center = node.world.transform_point((a + b) * 0.5);
        let half = (b - a) * 0.5;
        let r = &node.world.rows;
        let extent = |i: usize| r[i][0].abs() * half.x + r[i][1].abs() * half.y + r[i][2].abs() * half.z;
        let half = Vec3::new(extent(0), extent(1), extent(2));
        if (center + half).is_finite() && (center - half).is_finite() {
            lo = lo.min(center - half);
            hi = hi.max(center + half);
        }
    }
    let radius = 0.5 * (hi - lo).length();
    if radius > 0.0 && radius.is_finite() { radius } else { 1.0 }
}
