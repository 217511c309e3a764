//! A model to compare with.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use orthant_bvh::{Aabb, Bvh, Ray, Real, Scalar};

/// Coordinates as the tests make them: small integers, and ends that are as far out as the type goes.
pub trait Coordinate: Scalar {
    fn small(value: i32) -> Self;
}

macro_rules! coordinate {
    ($t:ty) => {
        impl Coordinate for $t {
            fn small(value: i32) -> Self {
                value as $t
            }
        }
    };
}
coordinate!(f32);
coordinate!(f64);
coordinate!(i32);
coordinate!(i64);

/// What a tree is to hold.
pub type Model<S, const N: usize> = BTreeMap<u32, Aabb<S, N>>;

/// The invariants, the items, and what queries find, against a look at every box.
pub fn assert_equals_model<S: Coordinate, const N: usize>(bvh: &Bvh<S, N>, model: &Model<S, N>, seed: i32) {
    bvh.validate().expect("every invariant holds");
    assert_eq!(bvh.len(), model.len());
    let mut items: Vec<_> = bvh.items().collect();
    items.sort_by_key(|&(item, _)| item);
    assert_eq!(items, model.iter().map(|(&item, &bounds)| (item, bounds)).collect::<Vec<_>>());

    let corner = std::array::from_fn(|a| S::small((seed >> (3 * a)) % 9 - 4));
    let region = Aabb::new(corner, corner.map(|c| S::small(c.to_f64() as i32 + 3)));
    let mut found = collect(|visit| bvh.overlap(&region, |item, _| visit(item)));
    found.sort_unstable();
    assert_eq!(found, by_hand(model, |b| (0..N).all(|a| b.min[a] <= region.max[a] && region.min[a] <= b.max[a])));

    let mut found = collect(|visit| bvh.point(&corner, |item, _| visit(item)));
    found.sort_unstable();
    assert_eq!(found, by_hand(model, |b| (0..N).all(|a| b.min[a] <= corner[a] && corner[a] <= b.max[a])));

    assert_ray(bvh, model, seed);
}

fn collect(query: impl FnOnce(&mut dyn FnMut(u32) -> ControlFlow<()>) -> ControlFlow<()>) -> Vec<u32> {
    let mut found = Vec::new();
    let flow = query(&mut |item| {
        found.push(item);
        ControlFlow::Continue(())
    });
    assert_eq!(flow, ControlFlow::Continue(()));
    found
}

fn by_hand<S: Coordinate, const N: usize>(model: &Model<S, N>, holds: impl Fn(&Aabb<S, N>) -> bool) -> Vec<u32> {
    model.iter().filter(|(_, bounds)| holds(bounds)).map(|(&item, _)| item).collect()
}

fn assert_ray<S: Coordinate, const N: usize>(bvh: &Bvh<S, N>, model: &Model<S, N>, seed: i32) {
    let origin: [i32; N] = std::array::from_fn(|a| (seed >> (2 * a)) % 25 - 12);
    // Many directions along axes, in faces of boxes: small integers, zero among them.
    let mut direction: [i32; N] = std::array::from_fn(|a| (seed >> (5 * a)) % 3 - 1);
    if direction == [0; N] {
        direction[seed as usize % N] = 1;
    }
    let real = |v: [i32; N]| v.map(|c| S::Real::from_f64(f64::from(c)));
    let ray = Ray::new(real(origin), real(direction), S::Real::ZERO, S::Real::from_f64(30.0));

    let mut all = Vec::new();
    bvh.ray(&ray, |hit| {
        all.push(hit.item);
        hit.t_max
    });
    all.sort_unstable();
    let expected = by_hand(model, |b| ray.enter(b, S::Real::from_f64(30.0)) < S::Real::INFINITY);
    assert_eq!(all, expected, "the ray visits each box that it enters, once");
    for (item, bounds) in model {
        let (near, far) = exact_slab(bounds, origin, direction);
        if near <= far {
            assert!(all.contains(item), "the ray misses item {item}");
        }
        if near > far + 1e-3 {
            assert!(!all.contains(item), "the ray does not meet item {item}");
        }
    }

    let mut nearest = S::Real::INFINITY;
    bvh.ray(&ray, |hit| {
        assert!(hit.t <= hit.t_max);
        nearest = hit.t;
        hit.t
    });
    let expected = model.values().map(|b| ray.enter(b, S::Real::from_f64(30.0)).to_f64()).fold(f64::INFINITY, f64::min);
    assert_eq!(nearest.to_f64(), expected, "the nearest box");

    let mut seen = 0;
    bvh.ray(&ray, |_| {
        seen += 1;
        S::Real::from_f64(-1.0)
    });
    assert_eq!(seen, usize::from(!all.is_empty()), "a visitor that has enough is not asked again");
}

/// Entry and exit by division, on axes where the ray moves; the interval is empty where it does not move and lies outside.
fn exact_slab<S: Coordinate, const N: usize>(b: &Aabb<S, N>, origin: [i32; N], direction: [i32; N]) -> (f64, f64) {
    let (mut near, mut far) = (0.0f64, 30.0f64);
    for a in 0..N {
        let (o, d) = (f64::from(origin[a]), f64::from(direction[a]));
        let (min, max) = (b.min[a].to_f64(), b.max[a].to_f64());
        if d == 0.0 {
            if o < min || o > max {
                return (1.0, f64::NEG_INFINITY);
            }
        } else {
            let (t0, t1) = ((min - o) / d, (max - o) / d);
            near = near.max(t0.min(t1));
            far = far.min(t0.max(t1));
        }
    }
    (near, far)
}
