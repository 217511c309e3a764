//! Normals that the file does not give.
//!
//! A corner without a normal in a smoothing group gets the normal of its position in that group: the sum of the normals
//! of the group's faces there, each weighted by the face's area and by its angle at the corner (Max, "Weights for
//! Computing Vertex Normals from Facet Normals", 1999, compares such weights). Without a group it is flat. Flat corners of
//! a primitive where others have normals get the face's; a primitive without any normals is left without, which
//! is flat shading in glTF.

use super::corner::{Corner, NONE};
use super::parse::{Kind, Parsed};
use super::spans::Span;
use super::triangulate::newell;
use crate::import::budget::{Budget, OverBudget};
use std::collections::{HashMap, HashSet};

/// Forgets normals of length zero, so that their corners count as corners without.
pub fn drop_zero_normals(parsed: &mut Parsed<'_>) {
    let is_zero = |n: u32| n != NONE && parsed.normals[n as usize] == [0.0; 3];
    for piece in &mut parsed.pieces {
        for corner in piece.corners.iter_mut() {
            if is_zero(corner.n) {
                corner.n = NONE;
            }
        }
    }
}

/// Gives corners without a normal one, where their primitive has normals. New normals are appended to
/// [`Parsed::normals`].
pub fn generate(parsed: &mut Parsed<'_>, spans: &[Span], budget: &Budget) -> Result<(), OverBudget> {
    let with_normals = materials_with_normals(parsed, spans);
    let mut smooth: HashMap<(u32, u32), u32> = HashMap::new();
    let mut sums: Vec<[f64; 3]> = Vec::new();
    let first_smooth = parsed.normals.len() as u32;

    let faces = |span: &Span, parsed: &Parsed<'_>| {
        let piece = &parsed.pieces[span.piece];
        let mut start = span.corner;
        let ranges = piece.elements[span.elements.clone()].iter().map(move |element| {
            let range = start..start + element.corners();
            start = range.end;
            (element.kind(), range)
        });
        ranges.filter(|(kind, _)| *kind == Kind::Polygon).map(|(_, range)| range).collect::<Vec<_>>()
    };

    // Every face of a group shapes its positions' normals, but only positions that need one get a sum.
    for span in spans.iter().filter(|span| span.smoothing != 0) {
        for range in faces(span, parsed) {
            for corner in parsed.pieces[span.piece].corners[range].iter_mut().filter(|corner| corner.n == NONE) {
                let next = first_smooth + sums.len() as u32;
                corner.n = *smooth.entry((corner.v, span.smoothing)).or_insert(next);
                if corner.n == next {
                    budget.charge(SUM_BYTES)?;
                    sums.push([0.0; 3]);
                }
            }
        }
    }
    if !smooth.is_empty() {
        for span in spans.iter().filter(|span| span.smoothing != 0) {
            for range in faces(span, parsed) {
                let corners = &parsed.pieces[span.piece].corners[range];
                let normal = newell(corners.iter().map(|corner| parsed.positions[corner.v as usize]));
                for i in 0..corners.len() {
                    if let Some(&slot) = smooth.get(&(corners[i].v, span.smoothing)) {
                        let weight = angle(&parsed.positions, corners, i);
                        let sum = &mut sums[(slot - first_smooth) as usize];
                        *sum = [0, 1, 2].map(|axis| sum[axis] + weight * normal[axis]);
                    }
                }
            }
        }
        parsed.normals.extend(sums.iter().map(|&sum| unit(sum)));
    }

    for span in spans.iter().filter(|span| span.smoothing == 0 && with_normals.contains(&span.material)) {
        for range in faces(span, parsed) {
            let corners = &mut parsed.pieces[span.piece].corners[range];
            if corners.iter().all(|corner| corner.n != NONE) {
                continue;
            }
            let normal = newell(corners.iter().map(|corner| parsed.positions[corner.v as usize]));
            budget.charge(24)?;
            let slot = parsed.normals.len() as u32;
            parsed.normals.push(unit(normal));
            corners.iter_mut().filter(|corner| corner.n == NONE).for_each(|corner| corner.n = slot);
        }
    }
    Ok(())
}

/// A sum, its entry in the table, and the normal; vectors and tables double.
const SUM_BYTES: u64 = 3 * (24 + 16 + 12);

/// Materials whose faces have a normal of the file or a smoothing group anywhere.
fn materials_with_normals(parsed: &Parsed<'_>, spans: &[Span]) -> HashSet<Option<usize>> {
    let mut found = HashSet::new();
    for span in spans {
        if found.contains(&span.material) {
            continue;
        }
        let piece = &parsed.pieces[span.piece];
        let mut start = span.corner;
        let has_normal = piece.elements[span.elements.clone()].iter().any(|element| {
            let corners = &piece.corners[start..start + element.corners()];
            start += element.corners();
            element.kind() == Kind::Polygon && (span.smoothing != 0 || corners.iter().any(|c| c.n != NONE))
        });
        if has_normal {
            found.insert(span.material);
        }
    }
    found
}

/// The angle of a polygon at a corner, in radians.
fn angle(positions: &[[f32; 3]], corners: &[Corner], i: usize) -> f64 {
    let n = corners.len();
    let at = |i: usize| glam::Vec3::from(positions[corners[i % n].v as usize]).as_dvec3();
    let (a, b) = (at(i + n - 1) - at(i), at(i + 1) - at(i));
    a.cross(b).length().atan2(a.dot(b))
}

/// Of length 1; any direction where there is none.
fn unit(normal: [f64; 3]) -> [f32; 3] {
    let largest = normal.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if !(largest > 0.0 && largest.is_finite()) {
        return [0.0, 0.0, 1.0];
    }
    let scaled = glam::DVec3::from(normal.map(|c| c / largest));
    scaled.normalize().as_vec3().to_array()
}
