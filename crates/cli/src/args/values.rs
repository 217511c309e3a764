//! Values of options, parsed once and typed.

use orthant_render::world::view::position;
use orthant_resident::film::BLOCK;
use orthant_resident::frame::Tile;
use orthant_world::{Aabb4, Point4};
use std::str::FromStr;

/// A number of bytes: `1000`, `64KiB`, `1.5GiB`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ByteSize(pub u64);

impl FromStr for ByteSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
        let (number, unit) = text.split_at(split);
        let factor: u64 = match unit.to_ascii_lowercase().as_str() {
            "" | "b" => 1,
            "k" | "kib" => 1 << 10,
            "m" | "mib" => 1 << 20,
            "g" | "gib" => 1 << 30,
            "t" | "tib" => 1 << 40,
            _ => return Err(format!("unknown unit {unit:?}: use KiB, MiB, GiB or TiB")),
        };
        let number = number.trim();
        if let Ok(whole) = number.parse::<u64>() {
            return whole.checked_mul(factor).map(Self).ok_or_else(|| "more bytes than can be counted".into());
        }
        match number.parse::<f64>() {
            Ok(v) if v.is_finite() && v >= 0.0 && v * (factor as f64) < 1.8e19 => Ok(Self((v * factor as f64) as u64)),
            _ => Err("expected a number of bytes, such as 4GiB".into()),
        }
    }
}

/// The size of an image: `1280x720`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Most pixels along a side.
const MAX_SIDE: u32 = 1 << 16;

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected WIDTHxHEIGHT in pixels, such as 1280x720".to_owned();
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
        let side = |s: &str| s.parse::<u32>().map_err(|_| expected());
        let size = Self { width: side(width)?, height: side(height)? };
        if !(1..=MAX_SIDE).contains(&size.width) || !(1..=MAX_SIDE).contains(&size.height) {
            return Err(format!("a side is 1 to {MAX_SIDE} pixels"));
        }
        Ok(size)
    }
}

/// Three numbers: `1,2.5,-3`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vector(pub [f64; 3]);

impl FromStr for Vector {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text).map(Self).ok_or_else(|| "expected three finite numbers, such as 1,2.5,-3".into())
    }
}

/// A point of a world: `1,2.5,-3,0.5`. Coordinates that lie between two of the steps of 1/65,536 that a world has are rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldPoint(pub Point4);

impl FromStr for WorldPoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected four finite numbers, such as 1,2.5,-3,0.5";
        let units: [f64; 4] = numbers(text).ok_or(expected)?;
        let beyond = || "the point lies beyond the space of a world, which reaches to 2^45 units".to_owned();
        let mut point = position(units).ok_or_else(beyond)?;
        // What is written out exactly is taken exactly, however far it is.
        for (coordinate, text) in point.0.iter_mut().zip(text.split(',')) {
            if let Ok(exact) = text.trim().parse() {
                *coordinate = exact;
            }
        }
        if Aabb4::SPACE.contains_point(point) { Ok(Self(point)) } else { Err(beyond()) }
    }
}

/// Two angles in degrees: `30,45`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angles(pub [f64; 2]);

impl FromStr for Angles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        numbers(text).map(Self).ok_or_else(|| "expected two finite numbers, such as 30,45".into())
    }
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let list: Vec<f64> = text.split(',').map(|s| s.trim().parse().ok()).collect::<Option<_>>()?;
    let list: [f64; N] = list.try_into().ok()?;
    list.iter().all(|v| v.is_finite()).then_some(list)
}

/// A finite number.
///
/// # Errors
/// A message for the command line.
pub fn finite(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| "expected a finite number".into())
}

/// A finite number, as exact as it is written.
///
/// # Errors
/// A message for the command line.
pub fn finite_f64(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| "expected a finite number".into())
}

/// A finite number that is not negative.
///
/// # Errors
/// A message for the command line.
pub fn not_negative(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|v| *v >= 0.0).ok_or_else(|| "expected a finite number, 0 or more".into())
}

/// A finite number above 0.
///
/// # Errors
/// A message for the command line.
pub fn positive(text: &str) -> Result<f32, String> {
    finite(text).ok().filter(|v| *v > 0.0).ok_or_else(|| "expected a finite number above 0".into())
}

/// A rectangle of pixels: `X,Y,W,H`.
///
/// # Errors
/// A message for the command line.
pub fn tile(text: &str) -> Result<Tile, String> {
    let list: Vec<u32> = text.split(',').filter_map(|s| s.trim().parse().ok()).collect();
    match (list.as_slice(), text.split(',').count()) {
        (&[x, y, width, height], 4) if width > 0 && height > 0 => Ok(Tile { x, y, width, height }),
        _ => Err("expected X,Y,WIDTH,HEIGHT in pixels, such as 0,0,640,720".into()),
    }
}

