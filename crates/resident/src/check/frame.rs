//! Frames and environments.

use crate::camera::Projection;
use crate::film::BLOCK;
use crate::frame::PixelFilter;
use crate::world::WorldView;
use crate::world::view::{Combine, MAX_DISTANCE, MAX_LAYERS, Shade};
use crate::{BackendError, Environment, Frame};

/// Checks a frame.
///
/// # Errors
/// [`BackendError::InvalidFrame`], which names the field.
pub fn check_frame(frame: &Frame) -> Result<(), BackendError> {
    let fault = |message: String| Err(BackendError::InvalidFrame(message));
    let (w, h) = (frame.width, frame.height);
    if w == 0 || h == 0 || u64::from(w) * u64::from(h) > u64::from(u32::MAX) {
        return fault(format!("the image has {w} x {h} pixels; both must be positive and their product below 2^32"));
    }
    let t = frame.tile;
    let fits = |first: u32, count: u32, size: u32| count > 0 && u64::from(first) + u64::from(count) <= u64::from(size);
    if !fits(t.x, t.width, w) || !fits(t.y, t.height, h) {
        return fault(format!("tile {},{} {}x{} is empty or leaves the image of {w}x{h}", t.x, t.y, t.width, t.height));
    }
    let s = &frame.samples;
    if !s.start.is_multiple_of(BLOCK) || s.start >= s.end {
        return fault(format!("samples {}..{} must begin at a multiple of {BLOCK} and not be empty", s.start, s.end));
    }
    if frame.max_depth == 0 {
        return fault("max_depth must be at least 1".into());
    }
    if let Some(clamp) = frame.firefly_clamp
        && (clamp.is_nan() || clamp <= 0.0)
    {
        return fault(format!("firefly_clamp is {clamp}; it must be positive"));
    }
    match frame.filter {
        PixelFilter::Box => {}
        PixelFilter::Tent { radius } | PixelFilter::BlackmanHarris { radius } => {
            if !(radius > 0.0 && radius.is_finite()) {
                return fault(format!("the pixel filter's radius is {radius}; it must be positive"));
            }
        }
    }
    let c = &frame.camera;
    let vectors = [c.position, c.right, c.up, c.forward];
    let size = match c.projection {
        Projection::Perspective { tan_half_fov_y } => tan_half_fov_y,
        Projection::Orthographic { half_height } => half_height,
    };
    if vectors.as_flattened().iter().any(|v| !v.is_finite()) || !(size > 0.0 && size.is_finite()) {
        return fault("the camera's vectors must be finite, and its field of view positive".into());
    }
    if !(c.lens_radius >= 0.0 && c.lens_radius.is_finite()) {
        return fault(format!("the lens radius is {}; it must not be negative", c.lens_radius));
    }
    if c.lens_radius > 0.0 && !(c.focus_distance > 0.0 && c.focus_distance.is_finite()) {
        return fault(format!("the focus distance is {}; it must be positive", c.focus_distance));
    }
    if !(c.near >= 0.0 && c.far > c.near) {
        return fault(format!("near is {} and far {}; 0 <= near < far is asked for", c.near, c.far));
    }
    if let Some(view) = &frame.world {
        check_view(view)?;
    }
    Ok(())
}

fn check_view(view: &WorldView) -> Result<(), BackendError> {
    let fault = |message: String| Err(BackendError::InvalidFrame(message));
    if view.layers.is_empty() || view.layers.len() > MAX_LAYERS {
        return fault(format!("a view of a world has {} layers; 1 to {MAX_LAYERS} are possible", view.layers.len()));
    }
    for (i, layer) in view.layers.iter().enumerate() {
        let dot = |a: &[f32; 4], b: &[f32; 4]| (0..4).map(|k| a[k] * b[k]).sum::<f32>();
        let good = (0..3).all(|a| {
            (0..=a).all(|b| (dot(&layer.axes[a], &layer.axes[b]) - if a == b { 1.0 } else { 0.0 }).abs() < 1e-4)
        });
        let camera = [layer.right, layer.up, layer.forward];
        if !good || camera.as_flattened().iter().any(|v| !v.is_finite()) {
            return fault(format!("the axes of layer {i} must be orthonormal, and its camera finite"));
        }
    }
    if !(view.distance > 0.0 && view.distance <= MAX_DISTANCE) {
        return fault(format!(
            "the view distance is {}; it must be positive and at most {MAX_DISTANCE}",
            view.distance
        ));
    }
    if !(0.0..=0.5).contains(&view.edges) {
        return fault(format!("the width of block edges is {}; it is a fraction from 0 to 0.5", view.edges));
    }
    if let Combine::Integral { mix } = view.combine
        && !(mix >= 0.0 && mix.is_finite())
    {
        return fault(format!("the integral's mixing constant is {mix}; it must not be negative"));
    }
    let bound = 1_i64 << 61;
    if view.anchor.iter().any(|&a| a <= -bound || a >= bound) || view.step_budget == 0 {
        return fault(
            "the view's anchor must lie within 2^45 units of the origin, and its step budget be positive".into(),
        );
    }
    Ok(())
}

/// Checks the view of a frame that shows a model scene too: rows of render nodes are resident.
///
/// # Errors
/// [`BackendError::InvalidFrame`], which says what is asked for.
pub fn check_view_with_scene(view: &WorldView) -> Result<(), BackendError> {
    let fault = |message: String| Err(BackendError::InvalidFrame(message));
    if view.layers.len() != 1 {
        return fault(format!(
            "a model scene and a world are seen together in one layer (a slice); this view has {}",
            view.layers.len()
        ));
    }
    if view.shade != Shade::Path {
        return fault(
            "a model scene and a world are seen together by path tracing; the preview shows a world alone".into(),
        );
    }
    Ok(())
}

/// Checks an environment.
///
/// # Errors
/// [`BackendError::Device`], which says what is wrong with it.
pub fn check_environment(environment: &Environment) -> Result<(), BackendError> {
    let fault = |message: &str| Err(BackendError::Device(format!("the environment is invalid: {message}")));
    if let Some(map) = &environment.map {
        if map.width == 0 || map.height == 0 || map.texels.len() as u64 != u64::from(map.width) * u64::from(map.height)
        {
            return fault("the map's texels do not match its size");
        }
        if map.texels.as_flattened().iter().any(|c| !(c.is_finite() && *c >= 0.0)) {
            return fault("a texel of the map is negative or not finite");
        }
    }
    if !(environment.intensity >= 0.0 && environment.intensity.is_finite() && environment.rotation.is_finite()) {
        return fault("intensity and rotation must be finite, and the intensity not negative");
    }
    if let Some(sun) = &environment.sun {
        let finite = sun.direction.iter().chain(&sun.radiance).all(|v| v.is_finite());
        if !(finite && sun.cos_radius >= -1.0 && sun.cos_radius < 1.0) {
            return fault("the sun's direction and radiance must be finite, and its radius positive");
        }
    }
    Ok(())
}
