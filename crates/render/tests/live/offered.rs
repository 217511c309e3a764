//! Patches that wait for the time of a tick.

use super::*;
use orthant_render::world::live::LiveError;
use orthant_world::{Material, PaletteEntry};

#[test]
fn offered_patches_are_applied_in_their_order_and_a_burst_costs_no_frame_more_than_its_share() {
    let mut rig = Rig::new(World::new(), LiveOptions::default());
    for id in 1..=50 {
        rig.live.offer_patch(edit::set_voxel([3, 4, 5, 6], Scale::UNIT, block(id)).expect("a voxel"));
    }
    // Without any time a tick still gets on, by one patch.
    let none = Budget { ms: 0.0, ..Budget::UNLIMITED };
    for waiting in (40..50).rev() {
        let frame = rig.tick(&none);
        assert_eq!((frame.patches, frame.patches_waiting), (1, waiting));
        assert!(!rig.live.is_settled());
    }
    rig.settle(&Budget::UNLIMITED);
    assert_eq!(rig.live.world().block_at(Point4::from_ints([3, 4, 5, 6])), block(50));
    assert_eq!(rig.live.world().revision(), 50);
}

#[test]
fn an_offered_patch_that_is_refused_is_an_error_of_its_tick_and_the_next_ones_go_on() {
    let mut rig = Rig::new(World::new(), LiveOptions::default());
    let named = |red: f32| {
        let mut patch = edit::fill_box(ints([0; 4], [1; 4]), block(1));
        patch.palette = vec![PaletteEntry { id: BlockId(1), material: Material::colored("stone", [red, 0.0, 0.0]) }];
        patch
    };
    // The same name with another content is refused.
    for patch in [named(0.25), named(0.5), edit::fill_box(ints([4; 4], [5; 4]), block(1))] {
        rig.live.offer_patch(patch);
    }
    let refused = rig.live.tick(&mut rig.backend, rig.camera, &Budget::UNLIMITED);
    assert!(matches!(refused, Err(LiveError::Patch(_))), "{refused:?}");
    assert_eq!((rig.live.world().revision(), rig.live.offered()), (1, 1));
    rig.settle(&Budget::UNLIMITED);
    assert_eq!(rig.live.world().revision(), 2);
}
