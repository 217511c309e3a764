//! Procedural textures, as RGBA texels.

use super::random::{Random, fractal_noise};

/// Calls `texel` with coordinates in 0..1 at the texel centres, rows from the top.
pub fn paint(width: u32, height: u32, texel: impl Fn(f32, f32) -> [u8; 4]) -> Vec<[u8; 4]> {
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| texel((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32))
        .collect()
}

/// A byte for a value in 0..=1.
pub fn byte(v: f32) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// An opaque grey or colour from encoded values in 0..=1.
pub fn opaque(rgb: [f32; 3]) -> [u8; 4] {
    [byte(rgb[0]), byte(rgb[1]), byte(rgb[2]), 255]
}

/// A mix of two colours.
pub fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t)
}

/// Noise that tiles: four shifted copies of [`fractal_noise`], blended towards the edges.
pub fn tiling_noise(seed: u64, u: f32, v: f32, cells: f32) -> f32 {
    let n = |du: f32, dv: f32| fractal_noise(seed, (u - du) * cells, (v - dv) * cells);
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    mix(mix(n(0.0, 0.0), n(1.0, 0.0), u), mix(n(0.0, 1.0), n(1.0, 1.0), u), v)
}

/// A tangent-space normal map (OpenGL convention: green is up) of a tiling height field.
pub fn normal_map(size: u32, strength: f32, height: impl Fn(f32, f32) -> f32) -> Vec<[u8; 4]> {
    let d = 0.5 / size as f32;
    paint(size, size, |u, v| {
        let slope_u = (height((u + d).rem_euclid(1.0), v) - height((u - d).rem_euclid(1.0), v)) * strength;
        // v grows downwards, the normal's y upwards.
        let slope_v = (height(u, (v - d).rem_euclid(1.0)) - height(u, (v + d).rem_euclid(1.0))) * strength;
        let n = glam::Vec3::new(-slope_u, -slope_v, 1.0).normalize() * 0.5 + 0.5;
        opaque(n.to_array())
    })
}

/// A spray of leaves with alpha: each leaf is a pointed ellipse with a midrib.
pub fn leaves(size: u32, seed: u64, count: usize, leaf: [f32; 2], dark: [f32; 3], light: [f32; 3]) -> Vec<[u8; 4]> {
    let mut random = Random::new(seed);
    // Transparent texels carry leaf green too: filtering must not bleed black into the edges.
    let background = mix(dark, light, 0.5);
    let mut texels = vec![[byte(background[0]), byte(background[1]), byte(background[2]), 0]; (size * size) as usize];
    for _ in 0..count {
        let (cx, cy) = (random.range(0.16, 0.84), random.range(0.16, 0.84));
        let (sin, cos) = random.range(0.0, std::f32::consts::TAU).sin_cos();
        let shade = random.unit();
        let [length, width] = leaf.map(|l| l * random.range(0.8, 1.2));
        for (i, texel) in texels.iter_mut().enumerate() {
            let u = (i as u32 % size) as f32 / size as f32 - cx;
            let v = (i as u32 / size) as f32 / size as f32 - cy;
            let (along, across) = ((u * cos + v * sin) / length, (v * cos - u * sin) / width);
            let outline = (1.0 - along * along).max(0.0) * (1.0 - 0.35 * along);
            if along.abs() < 1.0 && across.abs() < outline {
                let rib = if across.abs() < 0.08 { 0.25 } else { 0.0 };
                let colour = mix(dark, light, (shade + rib + 0.2 * (1.0 - across.abs())).min(1.0));
                *texel = opaque(colour);
            }
        }
    }
    texels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiling_noise_tiles() {
        for i in 0..20 {
            let t = i as f32 / 20.0;
            assert!((tiling_noise(3, 0.0, t, 4.0) - tiling_noise(3, 1.0, t, 4.0)).abs() < 1e-5);
            assert!((tiling_noise(3, t, 0.0, 4.0) - tiling_noise(3, t, 1.0, 4.0)).abs() < 1e-5);
        }
    }

    #[test]
    fn a_flat_height_field_has_the_neutral_normal() {
        assert!(normal_map(4, 1.0, |_, _| 0.3).iter().all(|t| *t == [128, 128, 255, 255]));
    }

    #[test]
    fn leaves_cover_a_part_of_the_card_and_keep_off_its_edges() {
        let texels = leaves(64, 1, 30, [0.12, 0.05], [0.1, 0.3, 0.1], [0.4, 0.6, 0.2]);
        let covered = texels.iter().filter(|t| t[3] == 255).count();
        assert!((600..3600).contains(&covered), "{covered}");
        assert!(texels[..64].iter().all(|t| t[3] == 0));
    }
}
