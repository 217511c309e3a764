//! The light of the preview: one sun, ambient, and a sky of three colours, from an environment.

use glam::Vec3;
use orthant_resident::Environment;
use orthant_resident::environment::EnvironmentMap;
use orthant_resident::world::Shade;
use std::f32::consts::PI;

/// The part of a map's light that comes as from a sun: what it has more on one side than on the other.
struct Directional {
    direction: Vec3,
    /// Irradiance over pi of a surface that faces it.
    sun: Vec3,
    /// Mean radiance of the rest.
    ambient: Vec3,
}

/// [`Shade::Preview`] with the light of an environment.
///
/// A sun is the sun, and all else is ambient. A map without a sun lights from where most of its light comes, by as much as its
/// first moment says. An environment without light (black) has a black sky; blocks are then lit from the upper left and all
/// around, so that they can be seen.
pub fn preview_light(environment: &Environment) -> Shade {
    let intensity = environment.intensity;
    let turn = |v: Vec3| glam::Quat::from_rotation_y(environment.rotation) * v;
    let map = environment.map.as_deref();
    let [zenith, horizon, nadir] = map.map_or([Vec3::ZERO; 3], |map| sky(map).map(|c| c * intensity));
    let of_map = map.map(directional);
    let (direction, sun, ambient) = match (&environment.sun, of_map) {
        (Some(sun), map) => {
            // The disc's radiance times its solid angle is its irradiance.
            let irradiance = Vec3::from(sun.radiance) * (2.0 * PI * (1.0 - sun.cos_radius));
            let ambient = map.map_or(Vec3::ZERO, |map| map.ambient + map.sun * 0.25);
            (turn(Vec3::from(sun.direction)), irradiance / PI * intensity, ambient * intensity)
        }
        (None, Some(map)) => (turn(map.direction), map.sun * intensity, map.ambient * intensity),
        (None, None) => (Vec3::Y, Vec3::ZERO, Vec3::ZERO),
    };
    let is_dark = (sun + ambient).max_element() <= 0.0;
    let (direction, sun, ambient) = if is_dark { LAMP } else { (direction, sun, ambient) };
    Shade::Preview {
        direction: direction.normalize_or(Vec3::Y).to_array(),
        sun: sun.to_array(),
        ambient: ambient.to_array(),
        zenith: zenith.to_array(),
        horizon: horizon.to_array(),
        nadir: nadir.to_array(),
    }
}

/// Direction, sun and ambient where there is no light: a white surface that faces the lamp has radiance 1.
const LAMP: (Vec3, Vec3, Vec3) = (Vec3::new(-0.5, 0.95, 0.62), Vec3::splat(0.75), Vec3::splat(0.25));

/// Solid angle of a texel of a row.
fn solid_angle(map: &EnvironmentMap, row: u32) -> f32 {
    let edge = |row: u32| (PI * row as f32 / map.height as f32).cos();
    (edge(row) - edge(row + 1)) * 2.0 * PI / map.width as f32
}

fn texels(map: &EnvironmentMap, row: u32) -> &[[f32; 3]] {
    &map.texels[(row * map.width) as usize..][..map.width as usize]
}

/// Mean radiance at the zenith, the horizon and the nadir: over the eighth of the rows that is nearest to each.
fn sky(map: &EnvironmentMap) -> [Vec3; 3] {
    let h = map.height;
    let band = h.div_ceil(8);
    [0, (h - band) / 2, h - band].map(|first| {
        let (mut sum, mut weight) = (Vec3::ZERO, 0.0);
        for row in first..first + band {
            let w = solid_angle(map, row);
            sum += texels(map, row).iter().map(|&t| Vec3::from(t)).sum::<Vec3>() * w;
            weight += w * map.width as f32;
        }
        sum / weight
    })
}

