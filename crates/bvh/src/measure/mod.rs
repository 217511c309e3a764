//! Measurements of this crate, and of `obvhs` beside it in the same run: what the benchmark command prints.

mod ours;
mod peer;
pub mod workload;

use std::time::Instant;

use workload::Load;

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
    /// The surface area heuristic of the tree afterwards.
    pub sah: f64,
    /// Nodes read by a query on average, where that is known.
    pub visits: Option<f64>,
}

impl Measurement {
    /// The median of the runs, in seconds.
    pub fn median_s(&self) -> f64 {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
    }

    /// The fastest run, in seconds.
    pub fn min_s(&self) -> f64 {
        self.seconds.iter().copied().fold(f64::INFINITY, f64::min)
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

/// What one run of an operation gave.
struct Outcome {
    seconds: f64,
    sah: f64,
    visits: Option<f64>,
}

/// An operation that can be run again and again on the same state.
struct Operation<'a> {
    name: &'static str,
    items: usize,
    run: Box<dyn FnMut() -> Outcome + 'a>,
}

/// Measures every operation of this crate on random boxes in `N` dimensions.
pub fn measure<const N: usize>(plan: Plan) -> Vec<Measurement> {
    let load = Load::<N>::new(plan);
    let trees = ours::Trees::new(&load);
    run(N, plan, ours::operations(&load, &trees), Vec::new())
}

/// Measures every operation in 3D, and the peer's counterpart with each: a run of ours, a run of the peer's, and so on.
pub fn measure_with_peer(plan: Plan) -> Vec<Measurement> {
    let load = Load::<3>::new(plan);
    let trees = ours::Trees::new(&load);
    let peer_load = peer::PeerLoad::new(&load);
    let peer_trees = peer::Trees::new(&load, &peer_load);
    run(3, plan, ours::operations(&load, &trees), peer::operations(&load, &peer_load, &peer_trees))
}

fn run(dim: usize, plan: Plan, ours: Vec<Operation<'_>>, mut peers: Vec<Operation<'_>>) -> Vec<Measurement> {
    let mut all = Vec::new();
    for mut operation in ours {
        let mut twin = peers.iter_mut().find(|peer| peer.name.strip_prefix("obvhs_") == Some(operation.name));
        let (mut own, mut others) = (Vec::new(), Vec::new());
        for _ in 0..plan.runs.max(1) {
            own.push((operation.run)());
            if let Some(twin) = &mut twin {
                others.push((twin.run)());
            }
        }
        for (operation, outcomes) in [(Some(&operation), own), (twin.as_deref(), others)] {
            if let (Some(operation), Some(last)) = (operation, outcomes.last()) {
                all.push(Measurement {
                    name: operation.name.to_owned(),
                    dim,
                    n: plan.n,
                    items: operation.items,
                    sah: last.sah,
                    visits: last.visits,
                    seconds: outcomes.iter().map(|outcome| outcome.seconds).collect(),
                });
            }
        }
    }
    all
}

/// Times `work` on a fresh state; making the state and looking at it afterwards is not timed.
fn time<T>(mut state: T, work: impl FnOnce(&mut T), sah: impl FnOnce(&T) -> f64) -> Outcome {
    let watch = Stopwatch::start();
    work(&mut state);
    let seconds = watch.seconds();
    Outcome { seconds, sah: sah(&state), visits: None }
}
