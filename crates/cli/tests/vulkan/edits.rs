//! Random edits on the device: after each the rows, streams and TLAS instances, read back, are those of the derived scene; what
//! went through the staging ring is what the batch says; and the AOVs are those of a scene that is loaded so. Edits that are
//! taken back leave no memory behind.

use crate::{device, scenes};
use orthant::live::aovs;
use orthant_render::{DeriveOptions, DerivedScene};
use orthant_resident::backend::ResidentBytes;
use orthant_resident::{Backend, SceneBatch};
use orthant_scene::Scene;
use orthant_scene::animation::Pose;
use orthant_scene::edit::random::{Choices, operation};
use orthant_scene::edit::script::{Operation, Session};
use orthant_scene::edit::{ChangeSet, Cursor};
use orthant_scene::import::ImportOptions;
use orthant_vulkan::{ResidentRows, VulkanBackend};
use std::path::Path;

/// Edits over each of the six scenes: 2,004 in all.
const EDITS: usize = 334;
/// Edits of a sequence that is taken back as a whole, and how often each of a few sequences is made.
const SEQUENCE: usize = 100;
const SEQUENCES: usize = 10;
/// Rounds of them before the memory is looked at.
const WARM_UP: usize = 4;

struct Followed<'d> {
    scene: Scene,
    session: Session,
    derived: DerivedScene,
    cursor: Cursor,
    vulkan: &'d mut VulkanBackend,
    /// What the batches so far have made of the streams.
    streams: ResidentRows,
}

impl Followed<'_> {
    fn new(mut scene: Scene, vulkan: &mut VulkanBackend) -> Followed<'_> {
        scene.prepare_edits();
        let mut derived = DerivedScene::derive(&scene, &live()).expect("the scene is sound");
        vulkan.clear().expect("the device works");
        let batch = derived.load_batch();
        let mut streams = ResidentRows::default();
        take_streams(&mut streams, &batch);
        vulkan.apply(batch).expect("the batch is sound");
        let cursor = scene.change_log().cursor();
        let session = Session::new(Path::new("."), ImportOptions::default());
        Followed { scene, session, derived, cursor, vulkan, streams }
    }

    /// Carries an operation out and lets the device follow; false if it is refused.
    fn edit(&mut self, operation: &Operation) -> bool {
        if self.session.run(&mut self.scene, operation).is_err() {
            return false;
        }
        let changes = self.changes();
        let batch = match self.derived.sync(&self.scene, &Pose::default(), &changes) {
            Ok((batch, _)) => batch,
            Err(_) => {
                // The document holds what cannot be shown: the edit is taken back, and all is derived anew.
                self.session.take_back(&mut self.scene, operation).expect("what was there before is sound");
                let changes = self.changes();
                self.derived.sync(&self.scene, &Pose::default(), &changes).expect("what was there before is sound").0
            }
        };
        let bytes = batch.upload_bytes();
        take_streams(&mut self.streams, &batch);
        self.vulkan.apply(batch).expect("the batch is sound");
        assert_eq!(self.vulkan.uploaded().batch, bytes, "{operation:?}: what the batch says crosses, and nothing else");
        true
    }

    fn changes(&mut self) -> ChangeSet {
        self.scene.change_log().take(&mut self.cursor).expect("the log is long enough")
    }

    fn check(&mut self, what: &str) {
        let resident = self.vulkan.read_back().expect("the device works");
        self.derived.rows().compare(&resident.rows()).unwrap_or_else(|e| panic!("{what}: {e}"));
        resident.check_instances().unwrap_or_else(|e| panic!("{what}: {e}"));
        assert!(resident.positions == self.streams.positions, "{what}: positions");
        assert!(resident.vertices == self.streams.vertices, "{what}: vertices");
        assert!(resident.indices == self.streams.indices, "{what}: indices");
        assert!(resident.tangents == self.streams.tangents, "{what}: tangents");
        assert!(resident.emitter_triangles == self.streams.emitter_triangles, "{what}: emitter triangles");
        let visible =
            |row: &orthant_resident::rows::RenderNodeRow| row.flags & orthant_resident::rows::NodeFlags::VISIBLE != 0;
        for (row, node) in resident.render_nodes.iter().enumerate().filter(|(_, node)| visible(node)) {
            assert_ne!(resident.blas[node.primitive as usize], 0, "{what}: render node {row} has no BLAS");
        }
    }

    /// What is seen is what is seen of a scene that is loaded now. How many pixels show something.
    fn check_pictures(&mut self, fresh: &mut VulkanBackend, seed: u64, what: &str) -> u64 {
        let mut derived = self.derived.fresh(&self.scene).expect("the scene is sound");
        fresh.clear().expect("the device works");
        fresh.apply(derived.load_batch()).expect("the batch is sound");
        let loaded = fresh.read_back().expect("the device works");
        aovs::compare(self.vulkan, fresh, (&loaded).into(), seed).unwrap_or_else(|e| panic!("{what}: {e}"))
    }

    /// Takes everything back that the history holds.
    fn undo_all(&mut self) {
        let count = self.session.history.done().len();
        if count > 0 {
            assert!(self.edit(&Operation::Undo { count }), "{count} edits can be taken back");
        }
    }
}

fn live() -> DeriveOptions {
    DeriveOptions { live: true, ..DeriveOptions::default() }
}

