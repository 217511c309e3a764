//! `bench trace FILE`: rays through the resident scene, beside crate `obvhs` called directly on the same triangles,
//! instances and rays.

mod rays;
mod twin;

use super::{Measured, Settings};
use crate::failure::{Exit, Failure};
use orthant_cpu::{Ray, ResidentScene};
use orthant_render::camera::View;
use rayon::prelude::*;
use rays::{Rays, accepts};
use std::path::Path;
use twin::Instanced;

/// Primary rays along each side of the picture.
const SIZE: u32 = 512;

/// Rays that one task traces.
const TASK_RAYS: usize = 1024;

/// What rays bring back, enough to see that contenders agree.
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

pub fn run(file: &Path, settings: Settings) -> Result<Vec<Measured>, Failure> {
    let internal = |e: String| Failure::new(Exit::Internal, e);
    let mut loaded = super::load(file, settings)?;
    let mut resident = ResidentScene::new();
    let batch = loaded.derived.load_batch();
    resident.apply(batch).map_err(|e| internal(e.to_string()))?;
    let (scene, derived) = (&loaded.scene, &loaded.derived);
    let view = View::first_camera(scene, derived, 1.0).or_else(|| derived.bounds().map(|b| View::framing(b, 1.0)));
    let Some(view) = view else { return Err(Failure::bad_input(file, "the scene shows nothing")) };
    let rays = Rays::new(&resident, &view.to_camera(derived.origin), SIZE);
    let obvhs = Instanced::new(&resident);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(settings.threads)
        .build()
        .map_err(|e| internal(format!("cannot start threads: {e}")))?;

    let contest = Contest { pool: &pool, runs: settings.runs };
    let ours = |ray: &Ray| Tally::of(resident.closest_hit(ray, |h| accepts(h.render_node, h.triangle)).map(|h| h.t));
    let theirs = |ray: &Ray| Tally::of(obvhs.closest_hit(ray));
    let ours_any = |ray: &Ray| Tally::of(resident.any_hit(ray, |h| accepts(h.render_node, h.triangle)).then_some(1.0));
    let theirs_any = |ray: &Ray| Tally::of(obvhs.any_hit(ray).then_some(1.0));
    let mut results = Vec::new();
    results.extend(contest.run("primary", &rays.primary, ours, theirs));
    results.extend(contest.run("shadow", &rays.shadow, ours_any, theirs_any));
    results.extend(contest.run("incoherent", &rays.incoherent, ours, theirs));
    for result in &mut results {
        result.counters.insert("instances".into(), resident.tlas.len().into());
    }
    Ok(results)
}

/// Two contenders that take turns.
struct Contest<'a> {
    pool: &'a rayon::ThreadPool,
    runs: usize,
}

impl Contest<'_> {
    fn run(
        &self,
        name: &str,
        rays: &[Ray],
        ours: impl Fn(&Ray) -> Tally + Sync,
        theirs: impl Fn(&Ray) -> Tally + Sync,
    ) -> [Measured; 2] {
        let mut a = Measured::new(name, rays.len() as u64);
        let mut b = Measured::new(&format!("obvhs_{name}"), rays.len() as u64);
        let (mut tally_a, mut tally_b) = (Tally::default(), Tally::default());
        for _ in 0..self.runs {
            tally_a = a.time(|| self.all(rays, &ours));
            tally_b = b.time(|| self.all(rays, &theirs));
        }
        let rate = |m: &Measured| if m.median_s() > 0.0 { rays.len() as f64 / m.median_s() / 1e6 } else { 0.0 };
        let (rate_a, rate_b) = (rate(&a), rate(&b));
        [
            a.with("mrays_s", rate_a)
                .with("ratio_to_obvhs", rate_a / rate_b)
                .with("hits", tally_a.hits)
                .with("sum", tally_a.sum),
            b.with("mrays_s", rate_b).with("hits", tally_b.hits).with("sum", tally_b.sum),
        ]
    }

    fn all(&self, rays: &[Ray], trace: &(impl Fn(&Ray) -> Tally + Sync)) -> Tally {
        let task = |rays: &[Ray]| rays.iter().map(trace).fold(Tally::default(), Tally::add);
        self.pool.install(|| rays.par_chunks(TASK_RAYS).map(task).reduce(Tally::default, Tally::add))
    }
}
