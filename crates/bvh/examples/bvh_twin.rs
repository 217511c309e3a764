//! Measures this crate and `obvhs` side by side, and prints a table.
//!
//! `cargo run --release -p orthant-bvh --features measure --example bvh_twin -- [ITEMS] [EDITS] [RUNS]`

use std::collections::BTreeMap;

use orthant_bvh::measure::{Measurement, Plan, measure_ours, measure_peer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<usize>());
    let mut next = |default| arguments.next().unwrap_or(Ok(default));
    let plan = Plan { n: next(1_000_000)?, edits: next(100_000)?, runs: next(5)?, rays: 100_000 };

    let peer = measure_peer(plan);
    let by_name: BTreeMap<_, _> = peer.iter().map(|m| (m.name.trim_start_matches("obvhs_"), m)).collect();
    println!(
        "{:<20} {:>3} {:>10} {:>12} {:>9} {:>7} {:>12} {:>8}",
        "name", "dim", "median ms", "items/s", "SAH", "visits", "obvhs ms", "ours is"
    );
    let ours = measure_ours::<3>(plan)?;
    for m in &ours {
        row(m, by_name.get(m.name.as_str()).copied());
    }
    println!("{:<20} {:>56} {:>12}", "", "", "");
    for m in &peer {
        row(m, None);
    }
    for m in &measure_ours::<4>(plan)? {
        row(m, None);
    }
    Ok(())
}

fn row(m: &Measurement, twin: Option<&Measurement>) {
    let or_dash = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |v| format!("{v:.digits$}"));
    let twin_s = twin.map(|t| t.median_s() * m.items as f64 / t.items as f64);
    let ratio = twin_s.map_or("-".to_owned(), |s| format!("{:.2} x", s / m.median_s()));
    println!(
        "{:<20} {:>3} {:>10.2} {:>12.0} {:>9} {:>7} {:>12} {:>8}",
        m.name,
        m.dim,
        m.median_s() * 1e3,
        m.items_per_s(),
        or_dash(m.sah, 2),
        or_dash(m.visits, 1),
        or_dash(twin_s.map(|s| s * 1e3), 2),
        ratio
    );
}
