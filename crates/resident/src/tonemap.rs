//! Tone mapping: from linear Rec. 709 radiance to what an 8-bit sRGB image shows.
//!
//! Every operator takes and gives *linear* display values (1 is display white); the sRGB encoding is a step of its own
//! ([`srgb_encode`]). All are pure functions of one colour, so that every backend and the viewer show the same picture.

/// A tone mapping operator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToneMapper {
    /// Khronos PBR Neutral: base colours under a grey-world light come out as they are; highlights roll off.
    #[default]
    KhronosNeutral,
    /// The ACES reference rendering and output transforms for a Rec. 709 display, as Stephen Hill fitted them.
    Aces,
    /// Troy Sobotka's AgX, base look.
    Agx,
    /// Nothing but clipping to the display's range.
    None,
}

impl ToneMapper {
    /// Every operator with its name on the command line.
    pub const ALL: [(&'static str, Self); 4] =
        [("khronos-neutral", Self::KhronosNeutral), ("aces", Self::Aces), ("agx", Self::Agx), ("none", Self::None)];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::KhronosNeutral => "khronos-neutral",
            Self::Aces => "aces",
            Self::Agx => "agx",
            Self::None => "none",
        }
    }

    /// Maps one colour. NaN becomes 0 and infinity white; the result is finite and within 0..=1.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        // A colour that overflows cannot be mapped by ratios of infinities: 1e6 is white to every operator.
        let rgb = rgb.map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, 1.0e6) });
        let mapped = match self {
            Self::KhronosNeutral => khronos_neutral(rgb),
            Self::Aces => aces_hill(rgb),
            Self::Agx => agx(rgb),
            Self::None => rgb,
        };
        mapped.map(|c| c.clamp(0.0, 1.0))
    }

    /// The picture of a pixel: exposure in stops, operator, sRGB encoding, rounding to 8 bits.
    pub fn display(self, rgb: [f32; 3], exposure: f32) -> [u8; 3] {
        let gain = exposure.exp2();
        self.apply(rgb.map(|c| c * gain)).map(|c| (srgb_encode(c) * 255.0 + 0.5) as u8)
    }
}

/// The sRGB transfer function of IEC 61966-2-1: linear 0..=1 to encoded 0..=1.
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of [`srgb_encode`].
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Khronos PBR Neutral tone mapper (Khronos Group, "PBR Neutral specification", 2024).
///
/// With `x = min(r, g, b)`: the Fresnel offset is `f = x - x^2 / (4 F90)` below `2 F90` and `F90` above it, `F90` = 0.04.
/// With `p = max(r, g, b) - f` and `Ks` = 0.8 - F90: colours with `p < Ks` are `c - f`; brighter ones are compressed to
/// `pn = 1 - (1 - Ks)^2 / (p + 1 - 2 Ks)` and mixed towards `pn` by `1 - 1 / (Kd (p - pn) + 1)`, `Kd` = 0.15.
fn khronos_neutral(rgb: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04;
    const KS: f32 = 0.8 - F90;
    const KD: f32 = 0.15;
    let x = rgb[0].min(rgb[1]).min(rgb[2]);
    let f = if x < 2.0 * F90 { x - x * x / (4.0 * F90) } else { F90 };
    let c = rgb.map(|v| v - f);
    let p = c[0].max(c[1]).max(c[2]);
    if p < KS {
        return c;
    }
    let pn = 1.0 - (1.0 - KS) * (1.0 - KS) / (p + 1.0 - 2.0 * KS);
    let g = 1.0 / (KD * (p - pn) + 1.0);
    c.map(|v| v * (pn / p) * g + pn * (1.0 - g))
}

