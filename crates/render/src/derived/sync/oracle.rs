//! The definition, as a check: what edits have led to is what a full derivation makes, slot numbering aside.

use super::registry::GeometryKey;
use super::{Live, occupancy};
use crate::derived::hierarchy::DerivedNode;
use crate::derived::{DeriveOptions, DerivedScene};
use crate::geometry::RenderPrimitive;
use glam::DVec3;
use orthant_resident::extent::scene_radius;
use orthant_resident::rows::{
    LightKind, LightRow, Mat3x4, MaterialRow, MeshDesc, MeshFlags, NONE, RenderNodeRow, TextureSlot,
};
use orthant_scene::Scene;
use orthant_scene::model::Store;
use std::collections::HashSet;

/// How far numbers may be apart that were rounded on different ways, relative to what they are part of.
const TOLERANCE: f64 = 2e-6;

impl DerivedScene {
    /// Compares this derived scene, which has followed edits, with a full derivation of the document as it is now, under the same
    /// pose.
    ///
    /// # Errors
    /// The first difference: the object and the field.
    pub fn check(&self, scene: &Scene) -> Result<(), String> {
        self.check_against(scene, &self.fresh(scene)?)
    }

    /// A full derivation of the document as it is now, under the pose that this scene shows.
    ///
    /// # Errors
    /// Why it cannot be derived.
    pub fn fresh(&self, scene: &Scene) -> Result<Self, String> {
        let Some(live) = &self.live else { return Err("it was not derived to follow edits".to_owned()) };
        let options = DeriveOptions {
            max_bytes: u64::MAX,
            origin: Some(self.origin),
            ..live.options(self.asked_scene, &self.pose)
        };
        Self::derive(scene, &options).map_err(|error| format!("it cannot be derived: {error}"))
    }

    /// [`DerivedScene::check`] against what [`DerivedScene::fresh`] has made.
    ///
    /// # Errors
    /// The first difference: the object and the field.
    pub fn check_against(&self, scene: &Scene, fresh: &Self) -> Result<(), String> {
        let Some(live) = &self.live else { return Err("it was not derived to follow edits".to_owned()) };
        let Some(fresh_live) = &fresh.live else { return Err("it was not derived to follow edits".to_owned()) };
        let mut emitting = vec![false; fresh.primitives.len()];
        for row in fresh.render_nodes.iter().filter(|row| row.emitter != NONE) {
            emitting[row.primitive as usize] = true;
        }
        let check = Check { scene, synced: self, fresh, live, fresh_live, emitting };
        check.nodes()?;
        check.holes()?;
        occupancy::check(self, live)?;
        check.materials()?;
        check.counts()?;
        check.radius()
    }
}

struct Check<'c> {
    scene: &'c Scene,
    synced: &'c DerivedScene,
    fresh: &'c DerivedScene,
    live: &'c Live,
    fresh_live: &'c Live,
    /// By RenderPrimitive of the fresh scene: whether some row emits with this geometry.
    emitting: Vec<bool>,
}

fn close(a: f64, b: f64, size: f64) -> bool {
    a == b || (a - b).abs() <= TOLERANCE * size.max(1e-30)
}

fn close_f32(a: f32, b: f32) -> bool {
    close(f64::from(a), f64::from(b), f64::from(a.abs().max(b.abs())))
}

