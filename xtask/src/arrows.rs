//! Which crate may depend on which: the arrows of `docs/ARCHITECTURE.md`.

use serde_json::Value;
use std::process::Command;

/// Each crate with the crates of this repository that it may compile against.
const ALLOWED: &[(&str, &[&str])] = &[
    ("orthant-bvh", &[]),
    ("orthant-scene", &[]),
    ("orthant-world", &["orthant-bvh"]),
    ("orthant-resident", &["orthant-bvh"]),
    ("orthant-render", &["orthant-resident", "orthant-bvh", "orthant-scene", "orthant-world"]),
    ("orthant-cpu", &["orthant-resident", "orthant-bvh"]),
    ("orthant-vulkan", &["orthant-resident"]),
    (
        "orthant-viewer",
        &["orthant-render", "orthant-resident", "orthant-scene", "orthant-world", "orthant-cpu", "orthant-vulkan"],
    ),
    (
        "orthant",
        &[
            "orthant-bvh",
            "orthant-scene",
            "orthant-world",
            "orthant-resident",
            "orthant-render",
            "orthant-cpu",
            "orthant-vulkan",
            "orthant-viewer",
        ],
    ),
    ("xtask", &[]),
];

/// Every dependency that is not an arrow. Dependencies of tests and examples are free.
pub fn check() -> Vec<String> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(crate::root())
        .output()
        .expect("cargo runs");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata prints JSON");
    let mut problems = Vec::new();
    for package in metadata["packages"].as_array().expect("metadata lists packages") {
        let name = package["name"].as_str().unwrap_or_default();
        let Some((_, allowed)) = ALLOWED.iter().find(|(n, _)| *n == name) else {
            problems.push(format!(
                "crate {name} has no place in the architecture: add it to xtask/src/arrows.rs and docs/ARCHITECTURE.md"
            ));
            continue;
        };
        for dependency in package["dependencies"].as_array().into_iter().flatten() {
            let on = dependency["name"].as_str().unwrap_or_default();
            let ours = dependency["path"].is_string();
            let normal = dependency["kind"].is_null();
            if ours && normal && !allowed.contains(&on) {
                problems.push(format!("crate {name} depends on {on}, which is not an arrow of the architecture"));
            }
        }
    }
    problems
}

#[cfg(test)]
mod tests {
    #[test]
    fn crates_depend_along_the_arrows_only() {
        assert_eq!(super::check(), Vec::<String>::new());
    }
}
