//! Measures this crate and `obvhs` side by side, and prints a table.
//!
//! `cargo run --release -p orthant-bvh --features measure --example bvh_twin -- [ITEMS] [EDITS] [RUNS]`

use orthant_bvh::measure::{Measurement, Plan, measure, measure_with_peer};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|argument| argument.parse::<usize>());
    let mut next = |default| arguments.next().unwrap_or(Ok(default));
    let plan = Plan { n: next(1_000_000)?, edits: next(100_000)?, runs: next(5)?, rays: 100_000 };

    println!(
        "{:<18} {:>3} {:>10} {:>9} {:>11} {:>8} {:>7} {:>10} {:>9} {:>9} {:>8}",
        "name", "dim", "median ms", "min ms", "items/s", "SAH", "visits", "obvhs ms", "min ms", "SAH", "obvhs/us"
    );
    let both = measure_with_peer(plan);
    for m in both.iter().filter(|m| !m.name.starts_with("obvhs_")) {
        row(m, both.iter().find(|peer| peer.name.strip_prefix("obvhs_") == Some(&m.name)));
    }
    for m in &measure::<4>(plan) {
        row(m, None);
    }
    Ok(())
}

fn row(m: &Measurement, twin: Option<&Measurement>) {
    let visits = m.visits.map_or("-".to_owned(), |visits| format!("{visits:.1}"));
    print!(
        "{:<18} {:>3} {:>10.2} {:>9.2} {:>11.0} {:>8.2} {:>7}",
        m.name,
        m.dim,
        m.median_s() * 1e3,
        m.min_s() * 1e3,
        m.items_per_s(),
        m.sah,
        visits
    );
    match twin {
        Some(t) => println!(
            " {:>10.2} {:>9.2} {:>9.2} {:>7.2}x",
            t.median_s() * 1e3,
            t.min_s() * 1e3,
            t.sah,
            t.median_s() / m.median_s()
        ),
        None => println!(),
    }
}
