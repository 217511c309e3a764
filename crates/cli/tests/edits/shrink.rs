//! What a failure is shortened to, and that `orthant edit --verify` takes it.

use crate::sequence::{Finding, Source};
use crate::{finding, minimise, source, write_scenes};
use orthant_scene::edit::random::{Choices, operation};
use orthant_scene::edit::script::Operation;
use std::process::Command;

fn random_script(source: &Source, edits: usize) -> Vec<Operation> {
    let mut live = source.live().expect("it can be derived");
    let mut script = Vec::new();
    for choice in Choices(11).take(edits) {
        let operation = operation(&live.scene, choice);
        crate::sequence::step(&mut live, &operation).expect("it can be followed");
        script.push(operation);
    }
    script
}

#[test]
fn a_failure_is_shortened_to_the_operations_that_it_takes() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = source(&write_scenes(folder.path()), "deep");
    let script = random_script(&source, 120);
    // Fails at the first undo after a deletion that comes after a duplicate.
    let fails = |script: &[Operation]| {
        let mut wanted = ["duplicate", "delete", "undo"].into_iter().peekable();
        for (i, operation) in script.iter().enumerate() {
            wanted.next_if(|name| *name == operation.name());
            if wanted.peek().is_none() {
                return Some((i + 1, format!("row {i} differs")));
            }
        }
        None
    };
    let (length, what) = fails(&script).expect("the script has them");
    let (shorter, _) = minimise::shorten(script[..length].to_vec(), what, fails);
    let names: Vec<&str> = shorter.iter().map(Operation::name).collect();
    assert_eq!(names, ["duplicate", "delete", "undo"]);
}

#[test]
fn the_script_of_a_failure_is_replayed_by_the_command_that_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let source = source(&write_scenes(folder.path()), "skinned");
    let script = random_script(&source, 30);
    let path = folder.path().join("found.jsonl");
    let replay = finding::keep(&source, &path, Finding { script: script.clone(), what: "nothing".into() });
    let replay = replay.expect("the script is written");
    // Nothing fails, so nothing is left out.
    assert_eq!(replay.operations, script.len());
    let mut words = replay.command.split(' ');
    assert_eq!(words.next(), Some("orthant"));
    let output = Command::new(env!("CARGO_BIN_EXE_orthant")).args(words).output().expect("the program runs");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{err}");
    assert_eq!(out.lines().count(), script.len(), "a line of the report for each: {out}");
}
