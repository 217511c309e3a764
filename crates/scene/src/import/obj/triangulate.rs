//! Polygons to triangles.
//!
//! Convex polygons become fans. Others are cut by ear clipping (Meisters, "Polygons Have Ears", 1975) in the coordinate
//! plane that Newell's normal faces most: dropping a coordinate keeps what is exact exact. A polygon of n corners always
//! gives n - 2 triangles, as a vertex in the middle of an edge is part of the mesh too.

use std::ops::Range;

/// How a polygon was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Triangles cover the polygon.
    Proper,
    /// It has no area, crosses itself, or is too intricate: some of it is a fan, whose triangles may overlap.
    Fan,
}

/// Point tests that every polygon may take per corner.
const WORK_PER_CORNER: u64 = 512;

/// Point tests that the polygons of a whole file may take beyond that: seconds. It bounds the time that a file made to be
/// slow can take; what people draw stays far below.
pub const SPARE_WORK: u64 = 1 << 31;

/// Scratch memory, used again from polygon to polygon.
pub struct Triangulator {
    /// Of [`SPARE_WORK`], what is left to this part of the file.
    spare: u64,
    points: Vec<[f64; 2]>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Corners that are not convex, by x.
    reflex: Vec<(f64, u32)>,
    is_reflex: Vec<bool>,
}

/// Twice the area vector of a polygon, by Newell's method (Sutherland, Sproull and Schumacker, 1974): its direction is
/// the normal of the plane that fits best.
pub fn newell(corners: impl ExactSizeIterator<Item = [f32; 3]> + Clone) -> [f64; 3] {
    let mut normal = [0.0; 3];
    let Some(origin) = corners.clone().next() else { return normal };
    // Relative to a corner, so that the area of a small polygon far from zero does not drown.
    let relative = corners.map(|p| [0, 1, 2].map(|i| f64::from(p[i]) - f64::from(origin[i])));
    let mut previous = [0.0; 3];
    for p in relative.skip(1) {
        normal[0] += previous[1] * p[2] - previous[2] * p[1];
        normal[1] += previous[2] * p[0] - previous[0] * p[2];
        normal[2] += previous[0] * p[1] - previous[1] * p[0];
        previous = p;
    }
    normal
}

impl Triangulator {
    pub fn new(spare: u64) -> Self {
        Self {
            spare,
            points: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
            reflex: Vec::new(),
            is_reflex: Vec::new(),
        }
    }

    /// Calls `emit` with three corner numbers per triangle, in the order of the polygon.
    pub fn cut(
        &mut self,
        corners: impl ExactSizeIterator<Item = [f32; 3]> + Clone,
        mut emit: impl FnMut([u32; 3]),
    ) -> Cut {
        let count = corners.len() as u32;
        if count == 3 {
            emit([0, 1, 2]);
            return Cut::Proper;
        }
        let normal = newell(corners.clone());
        let size = normal.map(f64::abs);
        if size == [0.0; 3] {
            fan(0..count, &mut emit);
            return Cut::Fan;
        }
        // The two coordinates that are kept, so ordered that the polygon turns counter-clockwise.
        let dropped = if size[0] > size[1] && size[0] > size[2] {
            0
        } else if size[1] > size[2] {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((dropped + 1) % 3, (dropped + 2) % 3);
        if normal[dropped] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        self.points.clear();
        self.points.extend(corners.map(|p| [f64::from(p[x]), f64::from(p[y])]));
        if self.is_convex() {
            fan(0..count, &mut emit);
            return Cut::Proper;
        }
        self.clip_ears(&mut emit)
    }

    /// Whether every corner turns left and the boundary goes round once.
    fn is_convex(&self) -> bool {
        let points = &self.points;
        let n = points.len();
        let turns_left = (0..n).all(|i| cross(points[i], points[(i + 1) % n], points[(i + 2) % n]) > 0.0);
        // A star that winds twice turns left everywhere too, but its x changes direction more than twice.
        let rises = |i: usize| points[(i + 1) % n][0] > points[i][0];
        turns_left && (n == 4 || (0..n).filter(|&i| rises(i) != rises((i + 1) % n)).count() <= 2)
    }

    fn clip_ears(&mut self, emit: &mut impl FnMut([u32; 3])) -> Cut {
        let n = self.points.len();
        self.next.clear();
        self.next.extend((1..n as u32).chain([0]));
        self.previous.clear();
        self.previous.extend([n as u32 - 1].into_iter().chain(0..n as u32 - 1));
        self.is_reflex.clear();
        self.is_reflex.extend((0..n).map(|i| {
            let (p, q) = (self.points[(i + n - 1) % n], self.points[(i + 1) % n]);
            cross(p, self.points[i], q) <= 0.0
        }));
        self.reflex.clear();
        let reflex = (0..n).filter(|&i| self.is_reflex[i]).map(|i| (self.points[i][0], i as u32));
        self.reflex.extend(reflex);
        self.reflex.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));

