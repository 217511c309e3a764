//! Long random sequences of patches: the set is what the world is wherever it says so, and everywhere in the end.

use super::content::{are_disjoint, equal_within, shapes};
use super::interpreter::Interpreter;
use super::patches::Patches;
use orthant_render::world::{BuildOptions, DerivedWorld, OpLimits, Plan};
use orthant_resident::world::rows::LeafRow;
use orthant_world::{Aabb4, World, WorldPatch};

/// A world, what is derived of it, and the judges.
struct Course {
    world: World,
    derived: DerivedWorld,
    arenas: Interpreter,
    /// To which only what was synced was applied.
    shadow: World,
    dirty: Vec<Aabb4>,
    untidy: Vec<Aabb4>,
    options: BuildOptions,
    cuts: usize,
    splits: usize,
}

impl Course {
    fn new(world: World, options: BuildOptions) -> Self {
        let derived = DerivedWorld::build(&world, &options).unwrap();
        let arenas = Interpreter::after(derived.load_batches(1000));
        let mut shadow = World::new();
        shadow.apply(&WorldPatch::of_tree(world.extract(&options.clip))).unwrap();
        let (dirty, untidy) = (Vec::new(), Vec::new());
        let course = Self { world, derived, arenas, shadow, dirty, untidy, options, cuts: 0, splits: 0 };
        course.check(&[options.clip]);
        course
    }

    fn patch(&mut self, patch: &WorldPatch) {
        let applied = self.world.apply(patch).unwrap();
        self.dirty.extend(applied.changed);
        // Regions may be others where blocks are the same.
        self.untidy.extend(applied.removed.iter().map(|(_, region)| region.bounds));
    }

    fn plan(&mut self, bounds: &Aabb4, limits: &OpLimits) -> Plan {
        let plan = self.derived.plan(&self.world, bounds, limits).unwrap();
        if !plan.batch.is_empty() {
            self.arenas.apply(&plan.batch);
            self.derived.commit(&plan.batch).unwrap();
        }
        self.arenas.check_mirror(self.derived.mirror());
        for synced in plan.synced.iter().filter_map(|bounds| bounds.intersection(&self.options.clip)) {
            self.shadow.apply(&WorldPatch::of_tree(self.world.extract(&synced))).unwrap();
        }
        self.cuts += usize::from(plan.untidy);
        self.splits += plan.deferred.len();
        plan
    }

    /// The leaves, after all checks of what they are.
    fn check(&self, synced: &[Aabb4]) -> Vec<LeafRow> {
        self.derived.validate().unwrap();
        let leaves = self.arenas.reach(self.derived.origin());
        assert!(are_disjoint(&leaves));
        for bounds in synced.iter().filter_map(|bounds| bounds.intersection(&self.options.clip)) {
            assert!(equal_within(&leaves, &self.arenas, &self.world, &bounds), "not synced: {bounds:?}");
        }
        leaves
    }

    /// One operation on a dirty box of one's choice.
    fn step(&mut self, index: usize, limits: &OpLimits) {
        let bounds = self.dirty.swap_remove(index);
        let plan = self.plan(&bounds, limits);
        let leaves = self.check(&plan.synced);
        if plan.untidy && plan.deferred.is_empty() {
            let again = self.plan(&bounds, limits);
            assert!(again.batch.is_empty() || !again.untidy, "what was cut is not cut again");
        }
        assert!(
            equal_within(&leaves, &self.arenas, &self.shadow, &Aabb4::SPACE.intersection(&self.options.clip).unwrap()),
            "something changed outside of what was synced"
        );
        let covered: Vec<Aabb4> = plan.synced.iter().chain(&plan.deferred).copied().collect();
        assert!(is_covered(&bounds, &covered), "a part of {bounds:?} is neither synced nor deferred");
        if plan.untidy {
            self.untidy.push(bounds);
        }
        self.dirty.extend(plan.deferred);
    }

    /// Everything that is dirty, then everything that is untidy; then the leaves are those of a fresh build.
    fn finish(&mut self, limits: &OpLimits) {
        while let Some(last) = self.dirty.len().checked_sub(1) {
            self.step(last, limits);
        }
        let leaves = self.check(&[self.options.clip]);
        assert!(equal_within(&leaves, &self.arenas, &self.world, &self.options.clip));
        let large = OpLimits { chunks: 1 << 20, leaves: 1 << 20, focus: None };
        for bounds in std::mem::take(&mut self.untidy) {
            let plan = self.plan(&bounds, &large);
            assert!(!plan.untidy && plan.deferred.is_empty());
        }
        let leaves = self.check(&[self.options.clip]);
        let fresh = DerivedWorld::build(&self.world, &self.options).unwrap();
        let fresh_arenas = Interpreter::after(fresh.load_batches(u64::MAX));
        let fresh_leaves = fresh_arenas.reach(fresh.origin());
        assert!(
            shapes(&leaves, &self.arenas) == shapes(&fresh_leaves, &fresh_arenas),
            "leaves are those of a fresh build"
        );
    }
}

fn is_covered(bounds: &Aabb4, by: &[Aabb4]) -> bool {
    let mut left = vec![*bounds];
    for cover in by {
        left = left.iter().flat_map(|part| part.subtract(cover).to_vec()).collect();
    }
    left.is_empty()
}

fn run(seed: u64, about: [i64; 4], steps: usize, options: BuildOptions) -> Course {
    let mut patches = Patches { random: super::patches::Random(seed), about, reach: 20 };
    let mut world = World::new();
    for _ in 0..10 {
        world.apply(&patches.next()).unwrap();
    }
    let mut course = Course::new(world, options);
    for _ in 0..steps {
        course.patch(&patches.next());
        let random = &mut patches.random;
        // Now and then a burst waits for a while, and what is done is not in the order in which it came.
        while course.dirty.len() > 40 || (!course.dirty.is_empty() && random.below(3) == 0) {
            let limits =
                OpLimits { chunks: random.pick(&[1, 2, 64]), leaves: random.pick(&[1, 3, 10, 512]), focus: None };
            let index = random.below(course.dirty.len() as u64) as usize;
            course.step(index, &limits);
        }
    }
    course.finish(&OpLimits { chunks: 2, leaves: 10, focus: None });
    course
}

#[test]
fn a_random_sequence_at_the_origin_is_followed_exactly() {
    let mut cuts = 0;
    let mut splits = 0;
    for seed in 0..4 {
        let course = run(seed, [0; 4], 60, BuildOptions::default());
        cuts += course.cuts;
        splits += course.splits;
    }
    assert!(cuts > 10 && splits > 10, "small limits ask for cuts ({cuts}) and splits ({splits})");
}

#[test]
fn a_random_sequence_a_million_units_away_is_followed_exactly() {
    run(10, [-1_000_000, 1_000_003, -999_999, 1_000_000], 100, BuildOptions::default());
}

#[test]
fn a_random_sequence_about_an_origin_far_away_is_followed_exactly() {
    let origin = Some(orthant_world::Point4::from_ints([2_000_000_000; 4]));
    run(11, [0; 4], 60, BuildOptions { origin, ..BuildOptions::default() });
}

#[test]
fn what_lies_outside_of_the_clip_is_left_out_now_and_later() {
    let clip = Aabb4::from_raw([-(9 << 16) - 123; 4], [(11 << 16) + 77; 4]).unwrap();
    run(12, [0; 4], 150, BuildOptions { clip, ..BuildOptions::default() });
}
