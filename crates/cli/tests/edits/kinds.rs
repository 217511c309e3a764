//! What random sequences are made of.

use crate::{sequence, source, write_scenes};
use orthant_scene::edit::random::Choices;
use orthant_scene::edit::script::Operation;
use std::collections::BTreeSet;

#[test]
fn random_sequences_carry_out_every_operation_that_there_is() {
    // The parser names every operation.
    let error = Operation::parse(r#"{"op": "?"}"#).expect_err("there is no such operation").to_string();
    let all: BTreeSet<&str> = error.split_once("known are: ").expect("the list").1.split(", ").collect();
    assert!(all.len() >= 25, "{error}");
    let folder = tempfile::tempdir().expect("a folder");
    let files = write_scenes(folder.path());
    let mut done: BTreeSet<&str> = BTreeSet::new();
    let mut matrices = 0;
    for name in ["skinned", "variants"] {
        let source = source(&files, name);
        for seed in 0..6 {
            let mut live = source.live().expect("it can be derived");
            for choice in Choices(seed).take(200) {
                let operation = source.operation(&live.scene, choice);
                if sequence::step(&mut live, &operation).expect("it can be followed") {
                    done.insert(operation.name());
                    matrices += u32::from(matches!(operation, Operation::SetTransform { matrix: Some(_), .. }));
                }
            }
        }
    }
    let missing: Vec<&&str> = all.difference(&done).collect();
    assert!(missing.is_empty(), "never carried out: {missing:?}");
    assert!(matrices > 10, "{matrices} matrices");
}
