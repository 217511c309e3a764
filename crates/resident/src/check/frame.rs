//! Frames and environments.

use crate::camera::Projection;
use crate::film::BLOCK;
use crate::frame::PixelFilter;
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
