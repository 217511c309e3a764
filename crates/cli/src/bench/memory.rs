//! Peak memory of a piece of work, as the operating system counts it.

/// Runs `work` and gives how many bytes the resident memory grew at its peak; `None` where the system does not tell
/// (only Linux does).
pub fn peak_of<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    // Writing 5 resets the high-water mark of resident memory (proc(5), clear_refs).
    let reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = status("VmRSS:");
    let value = work();
    let peak = status("VmHWM:");
    let grown = before.zip(peak).filter(|_| reset).map(|(before, peak)| peak.saturating_sub(before));
    (value, grown)
}

/// A size of this process in bytes.
fn status(key: &str) -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|l| l.starts_with(key))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib * 1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn touching_64_mib_is_seen() {
        let (_, peak) = super::peak_of(|| std::hint::black_box(vec![1u8; 64 << 20]).len());
        assert!(peak.is_none_or(|p| p > 60 << 20), "{peak:?}");
    }
}
