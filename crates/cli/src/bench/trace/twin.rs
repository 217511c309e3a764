//! Crate `obvhs` called directly, on a resident scene's geometry and instances.

use super::rays::accepts;
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
                if t < ray.tmax && !instance.opaque && !accepts(instance.node, bvh.primitive_indices[i]) {
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
                if t < ray.tmax && !instance.opaque && !accepts(instance.node, bvh.primitive_indices[i]) {
                    return f32::INFINITY;
                }
                t
            });
            if miss { f32::INFINITY } else { 0.0 }
        })
    }
}

fn to_obvhs(ray: &Ray) -> ObvhsRay {
    ObvhsRay::new(ray.origin.into(), ray.direction.into(), ray.t_min, ray.t_max)
}
