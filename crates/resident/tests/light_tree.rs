//! A light tree that follows changes is as good as one that is built anew, and costs what changed.

use glam::Vec3;
use orthant_resident::math::{safe_normalize, unit_float};
use orthant_resident::rows::NONE;
use orthant_resident::sampling::hash_combine;
use orthant_resident::sampling::light_tree::{LightBounds, LightNode, LightTree};
use proptest::prelude::*;

/// What is on another machine, and follows by writes alone.
#[derive(Default)]
struct Copy {
    nodes: Vec<LightNode>,
    leaves: Vec<u32>,
}

impl Copy {
    fn follow(&mut self, tree: &mut LightTree) -> usize {
        let writes = tree.take_writes();
        self.nodes.resize(writes.node_count, bytemuck::Zeroable::zeroed());
        self.leaves.resize(writes.leaf_count, NONE);
        writes.nodes.iter().for_each(|&at| self.nodes[at as usize] = tree.nodes[at as usize]);
        writes.leaves.iter().for_each(|&light| self.leaves[light as usize] = tree.leaves[light as usize]);
        assert_eq!(self.nodes, tree.nodes);
        assert_eq!(self.leaves, tree.leaves);
        writes.nodes.len()
    }
}

fn random(i: u32, k: u32) -> f32 {
    unit_float(hash_combine(hash_combine(11, i), k))
}

/// A light that a number decides: surfaces, spots and points, near and far, many in one place.
fn light(seed: u32) -> LightBounds {
    let scale = [0.0, 1.0, 10.0, 10.0, 1e4][seed as usize % 5];
    let at = Vec3::new(random(seed, 0), random(seed, 1), random(seed, 2)) * scale;
    let axis = Vec3::new(random(seed, 3), random(seed, 4), random(seed, 5)) - 0.5;
    let size = if seed.is_multiple_of(3) { 0.0 } else { 0.2 * random(seed, 6) };
    LightBounds {
        lower: at.to_array(),
        intensity: 0.01 + random(seed, 7).powi(4) * 100.0,
        upper: (at + Vec3::splat(size)).to_array(),
        cos_spread: [1.0, -1.0, 0.7][seed as usize % 3],
        axis: safe_normalize(axis, Vec3::Z).to_array(),
        cos_end: [0.0, 1.0][seed as usize % 2],
    }
}

fn check(tree: &LightTree, lights: &[Option<LightBounds>]) {
    tree.validate().unwrap();
    assert_eq!(tree.len(), lights.iter().flatten().count());
    assert!((0..).zip(lights).all(|(light, bounds)| tree.get(light) == bounds.as_ref()));
}

#[derive(Clone, Debug)]
enum Change {
    Put(u32, u32),
    Power(u32, u32),
    Remove(u32),
    /// Many in one batch.
    Batch(Vec<(u32, Option<u32>)>),
}