/// ACES RRT and ODT (Rec. 709, 100 nits) in the fit by Stephen Hill: to a desaturated AP1-like space, the rational curve
/// `(v (v + 0.0245786) - 0.000090537) / (v (0.983729 v + 0.4329510) + 0.238081)` on each channel, and back.
fn aces_hill(rgb: [f32; 3]) -> [f32; 3] {
    const INPUT: [[f32; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: [[f32; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fit = |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951_0) + 0.238_081);
    multiply(&OUTPUT, multiply(&INPUT, rgb).map(fit))
}

/// AgX by Troy Sobotka, base look: inset of the primaries, log2 encoding over 16.5 stops (-12.47393 to 4.026069 EV), the
/// sigmoid as the sixth-order polynomial fit in common use, outset; its output is encoded by a power of 2.2, which is
/// undone here.
fn agx(rgb: [f32; 3]) -> [f32; 3] {
    const INSET: [[f32; 3]; 3] = [
        [0.842_479_06, 0.078_433_6, 0.079_223_745],
        [0.042_328_242, 0.878_468_64, 0.079_166_13],
        [0.042_375_655, 0.078_433_6, 0.879_142_97],
    ];
    const OUTSET: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_744],
        [-0.052_896_85, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let contrast = |v: f32| {
        let x = (v.max(1.0e-10).log2().clamp(MIN_EV, MAX_EV) - MIN_EV) / (MAX_EV - MIN_EV);
        let (x2, x4) = (x * x, x * x * x * x);
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.002_32
    };
    multiply(&OUTSET, multiply(&INSET, rgb).map(contrast)).map(|v| v.max(0.0).powf(2.2))
}

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn operators() -> impl Iterator<Item = ToneMapper> {
        ToneMapper::ALL.into_iter().map(|(_, t)| t)
    }

    #[test]
    fn srgb_round_trips_every_byte() {
        for byte in 0..=255u8 {
            let linear = srgb_decode(f32::from(byte) / 255.0);
            assert_eq!(ToneMapper::None.display([linear; 3], 0.0), [byte; 3]);
        }
        assert!((srgb_encode(0.5) - 0.735_357).abs() < 1e-5, "IEC 61966-2-1");
        assert!((srgb_decode(0.5) - 0.214_041).abs() < 1e-5, "IEC 61966-2-1");
    }

    #[test]
    fn black_stays_black_and_bright_goes_to_white() {
        for t in operators() {
            assert_eq!(t.display([0.0; 3], 0.0), [0; 3], "{}", t.name());
            assert!(t.display([f32::INFINITY; 3], 0.0).iter().all(|&c| c >= 250), "{}", t.name());
            assert_eq!(t.apply([f32::NAN, -1.0, 0.0]).map(|c| c < 0.01), [true; 3], "{}", t.name());
        }
    }

    #[test]
    fn greys_stay_grey_and_their_order_is_kept() {
        for t in operators() {
            let mut last = -1.0;
            for i in 0..2000 {
                let [r, g, b] = t.apply([(i as f32 * 0.01 - 12.0).exp2(); 3]);
                assert!((r - g).abs() < 2e-3 && (g - b).abs() < 2e-3, "{}: {r} {g} {b}", t.name());
                // The AgX polynomial wiggles by less than a thousandth at its foot.
                assert!(r >= last - 1e-3, "{}", t.name());
                last = r;
            }
        }
    }

    #[test]
    fn khronos_neutral_reproduces_base_colours_less_the_fresnel_offset() {
        // A base colour of 0.5 with 0.04 of Fresnel reflection under a unit environment comes out as 0.5.
        let [r, g, b] = ToneMapper::KhronosNeutral.apply([0.54, 0.34, 0.14]);
        assert!((r - 0.50).abs() < 1e-6 && (g - 0.30).abs() < 1e-6 && (b - 0.10).abs() < 1e-6);
        // Continuous where compression begins: p = Ks, that is 0.8 for a grey.
        let below = ToneMapper::KhronosNeutral.apply([0.799_99; 3])[0];
        let above = ToneMapper::KhronosNeutral.apply([0.800_01; 3])[0];
        assert!((below - above).abs() < 1e-4 && (above - 0.76).abs() < 1e-4);
    }

    #[test]
    fn middle_grey_lands_where_the_operators_are_known_to_put_it() {
        let aces = ToneMapper::Aces.apply([0.18; 3])[0];
        assert!((aces - 0.1055).abs() < 2e-3, "the rational fit at 0.18: {aces}");
        let agx = srgb_encode(ToneMapper::Agx.apply([0.18; 3])[0]);
        assert!(
            (agx - 0.5).abs() < 2e-3,
            "the pivot of the sigmoid is middle grey at half of the encoded range: {agx}"
        );
    }

    #[test]
    fn exposure_is_in_stops() {
        let a = ToneMapper::Agx.display([0.1, 0.2, 0.3], 1.0);
        assert_eq!(a, ToneMapper::Agx.display([0.2, 0.4, 0.6], 0.0));
    }
}
