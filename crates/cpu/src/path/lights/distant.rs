//! The environment map and the sun.

use super::{LightSample, LightTables};
use glam::{Vec2, Vec3};
use orthant_resident::sampling::environment::{lookup_environment, rotate_y, sample_sun, sun_contains, sun_pdf};

/// Radiance of the map in a world-space direction.
#[inline]
pub fn environment_radiance(lights: &LightTables, direction: Vec3) -> Vec3 {
    let Some(map) = &lights.map else { return Vec3::ZERO };
    let [sin, cos] = lights.rotation;
    lookup_environment(map, rotate_y(direction, -sin, cos)) * lights.intensity
}

/// Density with which next event estimation chooses a direction of the map, the choice of the kind included.
#[inline]
pub fn environment_pdf(lights: &LightTables, direction: Vec3) -> f32 {
    let Some(distribution) = &lights.distribution else { return 0.0 };
    let [sin, cos] = lights.rotation;
    lights.kinds.environment * distribution.pdf(rotate_y(direction, -sin, cos))
}

/// Samples the map; the density leaves the choice of the kind out.
#[inline]
pub fn sample_environment(lights: &LightTables, u: Vec2) -> Option<LightSample> {
    let (map, distribution) = (lights.map.as_deref()?, lights.distribution.as_ref()?);
    let (local, pdf) = distribution.sample(u);
    let [sin, cos] = lights.rotation;
    let radiance = lookup_environment(map, local) * lights.intensity;
    (pdf > 0.0).then_some(LightSample { direction: rotate_y(local, sin, cos), end: None, radiance, pdf })
}

/// Radiance of the sun in a world-space direction, and the density with which next event estimation chooses it.
#[inline]
pub fn sun_radiance(lights: &LightTables, direction: Vec3) -> Option<(Vec3, f32)> {
    let sun = lights.sun.as_ref().filter(|sun| sun_contains(sun, direction))?;
    Some((Vec3::from_array(sun.radiance), lights.kinds.sun * sun_pdf(sun)))
}

/// Samples the sun's disc; the density leaves the choice of the kind out.
#[inline]
pub fn sample_sun_disc(lights: &LightTables, u: Vec2) -> Option<LightSample> {
    let sun = lights.sun.as_ref()?;
    let direction = sample_sun(sun, u);
    Some(LightSample { direction, end: None, radiance: Vec3::from_array(sun.radiance), pdf: sun_pdf(sun) })
}