impl Check<'_> {
    fn nodes(&self) -> Result<(), String> {
        let used = self.synced.hierarchy.nodes.iter().filter(|node| node.is_used()).count();
        if used != self.fresh.hierarchy.nodes.len() {
            return Err(format!("{used} nodes are shown, and should be {}", self.fresh.hierarchy.nodes.len()));
        }
        for fresh in &self.fresh.hierarchy.nodes {
            let slot = Store::<_, ()>::slot(fresh.node);
            let at = |what: &str| format!("node {slot}: {what}");
            let Some(synced) = self.synced.hierarchy.get(fresh.node) else { return Err(at("it is not shown")) };
            let size = fresh.world.to_cols_array().iter().fold(0.0f64, |size, v| size.max(v.abs()));
            let (a, b) = (synced.world.to_cols_array(), fresh.world.to_cols_array());
            if !a.iter().zip(&b).all(|(a, b)| close(*a, *b, size)) {
                return Err(at(&format!("its world matrix is {a:?}, and should be {b:?}")));
            }
            let parent = |scene: &DerivedScene, node: &DerivedNode| {
                scene.hierarchy.nodes.get(node.parent as usize).map(|n| n.node)
            };
            let facts = |scene: &DerivedScene, n: &DerivedNode| {
                (n.visible, n.deformed, n.instanced, n.mesh, n.render_node_count, parent(scene, n))
            };
            let (a, b) = (facts(self.synced, synced), facts(self.fresh, fresh));
            if a != b {
                return Err(at(&format!(
                    "(visible, deformed, instanced, mesh, rows, parent) is {a:?}, and should be {b:?}"
                )));
            }
            for i in 0..fresh.render_node_count {
                self.render_node(synced.first_render_node + i, fresh.first_render_node + i)
                    .map_err(|what| at(&format!("render node {i}: {what}")))?;
            }
            let light = |scene: &DerivedScene, node: &DerivedNode| scene.lights.get(node.light as usize).copied();
            match (light(self.synced, synced), light(self.fresh, fresh)) {
                (None, None) => {}
                (Some(a), Some(b)) if same_light(&a, &b, self.synced.origin - self.fresh.origin) => {}
                (a, b) => return Err(at(&format!("its light is {a:?}, and should be {b:?}"))),
            }
        }
        Ok(())
    }

    fn render_node(&self, synced_row: u32, fresh_row: u32) -> Result<(), String> {
        let (a, b) = (&self.synced.render_nodes[synced_row as usize], &self.fresh.render_nodes[fresh_row as usize]);
        let shift = self.synced.origin - self.fresh.origin;
        if !same_matrix(&a.world, &b.world, shift) {
            return Err(format!("its matrix is {:?}, and should be {:?}", a.world, b.world));
        }
        // Inverses of what is nearly flat may be far apart: their products with the matrix are not.
        let is_inverse = |row: &RenderNodeRow| {
            let (m, i) = (row.world.to_affine(), row.inverse.to_affine());
            (m * i).abs_diff_eq(glam::DAffine3::IDENTITY, 1e-2)
        };
        if is_inverse(b) && !is_inverse(a) {
            return Err(format!("its inverse is {:?}, and should be {:?}", a.inverse, b.inverse));
        }
        let facts = |row: &RenderNodeRow| (row.material, row.node, row.flags, row.emitter == NONE);
        if facts(a) != facts(b) {
            return Err(format!("(material, node, flags, dark) is {:?}, and should be {:?}", facts(a), facts(b)));
        }
        self.geometry(a.primitive, b.primitive)?;
        if b.emitter != NONE {
            let (e, f) = (&self.synced.emitters[a.emitter as usize], &self.fresh.emitters[b.emitter as usize]);
            if e.render_node != synced_row || e.triangle_count != f.triangle_count || !close_f32(e.power, f.power) {
                return Err(format!("its emitter is {e:?}, and should be like {f:?}"));
            }
        }
        Ok(())
    }

    fn key(&self, primitive: &RenderPrimitive) -> Option<(GeometryKey, Option<orthant_scene::model::NodeId>)> {
        let mesh = self.scene.meshes().get(primitive.mesh)?;
        Some((GeometryKey::of(mesh.primitives.get(primitive.primitive)?), primitive.deformed_by))
    }

    fn geometry(&self, synced: u32, fresh: u32) -> Result<(), String> {
        let (a, b) = (&self.synced.primitives[synced as usize], &self.fresh.primitives[fresh as usize]);
        // The mesh at which shared geometry was found first may be gone; the geometry is not.
        if let (Some(a), Some(b)) = (self.key(a), self.key(b))
            && a != b
        {
            return Err("its geometry is another".to_owned());
        }
        let (a, b) = (&self.synced.mesh_descs[synced as usize], &self.fresh.mesh_descs[fresh as usize]);
        // Tangents and area tables stay when no material wants them any more.
        let kept = MeshFlags::TANGENT | MeshFlags::PARALLELOGRAM;
        let emits = self.emitting[fresh as usize];
        let needed = MeshFlags::TANGENT | if emits { MeshFlags::PARALLELOGRAM } else { 0 };
        let facts = |d: &MeshDesc| (d.vertex_count, d.index_count, d.flags & !kept);
        if facts(a) != facts(b) || b.flags & needed & !a.flags != 0 {
            return Err(format!("its MeshDesc is {a:?}, and should be like {b:?}"));
        }
        let bounds = |d: &MeshDesc| [d.bounds_min, d.bounds_max].concat();
        let size = bounds(b).iter().fold(0.0f64, |size, v| size.max(f64::from(v.abs())));
        let is_deformed = b.flags & MeshFlags::DEFORMED != 0;
        let tolerance = if is_deformed { 100.0 * size } else { size };
        if !bounds(a).iter().zip(bounds(b)).all(|(a, b)| close(f64::from(*a), f64::from(b), tolerance)) {
            return Err(format!("its bounds are {:?}, and should be {:?}", bounds(a), bounds(b)));
        }
        if b.first_tangent != NONE && a.first_tangent == NONE || emits && a.first_emitter_triangle == NONE {
            return Err("it lacks tangents or an area table".to_owned());
        }
        Ok(())
    }

    /// What belongs to no node is a hole, and is free once.
    fn holes(&self) -> Result<(), String> {
        let mut owned = vec![false; self.synced.render_nodes.len()];
        let mut lights = HashSet::new();
        for node in self.synced.hierarchy.nodes.iter().filter(|node| node.is_used()) {
            for row in node.first_render_node..node.first_render_node + node.render_node_count {
                if std::mem::replace(&mut owned[row as usize], true) {
                    return Err(format!("render node {row} belongs to two nodes"));
                }
            }
            if node.light != NONE && !lights.insert(node.light) {
                return Err(format!("light {} belongs to two nodes", node.light));
            }
        }
        if let Some(row) = (0..owned.len()).find(|&i| !owned[i] && self.synced.render_nodes[i] != RenderNodeRow::HOLE) {
            return Err(format!("render node {row} is no hole, and belongs to no node"));
        }
        let stray = |(i, row): (usize, &LightRow)| row.kind != LightKind::None as u32 && !lights.contains(&(i as u32));
        if let Some(i) = self.synced.lights.iter().enumerate().position(stray) {
            return Err(format!("light {i} is no hole, and belongs to no node"));
        }
        for (i, emitter) in self.synced.emitters.iter().enumerate().filter(|(_, e)| e.power > 0.0) {
            if self.synced.render_nodes.get(emitter.render_node as usize).is_none_or(|row| row.emitter as usize != i) {
                return Err(format!("emitter {i} belongs to no render node"));
            }
        }
        Ok(())
    }

    fn materials(&self) -> Result<(), String> {
        for id in self.scene.materials().ids() {
            let row = Store::<_, ()>::slot(id) + 1;
            let (Some(a), Some(b)) = (self.synced.materials.get(row), self.fresh.materials.get(row)) else {
                return Err(format!("material {}: it has no row", row - 1));
            };
            let (mut a, mut b) = (*a, *b);
            let (slots_a, slots_b) = (textures(&mut a), textures(&mut b));
            if a != b {
                return Err(format!("material {}: its row is {a:?}, and should be {b:?}", row - 1));
            }
            for (a, b) in slots_a.iter().zip(&slots_b) {
                let place = |slot: &TextureSlot| (slot.texture == NONE, slot.uv_set, slot.transform);
                let sampling = |scene: &DerivedScene, slot: &TextureSlot| {
                    scene.textures.get(slot.texture as usize).map(|t| t.sampling)
                };
                let same = place(a) == place(b)
                    && sampling(self.synced, a) == sampling(self.fresh, b)
                    && self.live.textures.key_of(a.texture) == self.fresh_live.textures.key_of(b.texture);
                if !same {
                    return Err(format!("material {}: a texture is {a:?}, and should be like {b:?}", row - 1));
                }
            }
        }
        Ok(())
    }

    fn counts(&self) -> Result<(), String> {
        let emitters = |scene: &DerivedScene| scene.emitters.iter().filter(|row| row.power > 0.0).count();
        let lights =
            |scene: &DerivedScene| scene.lights.iter().filter(|row| row.kind != LightKind::None as u32).count();
        let counts = |scene| (emitters(scene), lights(scene));
        if counts(self.synced) != counts(self.fresh) {
            let (a, b) = (counts(self.synced), counts(self.fresh));
            return Err(format!("there are {a:?} emitters and lights, and should be {b:?}"));
        }
        Ok(())
    }

    /// The radius that batches have said is exactly that of the rows.
    fn radius(&self) -> Result<(), String> {
        let (kept, rows) =
            (self.live.extent.radius(), scene_radius(&self.synced.render_nodes, &self.synced.mesh_descs));
        if kept != rows {
            return Err(format!("the radius of the scene is {kept}, and should be {rows}"));
        }
        Ok(())
    }
}