fn change() -> impl Strategy<Value = Change> {
    let light = 0..60u32;
    prop_oneof![
        6 => (light.clone(), any::<u32>()).prop_map(|(light, seed)| Change::Put(light, seed)),
        2 => (light.clone(), any::<u32>()).prop_map(|(light, seed)| Change::Power(light, seed)),
        4 => light.clone().prop_map(Change::Remove),
        1 => prop::collection::btree_map(light, any::<Option<u32>>(), 0..40)
            .prop_map(|batch| Change::Batch(batch.into_iter().collect())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn any_sequence_of_changes_is_followed(
        first in 0..40u32,
        changes in prop::collection::vec(change(), 0..80),
    ) {
        let mut lights: Vec<Option<LightBounds>> = (0..first).map(|i| (i % 4 != 2).then(|| light(i))).collect();
        let mut tree = LightTree::build(&lights);
        lights.resize(60, None);
        let mut copy = Copy::default();
        copy.follow(&mut tree);
        for change in changes {
            match change {
                Change::Put(at, seed) => {
                    lights[at as usize] = Some(light(seed));
                    tree.set(at, lights[at as usize]);
                }
                Change::Power(at, seed) => {
                    let changed = lights[at as usize].map(|b| LightBounds { intensity: light(seed).intensity, ..b });
                    lights[at as usize] = changed;
                    tree.set(at, changed);
                }
                Change::Remove(at) => {
                    lights[at as usize] = None;
                    tree.set(at, None);
                }
                Change::Batch(batch) => {
                    let batch: Vec<_> = batch.into_iter().map(|(at, seed)| (at, seed.map(light))).collect();
                    batch.iter().for_each(|&(at, bounds)| lights[at as usize] = bounds);
                    tree.update(&batch);
                }
            }
            check(&tree, &lights);
            copy.follow(&mut tree);
        }
        for i in 0..4 {
            let from = Vec3::new(random(i, 20), random(i, 21), random(i, 22)) * 14.0 - 2.0;
            let sum: f64 = (0..60).map(|l| f64::from(tree.probability(l, from, Vec3::ZERO))).sum();
            // Less than 1 where a group seemed to bring light and none of its parts does.
            prop_assert!(sum < 1.0 + 1e-4 && (tree.is_empty() || sum > 0.5 - 1e-4), "{}", sum);
            for k in 0..40 {
                let Some((l, p)) = tree.sample(from, Vec3::ZERO, random(i, 30 + k)) else { continue };
                prop_assert!((p / tree.probability(l, from, Vec3::ZERO) - 1.0).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn lights_that_shine_all_around_are_chosen_with_a_probability_of_one_altogether() {
    let at = |i: u32| light(i * 3 + 1).lower;
    let around =
        |i: u32| LightBounds { lower: at(i), upper: at(i), cos_spread: -1.0, cos_end: 1.0, ..light(i * 3 + 1) };
    let mut tree = LightTree::default();
    for i in 0..500 {
        tree.set(i % 300, Some(around(i)));
    }
    for i in 0..20 {
        let from = Vec3::new(random(i, 20), random(i, 21), random(i, 22)) * 14.0;
        let sum: f64 = (0..300).map(|l| f64::from(tree.probability(l, from, Vec3::ZERO))).sum();
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }
}

#[test]
fn a_batch_of_most_lights_is_a_fresh_build_and_a_small_one_is_not() {
    let mut lights: Vec<Option<LightBounds>> = (0..100).map(|i| (i % 9 != 0).then(|| light(i))).collect();
    let mut tree = LightTree::build(&lights);
    let change = |lights: &mut [Option<LightBounds>], tree: &mut LightTree, numbers: std::ops::Range<u32>| {
        let batch: Vec<_> = numbers.map(|i| (i, (i % 7 != 0).then(|| light(1000 + i)))).collect();
        batch.iter().for_each(|&(at, bounds)| lights[at as usize] = bounds);
        tree.update(&batch);
    };
    tree.take_counters();
    change(&mut lights, &mut tree, 20..60);
    assert_eq!(tree.take_counters().rebuilds, 0);
    change(&mut lights, &mut tree, 20..60);
    assert_eq!(tree.take_counters().visited, 0, "they are what they were");
    change(&mut lights, &mut tree, 0..100);
    assert_eq!(tree.take_counters().rebuilds, 1);
    assert_eq!(tree.nodes, LightTree::build(&lights).nodes);
    check(&tree, &lights);
    let nothing: Vec<_> = (0..100).map(|light| (light, None)).collect();
    tree.update(&nothing);
    assert!(tree.is_empty() && tree.nodes.is_empty());
    tree.validate().unwrap();
}

fn lamp(at: Vec3) -> LightBounds {
    let at = at.to_array();
    LightBounds { lower: at, upper: at, intensity: 1.0, cos_spread: -1.0, ..LightBounds::NOTHING }
}

/// The second moment of one choice's estimate over the squared sum, for ground under lamps: 1 for the best choice.
fn second_moment(tree: &LightTree, lights: &[Option<LightBounds>]) -> f32 {
    let mut moment = 0.0;
    for i in 0..200 {
        let from = Vec3::new(random(i, 0) * 320.0, 0.0, random(i, 1) * 320.0);
        let (mut sum, mut squares) = (0.0, 0.0);
        for (light, bounds) in (0..).zip(lights).filter_map(|(light, bounds)| Some((light, (*bounds)?))) {
            let to = Vec3::from_array(bounds.lower) - from;
            let irradiance = bounds.intensity * to.y / to.length().powi(3);
            sum += irradiance;
            squares += irradiance * irradiance / tree.probability(light, from, Vec3::Y);
        }
        moment += squares / (sum * sum) / 200.0;
    }
    moment
}

#[test]
fn choices_are_about_as_good_after_ten_thousand_changes_as_in_a_fresh_tree() {
    let place = |i: u32| Vec3::new(random(i, 8) * 320.0, 5.0 + 3.0 * random(i, 9), random(i, 10) * 320.0);
    // A grid that is thinned out and moved about; and one that comes into being lamp by lamp.
    for start in [1000, 0] {
        let on_grid = |i: u32| lamp(Vec3::new((i % 32) as f32 * 10.0, 5.0, (i / 32) as f32 * 10.0));
        let mut lights: Vec<_> = (0..1000).map(|i| (i < start).then(|| on_grid(i))).collect();
        let mut tree = LightTree::build(&lights);
        for step in 0..10_000u32 {
            let at = hash_combine(step, start) % 1000;
            let before = lights[at as usize];
            let after = match (before, step % 4) {
                (Some(_), 0) => None,
                (Some(lamp), 1) => Some(LightBounds { intensity: 0.5 + random(step, 11), ..lamp }),
                _ => Some(lamp(place(step))),
            };
            lights[at as usize] = after;
            tree.set(at, after);
        }
        check(&tree, &lights);
        let (followed, fresh) = (second_moment(&tree, &lights), second_moment(&LightTree::build(&lights), &lights));
        eprintln!("second moment: {followed} after changes, {fresh} fresh");
        assert!(followed <= 1.3 * fresh, "{followed}, and {fresh} in a fresh tree");
    }
}

#[test]
fn a_change_costs_its_path_however_many_lights_there_are() {
    for count in [1000u32, 10_000, 100_000] {
        let edge = f32::from(count.isqrt() as u16);
        let place = |i: u32| Vec3::new(random(i, 0) * edge, 1.0, random(i, 1) * edge);
        let lights: Vec<_> = (0..count).map(|i| Some(lamp(place(i)))).collect();
        let mut tree = LightTree::build(&lights);
        tree.take_writes();
        tree.take_counters();
        let (mut most_visited, mut most_written, mut most_for_power) = (0, 0, 0);
        for step in 0..2000 {
            let at = hash_combine(step, 5) % count;
            tree.set(at, Some(lamp(place(count + step))));
            most_visited = most_visited.max(tree.take_counters().visited);
            most_written = most_written.max(tree.take_writes().nodes.len());
            tree.set(at, tree.get(at).map(|&lamp| LightBounds { intensity: 2.0 + random(step, 3), ..lamp }));
            assert_eq!(tree.take_writes().leaves, []);
            most_for_power = most_for_power.max(tree.take_counters().visited);
        }
        eprintln!("{count}: {most_visited} visited, {most_written} written, {most_for_power} for power");
        let levels = u64::from(count.ilog2());
        assert!(most_visited <= 9 * levels && most_written as u64 <= 9 * levels, "{most_visited}, {most_written}");
        assert!(most_for_power <= 3 * levels, "{most_for_power}");
        tree.validate().unwrap();
    }
}
