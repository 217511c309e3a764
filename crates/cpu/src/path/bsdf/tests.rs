use super::*;
use orthant_resident::math::unit_float;
use orthant_resident::sampling::sobol::owen_sobol;

const ROUGHNESSES: [f32; 7] = [0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.0];
const COSINES: [f32; 5] = [0.02, 0.1, 0.4, 0.8, 1.0];

fn direction(cos: f32, turns: f32) -> Vec3 {
    let (s, c) = orthant_resident::math::sin_cos_turns(turns);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * c, sin * s, cos)
}

fn samples(n: u32) -> impl Iterator<Item = (Vec2, f32)> {
    (0..n).map(|i| {
        let [x, y, z, _] = owen_sobol(i, 77 + (i >> 16)).map(unit_float);
        (Vec2::new(x, y), z)
    })
}

fn material(base_color: Vec3, metallic: f32, roughness: f32) -> BsdfParameters {
    BsdfParameters { base_color, metallic, roughness, ior: 1.5 }
}

fn sampled_albedo(bsdf: &MetallicRoughness, n: u32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (u, lobe) in samples(n) {
        let value = bsdf.evaluate(bsdf.sample(u, lobe));
        if value.pdf > 0.0 {
            sum += value.f_cos / value.pdf;
        }
    }
    sum / n as f32
}

#[test]
fn a_white_surface_reflects_all_light() {
    for metallic in [0.0, 0.5, 1.0] {
        for roughness in ROUGHNESSES.into_iter().chain([0.05, 0.42, 0.66, 0.9]) {
            for cos in COSINES {
                let bsdf = MetallicRoughness::new(&material(Vec3::ONE, metallic, roughness), direction(cos, 0.1));
                let albedo = sampled_albedo(&bsdf, 1 << 16).x;
                // The table is linear between its entries, which shows most at grazing angles.
                let tolerance = if cos < 0.05 { 4.5e-3 } else { 2.5e-3 };
                assert!(
                    (albedo - 1.0).abs() < tolerance,
                    "metallic {metallic} roughness {roughness} cos {cos}: {albedo}"
                );
            }
        }
    }
}

#[test]
fn sampled_and_tabulated_albedos_agree() {
    let color = Vec3::new(0.9, 0.5, 0.1);
    for metallic in [0.0, 0.3, 1.0] {
        for roughness in ROUGHNESSES {
            for cos in COSINES {
                let bsdf = MetallicRoughness::new(&material(color, metallic, roughness), direction(cos, 0.7));
                let (specular, cosine) = bsdf.albedos();
                let error = (sampled_albedo(&bsdf, 1 << 15) - specular - cosine).abs().max_element();
                assert!(error < 4e-3, "metallic {metallic} roughness {roughness} cos {cos}: {error}");
                assert!((specular + cosine).max_element() <= 1.0 + 1e-5);
            }
        }
    }
}

#[test]
fn the_bsdf_is_reciprocal() {
    for metallic in [0.0, 0.6, 1.0] {
        for roughness in ROUGHNESSES {
            let parameters = material(Vec3::new(0.9, 0.4, 0.2), metallic, roughness);
            for (i, &a) in COSINES.iter().enumerate() {
                for (j, &b) in COSINES.iter().enumerate() {
                    let (wo, wi) = (direction(a, 0.13 * i as f32), direction(b, 0.31 * j as f32));
                    let forward = MetallicRoughness::new(&parameters, wo).evaluate(wi).f_cos / wi.z;
                    let backward = MetallicRoughness::new(&parameters, wi).evaluate(wo).f_cos / wo.z;
                    let error = (forward - backward).abs().max_element();
                    assert!(error <= 2e-4 * forward.max_element().max(1e-3), "{forward} {backward}");
                }
            }
        }
    }
}

