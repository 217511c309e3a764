//! A progress bar on stderr, for whoever waits there.

use indicatif::{ProgressBar, ProgressStyle};
use orthant_resident::TicketStatus;
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Nothing is shown of what takes no longer.
const PATIENCE: Duration = Duration::from_secs(1);

/// Progress of a command. It shows nothing when stderr is not a terminal, with `--quiet`, and in the first second.
pub struct Progress {
    enabled: bool,
    start: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Begins to wait.
    pub fn new(quiet: bool) -> Self {
        Self { enabled: !quiet && std::io::stderr().is_terminal(), start: Instant::now(), bar: None }
    }

    /// Shows how far a frame is, its rays per second, and the time left.
    pub fn frame(&mut self, status: &TicketStatus, done_before: u64, total: u64) {
        if !self.enabled || self.start.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("rendering {wide_bar} {percent:>3} %  {msg}  {eta} left");
            // The template is a constant that a test parses.
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(total).with_style(style).with_elapsed(self.start.elapsed())
        });
        let seconds = status.elapsed.as_secs_f64().max(1e-9);
        bar.set_message(format!("{:.1} Mrays/s", status.rays.total() as f64 / seconds * 1e-6));
        bar.set_position(done_before + status.done);
    }

    /// Shows how many of `total` steps of some work are done, and the time left.
    pub fn step(&mut self, doing: &'static str, done: u64, total: u64) {
        if !self.enabled || self.start.elapsed() < PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let style = ProgressStyle::with_template("{prefix} {wide_bar} {percent:>3} %  {pos}/{len}  {eta} left");
            // As above.
            let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(total).with_prefix(doing).with_style(style).with_elapsed(self.start.elapsed())
        });
        bar.set_position(done);
    }

    /// Takes the bar away.
    pub fn finish(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}
