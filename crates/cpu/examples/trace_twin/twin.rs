//! Crate `obvhs` called directly, on a resident scene's geometry and instances.

use glam::{Mat4, Vec3A, Vec4};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::{build_cwbvh, build_cwbvh_from_tris};
use obvhs::ray::{Ray as ObvhsRay, RayHit};
use obvhs::triangle::Triangle;
use orthant_cpu::{Ray, ResidentScene};
use orthant_resident::rows::{Mat3x4, NodeFlags, RenderNodeRow};
use std::time::Duration;

/// Its two levels with instance transforms: a [`CwBvh`] of instance boxes whose intersection function moves the ray to
/// object space and goes on in a [`CwBvh`] of triangles, stored in leaf order as that crate advises.
pub struct Instanced {
    tlas: CwBvh,
    instances: Vec<Instance>,
    blas: Vec<(CwBvh, Vec<Triangle>)>,
}

struct Instance {
    inverse: Mat4,
    blas: usize,
    node: u32,
    opaque: bool,
}

fn matrix(m: &Mat3x4) -> Mat4 {
    let row = |i: usize| Vec4::from_array(m.rows[i]);
    Mat4::from_cols(row(0), row(1), row(2), Vec4::W).transpose()
}

fn build(triangles: &[Triangle]) -> CwBvh {
    build_cwbvh_from_tris(triangles, BvhBuildParams::medium_build(), &mut Duration::default())
}

fn triangles(scene: &ResidentScene, primitive: usize, world: Mat4) -> Vec<Triangle> {
    let desc = &scene.mesh_descs[primitive];
    let corner = |i: u32| {
        let index = scene.indices[(desc.first_index + i) as usize];
        world.transform_point3a(Vec3A::from_array(scene.positions[(desc.first_vertex + index) as usize]))
    };
    (0..desc.triangle_count())
        .map(|t| Triangle { v0: corner(3 * t), v1: corner(3 * t + 1), v2: corner(3 * t + 2) })
        .collect()
}

fn seen(rows: &[RenderNodeRow]) -> impl Iterator<Item = (u32, &RenderNodeRow)> {
    const SEEN: u32 = NodeFlags::OCCUPIED | NodeFlags::VISIBLE;
    (0..).zip(rows).filter(|(_, row)| row.flags & SEEN == SEEN)
}

impl Instanced {
    /// Builds both levels.
    pub fn new(scene: &ResidentScene) -> Self {
        let blas: Vec<_> = (0..scene.mesh_descs.len())
            .map(|p| {
                let triangles = triangles(scene, p, Mat4::IDENTITY);
                let bvh = build(&triangles);
                let ordered = bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect();
                (bvh, ordered)
            })
            .collect();
        let (instances, boxes): (Vec<_>, Vec<_>) = seen(&scene.render_nodes)
            .map(|(node, row)| {
                let world = matrix(&row.world);
                let b = blas[row.primitive as usize].0.total_aabb;
                let corners: Vec<Vec3A> = (0..8)
                    .map(|i| {
                        let pick = |k: usize| if i >> k & 1 == 0 { b.min[k] } else { b.max[k] };
                        world.transform_point3a(Vec3A::new(pick(0), pick(1), pick(2)))
                    })
                    .collect();
                let instance = Instance {
                    inverse: matrix(&row.inverse),
                    blas: row.primitive as usize,
                    node,
                    opaque: row.flags & NodeFlags::OPAQUE != 0,
                };
                (instance, Aabb::from_points(&corners))
            })
            .unzip();
        let tlas = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        Self { tlas, instances, blas }
    }

    fn enter(&self, ray: &ObvhsRay, leaf: usize) -> (&Instance, &CwBvh, &[Triangle], ObvhsRay) {
        let instance = &self.instances[self.tlas.primitive_indices[leaf] as usize];
        let (bvh, triangles) = &self.blas[instance.blas];
        let local = ObvhsRay::new(
            instance.inverse.transform_point3a(ray.origin),
            instance.inverse.transform_vector3a(ray.direction),
            ray.tmin,
            ray.tmax,
        );
        (instance, bvh, triangles, local)
    }

