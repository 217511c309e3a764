//! The judge: rays through the regions of a world, every one of them, in double precision, with a bound of what single precision may
//! make of each plane. It shares nothing with the backends but the numbers of the ray.

use orthant_world::{Block, Content, Lattice, Point4, Region, World};

const RAW: f64 = 65_536.0;

/// A region with its box relative to an anchor, in units.
struct Solid<'a> {
    region: &'a Region,
    low: [f64; 4],
    high: [f64; 4],
}

/// A world as it is seen from an anchor.
pub struct Walk<'a> {
    world: &'a World,
    anchor: [i64; 4],
    solids: Vec<Solid<'a>>,
}

/// The first surface on a ray.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    pub t: f64,
    /// What single precision may be off.
    pub error: f64,
    pub axis: usize,
    pub block: Block,
    /// Raw coordinate of the plane.
    pub plane: i64,
}

/// What a ray meets.
#[derive(Clone, Copy, Debug, Default)]
pub struct Truth {
    pub surface: Option<Surface>,
    /// Optical depth on the way there.
    pub depth: [f64; 3],
    /// Radiance of media on the way there.
    pub glow: [f64; 3],
    /// Whether the ray began in a block.
    pub inside: bool,
}

/// A stretch in one block.
#[derive(Clone, Copy)]
struct Stretch {
    enter: Crossing,
    leave: Crossing,
    block: Block,
}

/// Where the ray crosses a plane.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    t: f64,
    error: f64,
    axis: usize,
    plane: i64,
}

impl Crossing {
    fn is_near(&self, other: &Self) -> bool {
        (self.t - other.t).abs() <= self.error + other.error
    }
}

/// Rounding decides.
pub struct Tie;

impl<'a> Walk<'a> {
    pub fn new(world: &'a World, anchor: [i64; 4]) -> Self {
        let relative = |raw: [i64; 4]| std::array::from_fn(|a| (raw[a] - anchor[a]) as f64 / RAW);
        let solid = |region: &'a Region| Solid {
            region,
            low: relative(region.bounds.min_raw()),
            high: relative(region.bounds.max_raw()),
        };
        Self { world, anchor, solids: world.regions().map(|(_, region)| solid(region)).collect() }
    }

    /// Follows a ray from its origin, in units relative to the anchor, up to `t_max`.
    pub fn trace(&self, o: [f32; 4], d: [f32; 4], t_max: f64) -> Result<Truth, Tie> {
        let ray = Ray { anchor: self.anchor, o: o.map(f64::from), d: d.map(f64::from) };
        let mut stretches = Vec::new();
        // Boxes that the ray passes so close to that it may as well meet them.
        let mut grazed: Vec<f64> = Vec::new();
        for solid in &self.solids {
            let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
            for a in 0..4 {
                let (t0, t1) = ((solid.low[a] - ray.o[a]) / ray.d[a], (solid.high[a] - ray.o[a]) / ray.d[a]);
                enter = enter.max(t0.min(t1));
                leave = leave.min(t0.max(t1));
            }
            if enter > leave + 1e-3 || leave < -1e-3 || enter > t_max {
                continue;
            }
            let (enter, leave, second) = ray.interval(solid.region.bounds.min_raw(), solid.region.bounds.max_raw());
            if enter.t > leave.t || enter.is_near(&leave) {
                if enter.is_near(&leave) {
                    grazed.push(enter.t);
                }
                continue;
            }
            if second.is_near(&enter) {
                grazed.push(enter.t);
            }
            self.stretches(&ray, solid.region, enter, leave, &mut stretches, &mut grazed);
        }
        stretches.sort_by(|a, b| a.enter.t.total_cmp(&b.enter.t));
        let truth = self.follow(&stretches, t_max)?;
        let end = truth.surface.map_or(t_max, |surface| surface.t + surface.error);
        if grazed.iter().any(|&t| (-1e-3..=end).contains(&t)) { Err(Tie) } else { Ok(truth) }
    }

    /// The stretches of a region, in order.
    fn stretches(
        &self,
        ray: &Ray,
        region: &Region,
        enter: Crossing,
        leave: Crossing,
        stretches: &mut Vec<Stretch>,
        grazed: &mut Vec<f64>,
    ) {
        let Content::Chunk { lattice, .. } = &region.content else {
            let Content::Uniform(block) = region.content else { unreachable!("the other kind") };
            stretches.push(Stretch { enter, leave, block });
            return;
        };
        let mut crossings = vec![enter];
        ray.planes(region, lattice, &mut crossings);
        // A plane that is met just outside of the region may in single precision be met within.
        let outside = crossings.iter().filter(|c| c.t < enter.t || c.t > leave.t);
        grazed.extend(outside.filter(|c| c.is_near(&enter) || c.is_near(&leave)).map(|c| c.t));
        crossings.retain(|c| c.t >= enter.t && c.t <= leave.t);
        crossings.push(leave);
        crossings.sort_by(|a, b| a.t.total_cmp(&b.t));
        let mut before: Option<Stretch> = None;
        for pair in crossings.windows(2) {
            if pair[0].is_near(&pair[1]) {
                grazed.push(pair[0].t);
                continue;
            }
            let at = (pair[0].t + pair[1].t) / 2.0;
            let point = std::array::from_fn(|a| self.anchor[a] + ((ray.o[a] + at * ray.d[a]) * RAW).floor() as i64);
            let block = region.block_at(Point4::from_raw(point));
            match &mut before {
                Some(stretch) if stretch.block == block => stretch.leave = pair[1],
                _ => {
                    stretches.extend(before.take());
                    before = Some(Stretch { enter: pair[0], leave: pair[1], block });
                }
            }
        }
        stretches.extend(before);
        stretches.retain(|stretch| !stretch.block.is_air());
    }

    fn follow(&self, stretches: &[Stretch], t_max: f64) -> Result<Truth, Tie> {
        let mut truth = Truth::default();
        let mut current: Option<Stretch> = None;
        for stretch in stretches {
            if stretch.leave.t.abs() <= stretch.leave.error || stretch.enter.t.abs() <= stretch.enter.error {
                return Err(Tie);
            }
            if stretch.leave.t < 0.0 {
                continue;
            }
            if (stretch.enter.t - t_max).abs() <= stretch.enter.error {
                return Err(Tie);
            }
            if stretch.enter.t > t_max {
                break;
            }
            if let Some(run) = &mut current
                && run.block == stretch.block
                && run.leave.is_near(&stretch.enter)
            {
                if run.leave.plane != stretch.enter.plane || run.leave.axis != stretch.enter.axis {
                    return Err(Tie);
                }
                run.leave = stretch.leave;
                continue;
            }
            self.pass(current, t_max, &mut truth);
            let begins_inside = stretch.enter.t < 0.0;
            truth.inside |= begins_inside;
            let is_opaque = self.material(stretch.block).is_none_or(|m| m.transparency.is_none());
            if is_opaque && !begins_inside {
                let Crossing { t, error, axis, plane } = stretch.enter;
                truth.surface = Some(Surface { t, error, axis, plane, block: stretch.block });
                return Ok(truth);
            }
            current = Some(*stretch);
        }
        self.pass(current, t_max, &mut truth);
        Ok(truth)
    }

    fn material(&self, block: Block) -> Option<&orthant_world::Material> {
        self.world.palette().get(block.id()).map(|material| &**material)
    }

    fn pass(&self, run: Option<Stretch>, t_max: f64, truth: &mut Truth) {
        let Some(run) = run else { return };
        let Some(material) = self.material(run.block) else { return };
        let Some(transparency) = &material.transparency else { return };
        let length = run.leave.t.min(t_max) - run.enter.t.max(0.0);
        for c in 0..3 {
            let depth = f64::from(transparency.absorption[c]) * length;
            truth.glow[c] += f64::from(material.emission[c]) * (-truth.depth[c]).exp() * (1.0 - (-depth).exp());
            truth.depth[c] += depth;
        }
    }
}

