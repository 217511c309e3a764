//! `orthant devices`: what can render.

use crate::args::{BackendArg, DevicesArgs};
use crate::failure::Failure;
use crate::machine;
use crate::output::{print, print_json};
use orthant_vulkan::device::DeviceInfo;
use serde_json::{Value, json};

/// What `--device` names: by the number that `orthant devices` prints, or a part of the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Number 0.
    Cpu,
    /// The others: the number among Vulkan's devices.
    Vulkan(usize),
}

fn cpu_name() -> String {
    machine::cpu_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// The device that is named, of the backend that is asked for.
///
/// # Errors
/// If there is none.
pub fn choose(asked: &str, backend: BackendArg) -> Result<Choice, Failure> {
    let wanted = asked.to_lowercase();
    let vulkan =
        if backend == BackendArg::Cpu { Vec::new() } else { orthant_vulkan::device::list().unwrap_or_default() };
    let takes_cpu = backend != BackendArg::Vulkan;
    let found = match asked.parse::<usize>() {
        Ok(0) if takes_cpu => Some(Choice::Cpu),
        Ok(number) => number.checked_sub(1).filter(|&index| index < vulkan.len()).map(Choice::Vulkan),
        Err(_) if takes_cpu && (wanted == "cpu" || cpu_name().to_lowercase().contains(&wanted)) => Some(Choice::Cpu),
        Err(_) => vulkan.iter().find(|d| d.name.to_lowercase().contains(&wanted)).map(|d| Choice::Vulkan(d.index)),
    };
    found.ok_or_else(|| {
        let of = match backend {
            BackendArg::Auto => "",
            BackendArg::Cpu => " of the CPU backend",
            BackendArg::Vulkan => " of the Vulkan backend",
        };
        Failure::missing(format!("there is no device {asked:?}{of}: `orthant devices` lists what there is"))
    })
}

/// Prints the devices.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &DevicesArgs) -> Result<(), Failure> {
    let vulkan = orthant_vulkan::device::list();
    if args.json {
        let mut rows = vec![json!({ "index": 0, "backend": "cpu", "name": cpu_name(), "threads": machine::threads(),
            "memory_bytes": machine::memory(), "unfit": [] })];
        rows.extend(vulkan.iter().flatten().map(row));
        let mut all = json!({ "devices": rows });
        if let Err(error) = &vulkan {
            all["vulkan"] = json!(error.to_string());
        }
        return print_json(&all);
    }
    let gib = |bytes: u64| bytes as f64 / (1u64 << 30) as f64;
    let mut text =
        format!("0  cpu  {}  {} threads, {:.1} GiB\n", cpu_name(), machine::threads(), gib(machine::memory()));
    match &vulkan {
        Ok(devices) => {
            for d in devices {
                let (index, name, memory) = (d.index + 1, &d.name, gib(d.memory));
                text +=
                    &format!("{index}  vulkan  {name}  {}, Vulkan {}, {}, {memory:.1} GiB\n", d.kind, d.api, d.driver);
                let can = features(d);
                if !can.is_empty() {
                    text += &format!("   can: {}\n", can.join(", "));
                }
                if !d.unfit.is_empty() {
                    text += &format!("   unfit, it lacks: {}\n", d.unfit.join(", "));
                }
            }
        }
        Err(error) => text += &format!("   vulkan: {error}\n"),
    }
    print(&text)
}

fn features(d: &DeviceInfo) -> Vec<&'static str> {
    let f = d.features;
    let all = [
        (d.unfit.is_empty(), "ray tracing pipelines"),
        (f.ray_query, "ray query"),
        (f.invocation_reorder, "invocation reorder"),
        (f.position_fetch, "position fetch"),
        (f.opacity_micromap, "opacity micromaps"),
        (f.mesh_shader, "mesh shaders"),
    ];
    all.into_iter().filter(|(has, _)| *has).map(|(_, name)| name).collect()
}

fn row(d: &DeviceInfo) -> Value {
    json!({ "index": d.index + 1, "backend": "vulkan", "name": d.name, "kind": d.kind, "api": d.api, "driver": d.driver,
        "memory_bytes": d.memory, "features": features(d), "unfit": d.unfit })
}
