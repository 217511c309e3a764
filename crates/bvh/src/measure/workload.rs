//! Reproducible boxes, edits and rays.

use super::Plan;
use crate::aabb::Aabb;

/// Everything that the operations are measured with, in `N` dimensions.
#[derive(Clone, Debug)]
pub struct Load<const N: usize> {
    /// How much there is.
    pub plan: Plan,
    /// The boxes of the items 0, 1, ....
    pub boxes: Vec<Aabb<f32, N>>,
    /// Boxes anywhere: inserted, or moved to.
    pub new: Vec<Aabb<f32, N>>,
    /// As many items, none twice, with their box moved a little.
    pub near: Vec<(u32, Aabb<f32, N>)>,
    /// Every item, with its box moved a little.
    pub every: Vec<(u32, Aabb<f32, N>)>,
    /// Random edits.
    pub edits: Vec<RandomEdit<N>>,
    /// The boxes after these.
    pub edited: Vec<Aabb<f32, N>>,
    /// Rays: origin and direction.
    pub rays: Vec<([f32; N], [f32; N])>,
}

impl<const N: usize> Load<N> {
    /// The same for the same plan.
    pub fn new(plan: Plan) -> Self {
        let mut random = Random(1);
        let edge = edge::<N>(plan.n);
        let boxes: Vec<_> = (0..plan.n).map(|_| random_box(&mut random, edge)).collect();
        let mut shuffled: Vec<u32> = (0..plan.n as u32).collect();
        for i in 1..shuffled.len() {
            shuffled.swap(i, random.below(i + 1));
        }
        shuffled.truncate(plan.edits);
        let near = shuffled.iter().map(|&item| (item, nudged(&mut random, &boxes[item as usize]))).collect();
        let every = (0..).zip(&boxes).map(|(item, bounds)| (item, nudged(&mut random, bounds))).collect();
        let new = (0..plan.edits).map(|_| random_box(&mut random, edge)).collect();
        let rays = random_rays(plan.rays, edge, &mut random);
        let mut edited = boxes.clone();
        let edits = random_edits(&mut edited, plan.edits, &mut random);
        Self { plan, boxes, new, near, every, edits, edited, rays }
    }
}

/// SplitMix64: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// In 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In 0..count.
    pub fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.bits()) * count as u128) >> 64) as usize
    }
}

/// The edge of the cube that holds `n` boxes, one in each unit cell on average.
pub fn edge<const N: usize>(n: usize) -> f32 {
    (n as f32).powf(1.0 / N as f32)
}

/// A box of random edges up to 1, anywhere in a cube of the given edge.
pub fn random_box<const N: usize>(random: &mut Random, edge: f32) -> Aabb<f32, N> {
    let min = core::array::from_fn(|_| random.unit() * edge);
    Aabb::new(min, min.map(|c| c + random.unit()))
}

/// The box, up to half a unit away on every axis.
pub fn nudged<const N: usize>(random: &mut Random, bounds: &Aabb<f32, N>) -> Aabb<f32, N> {
    let mut moved = *bounds;
    for a in 0..N {
        let by = random.unit() - 0.5;
        moved.min[a] += by;
        moved.max[a] += by;
    }
    moved
}

/// An edit of a random workload.
#[derive(Clone, Copy, Debug)]
pub enum RandomEdit<const N: usize> {
    /// Give an item a box.
    Move(u32, Aabb<f32, N>),
    /// Take an item out.
    Remove(u32),
    /// Put an item in.
    Insert(u32, Aabb<f32, N>),
}

/// Edits that leave the boxes as even as they were: half are moves, near and far, the others take an item out and put one
/// in elsewhere. `boxes` follows.
pub fn random_edits<const N: usize>(
    boxes: &mut [Aabb<f32, N>],
    count: usize,
    random: &mut Random,
) -> Vec<RandomEdit<N>> {
    let edge = edge::<N>(boxes.len());
    let mut edits = Vec::with_capacity(count + 1);
    while edits.len() < count {
        let item = random.below(boxes.len());
        let kind = random.below(4);
        boxes[item] = if kind == 0 { nudged(random, &boxes[item]) } else { random_box(random, edge) };
        if kind < 2 {
            edits.push(RandomEdit::Move(item as u32, boxes[item]));
        } else {
            edits.push(RandomEdit::Remove(item as u32));
            edits.push(RandomEdit::Insert(item as u32, boxes[item]));
        }
    }
    edits
}

/// Origins and unit directions of rays that start anywhere in the cube.
pub fn random_rays<const N: usize>(count: usize, edge: f32, random: &mut Random) -> Vec<([f32; N], [f32; N])> {
    let ray = |_| {
        let origin = core::array::from_fn(|_| random.unit() * edge);
        let mut direction = [0.0f32; N];
        let mut length = 0.0f32;
        while !(0.01..=1.0).contains(&length) {
            direction = core::array::from_fn(|_| 2.0 * random.unit() - 1.0);
            length = direction.iter().map(|c| c * c).sum();
        }
        (origin, direction.map(|c| c / length.sqrt()))
    };
    (0..count).map(ray).collect()
}