struct Ray {
    anchor: [i64; 4],
    o: [f64; 4],
    d: [f64; 4],
}

impl Ray {
    /// In single precision the plane's offset is rounded once, then the difference, the reciprocal and the product: each by at most
    /// 2^-24 of its value.
    fn crossing(&self, axis: usize, plane: i64) -> Crossing {
        const U: f64 = 1.0 / (1 << 24) as f64;
        let offset = (plane - self.anchor[axis]) as f64 / RAW;
        let t = (offset - self.o[axis]) / self.d[axis];
        let error = U * (offset.abs() / self.d[axis].abs() + 3.5 * t.abs());
        Crossing { t, error, axis, plane }
    }

    /// Where a box is entered and left, and the plane that comes next to the one of entry.
    fn interval(&self, min: [i64; 4], max: [i64; 4]) -> (Crossing, Crossing, Crossing) {
        let near = |a: usize| self.crossing(a, if self.d[a] > 0.0 { min[a] } else { max[a] });
        let far = |a: usize| self.crossing(a, if self.d[a] > 0.0 { max[a] } else { min[a] });
        let mut entries = [0, 1, 2, 3].map(near);
        entries.sort_by(|a, b| b.t.total_cmp(&a.t));
        let leave = [0, 1, 2, 3].map(far).into_iter().min_by(|a, b| a.t.total_cmp(&b.t)).expect("four planes");
        (entries[0], leave, entries[1])
    }

    /// The planes between the blocks of a chunk that lie within the region.
    fn planes(&self, region: &Region, lattice: &Lattice, crossings: &mut Vec<Crossing>) {
        let extent = lattice.block_extent();
        for a in 0..4 {
            let edge = extent[a].raw();
            let (min, max) = (region.bounds.min_raw()[a], region.bounds.max_raw()[a]);
            let mut plane = (min.div_euclid(edge) + 1) * edge;
            while plane < max {
                crossings.push(self.crossing(a, plane));
                plane += edge;
            }
        }
    }
}
