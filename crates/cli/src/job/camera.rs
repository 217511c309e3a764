//! Which camera a rendering has.

use super::Loaded;
use crate::args::RenderArgs;
use crate::failure::Failure;
use glam::DVec3;
use orthant_render::camera::View;
use orthant_resident::Camera;
use orthant_resident::camera::Projection;
use orthant_scene::model::CameraId;

/// `--fov` of a camera by hand, unless given, in degrees.
pub const DEFAULT_FOV: f32 = 45.0;

/// The camera that the options ask for: one by hand, one of the file, or, without either, the file's first, or the whole
/// scene framed. The lens follows from `--aperture` and `--focus-distance`.
///
/// # Errors
/// A camera that the file does not have or the scene does not show, or an eye that is its target (usage); one that is at no
/// finite place (bad input).
pub fn select(loaded: &Loaded, args: &RenderArgs) -> Result<View, Failure> {
    let Loaded { scene, derived, path, .. } = loaded;
    let aspect = f64::from(args.size.width) / f64::from(args.size.height);
    let mut view = if let (Some(eye), Some(target)) = (args.eye, args.target) {
        let [eye, target, up] = [eye, target, args.up].map(|v| DVec3::from_array(v.0));
        View::look_at(eye, target, up, f64::from(args.fov.unwrap_or(DEFAULT_FOV)).to_radians())
            .ok_or_else(|| Failure::usage("--eye and --target are the same point: move one of them"))?
    } else if let Some(reference) = &args.camera {
        let id = find(loaded, reference)?;
        View::of_camera(scene, derived, id, aspect).ok_or_else(|| {
            let what = format!("--camera {reference}: no node of the scene that is shown carries it");
            Failure::usage(what).in_file(path).remedy("choose another camera or another --scene")
        })?
    } else if let Some(view) = View::first_camera(scene, derived, aspect) {
        view
    } else {
        let bounds = derived.bounds().unwrap_or((DVec3::NEG_ONE, DVec3::ONE));
        View::framing(bounds, aspect)
    };
    view.lens_radius = f64::from(args.aperture) * 0.5;
    if let Some(distance) = args.focus_distance {
        view.focus_distance = f64::from(distance);
    }
    if !is_somewhere(&view.to_camera(derived.origin)) {
        let what = "the camera is at no finite place: the scene, or the camera's node, reaches too far or has no size";
        return Err(Failure::bad_input(path, what.to_owned()).remedy("place one with --eye and --target"));
    }
    Ok(view)
}

/// Whether all that a scene file decides about a camera can be written in the numbers of a frame.
fn is_somewhere(camera: &Camera) -> bool {
    let vectors = [camera.position, camera.right, camera.up, camera.forward];
    let size = match camera.projection {
        Projection::Perspective { tan_half_fov_y } => tan_half_fov_y,
        Projection::Orthographic { half_height } => half_height,
    };
    vectors.as_flattened().iter().all(|c| c.is_finite()) && size.is_finite() && size > 0.0
}

/// A camera by index, by its name, or by the name of a node that carries it.
fn find(loaded: &Loaded, reference: &str) -> Result<CameraId, Failure> {
    let scene = &loaded.scene;
    let by_index = reference.parse::<usize>().ok().and_then(|index| scene.cameras().ids().nth(index));
    let by_name = || scene.cameras().iter().find(|(_, c)| c.name.as_deref() == Some(reference)).map(|(id, _)| id);
    let by_node = || {
        let named = scene.nodes().iter().filter(|(_, n)| n.name.as_deref() == Some(reference));
        named.filter_map(|(_, n)| n.camera).next()
    };
    by_index.or_else(by_name).or_else(by_node).ok_or_else(|| {
        let names: Vec<String> = scene
            .cameras()
            .iter()
            .enumerate()
            .map(|(i, (_, c))| c.name.as_ref().map_or(i.to_string(), |n| format!("{i} ({n})")))
            .collect();
        let known = if names.is_empty() { "no cameras".into() } else { format!("only {}", names.join(", ")) };
        Failure::usage(format!("--camera {reference}: the file has {known}")).in_file(&loaded.path)
    })
}
