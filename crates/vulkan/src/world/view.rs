//! What shaders see of a view of a world: twins of `shaders/world/view.slang` and `shaders/world/group.slang`.

use super::abi::WorldTable;
use crate::abi::{Address, TracePush};
use bytemuck::{Pod, Zeroable};
use orthant_resident::world::ray::plane_offset;
use orthant_resident::world::{Combine, Layer, Shade, WorldView};

/// What a frame shows of a world.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WorldFrame {
    /// The set of arenas that it sees.
    pub world: WorldTable,
    /// Of [`LayerRow`]s.
    pub layers: Address,
    /// 64 times eight 32-bit counters for each dispatch under way: rays, nodes, leaves, cells, exhausted rays, and zeros.
    pub counters: Address,
    /// See [`WorldView::anchor`].
    pub anchor: [i64; 4],
    /// The anchor less the set's origin, in units, rounded.
    pub offset: [f32; 4],
    /// Rows of `layers`.
    pub layer_count: u32,
    /// See [`WorldView::step_budget`].
    pub step_budget: u32,
    /// 0: mean, 1: integral.
    pub combine: u32,
    /// See [`Combine::Integral`].
    pub mix: f32,
    /// See [`WorldView::distance`].
    pub distance: f32,
    /// See [`WorldView::edges`].
    pub edges: f32,
    /// See [`Shade::Preview`], as all that follow.
    pub direction: [f32; 3],
    /// Likewise.
    pub sun: [f32; 3],
    /// Likewise.
    pub ambient: [f32; 3],
    /// Likewise.
    pub zenith: [f32; 3],
    /// Likewise.
    pub horizon: [f32; 3],
    /// Likewise.
    pub nadir: [f32; 3],
    /// Where the anchor is for rays: the camera's position if the frame shows a scene too, else 0.
    pub place: [f32; 3],
    /// Zero.
    pub reserved: u32,
}

/// A layer. 96 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LayerRow {
    /// See [`Layer::axes`].
    pub axes: [[f32; 4]; 3],
    /// See [`Layer::right`].
    pub right: [f32; 3],
    /// A bit for each axis of the world that the layer runs along: those that are not perpendicular to it.
    pub runs: u32,
    /// See [`Layer::up`].
    pub up: [f32; 3],
    /// Zero.
    pub up_reserved: u32,
    /// See [`Layer::forward`].
    pub forward: [f32; 3],
    /// Zero.
    pub forward_reserved: u32,
}

/// Push constants of frames that show a world.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct WorldPush {
    /// Those of any frame.
    pub trace: TracePush,
    /// Of a [`WorldFrame`].
    pub world: Address,
    /// Rows of the tile in this dispatch.
    pub rows: u32,
    /// Zero.
    pub reserved: u32,
}

impl WorldFrame {
    /// That of a view of a set, without addresses of its own.
    pub(crate) fn new(view: &WorldView, world: WorldTable) -> Self {
        let mut frame = Self {
            world,
            anchor: view.anchor,
            offset: std::array::from_fn(|a| plane_offset(view.anchor[a], world.origin[a])),
            layer_count: view.layers.len() as u32,
            step_budget: view.step_budget,
            distance: view.distance,
            edges: view.edges,
            ..Self::zeroed()
        };
        if let Combine::Integral { mix } = view.combine {
            (frame.combine, frame.mix) = (1, mix);
        }
        if let Shade::Preview { direction, sun, ambient, zenith, horizon, nadir } = view.shade {
            (frame.direction, frame.sun, frame.ambient) = (direction, sun, ambient);
            (frame.zenith, frame.horizon, frame.nadir) = (zenith, horizon, nadir);
        }
        frame
    }
}

impl LayerRow {
    /// That of a layer.
    pub(crate) fn new(layer: &Layer) -> Self {
        let runs_along = |a: &usize| layer.axes.iter().map(|axis| axis[*a] * axis[*a]).sum::<f32>() > 1e-6;
        Self {
            axes: layer.axes,
            right: layer.right,
            runs: (0..4).filter(runs_along).map(|a| 1 << a).sum(),
            up: layer.up,
            up_reserved: 0,
            forward: layer.forward,
            forward_reserved: 0,
        }
    }
}
