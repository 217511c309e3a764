//! Measurements of this crate, and of `obvhs` beside it in the same run: what the benchmark command prints.

mod ours;
mod peer;
pub mod workload;

pub use ours::measure as measure_ours;
pub use peer::measure as measure_peer;

use std::time::Instant;

/// Measures the calling thread's time on a processor where the system tells it, else the time that passes: on a machine
/// that others use too, the first is what can be compared.
struct Stopwatch {
    cpu_ns: Option<u64>,
    wall: Instant,
}

impl Stopwatch {
    fn start() -> Self {
        Self { cpu_ns: thread_cpu_ns(), wall: Instant::now() }
    }

    fn seconds(&self) -> f64 {
        let wall = self.wall.elapsed().as_secs_f64();
        match (self.cpu_ns, thread_cpu_ns()) {
            (Some(start), Some(end)) => (end - start) as f64 * 1e-9,
            _ => wall,
        }
    }
}

/// Linux keeps it in the first field of this file.
fn thread_cpu_ns() -> Option<u64> {
    // Giving way first makes the scheduler bring its account up to date.
    std::thread::yield_now();
    std::fs::read_to_string("/proc/thread-self/schedstat").ok()?.split_whitespace().next()?.parse().ok()
}

/// What was measured, with the seconds of every run.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The operation; with a leading `obvhs_` it is the peer's.
    pub name: String,
    /// Dimensions of the boxes.
    pub dim: usize,
    /// Items in the tree.
    pub n: usize,
    /// Items that one run handles.
    pub items: usize,
    /// Seconds of each run.
    pub seconds: Vec<f64>,
    /// The surface area heuristic of the tree afterwards, where it changed.
    pub sah: Option<f64>,
    /// Nodes read by a query on average, where that is known.
    pub visits: Option<f64>,
}

impl Measurement {
    fn new(name: &str, dim: usize, n: usize, items: usize, seconds: Vec<f64>) -> Self {
        Self { name: name.to_owned(), dim, n, items, seconds, sah: None, visits: None }
    }

    /// The median of the runs, in seconds.
    pub fn median_s(&self) -> f64 {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// Items handled per second in the median run.
    pub fn items_per_s(&self) -> f64 {
        self.items as f64 / self.median_s()
    }
}

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// Items in the tree.
    pub n: usize,
    /// Inserts, removals and moves in a run, and the edits before queries are measured again.
    pub edits: usize,
    /// Rays in a run.
    pub rays: usize,
    /// Runs of each operation.
    pub runs: usize,
}

/// Times `work` on a fresh `state` for every run; making the state, and dropping it, is not timed. Returns the last state.
fn time<T>(runs: usize, mut state: impl FnMut() -> T, mut work: impl FnMut(&mut T)) -> (Vec<f64>, T) {
    let mut seconds = Vec::with_capacity(runs);
    let mut last = None;
    for _ in 0..runs.max(1) {
        drop(last.take());
        let mut fresh = state();
        let start = Stopwatch::start();
        work(&mut fresh);
        seconds.push(start.seconds());
        last = Some(fresh);
    }
    (seconds, last.unwrap_or_else(state))
}
