//! The built-in sky: a clear atmosphere with a sun, as an environment map and a sun disc.
//!
//! Rayleigh, Mie and ozone by the constants of Bruneton (2017, "Precomputed Atmospheric Scattering: a New
//! Implementation"); transmittance and multiple scattering by tables as in Hillaire (2020, "A Scalable and Production
//! Ready Sky and Atmosphere Rendering Technique", sections 5.2 and 5.5). Lengths are in kilometres. Radiance is scaled
//! so that a white horizontal surface under a sun 45 degrees high has radiance 1.

use glam::{Vec2, Vec3};
use orthant_resident::Environment;
use orthant_resident::environment::{EnvironmentMap, Sun};
use rayon::prelude::*;
use std::f32::consts::PI;
use std::sync::Arc;

const GROUND_RADIUS: f32 = 6360.0;
const TOP_RADIUS: f32 = 6460.0;
const RAYLEIGH: Vec3 = Vec3::new(5.802e-3, 13.558e-3, 33.1e-3);
const MIE_SCATTERING: f32 = 3.996e-3;
const MIE_EXTINCTION: f32 = 4.44e-3;
const MIE_G: f32 = 0.8;
const OZONE: Vec3 = Vec3::new(0.650e-3, 1.881e-3, 0.085e-3);
const GROUND_ALBEDO: f32 = 0.3;
/// Solar irradiance in the three bands, relative to green.
const SUN_COLOR: Vec3 = Vec3::new(1.0, 1.0, 0.97);
/// Angular radius of the sun: 0.2666 degrees.
const SUN_RADIUS: f32 = 0.004_653;
/// The observer's height above the ground.
const OBSERVER: f32 = 0.2;
const TRANSMITTANCE_SIZE: (usize, usize) = (256, 64);
const MULTIPLE_SIZE: usize = 32;
const MAP_SIZE: (u32, u32) = (1024, 512);
/// Measured once from this model by the test `a_white_plane_has_radiance_one`: horizontal irradiance (luminance) on the
/// ground under a sun of irradiance 1 that stands 45 degrees high.
const IRRADIANCE_AT_45: f32 = 0.6521;

/// Where the sun stands unless one says else: 50 degrees high, in front of a camera's left shoulder where the camera looks
/// along -Z.
pub const DEFAULT_SUN: Vec3 = Vec3::new(-0.5, 0.95, 0.62);

/// A clear sky with the sun in a direction (+Y is up; normalised here).
pub fn clear_sky(toward_sun: Vec3) -> Environment {
    clear_sky_map(toward_sun, MAP_SIZE)
}

/// [`clear_sky`] for those who look at its colours alone: a hundredth of the work.
pub fn coarse_sky(toward_sun: Vec3) -> Environment {
    clear_sky_map(toward_sun, (96, 48))
}

fn clear_sky_map(toward_sun: Vec3, (width, height): (u32, u32)) -> Environment {
    let toward_sun = toward_sun.normalize_or(Vec3::Y);
    let atmosphere = Atmosphere::new(toward_sun.y);
    let scale = PI / IRRADIANCE_AT_45;
    let texels: Vec<[f32; 3]> = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            let atmosphere = &atmosphere;
            (0..width).map(move |x| {
                let theta = PI * (y as f32 + 0.5) / height as f32;
                let phi = 2.0 * PI * ((x as f32 + 0.5) / width as f32 - 0.5);
                let direction = Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                (atmosphere.radiance(direction, toward_sun) * scale).to_array()
            })
        })
        .collect();
    let disc = 2.0 * PI * (1.0 - SUN_RADIUS.cos());
    let sun = atmosphere.sun_at_observer(toward_sun.y) * scale / disc;
    Environment {
        map: Some(Arc::new(EnvironmentMap { width, height, texels })),
        rotation: 0.0,
        intensity: 1.0,
        sun: (sun.max_element() > 0.0).then(|| Sun {
            direction: toward_sun.to_array(),
            radiance: sun.to_array(),
            cos_radius: SUN_RADIUS.cos(),
        }),
    }
}

/// Scattering and extinction coefficients per kilometre at a height.
struct Medium {
    rayleigh: Vec3,
    mie: f32,
    extinction: Vec3,
}

impl Medium {
    fn at(height: f32) -> Self {
        let rayleigh = RAYLEIGH * (-height / 8.0).exp();
        let mie_density = (-height / 1.2).exp();
        let ozone = OZONE * (1.0 - (height - 25.0).abs() / 15.0).max(0.0);
        Self {
            rayleigh,
            mie: MIE_SCATTERING * mie_density,
            extinction: rayleigh + Vec3::splat(MIE_EXTINCTION * mie_density) + ozone,
        }
    }
}

