//! FLIP: the error that a viewer sees when flipping between two images.
//!
//! * LDR: Andersson, Nilsson, Akenine-Moller, Oskarsson, Astrom, Fairchild, "FLIP: A Difference Evaluator for
//!   Alternating Images", HPG 2020.
//! * HDR: Andersson, Nilsson, Shirley, Akenine-Moller, "Visualizing Errors in Rendered High Dynamic Range Images",
//!   Eurographics 2021 (short).
//!
//! Viewing conditions are those of the papers: 0.7 m from a screen 0.7 m wide with 3840 pixels.

use rayon::prelude::*;

/// Pixels per degree of visual angle: 0.7 m * 3840 / 0.7 m * pi / 180.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Exponent of the colour difference (LDR paper, section 4.1.4).
const QC: f32 = 0.7;
/// Knee of the remapped colour difference, as a part of its largest value.
const PC: f32 = 0.4;
/// Error that the knee is mapped to.
const PT: f32 = 0.95;
/// Exponent of the feature difference (section 4.2.2).
const QF: f32 = 0.5;
/// Width of the features in degrees (section 4.2.1).
const FEATURE_WIDTH: f32 = 0.082;

/// LDR-FLIP per pixel, 0..=1, of two images in *linear* display values (they are clamped to 0..=1).
pub fn ldr_flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize, height: usize) -> Vec<f32> {
    let [a, b] = [reference, test].map(|image| Perceived::new(image, width, height));
    let largest = largest_colour_difference();
    (0..a.lab.len())
        .into_par_iter()
        .map(|i| {
            let colour = redistribute(hyab(a.lab[i], b.lab[i]).powf(QC), largest);
            let feature = (a.edges[i] - b.edges[i]).abs().max((a.points[i] - b.points[i]).abs());
            let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(QF);
            colour.powf(1.0 - feature)
        })
        .collect()
}

/// HDR-FLIP per pixel, 0..=1: the largest LDR-FLIP error over a range of exposures, which the reference decides, each
/// tone-mapped by the ACES curve of the paper. Values that are not finite or negative count as 0.
pub fn hdr_flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize, height: usize) -> Vec<f32> {
    let clean = |image: &[[f32; 3]]| -> Vec<[f32; 3]> {
        image.iter().map(|p| p.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 })).collect()
    };
    let (reference, test) = (clean(reference), clean(test));
    let mut errors = vec![0.0f32; reference.len()];
    for exposure in exposures(&reference) {
        let gain = exposure.exp2();
        let map =
            |image: &[[f32; 3]]| -> Vec<[f32; 3]> { image.iter().map(|p| p.map(|c| aces_curve(c * gain))).collect() };
        let at_exposure = ldr_flip(&map(&reference), &map(&test), width, height);
        for (error, e) in errors.iter_mut().zip(at_exposure) {
            *error = error.max(e);
        }
    }
    errors
}

/// Coefficients of the ACES curve of the HDR paper: `(k0 x^2 + k1 x + k2) / (k3 x^2 + k4 x + k5)`.
const ACES: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];

fn aces_curve(x: f32) -> f32 {
    // Far above white the quotient of two overflowing squares would be NaN; 1e6 is as white as it gets.
    let x = x.min(1.0e6);
    let [k0, k1, k2, k3, k4, k5] = ACES;
    (((k0 * x + k1) * x + k2) / ((k3 * x + k4) * x + k5)).clamp(0.0, 1.0)
}

/// The exposures, in stops: from the one that maps the brightest pixel to 0.85 of the display to the one that maps the
/// median there (HDR paper, section 3), about one stop apart. Where the median is black, the median of what is not
/// black is taken; a black image is looked at once, as it is.
fn exposures(reference: &[[f32; 3]]) -> Vec<f32> {
    const TARGET: f32 = 0.85;
    let mut luminances: Vec<f32> = reference.iter().map(|p| luminance(*p)).collect();
    luminances.sort_by(f32::total_cmp);
    let brightest = luminances.last().copied().unwrap_or(0.0);
    if brightest <= 0.0 {
        return vec![0.0];
    }
    let mut median = luminances[luminances.len() / 2];
    if median <= 0.0 {
        let lit = &luminances[luminances.partition_point(|&l| l <= 0.0)..];
        median = lit[lit.len() / 2];
    }
    let [k0, k1, k2, k3, k4, k5] = ACES;
    let (a, b, c) = (k0 - TARGET * k3, k1 - TARGET * k4, k2 - TARGET * k5);
    let x = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let (start, stop) = ((x / brightest).log2(), (x / median).log2());
    let count = ((stop - start).ceil().max(2.0) as usize).min(64);
    (0..count).map(|i| start + (stop - start) * i as f32 / (count - 1) as f32).collect()
}

fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b
}

/// What the visual system makes of an image.
struct Perceived {
    /// CIELAB after the contrast sensitivity filters, Hunt-adjusted.
    lab: Vec<[f32; 3]>,
    /// Strength of edges in the achromatic channel.
    edges: Vec<f32>,
    /// Strength of points and thin lines in the achromatic channel.
    points: Vec<f32>,
}

impl Perceived {
    fn new(linear: &[[f32; 3]], width: usize, height: usize) -> Self {
        let opponent: Vec<[f32; 3]> =
            linear.par_iter().map(|p| xyz_to_ycxcz(rgb_to_xyz(p.map(|c| c.clamp(0.0, 1.0))))).collect();
        let plane = |c: usize| -> Vec<f32> { opponent.iter().map(|p| p[c]).collect() };

        // Blur away what the eye cannot resolve, each opponent channel by its contrast sensitivity
        let blurred = [0, 1, 2].map(|c| contrast_sensitivity(&plane(c), width, height, &SENSITIVITY[c]));
        let lab = (0..linear.len())
            .into_par_iter()
            .map(|i| {
                let rgb = xyz_to_rgb(ycxcz_to_xyz([blurred[0][i], blurred[1][i], blurred[2][i]]));
                hunt(xyz_to_lab(rgb_to_xyz(rgb.map(|c| c.clamp(0.0, 1.0)))))
            })
            .collect();

        // Detect edges and points on the achromatic channel, normalised to 0..=1
        let achromatic: Vec<f32> = opponent.iter().map(|p| (p[0] + 16.0) / 116.0).collect();
        let FeatureKernels { smooth, edge, point } = feature_kernels();
        let strength = |kernel: &[f32]| -> Vec<f32> {
            let x = separable(&achromatic, width, height, kernel, &smooth);
            let y = separable(&achromatic, width, height, &smooth, kernel);
            x.iter().zip(y).map(|(x, y)| x.hypot(y)).collect()
        };
        Self { lab, edges: strength(&edge), points: strength(&point) }
    }
}

/// A contrast sensitivity function as the sum of two Gaussians, `a sqrt(pi / b) exp(-pi^2 x^2 / b)` with x in degrees
/// (LDR paper, table 1: achromatic, red-green, blue-yellow).
const SENSITIVITY: [[(f32, f32); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1.0e-5)], [(1.0, 0.0053), (0.0, 1.0e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// Filters a channel. The kernel is round, normalised to 1 and reaches three standard deviations of the widest Gaussian
/// of all channels; a sum of two Gaussians is filtered one by one, each of them being separable.
fn contrast_sensitivity(plane: &[f32], width: usize, height: usize, gaussians: &[(f32, f32); 2]) -> Vec<f32> {
    use std::f32::consts::PI;
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let kernels = gaussians.map(|(a, b)| {
        let kernel: Vec<f32> = (-radius..=radius)
            .map(|i| {
                let x = i as f32 / PIXELS_PER_DEGREE;
                (-PI * PI * x * x / b).exp()
            })
            .collect();
        (a * (PI / b).sqrt(), kernel)
    });
    let total: f32 = kernels.iter().map(|(weight, k)| weight * k.iter().sum::<f32>().powi(2)).sum();
    let mut out = vec![0.0f32; plane.len()];
    for (weight, kernel) in kernels.iter().filter(|(weight, _)| *weight > 0.0) {
        for (o, v) in out.iter_mut().zip(separable(plane, width, height, kernel, kernel)) {
            *o += v * (weight / total);
        }
    }
    out
}

/// One-dimensional factors of the feature detectors.
struct FeatureKernels {
    /// Gaussian, along the feature; sum 1.
    smooth: Vec<f32>,
    /// First derivative, across it; the negative and the positive part sum to -1 and 1.
    edge: Vec<f32>,
    /// Second derivative, likewise.
    point: Vec<f32>,
}

/// The Gaussian of the detectors and its derivatives (LDR paper, section 4.2.1).
fn feature_kernels() -> FeatureKernels {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let sampled = |f: &dyn Fn(f32) -> f32| -> Vec<f32> {
        (-radius..=radius)
            .map(|i| {
                let x = i as f32;
                f(x) * (-x * x / (2.0 * deviation * deviation)).exp()
            })
            .collect()
    };
    let balance = |kernel: Vec<f32>| -> Vec<f32> {
        let positive: f32 = kernel.iter().filter(|&&v| v > 0.0).sum();
        let negative: f32 = -kernel.iter().filter(|&&v| v < 0.0).sum::<f32>();
        kernel.into_iter().map(|v| if v > 0.0 { v / positive } else { v / negative }).collect()
    };
    let gaussian = sampled(&|_| 1.0);
    let sum: f32 = gaussian.iter().sum();
    FeatureKernels {
        smooth: gaussian.iter().map(|v| v / sum).collect(),
        edge: balance(sampled(&|x| -x)),
        point: balance(sampled(&|x| x * x / (deviation * deviation) - 1.0)),
    }
}

/// Convolves by the outer product of two kernels of odd length; the image's border goes on outside.
fn separable(plane: &[f32], width: usize, height: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let clamp = |at: usize, offset: usize, half: usize, end: usize| (at + offset).saturating_sub(half).min(end - 1);
    let mut rows = vec![0.0f32; plane.len()];
    rows.par_chunks_mut(width).zip(plane.par_chunks(width)).for_each(|(out, row)| {
        for (x, o) in out.iter_mut().enumerate() {
            *o = across.iter().enumerate().map(|(i, k)| k * row[clamp(x, i, across.len() / 2, width)]).sum();
        }
    });
    let mut columns = vec![0.0f32; plane.len()];
    columns.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
        for (i, k) in down.iter().enumerate() {
            let row = clamp(y, i, down.len() / 2, height) * width;
            for (o, v) in out.iter_mut().zip(&rows[row..row + width]) {
                *o += k * v;
            }
        }
    });
    columns
}

