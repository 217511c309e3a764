//! What surrounds the scene of a rendering.

use super::Loaded;
use crate::args::{EnvArg, RenderArgs};
use crate::failure::Failure;
use crate::image_io::{self, Encoding};
use glam::Vec3;
use orthant_render::sky::{clear_sky, coarse_sky};
use orthant_resident::Environment;
use orthant_resident::environment::EnvironmentMap;
use std::path::Path;
use std::sync::Arc;

/// The environment that the options ask for. Without `--env`, a scene with light of its own ([`lights_itself`]) has
/// none; any other, and a frame that shows a world (`loaded` is then no matter), the sky.
///
/// A frame that is a `preview` takes no more of a clear sky than its colours.
///
/// # Errors
/// A bad image (bad input).
pub fn select(
    loaded: Option<&Loaded>,
    args: &RenderArgs,
    preview: bool,
    max_memory: u64,
) -> Result<Environment, Failure> {
    let chosen = match &args.env {
        Some(env) => env.clone(),
        None if loaded.is_some_and(lights_itself) => EnvArg::None,
        None => EnvArg::Sky,
    };
    let mut environment = match chosen {
        EnvArg::None => Environment::none(),
        EnvArg::Constant(radiance) => Environment::constant(radiance),
        EnvArg::Sky if preview => coarse_sky(sun_direction(args.sun.0)),
        EnvArg::Sky => clear_sky(sun_direction(args.sun.0)),
        EnvArg::File(path) => Environment { map: Some(Arc::new(read_map(&path, max_memory)?)), ..Environment::none() },
    };
    environment.rotation = args.env_rotation.to_radians();
    environment.intensity = args.env_intensity;
    Ok(environment)
}

/// Whether the scene has light of its own: a punctual light, or a visible surface that emits a radiance above 1 (that is,
/// by KHR_materials_emissive_strength). A surface that glows with at most 1, such as a screen or a pilot lamp of an
/// asset made for image-based lighting, lights nothing but itself.
pub fn lights_itself(loaded: &Loaded) -> bool {
    let derived = &loaded.derived;
    let bright = |render_node: u32| {
        let material = derived.render_nodes[render_node as usize].material;
        derived.materials[material as usize].emissive.iter().any(|&c| c > 1.0)
    };
    !derived.lights.is_empty() || derived.emitters.iter().any(|e| bright(e.render_node))
}

/// From degrees: azimuth from +Z towards +X, elevation above the horizon.
fn sun_direction([azimuth, elevation]: [f64; 2]) -> Vec3 {
    let (sin, cos) = azimuth.to_radians().sin_cos();
    let (up, level) = elevation.to_radians().sin_cos();
    glam::DVec3::new(sin * level, up, cos * level).as_vec3()
}

/// Reads a latitude-longitude image. What is negative or no number becomes 0, and infinity the largest finite value of
/// the image: one burnt-out pixel must not make every path white.
fn read_map(path: &Path, max_memory: u64) -> Result<EnvironmentMap, Failure> {
    let picture = image_io::read(path, max_memory)?;
    if picture.encoding != Encoding::Linear {
        return Err(Failure::bad_input(path, "an environment has linear radiance").remedy("use an .hdr or .exr file"));
    }
    let values = picture.pixels.as_flattened();
    let brightest = values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    let clean = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, brightest) };
    let texels = picture.pixels.iter().map(|p| p.map(clean)).collect();
    Ok(EnvironmentMap { width: picture.width, height: picture.height, texels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_stands_where_its_angles_say() {
        let close = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
        assert!(close(sun_direction([0.0, 0.0]), Vec3::Z));
        assert!(close(sun_direction([90.0, 0.0]), Vec3::X));
        assert!(close(sun_direction([30.0, 90.0]), Vec3::Y));
    }

    #[test]
    fn three_numbers_are_one_radiance_all_around() {
        assert_eq!("white".parse(), Ok(EnvArg::Constant([1.0; 3])));
        assert_eq!("0.5,0,2e3".parse(), Ok(EnvArg::Constant([0.5, 0.0, 2000.0])));
        for bad in ["1,-0.5,1", "0,0,1e39"] {
            assert!(bad.parse::<EnvArg>().is_err(), "{bad}");
        }
        for file in ["./1,2,3", "1,2", "1,2,3.hdr", "White"] {
            assert_eq!(file.parse(), Ok(EnvArg::File(file.into())));
        }
    }

    #[test]
    fn a_map_is_finite_and_not_negative_whatever_the_file_holds() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.exr");
        let channel = |name, values: [f32; 2]| image_io::Channel { name, values: values.to_vec() };
        let channels = vec![
            channel("R", [f32::INFINITY, 2.0]),
            channel("G", [f32::NAN, -1.0]),
            channel("B", [f32::NEG_INFINITY, 5.0]),
        ];
        image_io::write_channels(&path, 2, 1, channels).expect("write");
        let map = read_map(&path, 1 << 20).expect("read");
        assert_eq!(map.texels, [[5.0, 0.0, 0.0], [2.0, 0.0, 5.0]]);
    }
}