/// Distance along a ray from radius `r` with zenith cosine `mu` to a sphere, or `None` where it is missed.
fn distance_to_sphere(r: f32, mu: f32, radius: f32) -> Option<f32> {
    let discriminant = r * r * (mu * mu - 1.0) + radius * radius;
    if discriminant < 0.0 {
        return None;
    }
    let root = discriminant.sqrt();
    let far = -r * mu + root;
    let near = -r * mu - root;
    if near > 0.0 { Some(near) } else { (far > 0.0).then_some(far) }
}

/// Tables for one height of the sun.
struct Atmosphere {
    transmittance: Vec<Vec3>,
    /// Multiply scattered radiance per unit of scattering, for a sun of irradiance 1 (Hillaire's Psi_ms).
    multiple: Vec<Vec3>,
    /// Radiance of the ground.
    ground: Vec3,
}

impl Atmosphere {
    fn new(sun_mu: f32) -> Self {
        let mut atmosphere = Self { transmittance: Vec::new(), multiple: Vec::new(), ground: Vec3::ZERO };
        let (w, h) = TRANSMITTANCE_SIZE;
        atmosphere.transmittance = (0..w * h)
            .into_par_iter()
            .map(|i| {
                let mu = from_table_mu((i % w) as f32 / (w - 1) as f32);
                let height = from_table_height((i / w) as f32 / (h - 1) as f32);
                integrate_transmittance(GROUND_RADIUS + height, mu)
            })
            .collect();
        let n = MULTIPLE_SIZE;
        let multiple = (0..n * n)
            .into_par_iter()
            .map(|i| {
                let mu = (i % n) as f32 / (n - 1) as f32 * 2.0 - 1.0;
                let height = (i / n) as f32 / (n - 1) as f32 * (TOP_RADIUS - GROUND_RADIUS);
                atmosphere.integrate_multiple(height.clamp(0.01, 99.9), mu)
            })
            .collect();
        atmosphere.multiple = multiple;
        let sky = atmosphere.sky_irradiance(sun_mu);
        let direct = atmosphere.sun_at_observer(sun_mu) * sun_mu.max(0.0);
        atmosphere.ground = (direct + sky) * (GROUND_ALBEDO / PI);
        atmosphere
    }

    /// Transmittance from a height to space along a zenith cosine; 0 where the ground is in between.
    fn transmittance(&self, height: f32, mu: f32) -> Vec3 {
        let r = GROUND_RADIUS + height;
        let horizon = -(1.0 - (GROUND_RADIUS / r).powi(2)).max(0.0).sqrt();
        if mu < horizon {
            return Vec3::ZERO;
        }
        let at = Vec2::new(to_table_mu(mu), to_table_height(height));
        bilinear(&self.transmittance, TRANSMITTANCE_SIZE.0, TRANSMITTANCE_SIZE.1, at)
    }

    fn multiple(&self, height: f32, sun_mu: f32) -> Vec3 {
        if self.multiple.is_empty() {
            return Vec3::ZERO;
        }
        let at = Vec2::new(sun_mu * 0.5 + 0.5, height / (TOP_RADIUS - GROUND_RADIUS));
        bilinear(&self.multiple, MULTIPLE_SIZE, MULTIPLE_SIZE, at)
    }

    /// Irradiance of the sun on a surface that faces it, at the observer, for a sun of irradiance 1 above the air.
    fn sun_at_observer(&self, sun_mu: f32) -> Vec3 {
        self.transmittance(OBSERVER, sun_mu) * SUN_COLOR
    }

    /// Radiance that reaches the observer from a direction, the sun's disc apart.
    fn radiance(&self, direction: Vec3, toward_sun: Vec3) -> Vec3 {
        let r = GROUND_RADIUS + OBSERVER;
        let ground = distance_to_sphere(r, direction.y, GROUND_RADIUS).filter(|_| direction.y < 0.0);
        let Some(length) = ground.or_else(|| distance_to_sphere(r, direction.y, TOP_RADIUS)) else { return Vec3::ZERO };
        let cos = direction.dot(toward_sun);
        let phases = (rayleigh_phase(cos), mie_phase(cos));
        let steps = 48;
        let (mut radiance, mut through) = (Vec3::ZERO, Vec3::ONE);
        let mut from = 0.0;
        for i in 0..steps {
            // Samples lie closer together near the observer, where the air is dense.
            let to = length * ((i + 1) as f32 / steps as f32).powi(2);
            let (dt, t) = (to - from, (to + from) * 0.5);
            from = to;
            let position = Vec3::Y * r + direction * t;
            let height = (position.length() - GROUND_RADIUS).max(0.0);
            let sun_mu = position.normalize().dot(toward_sun);
            let (source, extinction) = self.source(height, sun_mu, phases);
            let step = (-extinction * dt).exp();
            // The source is constant over the step (Hillaire, equation in section 5.3).
            radiance += through * (source - source * step) / extinction.max(Vec3::splat(1e-9));
            through *= step;
        }
        radiance * SUN_COLOR + if ground.is_some() { through * self.ground } else { Vec3::ZERO }
    }

