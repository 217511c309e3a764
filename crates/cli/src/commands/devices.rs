//! `orthant devices`: what can render.

use crate::args::DevicesArgs;
use crate::failure::Failure;
use crate::machine;
use crate::output::{print, print_json};
use serde_json::json;

/// A device that a backend can render on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The backend's name.
    pub backend: &'static str,
    /// The device, in words.
    pub name: String,
    /// Hardware threads.
    pub threads: usize,
    /// Memory in bytes.
    pub memory_bytes: u64,
}

/// All devices; the index is what `--device` takes.
pub fn list() -> Vec<Device> {
    vec![Device {
        backend: "cpu",
        name: machine::cpu_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned()),
        threads: machine::threads(),
        memory_bytes: machine::memory(),
    }]
}

/// Prints the devices.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &DevicesArgs) -> Result<(), Failure> {
    let devices = list();
    if args.json {
        let rows: Vec<_> = devices
            .iter()
            .enumerate()
            .map(|(index, d)| {
                json!({ "index": index, "backend": d.backend, "name": d.name, "threads": d.threads,
                    "memory_bytes": d.memory_bytes })
            })
            .collect();
        return print_json(&json!({ "devices": rows }));
    }
    let lines: Vec<String> = devices
        .iter()
        .enumerate()
        .map(|(i, d)| {
            let gib = d.memory_bytes as f64 / (1u64 << 30) as f64;
            format!("{i}  {}  {}  {} threads, {gib:.1} GiB\n", d.backend, d.name, d.threads)
        })
        .collect();
    print(&lines.concat())
}
