//! Rays per second through a TLAS of many instances, beside crate `obvhs` called directly on the same scene and rays in
//! the same run.
//!
//! `cargo run --release -p orthant-cpu --example trace_twin -- [INSTANCES] [REPETITIONS] [flat]`
//!
//! `flat` adds a third contender: `CwBvh::ray_traverse_tlas_blas`, which knows no instance transforms and therefore gets
//! a BLAS of world-space triangles for each instance.

mod rays;
mod scene;
mod twin;

use orthant_cpu::{Ray, ResidentScene};
use rayon::prelude::*;
use std::time::Instant;
use twin::{Flat, Instanced};

/// What a ray brings back, enough to compare contenders: sums of parameters and counts.
#[derive(Clone, Copy, Default)]
struct Tally {
    hits: u64,
    sum: f64,
}

impl Tally {
    fn add(self, other: Self) -> Self {
        Self { hits: self.hits + other.hits, sum: self.sum + other.sum }
    }

    fn of(t: Option<f32>) -> Self {
        t.map_or(Self::default(), |t| Self { hits: 1, sum: f64::from(t) })
    }
}

/// The rejection rule of the alpha-tested instances: the same for every contender, and about as cheap as none.
fn accepts(node: u32, triangle: u32) -> bool {
    (node.wrapping_mul(0x9e37_79b9) ^ triangle.wrapping_mul(0x85eb_ca6b)).wrapping_mul(0xc2b2_ae35) >> 31 == 0
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let numbers: Vec<usize> = arguments.iter().filter_map(|a| a.parse().ok()).collect();
    let count = numbers.first().copied().unwrap_or(10_000);
    let repetitions = numbers.get(1).copied().unwrap_or(7);

    let start = Instant::now();
    let mut resident = ResidentScene::new();
    let report = resident.apply(scene::batch(count)).expect("the scene is valid");
    println!(
        "{} instances, {} triangles stored; BLAS {:.1} ms, TLAS {:.1} ms, all {:.1} ms, {:.2} MB of trees",
        resident.tlas.len(),
        resident.indices.len() / 3,
        report.blas_time.as_secs_f64() * 1e3,
        report.tlas_time.as_secs_f64() * 1e3,
        start.elapsed().as_secs_f64() * 1e3,
        resident.resident_bytes().acceleration as f64 / 1e6,
    );
    let start = Instant::now();
    let instanced = Instanced::new(&resident);
    println!("obvhs: {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    let flat = arguments.iter().any(|a| a == "flat").then(|| Flat::new(&resident));
    let rays = rays::Rays::new(&resident, 512);

    let ours_closest =
        |ray: &Ray| Tally::of(resident.closest_hit(ray, |h| accepts(h.render_node, h.triangle)).map(|h| h.t));
    let ours_any = |ray: &Ray| Tally::of(resident.any_hit(ray, |h| accepts(h.render_node, h.triangle)).then_some(1.0));
    let twin_closest = |ray: &Ray| Tally::of(instanced.closest_hit(ray));
    let twin_any = |ray: &Ray| Tally::of(instanced.any_hit(ray).then_some(1.0));
    let flat_closest = |ray: &Ray| Tally::of(flat.as_ref().and_then(|f| f.closest_hit(ray)));
    let flat_any = |ray: &Ray| Tally::of(flat.as_ref().and_then(|f| f.any_hit(ray).then_some(1.0)));

    type Trace<'a> = &'a (dyn Fn(&[Ray]) -> Tally + Sync);
    /// One call a chunk, so that the ray's own loop is compiled into each contender.
    fn chunked<F: Fn(&Ray) -> Tally + Sync>(f: F) -> impl Fn(&[Ray]) -> Tally + Sync {
        move |rays| rays.iter().map(&f).fold(Tally::default(), Tally::add)
    }
    let (oc, oa, tc, ta) = (chunked(ours_closest), chunked(ours_any), chunked(twin_closest), chunked(twin_any));
    let (fc, fa) = (chunked(flat_closest), chunked(flat_any));
    let suites: [(&str, &[Ray], [Trace; 3]); 3] = [
        ("primary", &rays.primary, [&oc, &tc, &fc]),
        ("shadow", &rays.shadow, [&oa, &ta, &fa]),
        ("incoherent", &rays.incoherent, [&oc, &tc, &fc]),
    ];
    let contenders = if flat.is_some() { 3 } else { 2 };
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of two threads");
        for (name, rays, traces) in &suites {
            let mut seconds = vec![Vec::new(); contenders];
            let mut tallies = [Tally::default(); 3];
            for _ in 0..repetitions {
                for contender in 0..contenders {
                    let start = Instant::now();
                    tallies[contender] = pool
                        .install(|| rays.par_chunks(1024).map(traces[contender]).reduce(Tally::default, Tally::add));
                    seconds[contender].push(start.elapsed().as_secs_f64());
                }
            }
            let rate = |contender: usize| {
                let mut s = seconds[contender].clone();
                s.sort_by(f64::total_cmp);
                rays.len() as f64 / s[s.len() / 2] / 1e6
            };
            print!(
                "{threads} threads {name:>10}: {:.3} Mrays/s, obvhs {:.3}, ratio {:.2}",
                rate(0),
                rate(1),
                rate(0) / rate(1)
            );
            if contenders == 3 {
                print!(", obvhs flat {:.3}, ratio {:.2}", rate(2), rate(0) / rate(2));
            }
            println!("  (hits {:?}, sum {:.6e} {:.6e})", tallies.map(|t| t.hits), tallies[0].sum, tallies[1].sum);
        }
    }
}