    /// In-scattered radiance per kilometre, for a sun of irradiance 1, and extinction.
    fn source(&self, height: f32, sun_mu: f32, (rayleigh_phase, mie_phase): (f32, f32)) -> (Vec3, Vec3) {
        let medium = Medium::at(height);
        let single = (medium.rayleigh * rayleigh_phase + Vec3::splat(medium.mie * mie_phase))
            * self.transmittance(height, sun_mu);
        let multiple = (medium.rayleigh + Vec3::splat(medium.mie)) * self.multiple(height, sun_mu);
        (single + multiple, medium.extinction)
    }

    /// Hillaire 2020, equations 5 to 10: second-order radiance and the geometric series of all further orders.
    fn integrate_multiple(&self, height: f32, sun_mu: f32) -> Vec3 {
        let toward_sun = Vec3::new((1.0 - sun_mu * sun_mu).max(0.0).sqrt(), sun_mu, 0.0);
        let r = GROUND_RADIUS + height;
        let (mut second, mut transfer) = (Vec3::ZERO, Vec3::ZERO);
        let directions = 64;
        for i in 0..directions {
            let mu = 1.0 - 2.0 * (i as f32 + 0.5) / directions as f32;
            let phi = i as f32 * 2.399_963;
            let s = (1.0 - mu * mu).sqrt();
            let direction = Vec3::new(s * phi.cos(), mu, s * phi.sin());
            let ground = if mu < 0.0 { distance_to_sphere(r, mu, GROUND_RADIUS) } else { None };
            let Some(length) = ground.or_else(|| distance_to_sphere(r, mu, TOP_RADIUS)) else { continue };
            let steps = 20;
            let dt = length / steps as f32;
            let mut through = Vec3::ONE;
            for k in 0..steps {
                let position = Vec3::Y * r + direction * ((k as f32 + 0.5) * dt);
                let h = (position.length() - GROUND_RADIUS).max(0.0);
                let (source, extinction) = self.source(h, position.normalize().dot(toward_sun), (0.25 / PI, 0.25 / PI));
                let medium = Medium::at(h);
                let step = (-extinction * dt).exp();
                let integral = through * (Vec3::ONE - step) / extinction.max(Vec3::splat(1e-9));
                second += source * integral;
                transfer += (medium.rayleigh + Vec3::splat(medium.mie)) * integral;
                through *= step;
            }
            if ground.is_some() {
                let normal = (Vec3::Y * r + direction * length).normalize();
                let mu = normal.dot(toward_sun);
                second += through * self.transmittance(0.0, mu) * (mu.max(0.0) * GROUND_ALBEDO / PI);
            }
        }
        second /= directions as f32;
        transfer /= directions as f32;
        second / (Vec3::ONE - transfer)
    }

    /// Irradiance of the sky on a horizontal surface at the observer.
    fn sky_irradiance(&self, sun_mu: f32) -> Vec3 {
        let toward_sun = Vec3::new((1.0 - sun_mu * sun_mu).max(0.0).sqrt(), sun_mu, 0.0);
        let n = 256;
        let sum: Vec3 = (0..n)
            .map(|i| {
                // Cosine-weighted directions: the mean times pi is the irradiance.
                let s = ((i as f32 + 0.5) / n as f32).sqrt();
                let phi = i as f32 * 2.399_963;
                let direction = Vec3::new(s * phi.cos(), (1.0 - s * s).sqrt(), s * phi.sin());
                self.radiance(direction, toward_sun)
            })
            .sum();
        sum * (PI / n as f32)
    }
}

