//! `bench bvh`: the operations of crate `orthant-bvh`, in three dimensions beside those of `obvhs`, and in four.

use super::{Measured, Settings};
use orthant_bvh::measure::{Measurement, Plan, measure, measure_with_peer};
use std::time::Duration;

/// Boxes in the trees.
const ITEMS: usize = 1_000_000;

/// Measures trees over `settings.size` boxes, [`ITEMS`] where that is not said. A tenth of them are edited in a run.
pub fn run(settings: Settings) -> Vec<Measured> {
    let n = settings.size.map_or(ITEMS, |size| size as usize).max(16);
    let plan = Plan { n, edits: (n / 10).max(1), rays: (n / 10).max(1000), runs: settings.runs };
    let mut all = measure_with_peer(plan);
    all.extend(measure::<4>(plan));
    all.iter().map(|measurement| measured(measurement, &all)).collect()
}

fn measured(own: &Measurement, all: &[Measurement]) -> Measured {
    let mut measured = Measured::new(&own.name, own.n as u64)
        .with("dim", own.dim)
        .with("items", own.items)
        .with("items_per_s", own.items_per_s())
        .with("sah", own.sah);
    measured.runs = own.seconds.iter().copied().map(Duration::from_secs_f64).collect();
    if let Some(visits) = own.visits {
        measured = measured.with("visits", visits);
    }
    let twin = all.iter().find(|peer| peer.dim == own.dim && peer.name.strip_prefix("obvhs_") == Some(&own.name));
    match twin {
        Some(twin) => measured.with("speed_to_obvhs", twin.median_s() / own.median_s()),
        None => measured,
    }
}