fn directional(map: &EnvironmentMap) -> Directional {
    let (mut total, mut moment, mut luminance) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for row in 0..map.height {
        let w = solid_angle(map, row);
        let theta = PI * (row as f32 + 0.5) / map.height as f32;
        for (column, &texel) in texels(map, row).iter().enumerate() {
            let phi = 2.0 * PI * ((column as f32 + 0.5) / map.width as f32 - 0.5);
            let direction = Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            let light = Vec3::from(texel) * w;
            let y = light.dot(Vec3::new(0.2126, 0.7152, 0.0722));
            total += light;
            moment += direction * y;
            luminance += y;
        }
    }
    let share = if luminance > 0.0 { (moment.length() / luminance).min(1.0) } else { 0.0 };
    // A map of one texel has its moment at random.
    let share = if share < 1e-3 || map.width < 2 { 0.0 } else { share };
    Directional {
        direction: moment.normalize_or(Vec3::Y),
        sun: total * (share / PI),
        ambient: total * ((1.0 - share) / (4.0 * PI)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Light {
        direction: Vec3,
        sun: Vec3,
        ambient: Vec3,
        sky: [Vec3; 3],
    }

    fn light(environment: &Environment) -> Light {
        let Shade::Preview { direction, sun, ambient, zenith, horizon, nadir } = preview_light(environment) else {
            panic!("a preview")
        };
        Light {
            direction: direction.into(),
            sun: sun.into(),
            ambient: ambient.into(),
            sky: [zenith, horizon, nadir].map(Vec3::from),
        }
    }

    #[test]
    fn one_radiance_all_around_is_ambient_alone() {
        let light = light(&Environment::constant([0.5, 1.0, 2.0]));
        let even = Vec3::new(0.5, 1.0, 2.0);
        assert!((light.ambient - even).abs().max_element() < 1e-5, "{:?}", light.ambient);
        assert_eq!(light.sun, Vec3::ZERO);
        assert!(light.sky.iter().all(|c| (*c - even).abs().max_element() < 1e-5));
    }

    #[test]
    fn a_black_environment_has_a_black_sky_and_a_lamp() {
        let light = light(&Environment::none());
        assert_eq!(light.sky, [Vec3::ZERO; 3]);
        assert_eq!(light.sun + light.ambient, Vec3::ONE);
    }

    #[test]
    fn a_clear_sky_lights_from_its_sun_and_is_brightest_at_the_horizon() {
        let toward = Vec3::new(0.3, 0.8, -0.4).normalize();
        let mut sky = crate::sky::clear_sky(toward);
        let noon = light(&sky);
        assert!((noon.direction - toward).length() < 1e-5);
        // A horizontal white surface has radiance 1 under a sun 45 degrees high, a little more under this one.
        let white = noon.sun * toward.y + noon.ambient;
        assert!((0.9..1.6).contains(&white.y), "{white}");
        let [zenith, horizon, nadir] = noon.sky;
        assert!(horizon.y > zenith.y && zenith.z > zenith.x && nadir.y > 0.0);
        sky.rotation = std::f32::consts::FRAC_PI_2;
        sky.intensity = 2.0;
        let turned = light(&sky);
        assert!((turned.direction - Vec3::new(toward.z, toward.y, -toward.x)).length() < 1e-5, "{}", turned.direction);
        assert!((turned.sun - noon.sun * 2.0).length() < 1e-4 && (turned.sky[0] - zenith * 2.0).length() < 1e-4);
    }

    #[test]
    fn a_coarse_sky_lights_like_a_fine_one() {
        let toward = crate::sky::DEFAULT_SUN;
        let (fine, coarse) = (light(&crate::sky::clear_sky(toward)), light(&crate::sky::coarse_sky(toward)));
        let pairs = [(fine.sun, coarse.sun), (fine.ambient, coarse.ambient)]
            .into_iter()
            .chain(fine.sky.into_iter().zip(coarse.sky));
        for (fine, coarse) in pairs {
            assert!((fine - coarse).abs().max_element() < 0.02 * fine.max_element(), "{fine} {coarse}");
        }
    }

    #[test]
    fn a_lamp_in_a_map_is_where_the_light_comes_from_and_no_light_is_lost() {
        let (width, height) = (64, 32);
        let mut texels = vec![[0.1; 3]; 64 * 32];
        // The middle of the image looks along -Z; this is a little to the right of it and above the horizon.
        texels[10 * 64 + 40] = [200.0; 3];
        let map = EnvironmentMap { width, height, texels };
        let environment = Environment { map: Some(Arc::new(map.clone())), ..Environment::none() };
        let light = light(&environment);
        let (theta, phi) = (PI * 10.5 / 32.0, 2.0 * PI * (40.5 / 64.0 - 0.5));
        let lamp = Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
        assert!((light.direction - lamp).length() < 1e-3, "{} {lamp}", light.direction);
        let total: f32 = (0..height).map(|row| texels_sum(&map, row) * solid_angle(&map, row)).sum();
        assert!((light.sun.x * PI + light.ambient.x * 4.0 * PI - total).abs() < 1e-2 * total);
    }

    fn texels_sum(map: &EnvironmentMap, row: u32) -> f32 {
        texels(map, row).iter().map(|t| t[0]).sum()
    }
}
