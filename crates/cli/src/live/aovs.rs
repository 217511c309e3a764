//! What cameras see of a scene on a device that has followed edits, and of one that was loaded there.

use super::aim::{Aim, Targets};
use super::geometry::Geometry;
use crate::metrics::hits::{Hits, hits};
use glam::DVec3;
use orthant_render::camera::View;
use orthant_resident::frame::{Aov, Estimator, Frame, PixelFilter, Tile};
use orthant_resident::{Backend, BackendError, Camera, Film};
use orthant_scene::edit::random::Choices;
use orthant_vulkan::VulkanBackend;
use std::time::Duration;

/// Pictures of one comparison: the first is of the whole scene, the others of triangles.
const PICTURES: usize = 3;
/// Pixels along a side of a picture.
const SIDE: u32 = 16;
/// How far cameras are away, in sizes of what they look at.
const AWAY: f64 = 1.5;
/// How far depths may be apart, relative to them.
const TOLERANCE: f64 = 1e-4;

/// Compares the AOVs of a few pictures that `seed` chooses, of the scene whose geometry is given. Slots of RenderPrimitives are
/// numbered differently on both sides; nodes and materials are not. Gives how many pixels show something.
///
/// # Errors
/// The first picture that shows something else; a device that is gone.
pub fn compare(
    synced: &mut VulkanBackend,
    fresh: &mut VulkanBackend,
    geometry: Geometry<'_>,
    seed: u64,
) -> Result<u64, String> {
    let targets = Targets::of(geometry);
    let mut seen = 0;
    for (i, choice) in Choices(seed).take(PICTURES).enumerate() {
        let aimed = if i == 0 { targets.across(choice) } else { targets.at_triangle(choice) };
        let Some(Aim { at, direction, size, .. }) = aimed else { continue };
        let from = at - direction * size * AWAY;
        let Some(view) = View::look_at(from, at, DVec3::Y, 1.0) else { continue };
        let camera = view.to_camera(DVec3::ZERO);
        let axes = [camera.position, camera.right, camera.up, camera.forward];
        if !axes.as_flattened().iter().all(|c| c.is_finite()) {
            continue;
        }
        let film = |backend: &mut VulkanBackend| film(backend, camera).map_err(|e| e.to_string());
        let (should, is) = (film(fresh)?, film(synced)?);
        let Hits { differ, unexplained, depth } = hits(&should, &is);
        if unexplained > 0 || depth > TOLERANCE {
            return Err(format!(
                "from {from} towards {at}, {differ} of {} pixels show something else than in a scene that is loaded now \
                 ({unexplained} of them far from any edge), and depths differ by {depth}",
                SIDE * SIDE
            ));
        }
        seen += is.aovs[0].1.iter().filter(|depth| depth.is_finite()).count() as u64;
    }
    Ok(seen)
}

/// What the rays through the centres of pixels hit.
fn film(backend: &mut VulkanBackend, camera: Camera) -> Result<Film, BackendError> {
    let ticket = backend.submit(Frame {
        camera,
        width: SIDE,
        height: SIDE,
        tile: Tile { x: 0, y: 0, width: SIDE, height: SIDE },
        samples: 0..1,
        keep_blocks: false,
        seed: 0,
        max_depth: 1,
        roulette_depth: 1,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::Box,
        aovs: vec![Aov::Depth, Aov::Node, Aov::Material],
        threads: 0,
        world: None,
    })?;
    while !backend.poll(ticket, Duration::from_secs(1))?.is_done() {}
    backend.read_film(ticket)
}
