//! Cameras in worlds, and the layers that an image of a world is made of.
//!
//! A camera has a position and four orthonormal axes: right, up, forward and hidden, which without turns are +X, +Y, -Z and +W.
//! Yaw and the two rotations with the hidden axis turn axes that are level, pitch comes last and leaves the hidden axis alone. So
//! right and hidden are always level, as is the heading, which is forward without the pitch: all turns but pitch are
//! rotations of the heading's frame about Y, and the horizon stays level however a camera was steered.

use glam::DVec4;
use orthant_resident::Camera;
use orthant_resident::camera::Projection;
use orthant_resident::world::view::STEP_BUDGET;
use orthant_resident::world::{Combine, Layer, Shade, WorldView};
use orthant_world::{Aabb4, Fixed, Point4};

/// Turns of a camera, in degrees, in the order in which they happen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Turns {
    /// Forward towards the left: counter-clockwise from above.
    pub yaw: f64,
    /// Right towards hidden.
    pub xw: f64,
    /// Forward towards hidden.
    pub zw: f64,
    /// Forward towards up.
    pub pitch: f64,
}

/// A way in the camera's axes, in units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Steps {
    /// Along right.
    pub right: f64,
    /// Along up.
    pub up: f64,
    /// Along forward.
    pub forward: f64,
    /// Along hidden.
    pub hidden: f64,
}

/// A camera in a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldCamera {
    /// Where it stands.
    pub position: Point4,
    /// Level.
    right: DVec4,
    /// Level: forward before the pitch.
    heading: DVec4,
    /// Level.
    hidden: DVec4,
    /// In radians.
    pitch: f64,
}

/// How an image is made of layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// The hyperplane of right, up and forward.
    Slice,
    /// Layers that sweep the hidden axis.
    Integral {
        /// How many, at least 1.
        layers: u32,
        /// They sweep `(pi / 2) / hidden_zoom`; above 0.
        hidden_zoom: f64,
        /// See [`Combine::Integral`].
        mix: f32,
    },
    /// The mean of layers about the slice.
    Thick {
        /// Layers on each side of the slice.
        each_side: u32,
        /// Degrees between one and the next.
        spacing: f64,
    },
}

/// What a view shows beside where it looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// How hits are shaded.
    pub shade: Shade,
    /// Rays end here, in units.
    pub distance: f32,
    /// Width of lines along the edges of blocks, see [`WorldView::edges`].
    pub edges: f32,
}

impl WorldCamera {
    /// At a position, turned.
    pub fn new(position: Point4, turns: &Turns) -> Self {
        let mut camera = Self { position, right: DVec4::X, heading: DVec4::NEG_Z, hidden: DVec4::W, pitch: 0.0 };
        camera.turn(turns);
        camera
    }

    /// To the right of the image.
    pub fn right(&self) -> DVec4 {
        self.right
    }

    /// To the top of the image.
    pub fn up(&self) -> DVec4 {
        let (sin, cos) = self.pitch.sin_cos();
        DVec4::Y * cos - self.heading * sin
    }

    /// Into the image.
    pub fn forward(&self) -> DVec4 {
        let (sin, cos) = self.pitch.sin_cos();
        self.heading * cos + DVec4::Y * sin
    }

    /// The axis that a slice does not show.
    pub fn hidden(&self) -> DVec4 {
        self.hidden
    }

    /// Turns the camera further, in the order of [`Turns`]. The pitch stays within a right angle of the horizon when a camera is
    /// steered; one that a camera begins with may be any.
    pub fn turn(&mut self, turns: &Turns) {
        // Towards `b`, a rotation takes `a` to `a cos + b sin`, and `b` to `b cos - a sin`.
        let rotate = |a: &mut DVec4, b: &mut DVec4, degrees: f64| {
            let (sin, cos) = sin_cos_degrees(degrees);
            (*a, *b) = (*a * cos + *b * sin, *b * cos - *a * sin);
        };
        rotate(&mut self.right, &mut self.heading, turns.yaw);
        rotate(&mut self.right, &mut self.hidden, turns.xw);
        rotate(&mut self.heading, &mut self.hidden, turns.zw);
        self.pitch += turns.pitch.to_radians();
        self.orthonormalize();
    }

    /// [`Self::turn`] for a camera that is steered: the pitch stays between straight down and straight up.
    pub fn steer(&mut self, turns: &Turns) {
        self.turn(turns);
        self.pitch = self.pitch.clamp(-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2);
    }

