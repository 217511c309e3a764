//! Prints `crates/resident/src/energy/table.rs`: the directional albedo of the GGX lobe by quadrature in `f64`.
//!
//!     cargo run --release -p orthant-cpu --example energy_table > table.rs && mv table.rs crates/resident/src/energy/

use orthant_resident::energy::MIN_ALPHA;
use std::f64::consts::TAU;

const COSINES: usize = 64;
const ROUGHNESSES: usize = 64;
/// Quadrature points along each axis of the square that visible normals are sampled from.
const POINTS: usize = 256;

fn main() {
    let mut table = Vec::new();
    let mut averages = Vec::new();
    for row in 0..ROUGHNESSES {
        let alpha = (row as f64 / (ROUGHNESSES - 1) as f64).powi(2).max(MIN_ALPHA as f64);
        let entries: Vec<[u32; 2]> = (0..COSINES)
            .map(|i| {
                let mu = (i as f64 / (COSINES - 1) as f64).powi(2).max(1e-5);
                albedo(mu, alpha).map(|e| (e.clamp(0.0, 1.0) * 65535.0).round() as u32)
            })
            .collect();
        averages.push([0, 1].map(|k| mean_of_linear_pieces(&entries, k)));
        table.extend(entries.iter().map(|e| e[0] | e[1] << 16));
    }
    println!("//! Made by `cargo run --release -p orthant-cpu --example energy_table`; do not edit.\n");
    println!("/// Cosines: entry i is at `(i / (COSINES - 1))^2`.\npub const COSINES: usize = {COSINES};\n");
    println!("/// Roughnesses: row i is at `i / (ROUGHNESSES - 1)`.\npub const ROUGHNESSES: usize = {ROUGHNESSES};\n");
    println!("/// A (low half) and B (high half) as 16-bit unorms, row by row.");
    println!("#[rustfmt::skip]\npub static ENERGY: [u32; COSINES * ROUGHNESSES] = [");
    for chunk in table.chunks(8) {
        let words: Vec<String> = chunk.iter().map(|v| format!("0x{:04x}_{:04x}", v >> 16, v & 0xffff)).collect();
        println!("    {},", words.join(", "));
    }
    println!("];\n\n/// Cosine-weighted means of A and B of each row.");
    println!("#[rustfmt::skip]\npub static AVERAGES: [[f32; 2]; ROUGHNESSES] = [");
    for [a, b] in averages {
        println!("    [{:?}, {:?}],", a as f32, b as f32);
    }
    println!("];");
}

/// A and B: means over visible normals (Dupuy and Benyoub 2023) of G2 / G1, times (1 - cos)^5 for B.
fn albedo(mu: f64, alpha: f64) -> [f64; 2] {
    let wo = [(1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu];
    let stretched = normalize([wo[0] * alpha, 0.0, wo[2]]);
    let lambda = |z: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 - z * z) / (z * z)).sqrt() - 1.0);
    let lambda_o = lambda(mu);
    let mut sums = [0.0; 2];
    for i in 0..POINTS {
        for j in 0..POINTS {
            let u = [(i as f64 + 0.5) / POINTS as f64, (j as f64 + 0.5) / POINTS as f64];
            let z = (1.0 - u[1]) * (1.0 + stretched[2]) - stretched[2];
            let r = (1.0 - z * z).max(0.0).sqrt();
            let (s, c) = (TAU * u[0]).sin_cos();
            let h = normalize([(r * c + stretched[0]) * alpha, r * s * alpha, z + stretched[2]]);
            let cos = wo[0] * h[0] + wo[2] * h[2];
            let wi_z = 2.0 * cos * h[2] - wo[2];
            if wi_z > 0.0 {
                let weight = (1.0 + lambda_o) / (1.0 + lambda_o + lambda(wi_z));
                sums[0] += weight;
                sums[1] += weight * (1.0 - cos).max(0.0).powi(5);
            }
        }
    }
    sums.map(|s| s / (POINTS * POINTS) as f64)
}

/// `2 integral of E(mu) mu dmu` where E is linear in u = sqrt(mu) between entries: `4 integral of E(u) u^3 du`.
fn mean_of_linear_pieces(entries: &[[u32; 2]], k: usize) -> f64 {
    let n = (entries.len() - 1) as f64;
    entries
        .windows(2)
        .enumerate()
        .map(|(i, pair)| {
            let (u0, u1) = (i as f64 / n, (i + 1) as f64 / n);
            let (e0, e1) = (pair[0][k] as f64 / 65535.0, pair[1][k] as f64 / 65535.0);
            let slope = (e1 - e0) / (u1 - u0);
            let primitive = |u: f64| (e0 - slope * u0) * u.powi(4) + slope * 0.8 * u.powi(5);
            primitive(u1) - primitive(u0)
        })
        .sum()
}

fn normalize(v: [f64; 3]) -> [f64; 3] {
    let l = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|c| c / l)
}
