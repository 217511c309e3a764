//! A stream of patches that follows a camera.

use super::Rig;
use orthant_render::world::DerivedWorld;
use orthant_render::world::live::{Budget, LiveOptions};
use orthant_world::stream::{PatchStream, StreamOptions, StreamSource};
use orthant_world::{Aabb4, Generator, World};

#[test]
fn a_streamed_walk_leaves_hardly_more_leaves_than_a_fresh_world() {
    let mut rig = Rig::new(World::new(), LiveOptions::default());
    let mut stream =
        PatchStream::new(StreamSource::Generator(Generator::Platforms { seed: 1 }), StreamOptions::default());
    for step in 0..40 {
        let middle = [step * 60, 0, step * 20, 0];
        let interest = Aabb4::from_ints(middle.map(|c| c - 256), middle.map(|c| c + 256)).expect("a box");
        stream.set_interest(&interest).expect("a small box");
        while let Some(patch) = stream.next_patch() {
            rig.patch(&patch);
        }
        let frame = rig.tick_unchecked(&Budget::UNLIMITED);
        assert!(step > 0 || frame.edits_applied > 0);
    }
    rig.settle(&Budget::UNLIMITED);
    let fresh = DerivedWorld::build(rig.live.world(), &orthant_render::world::BuildOptions::default()).expect("small");
    let (now, then) = (rig.live.derived().leaf_count(), fresh.leaf_count());
    assert!(now * 2 <= then * 3, "{now} leaves, and {then} of the same world built at once");
    // Nor is the world itself in many more pieces than the generator makes of the last box.
    let last = stream.covered(
        &Aabb4::from_ints([39 * 60 - 256, -256, 39 * 20 - 256, -256], [39 * 60 + 256, 256, 39 * 20 + 256, 256])
            .expect("a box"),
    );
    let made = Generator::Platforms { seed: 1 }.regions(&last, usize::MAX).expect("no limit").len();
    assert!(now * 2 <= made * 3, "{now} leaves, and {made} of a fresh world");
}
