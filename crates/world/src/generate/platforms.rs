//! `platforms`: a Poisson-like scatter of uniform boxes in four dimensions.
//!
//! Space is divided into cells of 384 x 96 x 384 x 384 units with one hashed candidate each. A candidate falls if another one that is
//! nearer than 384 units, with distances in y counted four times, has a higher priority. What remains is the centre of a
//! platform: 16 units thick, 160 to 288 wide in x, z and w. The candidate of the origin's cell is the origin, nothing is
//! above it, and its platform is 288 wide. Where the corners of two platforms meet, the higher priority has the space.

use super::hash::{below, hash};
use super::{TooManyRegions, block};
use crate::palette::{Material, Pattern};
use crate::space::{Aabb4, Fixed};
use crate::world::Region;

/// Extents of a candidate cell, in units.
const CELL: [i64; 4] = [384, 96, 384, 384];
/// Candidates nearer than this compete.
const REACH: i64 = 384;
/// Distances along the axes count so many times.
const STRETCH: [i64; 4] = [1, 4, 1, 1];
/// Half the extent of the widest platform.
const WIDEST: [i64; 4] = [144, 8, 144, 144];
const NARROWEST: i64 = 80;

/// Colours of platforms, sRGB.
const COLORS: [(&str, [u8; 3]); 6] = [
    ("platform-slate", [96, 108, 120]),
    ("platform-sand", [196, 176, 132]),
    ("platform-moss", [104, 132, 84]),
    ("platform-brick", [156, 92, 76]),
    ("platform-ice", [164, 196, 208]),
    ("platform-plum", [120, 88, 124]),
];

pub fn materials() -> Vec<Material> {
    let material = |(name, srgb)| Material {
        pattern: Pattern::Edges { width: 1.0 / 32.0, contrast: 0.75 },
        ..Material::colored(name, Material::linear(srgb))
    };
    COLORS.into_iter().map(material).collect()
}

/// The candidate of a cell.
#[derive(Clone, Copy)]
struct Candidate {
    center: [i64; 4],
    half: [i64; 4],
    /// The hash, then the cell, so that no two are equal.
    priority: (u64, [i64; 4]),
    color: u16,
}

impl Candidate {
    fn of(seed: u64, cell: [i64; 4]) -> Self {
        if cell == [0; 4] {
            return Self { center: [0; 4], half: WIDEST, priority: (u64::MAX, cell), color: 0 };
        }
        let bits = |stream: i64| hash(seed, [cell[0], cell[1], cell[2], cell[3], stream]);
        let (xy, zw, xz, wc) = (bits(0), bits(1), bits(2), bits(3));
        let places = [xy as u32, (xy >> 32) as u32, zw as u32, (zw >> 32) as u32];
        let width = |bits: u32| NARROWEST + below(bits, (WIDEST[0] - NARROWEST + 1) as u64);
        Self {
            center: std::array::from_fn(|a| cell[a] * CELL[a] + below(places[a], CELL[a] as u64)),
            half: [width(xz as u32), WIDEST[1], width((xz >> 32) as u32), width(wc as u32)],
            // One less than the origin's at most.
            priority: (bits(4) >> 1, cell),
            color: below((wc >> 32) as u32, COLORS.len() as u64) as u16,
        }
    }

    /// The candidates that may be nearer than [`REACH`], or whose platforms may meet: those of the 80 cells around.
    fn around(seed: u64, cell: [i64; 4]) -> impl Iterator<Item = ([i64; 4], Self)> {
        (0..81).filter(|&i| i != 40).map(move |i| {
            let beside = [cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 % 3 - 1, cell[3] + i / 27 - 1];
            (beside, Self::of(seed, beside))
        })
    }

    fn is_near(&self, other: &Self) -> bool {
        let along = |a: usize| (self.center[a] - other.center[a]) * STRETCH[a];
        (0..4).map(|a| along(a) * along(a)).sum::<i64>() < REACH * REACH
    }

    fn stands(&self, seed: u64, cell: [i64; 4]) -> bool {
        Self::around(seed, cell).all(|(_, other)| other.priority < self.priority || !self.is_near(&other))
    }

    /// The platform within a box.
    fn platform(&self, within: &Aabb4) -> Option<Aabb4> {
        // A corner of space is 2^45 units from the origin, and the nearest cells end less than a thousand beyond it.
        let one = Fixed::ONE.raw();
        let min = std::array::from_fn(|a| ((self.center[a] - self.half[a]) * one).max(within.min_raw()[a]));
        let max = std::array::from_fn(|a| ((self.center[a] + self.half[a]) * one).min(within.max_raw()[a]));
        Aabb4::from_raw(min, max).ok()
    }
}

