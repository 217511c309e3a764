//! Importance sampling of pixel filters.

use super::warp::sample_tent;
use crate::frame::PixelFilter;
use glam::Vec2;

/// The integral of the Blackman-Harris window `0.35875 + 0.48829 cos(pi t) + 0.14128 cos(2 pi t) + 0.01168 cos(3 pi t)`
/// over -t..t, divided by that over -1..1, at t = i / 32.
pub const BLACKMAN_HARRIS: [f32; 33] = [
    0.0,
    0.0869461513,
    0.172927073,
    0.257006969,
    0.33830754,
    0.416033378,
    0.489493577,
    0.558118632,
    0.621472005,
    0.679256032,
    0.731312139,
    0.777615677,
    0.818265922,
    0.853472039,
    0.883535966,
    0.908833264,
    0.929793025,
    0.946877872,
    0.960564989,
    0.971328975,
    0.979627114,
    0.985887466,
    0.990499956,
    0.993810474,
    0.996117801,
    0.997673073,
    0.998681394,
    0.999305167,
    0.999668732,
    0.999863905,
    0.999956096,
    0.999990759,
    1.0,
];

/// The offset from the pixel's centre, in pixels, that `u` selects.
#[inline]
pub fn sample_pixel_filter(filter: PixelFilter, u: Vec2) -> Vec2 {
    match filter {
        PixelFilter::Box => u - 0.5,
        PixelFilter::Tent { radius } => Vec2::new(sample_tent(u.x), sample_tent(u.y)) * radius,
        PixelFilter::BlackmanHarris { radius } => {
            Vec2::new(sample_blackman_harris(u.x), sample_blackman_harris(u.y)) * radius
        }
    }
}

/// An offset in -1..=1 with the density of a Blackman-Harris window, constant over cells of 1/32.
#[inline]
pub fn sample_blackman_harris(u: f32) -> f32 {
    let v = 2.0 * u - 1.0;
    let target = v.abs();
    // The last cell whose cumulative value does not exceed the target: five steps of bisection.
    let mut cell = 0;
    let mut step = 16;
    while step > 0 {
        if BLACKMAN_HARRIS[cell + step] <= target {
            cell += step;
        }
        step /= 2;
    }
    let (lo, hi) = (BLACKMAN_HARRIS[cell], BLACKMAN_HARRIS[cell + 1]);
    let t = ((cell as f32 + ((target - lo) / (hi - lo)).min(1.0)) / 32.0).min(1.0);
    if v < 0.0 { -t } else { t }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn cumulative(t: f64) -> f64 {
        (0.35875 * t
            + 0.48829 * (PI * t).sin() / PI
            + 0.14128 * (2.0 * PI * t).sin() / (2.0 * PI)
            + 0.01168 * (3.0 * PI * t).sin() / (3.0 * PI))
            / 0.35875
    }

    #[test]
    fn the_table_is_the_integral_of_the_window() {
        for (i, &v) in BLACKMAN_HARRIS.iter().enumerate() {
            assert!((v as f64 - cumulative(i as f64 / 32.0)).abs() < 1e-7, "{i}");
        }
    }

    #[test]
    fn samples_follow_the_window() {
        for i in 0..10_000 {
            let u = (i as f32 + 0.5) / 10_000.0;
            let t = sample_blackman_harris(u);
            assert!((0.5 + 0.5 * cumulative(t as f64) - u as f64).abs() < 1e-3, "{u}");
        }
        assert!(sample_blackman_harris(0.0) >= -1.0 && sample_blackman_harris(0.999_999_94) <= 1.0);
    }

    #[test]
    fn filters_are_centred_and_stay_within_their_radius() {
        for filter in [PixelFilter::Box, PixelFilter::Tent { radius: 1.0 }, PixelFilter::BlackmanHarris { radius: 1.5 }]
        {
            let mut sum = Vec2::ZERO;
            for i in 0..64 {
                for j in 0..64 {
                    let o = sample_pixel_filter(filter, Vec2::new(i as f32 + 0.5, j as f32 + 0.5) / 64.0);
                    assert!(o.abs().max_element() <= 1.5);
                    sum += o;
                }
            }
            assert!((sum / 4096.0).length() < 1e-3, "{filter:?}");
        }
    }
}