fn integrate_transmittance(r: f32, mu: f32) -> Vec3 {
    let Some(length) = distance_to_sphere(r, mu, TOP_RADIUS) else { return Vec3::ONE };
    let steps = 40;
    let dt = length / steps as f32;
    let depth: Vec3 = (0..steps)
        .map(|i| {
            let t = (i as f32 + 0.5) * dt;
            let height = (r * r + t * t + 2.0 * r * mu * t).sqrt() - GROUND_RADIUS;
            Medium::at(height.max(0.0)).extinction * dt
        })
        .sum();
    (-depth).exp()
}

/// Cosines are stored denser around the horizon, where transmittance changes fastest.
fn from_table_mu(u: f32) -> f32 {
    let v = u * 2.0 - 1.0;
    v * v * v.signum()
}

fn to_table_mu(mu: f32) -> f32 {
    mu.abs().sqrt() * mu.signum() * 0.5 + 0.5
}

fn from_table_height(v: f32) -> f32 {
    v * v * (TOP_RADIUS - GROUND_RADIUS)
}

fn to_table_height(height: f32) -> f32 {
    (height / (TOP_RADIUS - GROUND_RADIUS)).clamp(0.0, 1.0).sqrt()
}

fn bilinear(table: &[Vec3], width: usize, height: usize, at: Vec2) -> Vec3 {
    let p = at.clamp(Vec2::ZERO, Vec2::ONE) * Vec2::new((width - 1) as f32, (height - 1) as f32);
    let (x, y) = ((p.x as usize).min(width - 2), (p.y as usize).min(height - 2));
    let f = p - Vec2::new(x as f32, y as f32);
    let t = |x: usize, y: usize| table[y * width + x];
    t(x, y).lerp(t(x + 1, y), f.x).lerp(t(x, y + 1).lerp(t(x + 1, y + 1), f.x), f.y)
}

fn rayleigh_phase(cos: f32) -> f32 {
    3.0 / (16.0 * PI) * (1.0 + cos * cos)
}

/// Cornette and Shanks 1992.
fn mie_phase(cos: f32) -> f32 {
    let g2 = MIE_G * MIE_G;
    let k = 3.0 / (8.0 * PI) * (1.0 - g2) / (2.0 + g2);
    k * (1.0 + cos * cos) / (1.0 + g2 - 2.0 * MIE_G * cos).powf(1.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn luminance(c: Vec3) -> f32 {
        c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
    }

    fn horizontal_irradiance(environment: &Environment) -> Vec3 {
        let map = environment.map.as_ref().expect("the sky has a map");
        let mut sum = Vec3::ZERO;
        for (i, texel) in map.texels.iter().enumerate() {
            let theta = PI * ((i as u32 / map.width) as f32 + 0.5) / map.height as f32;
            let solid_angle = 2.0 * PI * PI / (map.width * map.height) as f32 * theta.sin();
            sum += Vec3::from_array(*texel) * (theta.cos().max(0.0) * solid_angle);
        }
        let Some(sun) = environment.sun else { return sum };
        sum + Vec3::from_array(sun.radiance) * (2.0 * PI * (1.0 - sun.cos_radius) * sun.direction[1])
    }

    #[test]
    fn a_white_plane_has_radiance_one() {
        let sky = clear_sky(Vec3::new(0.0, 1.0, 1.0));
        let radiance = luminance(horizontal_irradiance(&sky)) / PI;
        assert!((radiance - 1.0).abs() < 0.005, "{radiance}");
    }

    #[test]
    fn the_sky_is_blue_above_and_red_at_dusk() {
        let at = |environment: &Environment, u: f32, v: f32| {
            let map = environment.map.as_ref().expect("the sky has a map");
            let (x, y) = ((u * map.width as f32) as u32, (v * map.height as f32) as u32);
            Vec3::from_array(map.texels[(y * map.width + x) as usize])
        };
        let noon = clear_sky(Vec3::new(0.0, 1.0, 1.0));
        let zenith = at(&noon, 0.25, 0.05);
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        // The sun stands at the middle of the image, which looks along -Z.
        let dusk = clear_sky(Vec3::new(0.0, 0.02, -1.0));
        let horizon = at(&dusk, 0.5, 0.49);
        assert!(horizon.x > 1.5 * horizon.z, "{horizon}");
        assert!(horizon.x > at(&dusk, 0.01, 0.49).x);
        assert!(luminance(horizontal_irradiance(&dusk)) < 0.1 * luminance(horizontal_irradiance(&noon)));
    }

    #[test]
    fn a_sun_below_the_horizon_is_not_seen() {
        assert!(clear_sky(Vec3::new(0.0, -0.3, 1.0)).sun.is_none());
    }
}
