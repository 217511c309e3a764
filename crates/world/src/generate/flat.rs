//! `flat`: a slab of ground.

use crate::palette::{Material, Pattern};
use crate::space::{Aabb4, Fixed};
use crate::world::Region;

pub fn materials() -> Vec<Material> {
    let ground = Material::colored("ground", Material::linear([112, 128, 96]));
    vec![Material { pattern: Pattern::Edges { width: 1.0 / 32.0, contrast: 0.8 }, ..ground }]
}

pub fn regions(bounds: &Aabb4) -> Vec<Region> {
    let (mut min, mut max) = (Aabb4::SPACE.min_raw(), Aabb4::SPACE.max_raw());
    min[1] = Fixed::from_int(-8).raw();
    max[1] = 0;
    let slab = Aabb4::from_raw_unchecked(min, max);
    bounds.intersection(&slab).and_then(|part| Region::uniform(part, super::block(0))).into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ground_is_eight_units_thick_and_unbounded() {
        let all = regions(&Aabb4::SPACE);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].bounds.extent_raw()[1], Fixed::from_int(8).raw());
        assert_eq!(all[0].bounds.extent_raw()[3], Aabb4::SPACE.extent_raw()[3]);
        assert!(regions(&Aabb4::from_ints([0; 4], [9; 4]).unwrap()).is_empty());
    }
}