        let own = WORK_PER_CORNER * n as u64;
        let mut work = own + self.spare;
        let (mut ear, mut left, mut tried) = (0u32, n, 0);
        let mut flat_ears = false;
        while left > 3 {
            if tried == left {
                // No ear is left: first cut corners that lie on a line, then give up.
                if flat_ears {
                    break;
                }
                (flat_ears, tried) = (true, 0);
            }
            let (a, b) = (self.previous[ear as usize], self.next[ear as usize]);
            let Some(is_ear) = self.is_ear(a, ear, b, flat_ears, &mut work) else { break };
            if !is_ear {
                (ear, tried) = (b, tried + 1);
                continue;
            }
            emit(in_order(a, ear, b));
            self.next[a as usize] = b;
            self.previous[b as usize] = a;
            self.is_reflex[ear as usize] = false;
            for corner in [a, b] {
                let (p, q) = (self.previous[corner as usize], self.next[corner as usize]);
                let turn = cross(self.points[p as usize], self.points[corner as usize], self.points[q as usize]);
                self.is_reflex[corner as usize] &= turn <= 0.0;
            }
            left -= 1;
            (flat_ears, tried) = (false, 0);
            // Ears beside each other would make slivers.
            ear = self.next[b as usize];
        }
        self.spare = self.spare.min(work);
        let (mut b, start) = (self.next[ear as usize], ear);
        let cut = if left == 3 { Cut::Proper } else { Cut::Fan };
        for _ in 0..left - 2 {
            let c = self.next[b as usize];
            emit(in_order(start, b, c));
            b = c;
        }
        cut
    }

    /// `None` when the allowed work is done.
    fn is_ear(&self, a: u32, b: u32, c: u32, flat: bool, work: &mut u64) -> Option<bool> {
        let [pa, pb, pc] = [a, b, c].map(|i| self.points[i as usize]);
        let area = cross(pa, pb, pc);
        if !(area > 0.0 || flat && area == 0.0) {
            *work = work.checked_sub(1)?;
            return Some(false);
        }
        let low = [0, 1].map(|i: usize| pa[i].min(pb[i]).min(pc[i]));
        let high = [0, 1].map(|i: usize| pa[i].max(pb[i]).max(pc[i]));
        let first = self.reflex.partition_point(|&(x, _)| x < low[0]);
        for &(x, i) in &self.reflex[first..] {
            *work = work.checked_sub(1)?;
            if x > high[0] {
                break;
            }
            let p = self.points[i as usize];
            if p[1] < low[1] || p[1] > high[1] || !self.is_reflex[i as usize] || [a, b, c].contains(&i) {
                continue;
            }
            // Corners of a slit or of a bridge to a hole lie in the same place twice.
            if p == pa || p == pb || p == pc {
                continue;
            }
            let inside = [cross(pa, pb, p), cross(pb, pc, p), cross(pc, pa, p)];
            if inside.iter().all(|&side| side >= 0.0) {
                return Some(false);
            }
        }
        Some(true)
    }
}