/// Samples `start..end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleRange {
    /// The first sample, a multiple of [`BLOCK`].
    pub start: u32,
    /// One past the last.
    pub end: u32,
}

impl FromStr for SampleRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once("..").and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        match parsed {
            Some((start, end)) if start >= end => Err("the range holds no sample: the end is excluded".into()),
            Some((start, _)) if start % BLOCK != 0 => Err(format!("a range begins at a multiple of {BLOCK}")),
            Some((start, end)) => Ok(Self { start, end }),
            None => Err("expected FIRST..END with the end excluded, such as 0..64".into()),
        }
    }
}

/// A metric and the most that it may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Threshold {
    /// The metric, one of [`crate::metrics::METRICS`].
    pub metric: String,
    /// The most that it may be.
    pub value: f64,
}

impl FromStr for Threshold {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let metrics = crate::metrics::METRICS;
        let (metric, value) = text.split_once('=').ok_or("expected METRIC=VALUE, such as flip=0.02")?;
        if !metrics.contains(&metric) {
            return Err(format!("unknown metric {metric:?}: it is one of {}", metrics.join(", ")));
        }
        let value = value.parse().ok().filter(|v: &f64| !v.is_nan()).ok_or("expected a number after the =")?;
        Ok(Self { metric: metric.to_owned(), value })
    }
}

/// `--device`: a number or a name, and no empty text, which is a part of every name.
///
/// # Errors
/// What is wrong with it.
pub fn device(text: &str) -> Result<String, String> {
    let text = text.trim();
    if text.is_empty() {
        return Err("expected a number or a name that `orthant devices` lists".into());
    }
    Ok(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_with_binary_suffixes() {
        let read = |s: &str| s.parse::<ByteSize>().map(|b| b.0);
        assert_eq!(read("1000"), Ok(1000));
        assert_eq!(read("64KiB"), Ok(65_536));
        assert_eq!(read("1.5gib"), Ok(3 << 29));
        assert_eq!(read("2M"), Ok(2 << 20));
        for bad in ["", "GiB", "-1", "3XB", "nan", "99999999999TiB"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_tiles_ranges_and_vectors_are_strict() {
        assert_eq!("3x4".parse(), Ok(Size { width: 3, height: 4 }));
        for bad in ["3", "3x", "0x4", "3x4x5", "70000x1", "-3x4"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
        assert_eq!(tile("1,2,3,4"), Ok(Tile { x: 1, y: 2, width: 3, height: 4 }));
        for bad in ["1,2,3", "1,2,3,0", "1,2,3,4,5", "1,b,3,4", "1,2,3,4,x"] {
            assert!(tile(bad).is_err(), "{bad}");
        }
        assert_eq!("16..40".parse(), Ok(SampleRange { start: 16, end: 40 }));
        for bad in ["8..16", "16..16", "32..16", "16", "a..b"] {
            assert!(bad.parse::<SampleRange>().is_err(), "{bad}");
        }
        assert_eq!("1, -2.5,3e1".parse(), Ok(Vector([1.0, -2.5, 30.0])));
        for bad in ["1,2", "1,2,inf", "1,2,3,4", ""] {
            assert!(bad.parse::<Vector>().is_err(), "{bad}");
        }
    }

    #[test]
    fn points_of_a_world_are_exact_where_they_can_be_and_rounded_where_not() {
        let raw = |s: &str| s.parse::<WorldPoint>().map(|p| p.0.raw());
        assert_eq!(raw("1, -2.5,0.1,0"), Ok([65_536, -163_840, 6554, 0]));
        assert_eq!(raw("35184372088831.0000152587890625,0,0,0").map(|r| r[0]), Ok((35_184_372_088_831 << 16) + 1));
        for bad in
            ["1,2,3", "1,2,3,4,5", "1,2,3,nan", "1,2,3,inf", "1e300,0,0,0", "35184372088832,0,0,0", "a,b,c,d", ""]
        {
            assert!(raw(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_threshold_names_a_metric() {
        assert_eq!("flip=0.5".parse(), Ok(Threshold { metric: "flip".into(), value: 0.5 }));
        for bad in ["flip", "psnr=3", "rmse=x", "rmse=nan"] {
            assert!(bad.parse::<Threshold>().is_err(), "{bad}");
        }
    }
}
