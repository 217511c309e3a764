//! Worlds on the Vulkan backend beside the CPU backend: the same hits, the same images. Without a device the tests say so, unless
//! `ORTHANT_REQUIRE_VULKAN=1`. The validation layers have nothing to say.

use arenas::{Recipe, UNIT, build};
use orthant_cpu::CpuBackend;
use orthant_resident::camera::Projection;
use orthant_resident::frame::{Aov, Estimator, PixelFilter, Tile};
use orthant_resident::world::view::STEP_BUDGET;
use orthant_resident::world::{ArenaLens, Combine, Layer, MutationBatch, SetSlot, Shade, WorldView};
use orthant_resident::{Backend, Camera, Film, Frame, TicketStatus};
use orthant_vulkan::VulkanBackend;
use orthant_vulkan::device::{DeviceOptions, Tracer};
use std::time::Duration;

mod arenas;
#[path = "../../../cpu/tests/common/mod.rs"]
mod common;
mod paths;
mod preview;

/// A device under the validation layers, or `None` where there is none and none has to be.
fn device() -> Option<VulkanBackend> {
    device_with(None)
}

fn device_with(tracer: Option<Tracer>) -> Option<VulkanBackend> {
    let required = std::env::var("ORTHANT_REQUIRE_VULKAN").is_ok_and(|v| v == "1");
    match VulkanBackend::new(&DeviceOptions { validate: true, tracer, ..DeviceOptions::default() }) {
        Ok(backend) => Some(backend),
        Err(error) if required => panic!("ORTHANT_REQUIRE_VULKAN is set: {error}"),
        Err(error) => {
            eprintln!("skipped: {error}");
            None
        }
    }
}

fn assert_silent(vulkan: &VulkanBackend) {
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

/// Has a backend show a world.
fn show(backend: &mut dyn Backend, origin: [i64; 4], batch: &MutationBatch) {
    backend.begin_staging(origin, ArenaLens::default()).expect("there is room");
    backend.apply_world(SetSlot::Staging, batch).expect("the batch is sound");
    backend.swap_sets().expect("there is a staging set");
}

fn render(backend: &mut dyn Backend, frame: &Frame) -> (Film, TicketStatus) {
    let ticket = backend.submit(frame.clone()).expect("the frame is sound");
    let status = loop {
        let status = backend.poll(ticket, Duration::from_secs(1)).expect("the device works");
        if status.is_done() {
            break status;
        }
    };
    (backend.read_film(ticket).expect("the film is there"), status)
}

const AOVS: [Aov; 7] = [Aov::Albedo, Aov::Normal, Aov::Depth, Aov::Position, Aov::Block, Aov::Face, Aov::Cell];

const PREVIEW: Shade = Shade::Preview {
    direction: [0.36, 0.8, 0.48],
    sun: [0.8, 0.75, 0.7],
    ambient: [0.25, 0.28, 0.33],
    zenith: [0.2, 0.4, 0.9],
    horizon: [0.8, 0.85, 0.9],
    nadir: [0.3, 0.28, 0.25],
};

/// Which layers a frame shows, about the one of right, up and forward: angles towards the hidden axis, in radians.
#[derive(Clone, Copy, Debug)]
enum Mode {
    Slice,
    Integral { layers: u32, mix: f32 },
    Thick { each_side: u32, degrees: f64 },
}

/// Degrees: forward towards left, right towards hidden, forward towards hidden, forward towards up.
#[derive(Clone, Copy, Debug, Default)]
struct Turns {
    yaw: f64,
    xw: f64,
    zw: f64,
    pitch: f64,
}

/// Right, up, forward and hidden.
fn axes(turns: &Turns) -> [[f64; 4]; 4] {
    let mut axes = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    for (from, to, degrees) in [(0, 2, turns.yaw), (0, 3, turns.xw), (2, 3, turns.zw), (2, 1, turns.pitch)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (a, b) = (axes[from], axes[to]);
        axes[from] = std::array::from_fn(|k| a[k] * cos + b[k] * sin);
        axes[to] = std::array::from_fn(|k| b[k] * cos - a[k] * sin);
    }
    axes
}

/// A view from a point of a world.
fn frame(
    about: [i64; 4],
    at: [f64; 4],
    turns: &Turns,
    mode: &Mode,
    (width, height): (u32, u32),
    samples: u32,
) -> Frame {
    let [right, up, forward, hidden] = axes(turns);
    let layer = |theta: f64| {
        let (sin, cos) = theta.sin_cos();
        let back: [f64; 4] = std::array::from_fn(|k| -forward[k] * cos - hidden[k] * sin);
        Layer {
            axes: [right, up, back].map(|axis| axis.map(|v| v as f32)),
            right: [1.0, 0.0, 0.0],
            up: [0.0, 1.0, 0.0],
            forward: [0.0, 0.0, -1.0],
        }
    };
    let quarter = std::f64::consts::FRAC_PI_2;
    let angles: Vec<f64> = match *mode {
        Mode::Slice => vec![0.0],
        Mode::Integral { layers, .. } => {
            (0..layers).map(|l| (2.0 * (f64::from(l) + 0.5) / f64::from(layers) - 1.0) * quarter / 2.0).collect()
        }
        Mode::Thick { each_side, degrees } => {
            let n = each_side as i32;
            (-n..=n).map(|i| (f64::from(i) * degrees).to_radians()).collect()
        }
    };
    let world = WorldView {
        anchor: std::array::from_fn(|a| about[a] + (at[a] * UNIT as f64).round() as i64),
        layers: angles.into_iter().map(layer).collect(),
        combine: if let Mode::Integral { mix, .. } = *mode { Combine::Integral { mix } } else { Combine::Mean },
        distance: 60.0,
        shade: PREVIEW,
        edges: 0.03,
        step_budget: STEP_BUDGET,
    };
    let camera = Camera {
        position: [0.0; 3],
        right: world.layers[0].right,
        up: world.layers[0].up,
        forward: world.layers[0].forward,
        projection: Projection::Perspective { tan_half_fov_y: 0.6 },
        lens_radius: 0.0,
        focus_distance: 1.0,
        near: 0.0,
        far: f32::INFINITY,
    };
    Frame {
        camera,
        width,
        height,
        tile: Tile { x: 0, y: 0, width, height },
        samples: 0..samples,
        keep_blocks: false,
        seed: 5,
        max_depth: 4,
        roulette_depth: 3,
        firefly_clamp: None,
        estimator: Estimator::Mis,
        filter: PixelFilter::BlackmanHarris { radius: 1.5 },
        aovs: AOVS.to_vec(),
        threads: 0,
        world: Some(world),
    }
}

fn aov(film: &Film, wanted: Aov) -> &[f32] {
    &film.aovs.iter().find(|(aov, _)| *aov == wanted).expect("the frame asked for it").1
}

/// Both backends with one world.
fn both(vulkan: &mut VulkanBackend, recipe: &Recipe, origin: [i64; 4]) -> CpuBackend {
    let batch = build(recipe, origin);
    let mut cpu = CpuBackend::new();
    show(&mut cpu, origin, &batch);
    show(vulkan, origin, &batch);
    cpu
}