/// Integrates over the hemisphere by the midpoint rule, in coordinates of equal solid angle.
fn integrate(n: usize, f: impl Fn(Vec3) -> Vec3) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for i in 0..n {
        let cos = (i as f32 + 0.5) / n as f32;
        let mut ring = Vec3::ZERO;
        for j in 0..2 * n {
            ring += f(direction(cos, (j as f32 + 0.5) / (2 * n) as f32));
        }
        sum += ring;
    }
    sum * (2.0 * PI / (2 * n * n) as f32)
}

#[test]
fn the_density_integrates_to_the_share_of_samples_above_the_surface() {
    for roughness in [0.3, 0.5, 0.8, 1.0] {
        for cos in [0.1, 0.4, 0.8, 1.0] {
            let bsdf = MetallicRoughness::new(&material(Vec3::splat(0.5), 0.4, roughness), direction(cos, 0.2));
            let kept = samples(1 << 14).filter(|&(u, lobe)| bsdf.sample(u, lobe).z > 0.0).count() as f32 / 16_384.0;
            let integral = integrate(400, |wi| Vec3::splat(bsdf.evaluate(wi).pdf)).x;
            assert!((integral - kept).abs() < 6e-3, "roughness {roughness} cos {cos}: {integral} {kept}");
        }
    }
}

#[test]
fn integrated_and_sampled_albedos_agree() {
    for roughness in [0.3, 0.6, 1.0] {
        for cos in [0.1, 0.5, 1.0] {
            let bsdf = MetallicRoughness::new(&material(Vec3::new(0.8, 0.4, 0.2), 0.5, roughness), direction(cos, 0.2));
            let integrated = integrate(400, |wi| bsdf.evaluate(wi).f_cos);
            let sampled = sampled_albedo(&bsdf, 1 << 15);
            assert!((integrated - sampled).abs().max_element() < 5e-3, "{roughness} {cos}: {integrated} {sampled}");
        }
    }
}

/// Pearson's statistic of sampled directions against the density, over cells of equal solid angle; the number of
/// samples is fixed and hashed, so that the outcome is always the same.
fn chi_squared(roughness: f32, cos: f32, metallic: f32) -> (f64, usize) {
    const RINGS: usize = 8;
    const SECTORS: usize = 16;
    let n = 40_000u32;
    let bsdf = MetallicRoughness::new(&material(Vec3::splat(0.6), metallic, roughness), direction(cos, 0.23));
    let mut observed = [0.0f64; RINGS * SECTORS + 1];
    for i in 0..n {
        let u = |k: u32| unit_float(orthant_resident::sampling::hash_combine(i, k));
        let wi = bsdf.sample(Vec2::new(u(1), u(2)), u(3));
        let cell = if wi.z <= 0.0 {
            RINGS * SECTORS
        } else {
            let ring = ((wi.z * RINGS as f32) as usize).min(RINGS - 1);
            let turns = orthant_resident::math::atan2_turns(wi.y, wi.x) + 0.5;
            ring * SECTORS + ((turns * SECTORS as f32) as usize).min(SECTORS - 1)
        };
        observed[cell] += 1.0;
    }
    let mut expected = [0.0f64; RINGS * SECTORS + 1];
    const FINE: usize = 64;
    for ring in 0..RINGS {
        for sector in 0..SECTORS {
            let mut sum = 0.0f64;
            for i in 0..FINE {
                let z = (ring as f32 + (i as f32 + 0.5) / FINE as f32) / RINGS as f32;
                for j in 0..FINE {
                    let turns = (sector as f32 + (j as f32 + 0.5) / FINE as f32) / SECTORS as f32;
                    sum += bsdf.evaluate(direction(z, turns - 0.5)).pdf as f64;
                }
            }
            let area = std::f64::consts::TAU / (RINGS * SECTORS * FINE * FINE) as f64;
            expected[ring * SECTORS + sector] = sum * area * n as f64;
        }
    }
    expected[RINGS * SECTORS] = (n as f64 - expected.iter().sum::<f64>()).max(0.0);
    // Cells that expect few samples are pooled.
    let (mut statistic, mut cells, mut pool) = (0.0, 0, (0.0, 0.0));
    for (&o, &e) in observed.iter().zip(&expected) {
        if e < 20.0 {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            statistic += (o - e) * (o - e) / e;
            cells += 1;
        }
    }
    if pool.1 > 5.0 {
        statistic += (pool.0 - pool.1) * (pool.0 - pool.1) / pool.1;
        cells += 1;
    }
    (statistic, cells - 1)
}

