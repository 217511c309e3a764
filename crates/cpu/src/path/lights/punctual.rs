//! Lights without a size (KHR_lights_punctual).
//!
//! No ray hits them, so their choice needs no density: candidates are weighed by what they would contribute without
//! occlusion, and one is kept (resampled importance sampling, Talbot 2005).

use super::{LightSample, LightTables};
use crate::scene::ResidentScene;
use glam::Vec3;
use orthant_resident::math::luminance;
use orthant_resident::rows::{LightKind, LightRow};
use orthant_resident::sampling::lights::PUNCTUAL_CANDIDATES;

/// Samples a punctual light for a surface at `position`; the sample's radiance is the irradiance at a surface that faces
/// the light, divided by the probability of the choice. `seed` and `choice` are random numbers in 0..1.
#[inline]
pub fn sample_punctual(
    scene: &ResidentScene,
    lights: &LightTables,
    position: Vec3,
    geometric: Vec3,
    shading: Vec3,
    seed: f32,
    choice: f32,
) -> Option<LightSample> {
    let candidates = lights.punctual.candidates();

    // Weigh the candidates
    let mut importance = [0.0f32; PUNCTUAL_CANDIDATES];
    let mut total = 0.0;
    for (j, importance) in importance.iter_mut().enumerate().take(candidates) {
        if let Some((index, weight)) = lights.punctual.candidate(j, seed, position, geometric)
            && let Some(sample) = punctual_light(&scene.lights[index], position)
        {
            let value = light_importance(&sample, geometric, shading) * weight;
            *importance = if value.is_finite() { value } else { 0.0 };
        }
        total += *importance;
    }
    if total <= 0.0 {
        return None;
    }

    // Choose one in proportion; rounding may leave the target past the sum: then it is the last that counts
    let target = choice * total;
    let (mut sum, mut chosen) = (0.0, 0);
    for (j, &importance) in importance.iter().enumerate().take(candidates) {
        if importance > 0.0 {
            chosen = j;
            sum += importance;
            if sum > target {
                break;
            }
        }
    }
    let (index, weight) = lights.punctual.candidate(chosen, seed, position, geometric)?;
    let mut sample = punctual_light(&scene.lights[index], position)?;
    sample.radiance *= total * weight / importance[chosen];
    Some(sample)
}

#[inline]
fn light_importance(sample: &LightSample, geometric: Vec3, shading: Vec3) -> f32 {
    if sample.direction.dot(geometric) <= 0.0 {
        return 0.0;
    }
    luminance(sample.radiance) * sample.direction.dot(shading).max(0.01)
}

/// Direction to a light and its irradiance at a surface at `position` that faces it; `None` where it does not reach.
#[inline]
pub fn punctual_light(light: &LightRow, position: Vec3) -> Option<LightSample> {
    let color = Vec3::from_array(light.color);
    if light.kind == LightKind::Directional as u32 {
        let direction = -Vec3::from_array(light.direction);
        return Some(LightSample { direction, end: None, radiance: color, pdf: 1.0 });
    }
    if light.kind != LightKind::Point as u32 && light.kind != LightKind::Spot as u32 {
        return None;
    }
    let end = Vec3::from_array(light.position);
    let to_light = end - position;
    let distance2 = to_light.length_squared();
    if distance2 <= 0.0 {
        return None;
    }
    let direction = to_light / distance2.sqrt();
    // The window of the extension: 1 - (d / range)^4
    let ratio2 = distance2 / (light.range * light.range);
    let window = (1.0 - ratio2 * ratio2).clamp(0.0, 1.0);
    let mut intensity = window / distance2;
    if light.kind == LightKind::Spot as u32 {
        let cos = -direction.dot(Vec3::from_array(light.direction));
        let cone = (cos * light.angle_scale + light.angle_offset).clamp(0.0, 1.0);
        intensity *= cone * cone;
    }
    (intensity > 0.0).then_some(LightSample { direction, end: Some(end), radiance: color * intensity, pdf: 1.0 })
}
