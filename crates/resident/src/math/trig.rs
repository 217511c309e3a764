//! Sine, cosine and arc tangent in turns (1 turn = 2 pi).
//!
//! Turns suit what a renderer asks: random numbers and texture coordinates are turns already, and the reduction to a
//! quadrant is exact. The coefficients are Chebyshev fits.

use std::f32::consts::FRAC_PI_2;

/// Sine and cosine of `2 pi turns`; the absolute error is below 1.5e-7 for |turns| <= 1, and grows with the rounding of
/// the argument beyond.
#[inline]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    let quarters = turns * 4.0;
    let nearest = (quarters + 0.5).floor();
    let r = quarters - nearest;
    let r2 = r * r;
    let s =
        r * (FRAC_PI_2 + r2 * (-0.645_964_1 + r2 * (0.079_692_583 + r2 * (-0.004_681_266_3 + r2 * 0.000_158_206_3))));
    let c = 1.0 + r2 * (-1.233_700_5 + r2 * (0.253_669_2 + r2 * (-0.020_860_07 + r2 * 0.000_903_628_07)));
    match nearest as i32 & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// The angle of the point (x, y) in turns, -0.5..=0.5, counter-clockwise from +x; 0 for the origin. The absolute error
/// is below 4e-8 turns.
#[inline]
pub fn atan2_turns(y: f32, x: f32) -> f32 {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = if ax < ay { (ax, ay) } else { (ay, ax) };
    let t = if large > 0.0 { small / large } else { 0.0 };
    let t2 = t * t;
    let p = 0.159_154_94
        + t2 * (-0.053_051_557
            + t2 * (0.031_827_926
                + t2 * (-0.022_695_52
                    + t2 * (0.017_399_362
                        + t2 * (-0.013_289
                            + t2 * (0.009_086_085
                                + t2 * (-0.004_830_649_3 + t2 * (0.001_669_161_2 - t2 * 0.000_270_749_62))))))));
    let mut a = t * p;
    if ax < ay {
        a = 0.25 - a;
    }
    if x < 0.0 {
        a = 0.5 - a;
    }
    if y < 0.0 { -a } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sine_and_cosine_are_within_their_error() {
        let mut worst = 0.0f64;
        for i in -200_000..=200_000 {
            let turns = i as f32 / 200_000.0;
            let (s, c) = sin_cos_turns(turns);
            let (s64, c64) = (turns as f64 * TAU).sin_cos();
            worst = worst.max((s as f64 - s64).abs()).max((c as f64 - c64).abs());
        }
        assert!(worst < 1.5e-7, "{worst}");
        assert_eq!(sin_cos_turns(0.0), (0.0, 1.0));
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
    }

    #[test]
    fn arc_tangent_is_within_its_error() {
        let mut worst = 0.0f64;
        for i in 0..400_000 {
            let (y, x) = (i as f64 / 400_000.0 * TAU).sin_cos();
            let (y, x) = (y as f32 * 3.0, x as f32 * 3.0);
            let reference = (y as f64).atan2(x as f64) / TAU;
            worst = worst.max((atan2_turns(y, x) as f64 - reference).abs());
        }
        assert!(worst < 4e-8, "{worst}");
        assert_eq!(atan2_turns(0.0, 0.0), 0.0);
        assert_eq!(atan2_turns(0.0, -1.0), 0.5);
        assert_eq!(atan2_turns(-2.0, 0.0), -0.25);
    }
}
