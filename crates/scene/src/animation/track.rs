//! Key frames and what lies between them: glTF 2.0, appendix C ("Animation Sampler Interpolation Modes").

use super::AnimationError;
use crate::Scene;
use crate::accessor;
use crate::model::{AccessorId, Animation, AnimationId, Interpolation, Store};
use std::collections::HashMap;
use std::sync::Arc;

/// Accessors of key frames, decoded once each: all channels of a figure share their times. An accessor never changes under
/// its id, so what is here stays true through edits.
#[derive(Clone, Debug, Default)]
pub struct KeyFrames {
    floats: HashMap<AccessorId, Arc<[f32]>>,
    bytes: u64,
}

impl KeyFrames {
    /// All components of an accessor, one behind the other. At most `max_bytes` are taken by all together.
    fn floats(&mut self, scene: &Scene, id: AccessorId, max_bytes: u64) -> Result<Arc<[f32]>, String> {
        if let Some(floats) = self.floats.get(&id) {
            return Ok(floats.clone());
        }
        let accessor = scene.accessors().get(id).ok_or("its accessor is not in the document any more")?;
        let components = accessor.element_type.components();
        let bytes = (accessor.count as u64).saturating_mul(4 * components as u64);
        let sum = self.bytes.saturating_add(bytes);
        if sum > max_bytes {
            return Err(format!("the key frames take {sum} bytes, over the limit of {max_bytes}"));
        }
        fn read<const N: usize>(scene: &Scene, id: AccessorId) -> Result<Arc<[f32]>, String> {
            let values = accessor::read_f32::<N>(scene, id).map_err(|e| e.to_string())?;
            Ok(values.into_flattened().into())
        }
        let floats = match components {
            1 => read::<1>(scene, id),
            2 => read::<2>(scene, id),
            3 => read::<3>(scene, id),
            4 => read::<4>(scene, id),
            _ => Err("its elements are matrices, which nothing that can be animated is".to_owned()),
        }?;
        self.bytes = sum;
        self.floats.insert(id, floats.clone());
        Ok(floats)
    }

    /// Forgets what only `self` holds.
    pub fn trim(&mut self) {
        self.floats.retain(|_, floats| Arc::strong_count(floats) > 1);
        self.bytes = self.floats.values().map(|floats| size_of_val(&**floats) as u64).sum();
    }
}

/// How values are taken between two keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// Component by component.
    Numbers,
    /// As rotations: spherically, and of length one.
    Rotation,
}

/// A sampler, decoded and checked.
#[derive(Clone, Debug)]
pub struct Track {
    /// Seconds, strictly rising; at least one.
    times: Arc<[f32]>,
    /// `width` numbers a key; for a cubic spline three times as many: in-tangent, value, out-tangent.
    values: Arc<[f32]>,
    width: usize,
    interpolation: Interpolation,
}

