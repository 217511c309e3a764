//! Camera motion does nothing to the scene.

use super::{Rig, platforms};
use orthant_render::world::live::{Budget, Diagnostics, LiveOptions};
use orthant_world::Point4;

#[test]
fn a_thousand_frames_of_fast_flight_write_nothing() {
    let mut rig = Rig::new(platforms(704), LiveOptions::default());
    rig.set([3, -5, 2, 1], 7);
    rig.settle(&Budget::default());
    let (commands, revision) = (rig.backend.commands, rig.backend.active.revision);
    for step in 0..1000 {
        // From one end of space to beyond the other.
        rig.camera = Point4::from_ints([(step - 500) * 4_000_000, step % 50, -step, step / 3]);
        let frame = rig.tick_unchecked(&Budget::default());
        let zero = Diagnostics {
            frame: frame.frame,
            revisions: frame.revisions,
            occupancy: frame.occupancy,
            leaves: frame.leaves,
            depth: frame.depth,
            sah_growth: frame.sah_growth,
            edit_ms: frame.edit_ms,
            mutation_ms: frame.mutation_ms,
            ..Diagnostics::default()
        };
        assert_eq!(frame, zero, "no patch, no queue entry, no byte, no compaction, no rebuild");
        assert_eq!((frame.revisions.mirror, frame.revisions.resident), (revision, revision));
    }
    assert_eq!((rig.backend.commands, rig.backend.active.revision), (commands, revision));
}