fn take_streams(streams: &mut ResidentRows, batch: &SceneBatch) {
    batch.positions.clone().apply_to(&mut streams.positions);
    batch.vertices.clone().apply_to(&mut streams.vertices);
    batch.indices.clone().apply_to(&mut streams.indices);
    batch.tangents.clone().apply_to(&mut streams.tangents);
    batch.emitter_triangles.clone().apply_to(&mut streams.emitter_triangles);
}

#[test]
fn the_device_follows_random_edits() {
    let (Some(mut vulkan), Some(mut fresh)) = (device(), device()) else { return };
    for (k, (name, scene)) in scenes::all().into_iter().enumerate() {
        let mut followed = Followed::new(scene, &mut vulkan);
        let (mut carried_out, mut seen) = (0, 0);
        for (i, choice) in Choices(k as u64 + 77).take(EDITS).enumerate() {
            let operation = operation(&followed.scene, choice);
            if !followed.edit(&operation) {
                continue;
            }
            carried_out += 1;
            let what = format!("{name}, edit {i}, {operation:?}");
            followed.check(&what);
            seen += followed.check_pictures(&mut fresh, i as u64, &what);
        }
        assert!(carried_out * 2 > EDITS, "{name}: most edits are carried out");
        assert!(seen > 50 * carried_out as u64, "{name}: {seen} pixels show something");
    }
    assert_eq!(vulkan.messages().map(|m| m.first), Some(Vec::new()), "the validation layers are silent");
}

#[test]
fn moving_a_node_makes_no_allocation_no_blas_and_no_wait() {
    let Some(mut vulkan) = device() else { return };
    let (_, scene) = scenes::all().remove(1);
    // The last one is a leaf.
    let leaf = scene.nodes().len() - 1;
    let mut followed = Followed::new(scene, &mut vulkan);
    let mut moved = |x: f64| {
        let line = format!(r#"{{"op":"set_transform","node":{leaf},"translation":[{x},0,0]}}"#);
        assert!(followed.edit(&Operation::parse(&line).expect("an operation")));
        // A device that is many edits behind would hold the host back.
        while !followed.vulkan.is_idle().expect("the device works") {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let device = followed.vulkan.vulkan_device().clone();
        (device.allocated(), followed.vulkan.uploaded())
    };
    // The first takes what the device keeps from then on.
    for i in 0..4 {
        moved(f64::from(i) * 0.25);
    }
    let before = moved(2.0);
    for i in 0..50 {
        let after = moved(3.0 + f64::from(i) * 0.01);
        assert_eq!(before.0, after.0, "no allocation");
        assert_eq!(before.1.waits, after.1.waits, "no wait");
        assert!(after.1.batch + after.1.overhead < 1024, "{:?}", after.1);
    }
    followed.check("moved");
}

#[test]
fn what_was_loaded_and_dropped_and_edited_leaves_no_memory_behind() {
    let Some(mut vulkan) = device() else { return };
    let (_, scene) = scenes::all().remove(0);
    let cycle = |vulkan: &mut VulkanBackend| {
        let mut derived = DerivedScene::derive(&scene, &DeriveOptions::default()).expect("the scene is sound");
        vulkan.clear().expect("the device works");
        vulkan.apply(derived.load_batch()).expect("the batch is sound");
    };
    cycle(&mut vulkan);
    let before = crate::emptied(&mut vulkan);
    for _ in 0..1000 {
        cycle(&mut vulkan);
    }
    crate::assert_emptied(&mut vulkan, before);
}

#[test]
fn ten_thousand_edits_that_are_taken_back_leave_no_memory_behind() {
    let Some(mut vulkan) = device() else { return };
    let (_, scene) = scenes::all().remove(2);
    let device = vulkan.vulkan_device().clone();
    let mut followed = Followed::new(scene, &mut vulkan);
    // The same edits in every round: those that are chosen in the first, over the scene as it is then.
    let mut sequences: Vec<Vec<Operation>> = Vec::new();
    let mut round = |followed: &mut Followed<'_>| {
        let mut carried_out = 0;
        for k in 0..SEQUENCES {
            if let Some(sequence) = sequences.get(k) {
                carried_out += sequence.iter().filter(|operation| followed.edit(operation)).count();
            } else {
                let mut sequence = Vec::new();
                for choice in Choices(k as u64 + 5).take(SEQUENCE) {
                    sequence.push(operation(&followed.scene, choice));
                    carried_out += usize::from(followed.edit(&sequence[sequence.len() - 1]));
                }
                sequences.push(sequence);
            }
            followed.undo_all();
        }
        // It waits for all that is in flight, and what that has used is let go.
        followed.check("after a round");
        followed.vulkan.read_back().expect("the device works");
        (device.allocated(), followed.vulkan.resident_bytes(), carried_out)
    };
    // Buffers keep the size that the largest scene has needed: a few rounds, and every one has been there.
    let mut rounds: Vec<_> = (0..WARM_UP).map(|_| round(&mut followed)).collect();
    let mut carried_out = 0;
    while carried_out < 10_000 {
        rounds.push(round(&mut followed));
        carried_out += rounds[rounds.len() - 1].2;
    }
    let allocations = |&((_, count), ..): &((u64, usize), ResidentBytes, usize)| count;
    assert!(rounds.iter().all(|round| allocations(round) == allocations(&rounds[0])), "{rounds:?}");
    let (before, after) = (&rounds[WARM_UP - 1], &rounds[rounds.len() - 1]);
    assert_eq!((before.0, before.1), (after.0, after.1));
}