/// Remaps the colour difference so that the range up to the knee takes most of 0..=1 (section 4.1.4).
fn redistribute(difference: f32, largest: f32) -> f32 {
    let knee = PC * largest;
    if difference < knee { PT / knee * difference } else { PT + (difference - knee) / (largest - knee) * (1.0 - PT) }
}

/// The largest colour difference that can occur: between the green and the blue primary.
fn largest_colour_difference() -> f32 {
    let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| hunt(xyz_to_lab(rgb_to_xyz(c))));
    hyab(green, blue).powf(QC)
}

/// The HyAB distance: city-block between lightness and chroma, Euclidean in chroma.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// The Hunt effect: dark colours look less colourful.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

const RGB_TO_XYZ: [[f32; 3]; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_79],
    [0.212_639_01, 0.715_168_68, 0.072_192_32],
    [0.019_330_819, 0.119_194_78, 0.950_532_15],
];
const XYZ_TO_RGB: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_64, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];
/// XYZ of display white: the sums of the rows of `RGB_TO_XYZ`.
const WHITE: [f32; 3] = [0.950_455_93, 1.0, 1.089_057_7];

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn rgb_to_xyz(rgb: [f32; 3]) -> [f32; 3] {
    multiply(&RGB_TO_XYZ, rgb)
}

fn xyz_to_rgb(xyz: [f32; 3]) -> [f32; 3] {
    multiply(&XYZ_TO_RGB, xyz)
}

