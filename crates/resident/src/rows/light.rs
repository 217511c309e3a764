use bytemuck::{Pod, Zeroable};

/// Kinds of punctual light (KHR_lights_punctual).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum LightKind {
    /// A hole in the buffer.
    None = 0,
    /// From infinitely far; `color` is illuminance, in lux.
    Directional = 1,
    /// From a point; `color` is luminous intensity, in candela.
    Point = 2,
    /// A cone from a point; `color` is luminous intensity, in candela.
    Spot = 3,
}

/// One punctual light in world space. 64 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LightRow {
    /// Position (point, spot), relative to the scene's origin.
    pub position: [f32; 3],
    /// [`LightKind`].
    pub kind: u32,
    /// Unit direction in which the light shines (directional, spot).
    pub direction: [f32; 3],
    /// Distance at which the light ends smoothly, as the extension defines; infinity for none.
    pub range: f32,
    /// Linear colour times intensity, in the unit of the kind.
    pub color: [f32; 3],
    /// `1 / max(0.001, cos(inner) - cos(outer))` of a spot.
    pub angle_scale: f32,
    /// `-cos(outer) * angle_scale` of a spot.
    pub angle_offset: f32,
    /// The index of the node in the document that carries it.
    pub node: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

impl LightRow {
    /// A row that holds no light.
    pub const HOLE: Self = Self {
        position: [0.0; 3],
        kind: LightKind::None as u32,
        direction: [0.0, 0.0, -1.0],
        range: 0.0,
        color: [0.0; 3],
        angle_scale: 0.0,
        angle_offset: 0.0,
        node: super::NONE,
        reserved: [0; 2],
    };
}