    /// Moves the camera along its axes. At the end of space it stands still.
    pub fn advance(&mut self, steps: &Steps) {
        let by = self.right * steps.right
            + self.up() * steps.up
            + self.forward() * steps.forward
            + self.hidden * steps.hidden;
        let raw = self.position.raw();
        let (low, high) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
        self.position = Point4::from_raw(std::array::from_fn(|a| {
            // A conversion from f64 saturates, and one of no number is 0.
            let delta = (by[a] * RAW_PER_UNIT).round() as i64;
            raw[a].saturating_add(delta).clamp(low[a] + 1, high[a] - 1)
        }));
    }

    /// Turns the view so that its hidden axis is the nearest axis of the world: X, Z or W, in either direction. Of two that are as
    /// near, W is taken before X, and X before Z.
    pub fn pull_to_3d(&mut self) {
        let mut nearest = DVec4::W;
        for axis in [DVec4::W, DVec4::X, DVec4::Z] {
            // A rounding error is no reason to prefer an axis.
            if self.hidden.dot(axis).abs() > self.hidden.dot(nearest).abs() + 1e-9 {
                nearest = axis;
            }
        }
        let target = nearest * self.hidden.dot(nearest).signum();
        let turned = smallest_rotation(self.hidden, target);
        (self.right, self.heading, self.hidden) = (turned(self.right), turned(self.heading), target);
        self.orthonormalize();
    }

    /// Turned as model scenes are framed: a little down and from the right, by (0.45, 0.35, 1).
    pub const DEFAULT_TURNS: Turns =
        Turns { yaw: 24.227_745_317_954_17, xw: 0.0, zw: 0.0, pitch: -17.701_654_477_890_11 };

    /// Sees the box of a world whole, from w = 0.5. `tan_half_fov` is that of the vertical field of view, `aspect` the image's width over
    /// its height.
    ///
    /// The eight corners that the box has in x, y and z lie within the frame, with a margin of 5 %, as far as the camera can go
    /// back without leaving w = 0.5; one that looks along W alone stands in the middle of the box.
    pub fn framing(bounds: &Aabb4, turns: &Turns, tan_half_fov: f64, aspect: f64) -> Self {
        const W: i64 = 1 << 15;
        let (min, max) = (bounds.min_raw(), bounds.max_raw());
        // Corners lie within 2^61 of the origin: the sum does not overflow.
        let mut middle: [i64; 4] = std::array::from_fn(|a| (min[a] + max[a]) >> 1);
        middle[3] = W;
        let mut camera = Self::new(Point4::from_raw(middle), turns);
        let (right, up, forward) = (camera.right(), camera.up(), camera.forward());
        let mut back = -forward;
        back.w = 0.0;
        let Some(back) = back.try_normalize() else { return camera };
        let half: [f64; 3] = std::array::from_fn(|a| (max[a] as f64 - min[a] as f64) * 0.5 / RAW_PER_UNIT);
        let mut distance = 0.0_f64;
        for corner in 0..8 {
            let sign = |a: usize| if corner >> a & 1 == 0 { -half[a] } else { half[a] };
            let p = DVec4::new(sign(0), sign(1), sign(2), 0.0);
            for (side, tan) in [(right, tan_half_fov * aspect), (up, tan_half_fov)] {
                // A camera that went back by d sees the corner at side (p - d back), at depth forward (p - d back): within the frame
                // where +-side (p - d back) <= tan / 1.05 forward (p - d back), which is linear in d.
                let edge = forward * (tan / 1.05);
                for side in [side, -side] {
                    let (gain, lack) = ((side - edge).dot(back), (side - edge).dot(p));
                    if gain > 1e-6 {
                        distance = distance.max(lack / gain);
                    }
                }
            }
        }
        let raw = camera.position.raw();
        let (low, high) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
        camera.position = Point4::from_raw(std::array::from_fn(|a| match a {
            3 => W,
            _ => {
                raw[a].saturating_add((back[a] * distance * RAW_PER_UNIT).round() as i64).clamp(low[a] + 1, high[a] - 1)
            }
        }));
        camera
    }

    /// The distance from the camera to the farthest corner of a box, in units, rounded up.
    pub fn reach(&self, bounds: &Aabb4) -> f64 {
        let (at, min, max) = (self.position.raw(), bounds.min_raw(), bounds.max_raw());
        let far = |a: usize| (at[a].abs_diff(min[a]).max(at[a].abs_diff(max[a])) as f64 / RAW_PER_UNIT).powi(2);
        (0..4).map(far).sum::<f64>().sqrt().ceil()
    }

