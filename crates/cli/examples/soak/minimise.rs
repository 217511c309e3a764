//! Shorter scripts that fail as well: by leaving out halves, then quarters, and so on (delta debugging: Zeller and
//! Hildebrandt, Simplifying and isolating failure-inducing input, 2002).

use crate::sequence::{Finding, Source, guarded};
use orthant_scene::edit::script::Operation;
use std::time::{Duration, Instant};

/// Time that it may take.
const LIMIT: Duration = Duration::from_secs(600);

/// The shortest script that was found, and what it fails with.
pub fn minimise(source: &Source, finding: Finding) -> (Vec<Operation>, String) {
    let Finding { mut script, mut what } = finding;
    // A comparison after each operation finds where it began to be wrong, and costs most: once.
    if let Some((length, earlier)) = failure(source, &script, true) {
        script.truncate(length);
        what = earlier;
    }
    shorten(script, what, |shorter| failure(source, shorter, false))
}

/// Leaves out what is not needed for a failure of the same kind. `fails` says after how many operations a script fails, and with
/// what.
pub fn shorten(
    mut script: Vec<Operation>,
    mut what: String,
    mut fails: impl FnMut(&[Operation]) -> Option<(usize, String)>,
) -> (Vec<Operation>, String) {
    let wanted = kind(&what);
    let start = Instant::now();
    let mut size = script.len().div_ceil(2);
    while size > 0 && start.elapsed() < LIMIT {
        let mut first = 0;
        while first < script.len() && start.elapsed() < LIMIT {
            let end = (first + size).min(script.len());
            let shorter: Vec<Operation> = [&script[..first], &script[end..]].concat();
            match fails(&shorter) {
                Some((length, now)) if kind(&now) == wanted => {
                    script = shorter;
                    script.truncate(length);
                    what = now;
                }
                _ => first = end,
            }
        }
        size = if size == 1 { 0 } else { size.div_ceil(2) };
    }
    (script, what)
}

/// What sort of failure it is: its first words without the numbers. A shorter script for another failure shows nothing.
fn kind(what: &str) -> String {
    what.split([' ', ':'])
        .filter(|word| !word.is_empty() && !word.contains(|c: char| c.is_ascii_digit()))
        .take(5)
        .collect()
}

/// After how many operations a script fails, and with what. The state is compared after each of them, or at the end.
pub fn failure(source: &Source, script: &[Operation], after_each: bool) -> Option<(usize, String)> {
    let mut done = 0;
    let result = guarded(|| {
        let mut live = source.live()?;
        for operation in script {
            done += 1;
            crate::sequence::step(&mut live, operation)?;
            if after_each {
                live.check(done as u64)?;
            }
        }
        (0..4).try_for_each(|seed| live.check(seed).map(|_| ()))
    });
    result.err().map(|what| (done, what))
}