impl Track {
    /// Decodes a sampler. The error names it.
    pub fn read(
        scene: &Scene,
        id: AnimationId,
        animation: &Animation,
        sampler: usize,
        frames: &mut KeyFrames,
        max_bytes: u64,
    ) -> Result<Self, AnimationError> {
        let place = |member: &str| format!("/animations/{}/samplers/{sampler}/{member}", Store::<_, ()>::slot(id));
        let source = &animation.samplers[sampler];
        let unreadable = |member: &str, what: String| {
            AnimationError::new(place(member), what, "export the animation anew, or raise --max-memory")
        };
        let times = frames.floats(scene, source.input, max_bytes).map_err(|what| unreadable("input", what))?;
        let values = frames.floats(scene, source.output, max_bytes).map_err(|what| unreadable("output", what))?;
        if scene.accessors()[source.input].element_type.components() != 1 {
            let what = "its times are not scalars";
            return Err(AnimationError::new(place("input"), what, "give each key one time in seconds"));
        }
        if times.is_empty() {
            return Err(AnimationError::new(place("input"), "it has no keys", "give it one, or remove the channel"));
        }
        let bad = (0..times.len()).find(|&i| !times[i].is_finite() || i > 0 && times[i] <= times[i - 1]);
        if let Some(i) = bad {
            let what = match i {
                0 => format!("its first time is {}", times[0]),
                _ => format!("time {i} is {}, and the one before it {}", times[i], times[i - 1]),
            };
            return Err(AnimationError::new(
                place("input"),
                what,
                "times must be finite and rise strictly: sort the keys",
            ));
        }
        let per_key = if source.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let parts = times.len() * per_key;
        if values.is_empty() || values.len() % parts != 0 {
            let elements = scene.accessors()[source.output].count;
            let what = format!("it has {elements} values for {} keys, which needs a multiple of {parts}", times.len());
            return Err(AnimationError::new(place("output"), what, "export the animation anew"));
        }
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let width = values.len() / parts;
            let what = format!("a value of key {} is {}", i / (width * per_key), values[i]);
            return Err(AnimationError::new(place("output"), what, "values must be finite: correct the key"));
        }
        let width = values.len() / parts;
        Ok(Self { times, values, width, interpolation: source.interpolation })
    }

    /// Numbers that a key holds.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Whether values jump from key to key.
    pub fn is_stepped(&self) -> bool {
        self.interpolation == Interpolation::Step
    }

    /// The last time, in seconds.
    pub fn end(&self) -> f64 {
        self.times.last().map_or(0.0, |&t| f64::from(t))
    }

    /// Number `c` of key `key`; `part` is 0, 1 or 2 for the in-tangent, value and out-tangent of a cubic spline.
    fn at(&self, key: usize, part: usize, c: usize) -> f64 {
        let parts = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        f64::from(self.values[(key * parts + part) * self.width + c])
    }

    fn value(&self, key: usize, c: usize) -> f64 {
        self.at(key, usize::from(self.interpolation == Interpolation::CubicSpline), c)
    }

    /// The value at a time, as many numbers as `out` has room for ([`Track::width`] at most). Before the first key and after
    /// the last it is theirs.
    pub fn sample(&self, seconds: f64, blend: Blend, out: &mut [f64]) {
        let after = self.times.partition_point(|&time| f64::from(time) <= seconds);
        let key = after.saturating_sub(1);
        if after == 0 || after == self.times.len() || self.interpolation == Interpolation::Step {
            (0..out.len()).for_each(|c| out[c] = self.value(key, c));
        } else {
            let (from, to) = (f64::from(self.times[key]), f64::from(self.times[after]));
            let step = to - from;
            let t = (seconds - from) / step;
            match (self.interpolation, blend) {
                (Interpolation::CubicSpline, _) => self.spline(key, t, step, out),
                (_, Blend::Rotation) if out.len() == 4 => {
                    let quaternion = |key| std::array::from_fn(|c| self.value(key, c));
                    out.copy_from_slice(&slerp(normalized(quaternion(key)), normalized(quaternion(after)), t));
                }
                _ => (0..out.len()).for_each(|c| {
                    let (a, b) = (self.value(key, c), self.value(after, c));
                    out[c] = (1.0 - t) * a + t * b;
                }),
            }
        }
        if blend == Blend::Rotation
            && let Ok(quaternion) = <&mut [f64; 4]>::try_from(out)
        {
            *quaternion = normalized(*quaternion);
        }
    }

    /// Appendix C.5: a Hermite spline whose tangents are scaled by the time between the keys.
    fn spline(&self, key: usize, t: f64, step: f64, out: &mut [f64]) {
        let (t2, t3) = (t * t, t * t * t);
        for (c, out) in out.iter_mut().enumerate() {
            let (v0, b0) = (self.at(key, 1, c), self.at(key, 2, c));
            let (a1, v1) = (self.at(key + 1, 0, c), self.at(key + 1, 1, c));
            *out = (2.0 * t3 - 3.0 * t2 + 1.0) * v0
                + step * (t3 - 2.0 * t2 + t) * b0
                + (-2.0 * t3 + 3.0 * t2) * v1
                + step * (t3 - t2) * a1;
        }
    }
}

/// A quaternion of length one; one of length zero is no rotation.
fn normalized(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() { q.map(|c| c / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

/// Appendix C.4: spherical linear interpolation of unit quaternions, the short way round.
fn slerp(a: [f64; 4], b: [f64; 4], t: f64) -> [f64; 4] {
    let dot: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    let angle = dot.abs().min(1.0).acos();
    // For small angles the sines cancel: there the chord is as good as the arc.
    let (wa, wb) = if angle < 1e-6 {
        (1.0 - t, t)
    } else {
        (((1.0 - t) * angle).sin() / angle.sin(), (t * angle).sin() / angle.sin())
    };
    std::array::from_fn(|c| wa * a[c] + sign * wb * b[c])
}