    /// The layers of an image, at least one.
    pub fn layers(&self, mode: &Mode) -> Vec<Layer> {
        match *mode {
            Mode::Slice => vec![self.layer(0.0)],
            Mode::Integral { layers, hidden_zoom, .. } => {
                let angle = std::f64::consts::FRAC_PI_2 / hidden_zoom;
                let theta = |l: u32| (2.0 * (f64::from(l) + 0.5) / f64::from(layers) - 1.0) * angle / 2.0;
                (0..layers.max(1)).map(|l| self.layer(theta(l))).collect()
            }
            Mode::Thick { each_side, spacing } => {
                let n = i64::from(each_side);
                (-n..=n).map(|i| self.layer((i as f64 * spacing).to_radians())).collect()
            }
        }
    }

    /// The layer of right, up and `forward cos(theta) + hidden sin(theta)`.
    fn layer(&self, theta: f64) -> Layer {
        let (sin, cos) = theta.sin_cos();
        let forward = self.forward() * cos + self.hidden * sin;
        let axes = layer_axes(self.hidden * cos - self.forward() * sin);
        let within = |v: DVec4| axes.map(|axis| axis.dot(v) as f32);
        Layer {
            axes: axes.map(|axis| axis.as_vec4().to_array()),
            right: within(self.right),
            up: within(self.up()),
            forward: within(forward),
        }
    }

    /// What a frame shows of the world.
    pub fn view(&self, mode: &Mode, look: &Look) -> WorldView {
        WorldView {
            anchor: self.position.raw(),
            layers: self.layers(mode),
            combine: match *mode {
                Mode::Integral { mix, .. } => Combine::Integral { mix },
                Mode::Slice | Mode::Thick { .. } => Combine::Mean,
            },
            distance: look.distance,
            shade: look.shade,
            edges: look.edges,
            step_budget: STEP_BUDGET,
        }
    }

    /// The frame's camera for a view: at the anchor, with the vectors of the first layer. A pinhole that sees everything.
    pub fn camera(view: &WorldView, tan_half_fov_y: f32) -> Camera {
        let layer = &view.layers[0];
        Camera {
            position: [0.0; 3],
            right: layer.right,
            up: layer.up,
            forward: layer.forward,
            projection: Projection::Perspective { tan_half_fov_y },
            lens_radius: 0.0,
            focus_distance: 1.0,
            near: 0.0,
            far: f32::INFINITY,
        }
    }

    /// Removes the rounding errors of many turns.
    fn orthonormalize(&mut self) {
        let level = |v: DVec4| DVec4::new(v.x, 0.0, v.z, v.w);
        self.hidden = level(self.hidden).normalize_or(self.hidden);
        let heading = level(self.heading);
        self.heading = (heading - self.hidden * heading.dot(self.hidden)).normalize_or(self.heading);
        let right = level(self.right);
        let right = right - self.hidden * right.dot(self.hidden) - self.heading * right.dot(self.heading);
        self.right = right.normalize_or(self.right);
    }
}

/// Raw steps in a unit.
const RAW_PER_UNIT: f64 = 65_536.0;

/// Sine and cosine, exact at multiples of 90 degrees: a view that is turned by right angles has the axes of the world.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        rest => rest.to_radians().sin_cos(),
    }
}

/// X, Y and Z turned by the smallest rotation that takes W to `hidden`, a unit vector. The rotations that take W to -W are all as
/// small; the one that turns X with it is taken.
///
/// With `hidden = (n d, c)`, `d` a unit vector of three components, the rotation takes the axis e of W's complement to
/// `e - (1 - c) (e d) d - n (e d) W`.
fn layer_axes(hidden: DVec4) -> [DVec4; 3] {
    let d = DVec4::new(hidden.x, hidden.y, hidden.z, 0.0).try_normalize().unwrap_or(DVec4::X);
    [DVec4::X, DVec4::Y, DVec4::Z].map(|e| e - d * ((1.0 - hidden.w) * e.dot(d)) - DVec4::W * e.dot(hidden))
}

/// The smallest rotation that takes one unit vector to another, which is not opposite to it.
fn smallest_rotation(from: DVec4, to: DVec4) -> impl Fn(DVec4) -> DVec4 {
    let sum = from + to;
    move |v| v - sum * (sum.dot(v) / (1.0 + from.dot(to))) + to * (2.0 * from.dot(v))
}

/// A position whose coordinates are numbers of units, each rounded to the nearest that there is; `None` beyond the space of a world
/// and for what is no number.
pub fn position(units: [f64; 4]) -> Option<Point4> {
    let raw = units.map(|c| (c * RAW_PER_UNIT).round());
    let limit = Aabb4::SPACE.max_raw()[0] as f64;
    // Comparisons with what is no number are false.
    let inside = raw.iter().all(|c| c.abs() < limit);
    inside.then(|| Point4(raw.map(|c| Fixed::from_raw(c as i64))))
}

#[cfg(test)]
mod tests;
