//! Random sequences of edits and poses, compared with a full derivation.

use crate::{Live, scenes};
use orthant_scene::Scene;
use orthant_scene::edit::random::{Choice, Choices, operation, time};
use proptest::prelude::*;

/// Drives a scene through operations. A failure names the script that leads to it.
fn drive(name: &str, scene: &Scene, choices: impl IntoIterator<Item = Choice>, syncs_each: bool) {
    let mut live = Live::new(scene.clone());
    let mut script = String::new();
    for (i, choice) in choices.into_iter().enumerate() {
        let operation = if choice.1 % 5 == 0 { time(&live.scene, choice) } else { operation(&live.scene, choice) };
        if live.edit(&operation).is_err() {
            continue;
        }
        script.push_str(&format!("{}\n", serde_json::to_string(&operation).unwrap()));
        // Several edits in one sync merge.
        if syncs_each || i % 5 == 4 {
            live.sync();
            if let Err(difference) = live.check() {
                panic!("{name}: {difference}, after\n{script}");
            }
            if live.derived.holes_are_due() {
                live.close_holes(10);
                if let Err(difference) = live.check() {
                    panic!("{name}, holes closed: {difference}, after\n{script}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn any_sequence_of_edits_is_followed(
        scene in 0..6usize,
        choices in prop::collection::vec(any::<Choice>(), 0..40),
        syncs_each: bool,
    ) {
        let (name, scene) = &scenes::all()[scene];
        drive(name, scene, choices, syncs_each);
    }
}

/// One at a time, and with a backend and rays, sequences of this length are followed in the tests of crate `orthant`.
#[test]
fn long_sequences_whose_edits_merge_five_at_a_time_are_followed() {
    let scenes = scenes::all();
    for seed in 0..60u64 {
        let (name, scene) = &scenes[seed as usize % scenes.len()];
        drive(name, scene, Choices(seed * 7919).take(200), false);
    }
}
