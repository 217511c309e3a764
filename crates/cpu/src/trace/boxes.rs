//! The conservative ray-box test: Ize 2013, "Robust BVH Ray Traversal", with the slack of Woop, Benthin and Wald 2013.

use crate::accel::wide::{WIDTH, WideNode};

/// What the box tests need of a ray.
///
/// Near planes are tested from an origin that is moved back by the slack, far planes from one that is moved forth; far
/// parameters are enlarged by the rounding errors of their computation. Each parameter is a monotone function of its
/// plane, so a larger box never gets a smaller interval.
pub(super) struct BoxRay {
    near_origin: [f32; 3],
    far_origin: [f32; 3],
    near_inverse: [f32; 3],
    far_inverse: [f32; 3],
    /// Index of the near plane in [`WideNode::planes`], by axis; the far one is its sibling.
    near_plane: [usize; 3],
    t_min: f32,
}

/// `1 + 2 gamma(3)` (Ize 2013, section 3).
const FAR_SCALE: f32 = 1.0 + 4.0 * f32::EPSILON;

/// `max`, but `b` where one is not a number (which a plane through the origin of a parallel ray makes): what the
/// instruction `maxps` does.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// `min`, but `b` where one is not a number.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

impl BoxRay {
    /// Prepares a ray whose position is known up to `slack`, by axis.
    #[inline(always)]
    pub fn new(origin: [f32; 3], direction: [f32; 3], slack: [f32; 3], t_min: f32) -> Self {
        let inverse = direction.map(|d| 1.0 / d);
        let negative = direction.map(f32::is_sign_negative);
        let moved =
            |k: usize, back: bool| if back == negative[k] { origin[k] + slack[k] } else { origin[k] - slack[k] };
        Self {
            near_origin: std::array::from_fn(|k| moved(k, false)),
            far_origin: std::array::from_fn(|k| moved(k, true)),
            near_inverse: inverse,
            far_inverse: inverse.map(|i| i * FAR_SCALE),
            near_plane: std::array::from_fn(|k| 2 * k + usize::from(negative[k])),
            t_min,
        }
    }

    /// Parameters at which the ray enters and leaves the box of three points.
    #[inline(always)]
    pub fn interval(&self, corners: [&[f32; 3]; 3]) -> (f32, f32) {
        let mut enter = f32::NEG_INFINITY;
        let mut leave = f32::INFINITY;
        for k in 0..3 {
            let (a, b, c) = (corners[0][k], corners[1][k], corners[2][k]);
            let (lower, upper) = (min(min(a, b), c), max(max(a, b), c));
            let (near, far) = if self.near_plane[k] & 1 == 0 { (lower, upper) } else { (upper, lower) };
            enter = max((near - self.near_origin[k]) * self.near_inverse[k], enter);
            leave = min((far - self.far_origin[k]) * self.far_inverse[k], leave);
        }
        (enter, leave)
    }
}

/// An instruction set for the test of eight boxes. All give the same bits.
pub(super) trait BoxTest: Copy {
    /// Tests the boxes of a node: bit i is set when the ray meets slot i at a parameter in `t_min..=t_max`; the
    /// parameters at which it enters, `t_min` or more, go to `enter`.
    fn test(self, ray: &BoxRay, node: &WideNode, t_max: f32, enter: &mut Lanes) -> u32;
}

/// A value for each child.
#[repr(C, align(32))]
pub(super) struct Lanes(pub [f32; WIDTH]);

/// Any machine.
#[derive(Clone, Copy)]
pub(super) struct Portable;

impl BoxTest for Portable {
    #[inline(always)]
    fn test(self, ray: &BoxRay, node: &WideNode, t_max: f32, enter: &mut Lanes) -> u32 {
        let enter = &mut enter.0;
        let mut leave = [t_max; WIDTH];
        *enter = [ray.t_min; WIDTH];
        for k in 0..3 {
            let near = &node.planes[ray.near_plane[k]];
            let far = &node.planes[ray.near_plane[k] ^ 1];
            for i in 0..WIDTH {
                enter[i] = max((near[i] - ray.near_origin[k]) * ray.near_inverse[k], enter[i]);
                leave[i] = min((far[i] - ray.far_origin[k]) * ray.far_inverse[k], leave[i]);
            }
        }
        let mut mask = 0;
        for i in 0..WIDTH {
            mask |= u32::from(enter[i] <= leave[i]) << i;
        }
        mask
    }
}

/// x86-64 machines with AVX2.
#[cfg(target_arch = "x86_64")]
pub(super) use avx2::Avx2;

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code, reason = "vector instructions, which the walk enters only where they exist")]
mod avx2 {
    use super::{BoxRay, BoxTest, Lanes};
    use crate::accel::wide::WideNode;
    use std::arch::x86_64::*;

    /// Proof that the machine has AVX2: [`Avx2::detect`] alone makes one.
    #[derive(Clone, Copy)]
    pub struct Avx2(());

    impl Avx2 {
        /// Looks whether the machine has AVX2 (the answer is cached by the standard library).
        #[inline]
        pub fn detect() -> Option<Self> {
            std::arch::is_x86_feature_detected!("avx2").then_some(Self(()))
        }
    }

    impl BoxTest for Avx2 {
        #[inline(always)]
        fn test(self, ray: &BoxRay, node: &WideNode, t_max: f32, enter: &mut Lanes) -> u32 {
            // SAFETY: `self` proves that the machine has AVX2. Plane indices are below 6 by the construction of `BoxRay`,
            // and a node's planes are aligned to 32 bytes, as are the lanes.
            unsafe {
                let planes = node.planes.as_ptr();
                let mut nearest = _mm256_set1_ps(ray.t_min);
                let mut leave = _mm256_set1_ps(t_max);
                for k in 0..3 {
                    let near = _mm256_load_ps(planes.add(ray.near_plane[k]).cast());
                    let far = _mm256_load_ps(planes.add(ray.near_plane[k] ^ 1).cast());
                    let near = _mm256_sub_ps(near, _mm256_set1_ps(ray.near_origin[k]));
                    let far = _mm256_sub_ps(far, _mm256_set1_ps(ray.far_origin[k]));
                    nearest = _mm256_max_ps(_mm256_mul_ps(near, _mm256_set1_ps(ray.near_inverse[k])), nearest);
                    leave = _mm256_min_ps(_mm256_mul_ps(far, _mm256_set1_ps(ray.far_inverse[k])), leave);
                }
                _mm256_store_ps(enter.0.as_mut_ptr(), nearest);
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(nearest, leave)) as u32
            }
        }
    }
}