    /// Parameter of the nearest accepted hit.
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let mut hit = RayHit::none();
        self.tlas.ray_traverse(to_obvhs(ray), &mut hit, |ray, leaf| {
            let (instance, bvh, triangles, local) = self.enter(ray, leaf);
            let mut inner = RayHit::none();
            bvh.ray_traverse(local, &mut inner, |ray, i| {
                let t = triangles[i].intersect(ray);
                if t < ray.tmax && !instance.opaque && !super::accepts(instance.node, bvh.primitive_indices[i]) {
                    return f32::INFINITY;
                }
                t
            });
            inner.t
        });
        (hit.t < ray.t_max).then_some(hit.t)
    }

    /// Whether there is an accepted hit.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        !self.tlas.ray_traverse_miss(to_obvhs(ray), |ray, leaf| {
            let (instance, bvh, triangles, local) = self.enter(ray, leaf);
            let miss = bvh.ray_traverse_miss(local, |ray, i| {
                let t = triangles[i].intersect(ray);
                if t < ray.tmax && !instance.opaque && !super::accepts(instance.node, bvh.primitive_indices[i]) {
                    return f32::INFINITY;
                }
                t
            });
            if miss { f32::INFINITY } else { 0.0 }
        })
    }
}

/// Its two levels as [`CwBvh::ray_traverse_tlas_blas`] walks them, without transforms: world-space triangles for each
/// instance.
///
/// In version 0.4.0 that walk loses instances: where a ray meets several in one node, it puts the rest on a stack whose
/// entries it reads back as inner nodes. Its hits are fewer, so its rate says little.
pub struct Flat {
    tlas: CwBvh,
    blas: Vec<CwBvh>,
    triangles: Vec<Vec<Triangle>>,
    instances: Vec<(u32, bool)>,
}

impl Flat {
    /// Builds both levels.
    pub fn new(scene: &ResidentScene) -> Self {
        let mut flat = Self { tlas: CwBvh::default(), blas: Vec::new(), triangles: Vec::new(), instances: Vec::new() };
        for (node, row) in seen(&scene.render_nodes) {
            let triangles = triangles(scene, row.primitive as usize, matrix(&row.world));
            let bvh = build(&triangles);
            flat.triangles.push(bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect());
            flat.blas.push(bvh);
            flat.instances.push((node, row.flags & NodeFlags::OPAQUE != 0));
        }
        let boxes: Vec<Aabb> = flat.blas.iter().map(|b| b.total_aabb).collect();
        flat.tlas = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        flat
    }

    #[inline(always)]
    fn triangle(&self, ray: &ObvhsRay, mesh: usize, i: usize) -> f32 {
        let t = self.triangles[mesh][i].intersect(ray);
        let (node, opaque) = self.instances[mesh];
        if t < ray.tmax && !opaque && !super::accepts(node, self.blas[mesh].primitive_indices[i]) {
            return f32::INFINITY;
        }
        t
    }

    /// Parameter of the nearest accepted hit.
    pub fn closest_hit(&self, ray: &Ray) -> Option<f32> {
        let mut nearest = f32::INFINITY;
        self.tlas.ray_traverse_tlas_blas(&self.blas, to_obvhs(ray), &mut RayHit::none(), |ray, mesh, i| {
            let t = self.triangle(ray, mesh, i);
            nearest = nearest.min(t);
            t
        });
        (nearest < ray.t_max).then_some(nearest)
    }

    /// Whether there is an accepted hit: the first one ends the ray at 0, where no box follows.
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let mut any = false;
        self.tlas.ray_traverse_tlas_blas(&self.blas, to_obvhs(ray), &mut RayHit::none(), |ray, mesh, i| {
            if self.triangle(ray, mesh, i) < ray.tmax {
                any = true;
                return 0.0;
            }
            f32::INFINITY
        });
        any
    }
}

fn to_obvhs(ray: &Ray) -> ObvhsRay {
    ObvhsRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}