/// The same triangle, beginning with its smallest corner.
fn in_order(a: u32, b: u32, c: u32) -> [u32; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

fn fan(corners: Range<u32>, emit: &mut impl FnMut([u32; 3])) {
    for i in corners.start + 1..corners.end - 1 {
        emit([corners.start, i, i + 1]);
    }
}

/// Twice the signed area of a triangle.
#[inline]
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cuts a polygon of the xy plane, turned into each coordinate plane and each orientation, and checks that the
    /// triangles cover it: no triangle turns the other way, and areas add up.
    fn cover(outline: &[[f32; 2]]) {
        for plane in 0..3 {
            for is_reversed in [false, true] {
                let mut points: Vec<[f32; 3]> = outline
                    .iter()
                    .map(|&[x, y]| {
                        let mut p = [0.25 * x + 7.0; 3];
                        p[(plane + 1) % 3] = x;
                        p[(plane + 2) % 3] = y;
                        p
                    })
                    .collect();
                if is_reversed {
                    points.reverse();
                }
                let mut triangles = Vec::new();
                let cut = Triangulator::new(SPARE_WORK).cut(points.iter().copied(), |t| triangles.push(t));
                assert_eq!(cut, Cut::Proper, "plane {plane}, reversed {is_reversed}");
                assert_eq!(triangles.len(), points.len() - 2);
                let flat = |i: u32| points[i as usize].map(f64::from);
                let area = |t: &[u32; 3]| {
                    let [a, b, c] = t.map(|i| [flat(i)[(plane + 1) % 3], flat(i)[(plane + 2) % 3]]);
                    cross(a, b, c) * if is_reversed { -1.0 } else { 1.0 }
                };
                assert!(triangles.iter().all(|t| area(t) >= 0.0), "{triangles:?} turn back");
                let sum: f64 = triangles.iter().map(area).sum();
                let n = outline.len();
                let o = |i: usize| outline[i % n].map(f64::from);
                let whole: f64 = (0..n).map(|i| o(i)[0] * o(i + 1)[1] - o(i)[1] * o(i + 1)[0]).sum();
                assert!((sum - whole).abs() <= 1e-6 * whole, "area {sum} of {whole}");
            }
        }
    }

    #[test]
    fn convex_and_concave_polygons_are_covered_without_overlap() {
        cover(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]]);
        // A dart: the fan from any corner but two would leave the polygon.
        for first in 0..4 {
            let mut dart = [[0., 0.], [4., 0.], [1., 1.], [0., 4.]];
            dart.rotate_left(first);
            cover(&dart);
        }
        cover(&[[0., 0.], [4., 0.], [4., 3.], [3., 3.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]]);
    }

    #[test]
    fn corners_on_an_edge_stay_and_slits_to_holes_are_followed() {
        cover(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.], [0., 1.]]);
        // A square ring: the outer boundary, a slit, the hole the other way round, and back along the slit.
        cover(&[[0., 0.], [4., 0.], [4., 4.], [0., 4.], [0., 0.], [1., 1.], [1., 3.], [3., 3.], [3., 1.], [1., 1.]]);
    }

    #[test]
    fn a_large_comb_and_a_large_star_are_cut_in_time() {
        let mut comb: Vec<[f32; 2]> =
            (0..5000).map(|i| [i as f32, if i % 2 == 0 { 1.0 } else { 50.0 }]).rev().collect();
        comb.extend([[0.0, 0.0], [4999.0, 0.0]]);
        cover(&comb);
        let star: Vec<[f32; 2]> = (0..4000)
            .map(|i| {
                let angle = i as f32 * std::f32::consts::TAU / 4000.0;
                let radius = if i % 2 == 0 { 100.0 } else { 40.0 };
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        cover(&star);
    }

    #[test]
    fn without_an_area_it_is_a_fan() {
        let mut triangles = Vec::new();
        let line = [[0.0; 3], [1.0; 3], [2.0; 3], [3.0; 3], [4.0; 3]];
        assert_eq!(Triangulator::new(SPARE_WORK).cut(line.into_iter(), |t| triangles.push(t)), Cut::Fan);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }
}