/// The linearised opponent space of the contrast sensitivity functions.
fn xyz_to_ycxcz(xyz: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = [xyz[0] / WHITE[0], xyz[1] / WHITE[1], xyz[2] / WHITE[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn ycxcz_to_xyz([luma, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (luma + 16.0) / 116.0;
    [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]]
}

fn xyz_to_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let f = |t: f32| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = [f(xyz[0] / WHITE[0]), f(xyz[1] / WHITE[1]), f(xyz[2] / WHITE[2])];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const W: usize = 48;
    const H: usize = 40;

    fn mean(map: &[f32]) -> f32 {
        map.iter().sum::<f32>() / map.len() as f32
    }

    fn flat(colour: [f32; 3]) -> Vec<[f32; 3]> {
        vec![colour; W * H]
    }

    fn checker(size: usize) -> Vec<[f32; 3]> {
        (0..W * H)
            .map(|i| if (i % W / size + i / W / size).is_multiple_of(2) { [0.8; 3] } else { [0.1, 0.2, 0.3] })
            .collect()
    }

    #[test]
    fn an_image_does_not_differ_from_itself() {
        assert_eq!(ldr_flip(&checker(4), &checker(4), W, H), vec![0.0; W * H]);
        assert_eq!(hdr_flip(&checker(4), &checker(4), W, H), vec![0.0; W * H]);
    }

    #[test]
    fn white_against_black_is_what_the_formula_gives_by_hand() {
        // HyAB(white, black) = 100. Green is L = 87.735, a = -86.183, b = 83.180 and blue L = 32.297, a = 79.188,
        // b = -107.860; Hunt-adjusted, they are 203.3 apart. 100^0.7 = 25.12, cmax = 203.3^0.7 = 41.27, knee
        // 0.4 * 41.27 = 16.51: 0.95 + (25.12 - 16.51) / (41.27 - 16.51) * 0.05 = 0.967.
        let cmax = hyab([87.735, -75.613, 72.978], [32.297, 25.575, -34.836]).powf(0.7);
        let expected = 0.95 + (100f32.powf(0.7) - 0.4 * cmax) / (0.6 * cmax) * 0.05;
        let map = ldr_flip(&flat([1.0; 3]), &flat([0.0; 3]), W, H);
        for error in map {
            assert!((error - expected).abs() < 1e-3, "{error} {expected}");
        }
        let green_blue = mean(&ldr_flip(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0]), W, H));
        assert!((green_blue - 1.0).abs() < 1e-4, "the largest error that there is: {green_blue}");
    }

    #[test]
    fn the_error_does_not_depend_on_the_order_of_two_ldr_images() {
        let (a, b) = (checker(4), flat([0.5, 0.4, 0.3]));
        let (ab, ba) = (mean(&ldr_flip(&a, &b, W, H)), mean(&ldr_flip(&b, &a, W, H)));
        assert!((ab - ba).abs() < 1e-6 && ab > 0.05, "{ab} {ba}");
    }

    #[test]
    fn more_blur_is_more_error() {
        let sharp = checker(8);
        let mut blurred = sharp.clone();
        let mut last = 0.0;
        for _ in 0..5 {
            let planes = [0, 1, 2].map(|c| {
                let plane: Vec<f32> = blurred.iter().map(|p| p[c]).collect();
                separable(&plane, W, H, &[0.25, 0.5, 0.25], &[0.25, 0.5, 0.25])
            });
            blurred = (0..W * H).map(|i| [planes[0][i], planes[1][i], planes[2][i]]).collect();
            let error = mean(&ldr_flip(&sharp, &blurred, W, H));
            assert!(error > last, "{error} {last}");
            last = error;
        }
    }

    #[test]
    fn detail_too_fine_to_see_counts_less_than_a_coarse_pattern_of_the_same_contrast() {
        let grey = flat([0.45; 3]);
        let fine = mean(&ldr_flip(&grey, &checker(1), W, H));
        let coarse = mean(&ldr_flip(&grey, &checker(8), W, H));
        assert!(fine < coarse, "{fine} {coarse}");
    }

    #[test]
    fn hdr_flip_sees_an_error_in_a_highlight_that_the_display_clips() {
        let mut reference = flat([0.2; 3]);
        let mut test = reference.clone();
        for y in 10..20 {
            for x in 10..20 {
                reference[y * W + x] = [40.0; 3];
                test[y * W + x] = [10.0; 3];
            }
        }
        assert_eq!(mean(&ldr_flip(&reference, &test, W, H)), 0.0, "both clip to white");
        assert!(hdr_flip(&reference, &test, W, H)[15 * W + 15] > 0.3);
    }

    #[test]
    fn kernels_are_balanced() {
        let k = feature_kernels();
        for kernel in [&k.edge, &k.point] {
            let positive: f32 = kernel.iter().filter(|v| **v > 0.0).sum();
            assert!((positive - 1.0).abs() < 1e-5 && kernel.iter().sum::<f32>().abs() < 1e-5);
        }
        assert!((k.smooth.iter().sum::<f32>() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn images_smaller_than_the_kernels_work() {
        for (w, h) in [(1, 1), (3, 1), (1, 5)] {
            let (a, b) = (vec![[0.5; 3]; w * h], vec![[0.2; 3]; w * h]);
            assert!(ldr_flip(&a, &b, w, h).iter().all(|e| e.is_finite() && *e > 0.0));
            assert!(hdr_flip(&a, &b, w, h).iter().all(|e| e.is_finite() && *e > 0.0));
            assert!(hdr_flip(&vec![[0.0; 3]; w * h], &b, w, h).iter().all(|e| e.is_finite()));
        }
    }
}