pub fn regions(seed: u64, bounds: &Aabb4, limit: usize) -> Result<Vec<Region>, TooManyRegions> {
    let one = Fixed::ONE.raw();
    let first: [i64; 4] =
        std::array::from_fn(|a| (bounds.min_raw()[a].div_euclid(one) - WIDEST[a]).div_euclid(CELL[a]));
    let last: [i64; 4] =
        std::array::from_fn(|a| ((bounds.max_raw()[a] - 1).div_euclid(one) + WIDEST[a]).div_euclid(CELL[a]));
    let cells = (0..4).fold(1_u128, |cells, a| cells.saturating_mul((last[a] - first[a] + 1) as u128));
    // More than a fifth of the candidates stand.
    if cells / 5 > limit as u128 + 100 {
        return Err(TooManyRegions { limit });
    }
    let mut regions = Vec::new();
    for w in first[3]..=last[3] {
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    add_platform(seed, [x, y, z, w], bounds, &mut regions);
                    if regions.len() > limit {
                        return Err(TooManyRegions { limit });
                    }
                }
            }
        }
    }
    Ok(regions)
}

fn add_platform(seed: u64, cell: [i64; 4], bounds: &Aabb4, regions: &mut Vec<Region>) {
    let candidate = Candidate::of(seed, cell);
    let Some(platform) = candidate.platform(bounds) else { return };
    if !candidate.stands(seed, cell) {
        return;
    }
    let above: Vec<Aabb4> = Candidate::around(seed, cell)
        .filter(|(_, other)| other.priority > candidate.priority)
        .filter_map(|(beside, other)| other.platform(&platform).filter(|_| other.stands(seed, beside)))
        .collect();
    let mut parts = vec![platform];
    for hole in above {
        parts = parts.iter().flat_map(|part| part.subtract(&hole).to_vec()).collect();
    }
    regions.extend(parts.into_iter().filter_map(|part| Region::uniform(part, block(candidate.color))));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(half: i32) -> Aabb4 {
        Aabb4::from_ints([-half; 4], [half; 4]).unwrap()
    }

    fn platforms_in(seed: u64, half: i32) -> usize {
        regions(seed, &cube(half), 1 << 20).unwrap().len()
    }

    #[test]
    fn densities_are_those_of_the_specification() {
        for (half, wanted, seeds, least) in [(352, 27, 12, 0.75), (704, 256, 6, 0.9), (1040, 1050, 2, 0.95)] {
            let mean = (0..seeds).map(|seed| platforms_in(seed, half)).sum::<usize>() as f64 / seeds as f64;
            let ratio = mean / f64::from(wanted);
            assert!((least..1.1).contains(&ratio), "{mean} platforms in a half extent of {half}, for {wanted}");
        }
    }

    #[test]
    fn the_origin_has_a_platform_of_half_width_144() {
        for seed in 0..20 {
            let at_origin = regions(seed, &Aabb4::from_ints([0; 4], [1; 4]).unwrap(), 10).unwrap();
            assert_eq!(at_origin.len(), 1);
            let around = regions(seed, &cube(200), 1 << 20).unwrap();
            let whole = Aabb4::from_ints([-144, -8, -144, -144], [144, 8, 144, 144]).unwrap();
            assert!(around.iter().any(|region| region.bounds == whole));
        }
    }

    #[test]
    fn platforms_have_the_extents_of_the_specification() {
        let all = regions(3, &cube(1500), 1 << 20).unwrap();
        let inner = cube(1100);
        let mut cut = 0;
        for region in all.iter().filter(|region| inner.contains(&region.bounds)) {
            let [x, y, z, w] = region.bounds.extent();
            assert!(y == 16.0 && [x, z, w].iter().all(|&width| width <= 288.0));
            cut += usize::from([x, z, w].iter().any(|&width| width < 160.0));
        }
        assert!(cut * 50 < all.len(), "few platforms meet another: {cut} of {}", all.len());
    }

    #[test]
    fn a_box_of_more_platforms_than_allowed_is_refused_before_the_work() {
        assert!(regions(1, &Aabb4::SPACE, 1 << 22).is_err());
        assert!(regions(1, &cube(704), 100).is_err());
        let corner = Aabb4::from_raw([(1 << 61) - (1 << 26); 4], [1 << 61; 4]).unwrap();
        assert!(!regions(1, &corner, 1 << 20).unwrap().is_empty(), "there are platforms at the end of space");
    }
}
