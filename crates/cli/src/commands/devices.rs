//! `orthant devices`: what can render.

use crate::args::{BackendArg, DevicesArgs};
use crate::failure::Failure;
use crate::machine;
use crate::output::{print, print_json};
use orthant_vulkan::device::DeviceInfo;
use serde_json::{Value, json};

/// What `--device` names: by the number that `orthant devices` prints, the name, or a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Number 0.
    Cpu,
    /// The others: the number among Vulkan's devices.
    Vulkan(usize),
}

impl Choice {
    /// The number that `orthant devices` prints.
    fn number(self) -> usize {
        match self {
            Self::Cpu => 0,
            Self::Vulkan(index) => index + 1,
        }
    }
}

fn cpu_name() -> String {
    machine::cpu_name().unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

/// The device that is named, of the backend that is asked for.
///
/// # Errors
/// If there is none (missing), or the name is that of several (usage).
pub fn choose(asked: &str, backend: BackendArg) -> Result<Choice, Failure> {
    let mut all = Vec::new();
    if backend != BackendArg::Vulkan {
        all.push((Choice::Cpu, cpu_name()));
    }
    if backend != BackendArg::Cpu {
        let vulkan = orthant_vulkan::device::list().unwrap_or_default();
        all.extend(vulkan.into_iter().map(|d| (Choice::Vulkan(d.index), d.name)));
    }
    match named(asked, &all).as_slice() {
        [found] => Ok(found.0),
        [] => {
            let of = match backend {
                BackendArg::Auto => "",
                BackendArg::Cpu => " of the CPU backend",
                BackendArg::Vulkan => " of the Vulkan backend",
            };
            Err(Failure::missing(format!("there is no device {asked:?}{of}: `orthant devices` lists what there is")))
        }
        several => {
            let list: Vec<String> = several.iter().map(|(d, name)| format!("{} {name}", d.number())).collect();
            let what = format!("--device {asked}: several devices have that in their name: {}", list.join(", "));
            Err(Failure::usage(what).remedy("say which by its number"))
        }
    }
}

/// The devices that a text names: by number the one, by name the one, or those of which it is a part of the name. The CPU is
/// also called so.
fn named<'d>(asked: &str, all: &'d [(Choice, String)]) -> Vec<&'d (Choice, String)> {
    if let Ok(number) = asked.parse::<usize>() {
        return all.iter().filter(|(device, _)| device.number() == number).collect();
    }
    let wanted = asked.to_lowercase();
    let is_it =
        |(device, name): &&(Choice, String)| name.to_lowercase() == wanted || *device == Choice::Cpu && wanted == "cpu";
    let exact: Vec<_> = all.iter().filter(is_it).collect();
    if !exact.is_empty() {
        return exact;
    }
    all.iter().filter(|(_, name)| name.to_lowercase().contains(&wanted)).collect()
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
        (f.ray_tracing_pipeline, "ray tracing pipelines"),
        (f.ray_query, "ray query"),
        (f.invocation_reorder, "invocation reorder"),
        (f.position_fetch, "position fetch"),
        (f.opacity_micromap, "opacity micromaps"),
        (f.mesh_shader, "mesh shaders"),
        (f.raster, "raster preview"),
    ];
    all.into_iter().filter(|(has, _)| *has).map(|(_, name)| name).collect()
}

fn row(d: &DeviceInfo) -> Value {
    json!({ "index": d.index + 1, "backend": "vulkan", "name": d.name, "kind": d.kind, "api": d.api, "driver": d.driver,
        "memory_bytes": d.memory, "features": features(d), "unfit": d.unfit })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_name_wins_and_a_part_of_several_names_all_of_them() {
        let name = |text: &str| text.to_owned();
        let all = [
            (Choice::Cpu, name("Some CPU 9000")),
            (Choice::Vulkan(0), name("Some GPU")),
            (Choice::Vulkan(1), name("Some GPU Ti")),
            (Choice::Vulkan(2), name("Some GPU Ti")),
        ];
        let numbers = |asked: &str| named(asked, &all).iter().map(|(d, _)| d.number()).collect::<Vec<_>>();
        assert_eq!(numbers("some gpu"), [1]);
        assert_eq!(numbers("GPU"), [1, 2, 3]);
        assert_eq!(numbers("some gpu ti"), [2, 3]);
        assert_eq!(numbers("cpu"), [0]);
        assert_eq!(numbers("cpu 9"), [0]);
        assert_eq!((numbers("2"), numbers("7"), numbers("nothing")), (vec![2], Vec::new(), Vec::new()));
    }
}