/// Takes the texture references out of a row: their numbering is free.
fn textures(row: &mut MaterialRow) -> [TextureSlot; 5] {
    super::textures::slots(row).map(|slot| std::mem::replace(slot, TextureSlot::NONE))
}

fn same_matrix(a: &Mat3x4, b: &Mat3x4, shift: DVec3) -> bool {
    let (mut a, b) = (a.to_affine(), b.to_affine());
    a.translation += shift;
    let size = b.to_cols_array().iter().fold(0.0f64, |size, v| size.max(v.abs())).max(shift.length());
    a.to_cols_array().iter().zip(b.to_cols_array()).all(|(a, b)| close(*a, b, size))
}

fn same_light(a: &LightRow, b: &LightRow, shift: DVec3) -> bool {
    let position = |row: &LightRow| DVec3::from_array(row.position.map(f64::from));
    let (p, q) = (position(a) + shift, position(b));
    let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-5 * (1.0 + b.abs()));
    (p - q).length() <= TOLERANCE * (q.length() + shift.length() + 1.0)
        && (a.kind, a.node) == (b.kind, b.node)
        && near(&a.direction, &b.direction)
        && near(&a.color, &b.color)
        && (a.range == b.range)
        && near(&[a.angle_scale, a.angle_offset], &[b.angle_scale, b.angle_offset])
}
