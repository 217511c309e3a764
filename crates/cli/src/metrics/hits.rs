//! Whether two films show the same things: their AOVs of pixels' centres.

use orthant_resident::Film;
use orthant_resident::frame::Aov;

/// How far depths of the same place may be apart, relative to them.
const COINCIDENT: f32 = 1e-4;

/// What differs between the hits of two films.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hits {
    /// Pixels that show another node, primitive or material.
    pub differ: usize,
    /// Those of them that neither an edge explains (a neighbour shows it in the reference) nor surfaces that coincide.
    pub unexplained: usize,
    /// The largest relative difference of depths where both show the same.
    pub depth: f64,
}

/// Compares films of the same tile by their depths and those indices (node, primitive, material) that both have. Without depths
/// nothing is compared.
pub fn hits(reference: &Film, test: &Film) -> Hits {
    fn aov(film: &Film, wanted: Aov) -> Option<&[f32]> {
        film.aovs.iter().find(|(aov, _)| *aov == wanted).map(|(_, values)| values.as_slice())
    }
    let both = |wanted| aov(reference, wanted).zip(aov(test, wanted));
    let ids: Vec<_> = [Aov::Node, Aov::Primitive, Aov::Material].into_iter().filter_map(both).collect();
    let mut found = Hits::default();
    let Some((should, is)) = both(Aov::Depth) else { return found };
    let (width, height) = (reference.tile.width as i32, reference.tile.height as i32);
    for y in 0..height {
        for x in 0..width {
            let i = (y * width + x) as usize;
            let apart = (should[i] - is[i]).abs();
            if ids.iter().all(|(reference, test)| reference[i] == test[i]) {
                if should[i] != is[i] {
                    found.depth = found.depth.max(f64::from(apart / should[i].abs()));
                }
                continue;
            }
            found.differ += 1;
            let is_near = |dx: i32, dy: i32| {
                let (x, y) = (x + dx, y + dy);
                let at = (y * width + x) as usize;
                (0..width).contains(&x)
                    && (0..height).contains(&y)
                    && ids.iter().all(|(reference, test)| reference[at] == test[i])
            };
            let is_edge = (-1..=1).any(|dx| (-1..=1).any(|dy| is_near(dx, dy)));
            let coincide = apart.is_finite() && apart <= COINCIDENT * should[i].abs();
            found.unexplained += usize::from(!is_edge && !coincide);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use orthant_resident::frame::Tile;

    fn film(depth: &[f32], node: &[f32]) -> Film {
        let width = depth.len() as u32;
        Film {
            width,
            height: 1,
            tile: Tile { x: 0, y: 0, width, height: 1 },
            samples: 1,
            sum: Vec::new(),
            blocks: Vec::new(),
            aovs: vec![(Aov::Depth, depth.to_vec()), (Aov::Node, node.to_vec())],
        }
    }

    #[test]
    fn edges_and_coincident_surfaces_explain_what_differs_and_nothing_else_does() {
        const NONE: f32 = f32::INFINITY;
        let reference = film(&[1.0, 2.0, NONE, NONE, NONE], &[0.0, 1.0, -1.0, -1.0, -1.0]);
        let compare = |depth: &[f32], node: &[f32]| hits(&reference, &film(depth, node));
        let same = compare(&[1.0, 2.0, NONE, NONE, NONE], &[0.0, 1.0, -1.0, -1.0, -1.0]);
        assert_eq!(same, Hits::default());
        // The neighbour's node; the same place under another name; something in the middle of nothing.
        let edge = compare(&[1.0, 2.0, 2.0, NONE, NONE], &[0.0, 1.0, 1.0, -1.0, -1.0]);
        assert_eq!((edge.differ, edge.unexplained), (1, 0));
        let coincident = compare(&[1.0, 2.0, NONE, NONE, NONE], &[7.0, 1.0, -1.0, -1.0, -1.0]);
        assert_eq!((coincident.differ, coincident.unexplained), (1, 0));
        let wrong = compare(&[1.0, 2.0, NONE, NONE, 3.0], &[0.0, 1.0, -1.0, -1.0, 7.0]);
        assert_eq!((wrong.differ, wrong.unexplained), (1, 1));
        let gone = compare(&[NONE, 2.0, NONE, NONE, NONE], &[9.0, 1.0, -1.0, -1.0, -1.0]);
        assert_eq!((gone.differ, gone.unexplained), (1, 1));
        let deeper = compare(&[1.0, 2.5, NONE, NONE, NONE], &[0.0, 1.0, -1.0, -1.0, -1.0]);
        assert_eq!((deeper.differ, deeper.depth), (0, 0.25));
    }
}