#[test]
fn samples_pass_a_chi_squared_test_against_the_density() {
    for roughness in [0.3, 0.5, 0.8, 1.0] {
        for cos in [0.1, 0.5, 0.95] {
            for metallic in [0.0, 1.0] {
                let (statistic, degrees) = chi_squared(roughness, cos, metallic);
                // Wilson and Hilferty's approximation of the quantile at five standard deviations.
                let k = degrees as f64;
                let limit = k * (1.0 - 2.0 / (9.0 * k) + 5.0 * (2.0 / (9.0 * k)).sqrt()).powi(3);
                assert!(statistic < limit, "roughness {roughness} cos {cos}: {statistic} with {degrees} cells");
            }
        }
    }
}

#[test]
fn the_density_of_a_narrow_lobe_measures_solid_angles() {
    // The mean of 1 / pdf over the samples within a region is the region's solid angle.
    for roughness in [0.0, 0.05, 0.1] {
        let wo = direction(0.7, 0.4);
        let bsdf = MetallicRoughness::new(&material(Vec3::ONE, 1.0, roughness), wo);
        let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
        let radius = roughness_to_alpha(roughness);
        let one_minus_cos = 0.5 * radius * radius;
        let mut sum = 0.0f64;
        for (u, lobe) in samples(1 << 16) {
            let wi = bsdf.sample(u, lobe);
            if (wi - mirror).length_squared() <= 2.0 * one_minus_cos {
                sum += 1.0 / bsdf.evaluate(wi).pdf as f64;
            }
        }
        let ratio = sum / 65_536.0 / (2.0 * std::f64::consts::PI * one_minus_cos as f64);
        assert!((ratio - 1.0).abs() < 0.02, "{roughness}: {ratio}");
    }
}

#[test]
fn an_index_matched_dielectric_is_lambertian() {
    let parameters = BsdfParameters { ior: 1.0, ..material(Vec3::new(0.8, 0.5, 0.2), 0.0, 0.3) };
    for cos in COSINES {
        let bsdf = MetallicRoughness::new(&parameters, direction(cos, 0.0));
        let wi = direction(0.3, 0.6);
        let expected = parameters.base_color * FRAC_1_PI * 0.3;
        assert!((bsdf.evaluate(wi).f_cos - expected).abs().max_element() < 1e-6);
    }
}

#[test]
fn a_folded_bsdf_keeps_the_energy_of_a_white_surface() {
    let geometric = Vec3::Z;
    for tilt in [0.0f32, 0.2, 0.6, 1.2] {
        let shading = Vec3::new(tilt.sin(), 0.0, tilt.cos());
        for roughness in [0.0, 0.3, 0.7, 1.0] {
            for (cos, turns) in [(0.05, 0.0), (0.05, 0.5), (0.6, 0.3), (1.0, 0.0)] {
                let wo = direction(cos, turns);
                let n = valid_shading_normal(shading, geometric, wo);
                let bsdf = ShadingBsdf::new(&material(Vec3::ONE, 0.0, roughness), n, geometric, wo);
                let mut sum = 0.0;
                for (u, lobe) in samples(1 << 15) {
                    if let Some(s) = bsdf.sample(u, lobe) {
                        assert!(s.direction.dot(geometric) > -1e-6);
                        sum += s.value.f_cos.x / s.value.pdf;
                    }
                }
                let albedo = sum / 32_768.0;
                assert!((albedo - 1.0).abs() < 6e-3, "tilt {tilt} roughness {roughness} cos {cos}: {albedo}");
            }
        }
    }
}
