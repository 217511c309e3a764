//! Nodes, scenes, and what hangs at nodes: skins, cameras, lights.

use super::{Converter, Members, Result, invalid};
use crate::import::ImportFault;
use crate::import::gltf::schema::{self, Int};
use crate::model::*;
use crate::place::At;

/// How far a rotation's length may be from 1 before it is worth a warning. It is normalised when used in any case.
const UNIT_TOLERANCE: f64 = 1e-3;
/// How far the last row of a matrix may be from (0, 0, 0, 1).
const AFFINE_TOLERANCE: f64 = 1e-5;
const NO_PARENT: u32 = u32::MAX;

impl Converter<'_> {
    pub(super) fn nodes(&mut self, nodes: Vec<schema::Node<'_>>) -> Result<()> {
        let at = &At::Root.key("nodes");
        let parents = self.parents(&nodes, at)?;
        check_cycles(&parents, &nodes, at)?;
        self.scene.nodes.reserve(nodes.len());
        for (i, n) in nodes.into_iter().enumerate() {
            let parent = (parents[i] != NO_PARENT).then(|| Store::<NodeId, Node>::nth_id(parents[i] as usize));
            let node = self.node(n, parent, &at.index(i))?;
            self.scene.nodes.insert_nth(i, node);
        }
        Ok(())
    }

    /// The parent of each node, or [`NO_PARENT`].
    fn parents(&self, nodes: &[schema::Node<'_>], at: &At<'_>) -> Result<Vec<u32>> {
        let mut parents = vec![NO_PARENT; nodes.len()];
        for (i, n) in nodes.iter().enumerate() {
            for (k, &child) in n.children.iter().enumerate() {
                let at = &at.index(i);
                let at = &at.key("children");
                let at = &at.index(k);
                self.counts.node(child, at)?;
                let child = child.0 as usize;
                if parents[child] != NO_PARENT {
                    let fault = ImportFault::TwoParents {
                        node: child,
                        name: nodes[child].name.clone(),
                        first: parents[child] as usize,
                        second: i,
                    };
                    return Err((at.place(), fault));
                }
                parents[child] = i as u32;
            }
        }
        Ok(parents)
    }

    fn node(&mut self, n: schema::Node<'_>, parent: Option<NodeId>, at: &At<'_>) -> Result<Node> {
        let mut stated = Stated::default();
        let transform = self.transform(&n, &mut stated, at)?;
        // `parents` has checked each child.
        let children = n.children.iter().map(|c| Store::<NodeId, Node>::nth_id(c.0 as usize)).collect();
        let mesh = n.mesh.map(|m| self.counts.mesh(m, &at.key("mesh"))).transpose()?;
        let skin = n.skin.map(|s| self.counts.skin(s, &at.key("skin"))).transpose()?;
        let camera = n.camera.map(|c| self.counts.camera(c, &at.key("camera"))).transpose()?;
        self.check_deformation(mesh, skin, n.weights.as_deref(), at);
        let mut node = Node {
            name: n.name,
            parent,
            children: Children(children),
            transform,
            mesh,
            skin,
            camera,
            weights: n.weights,
            ..Node::default()
        };
        if n.extensions.is_some() || n.extras.is_some() || n.rest.0.is_some() {
            let mut members = Members::new(n.extensions, n.rest);
            self.node_extensions(&mut members, &mut node, &mut stated, at)?;
            node.extra = members.finish(n.extras, at)?;
        }
        node.extra.stated = stated;
        Ok(node)
    }

    fn transform(&mut self, n: &schema::Node<'_>, stated: &mut Stated, at: &At<'_>) -> Result<Transform> {
        let has_trs = n.translation.is_some() || n.rotation.is_some() || n.scale.is_some();
        if let Some(m) = &n.matrix {
            if has_trs {
                self.tolerate("the node has a matrix besides translation, rotation or scale; the matrix counts", at);
            }
            let last_row = [m[3], m[7], m[11], m[15] - 1.0];
            if last_row.iter().any(|v| v.abs() > AFFINE_TOLERANCE) {
                return invalid(&at.key("matrix"), "the last row of the matrix must be 0, 0, 0, 1");
            }
            return Ok(Transform::Matrix(**m));
        }
        if !has_trs {
            return Ok(Transform::default());
        }
        let rotation = stated.note(Member::Rotation, n.rotation).unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let length = rotation.iter().map(|v| v * v).sum::<f64>().sqrt();
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            self.tolerate("the rotation is not of unit length; it is normalised", &at.key("rotation"));
        }
        Ok(Transform::Trs {
            translation: stated.note(Member::Translation, n.translation).unwrap_or([0.0; 3]),
            rotation,
            scale: stated.note(Member::Scale, n.scale).unwrap_or([1.0; 3]),
        })
    }

    /// Says what a skin or weights cannot do here.
    fn check_deformation(&mut self, mesh: Option<MeshId>, skin: Option<SkinId>, weights: Option<&[f64]>, at: &At<'_>) {
        let primitives = mesh.map_or(&[][..], |m| &self.scene.meshes[m].primitives);
        let targets = primitives.first().map_or(0, |p| p.targets.len());
        let bound = primitives.iter().all(|p| p.attributes.get("JOINTS_0").is_some());
        if skin.is_some() && mesh.is_none() {
            self.tolerate("the node has a skin, but no mesh", &at.key("skin"));
        } else if skin.is_some() && !bound {
            self.tolerate("the mesh has no joints; the skin does not move it", &at.key("skin"));
        }
        if weights.is_some_and(|w| w.len() != targets) {
            self.tolerate("there are not as many weights as morph targets", &at.key("weights"));
        }
    }

    fn node_extensions<'a>(
        &mut self,
        members: &mut Members<'a>,
        node: &mut Node,
        stated: &mut Stated,
        at: &At<'_>,
    ) -> Result<()> {
        let extensions = &at.key("extensions");
        let name = "KHR_lights_punctual";
        if let Some(e) = members.take::<schema::NodeLight<'a>>(name, at)? {
            node.light = Some(self.counts.light(e.light, &extensions.key(name).key("light"))?);
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        let name = "KHR_node_visibility";
        if let Some(e) = members.take::<schema::NodeVisibility<'a>>(name, at)? {
            node.visible = Some(stated.note(Member::Visible, e.visible).unwrap_or(true));
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        let name = "EXT_mesh_gpu_instancing";
        if let Some(e) = members.take::<schema::Instancing<'a>>(name, at)? {
            node.instancing = Some(Box::new(self.instancing(e, &extensions.key(name))?));
        }
        Ok(())
    }

    fn instancing(&mut self, e: schema::Instancing<'_>, at: &At<'_>) -> Result<Instancing> {
        let attributes_at = &at.key("attributes");
        let mut out = Instancing {
            translation: None,
            rotation: None,
            scale: None,
            custom: Vec::new(),
            extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?,
        };
        let mut count = None;
        for (semantic, index) in e.attributes.0 {
            let at = &attributes_at.key(&semantic);
            let id = self.counts.accessor(index, at)?;
            let accessor = &self.scene.accessors[id];
            if *count.get_or_insert(accessor.count) != accessor.count {
                return invalid(at, "the instance attributes have different numbers of elements");
            }
            let (slot, element) = match semantic.as_str() {
                "TRANSLATION" => (&mut out.translation, ElementType::Vec3),
                "ROTATION" => (&mut out.rotation, ElementType::Vec4),
                "SCALE" => (&mut out.scale, ElementType::Vec3),
                _ => {
                    out.custom.push((semantic, id));
                    continue;
                }
            };
            if accessor.element_type != element {
                return invalid(at, format!("{semantic} cannot be {:?}", accessor.element_type));
            }
            *slot = Some(id);
        }
        if count.is_none() {
            self.tolerate("there are no instance attributes; the mesh is shown once", at);
        }
        Ok(out)
    }

    pub(super) fn scenes(&mut self, scenes: Vec<schema::Scene<'_>>) -> Result<()> {
        let at = &At::Root.key("scenes");
        // The last scene, counted from 1, that each node is a root of.
        let mut seen = vec![0u32; self.counts.nodes];
        for (i, s) in scenes.into_iter().enumerate() {
            let at = &at.index(i);
            let mut roots = Vec::with_capacity(s.nodes.len());
            for (k, index) in s.nodes.into_iter().enumerate() {
                let nodes_at = &at.key("nodes");
                let at = &nodes_at.index(k);
                let id = self.counts.node(index, at)?;
                let slot = index.0 as usize;
                let node = &self.scene.nodes[id];
                if let Some(parent) = node.parent {
                    let parent = Store::<NodeId, Node>::slot(parent);
                    return invalid(at, format!("node {slot} cannot be a root: it is a child of node {parent}"));
                }
                if std::mem::replace(&mut seen[slot], i as u32 + 1) == i as u32 + 1 {
                    return invalid(at, format!("node {slot} is a root of this scene twice"));
                }
                roots.push(id);
            }
            let extra = Members::new(s.extensions, s.rest).finish(s.extras, at)?;
            self.scene.scenes.insert_nth(i, SceneRoots { name: s.name, roots: Children(roots), extra });
        }
        Ok(())
    }

    pub(super) fn skins(&mut self, skins: Vec<schema::Skin<'_>>) -> Result<()> {
        let at = &At::Root.key("skins");
        for (i, s) in skins.into_iter().enumerate() {
            let at = &at.index(i);
            let joints_at = &at.key("joints");
            if s.joints.is_empty() {
                return invalid(joints_at, "a skin needs at least one joint");
            }
            let mut joints = Vec::with_capacity(s.joints.len());
            for (k, &j) in s.joints.iter().enumerate() {
                joints.push(self.counts.node(j, &joints_at.index(k))?);
            }
            let inverse_bind_matrices = self.inverse_bind_matrices(s.inverse_bind_matrices, joints.len(), at)?;
            let skin = Skin {
                name: s.name,
                joints,
                inverse_bind_matrices,
                skeleton: s.skeleton.map(|n| self.counts.node(n, &at.key("skeleton"))).transpose()?,
                extra: Members::new(s.extensions, s.rest).finish(s.extras, at)?,
            };
            self.scene.skins.insert_nth(i, skin);
        }
        Ok(())
    }

    fn inverse_bind_matrices(&self, index: Option<Int>, joints: usize, at: &At<'_>) -> Result<Option<AccessorId>> {
        let at = &at.key("inverseBindMatrices");
        let Some(index) = index else { return Ok(None) };
        let id = self.counts.accessor(index, at)?;
        let accessor = &self.scene.accessors[id];
        if (accessor.element_type, accessor.component_type) != (ElementType::Mat4, ComponentType::F32) {
            let (element, component) = (accessor.element_type, accessor.component_type);
            return invalid(at, format!("inverse bind matrices cannot be {element:?} of {component:?}"));
        }
        if accessor.count < joints {
            return invalid(at, format!("there are {} inverse bind matrices for {joints} joints", accessor.count));
        }
        Ok(Some(id))
    }

    pub(super) fn cameras(&mut self, cameras: Vec<schema::Camera<'_>>) -> Result<()> {
        let at = &At::Root.key("cameras");
        for (i, c) in cameras.into_iter().enumerate() {
            let at = &at.index(i);
            let projection = match (c.kind, c.perspective, c.orthographic) {
                (schema::CameraType::Perspective, Some(p), _) => {
                    let positive = p.yfov > 0.0 && p.znear > 0.0 && p.aspect_ratio.is_none_or(|a| a > 0.0);
                    if !positive || p.yfov >= std::f64::consts::PI || p.zfar.is_some_and(|z| z <= p.znear) {
                        self.tolerate("a figure of the camera is outside its range", &at.key("perspective"));
                    }
                    CameraProjection::Perspective {
                        aspect_ratio: p.aspect_ratio,
                        yfov: p.yfov,
                        znear: p.znear,
                        zfar: p.zfar,
                        extra: Members::new(p.extensions, p.rest).finish(p.extras, &at.key("perspective"))?,
                    }
                }
                (schema::CameraType::Orthographic, _, Some(o)) => {
                    if o.xmag == 0.0 || o.ymag == 0.0 || o.zfar <= o.znear || o.znear < 0.0 {
                        self.tolerate("a figure of the camera is outside its range", &at.key("orthographic"));
                    }
                    CameraProjection::Orthographic {
                        xmag: o.xmag,
                        ymag: o.ymag,
                        znear: o.znear,
                        zfar: o.zfar,
                        extra: Members::new(o.extensions, o.rest).finish(o.extras, &at.key("orthographic"))?,
                    }
                }
                (schema::CameraType::Perspective, ..) => return invalid(at, "the camera has no \"perspective\""),
                (schema::CameraType::Orthographic, ..) => return invalid(at, "the camera has no \"orthographic\""),
            };
            let extra = Members::new(c.extensions, c.rest).finish(c.extras, at)?;
            self.scene.cameras.insert_nth(i, Camera { name: c.name, projection, extra });
        }
        Ok(())
    }

    pub(super) fn lights<'a>(&mut self, lights: schema::Lights<'a>, members: &mut Members<'a>) -> Result<()> {
        let name = "KHR_lights_punctual";
        let at = &At::Root.key("extensions");
        let at = &at.key(name);
        let at = &at.key("lights");
        for (i, l) in lights.lights.into_iter().enumerate() {
            let at = &at.index(i);
            let (mut stated, mut spot_stated) = (Stated::default(), Stated::default());
            let (spot, spot_extra) = match stated.note(Member::Spot, l.spot) {
                None => ((None, None), Extra::default()),
                Some(mut s) if !matches!(l.kind, schema::LightType::Spot) => {
                    // Angles of a light that is none of a spot are members that nobody knows.
                    for (name, angle) in
                        [("innerConeAngle", s.inner_cone_angle), ("outerConeAngle", s.outer_cone_angle)]
                    {
                        if let Some(angle) = angle {
                            s.rest.0.get_or_insert_default().insert(name.to_owned(), angle.into());
                        }
                    }
                    let extra = Members::new(s.extensions, s.rest).finish(s.extras, &at.key("spot"))?;
                    ((None, None), extra)
                }
                Some(s) => (
                    (
                        spot_stated.note(Member::InnerConeAngle, s.inner_cone_angle),
                        spot_stated.note(Member::OuterConeAngle, s.outer_cone_angle),
                    ),
                    Members::new(s.extensions, s.rest).finish(s.extras, &at.key("spot"))?.stating(spot_stated),
                ),
            };
            if matches!(l.kind, schema::LightType::Spot) {
                // It has to have it, so export writes it in any case.
                stated.note(Member::Spot, Some(()));
            }
            let kind = match l.kind {
                schema::LightType::Directional => LightKind::Directional,
                schema::LightType::Point => LightKind::Point,
                schema::LightType::Spot => {
                    let (inner, outer) = (spot.0.unwrap_or(0.0), spot.1.unwrap_or(std::f64::consts::FRAC_PI_4));
                    if !(0.0 <= inner && inner < outer && outer <= std::f64::consts::FRAC_PI_2 + 1e-6) {
                        self.tolerate("the cone angles of the spot light are outside their range", at);
                    }
                    LightKind::Spot { inner_cone_angle: inner, outer_cone_angle: outer }
                }
            };
            let light = Light {
                name: l.name,
                color: stated.note(Member::Color, l.color).unwrap_or([1.0; 3]),
                intensity: stated.note(Member::Intensity, l.intensity).unwrap_or(1.0),
                range: l.range,
                kind,
                spot_extra,
                extra: Members::new(l.extensions, l.rest).finish(l.extras, at)?.stating(stated),
            };
            self.scene.lights.insert_nth(i, light);
        }
        members.keep_rest(name, lights.extensions, lights.extras, lights.rest, &At::Root)
    }
}

/// Each node has one parent at most, so a cycle is a chain of parents that comes back. Every chain is climbed until it
/// meets a node that an earlier one has passed: O(n), without a stack.
fn check_cycles(parents: &[u32], nodes: &[schema::Node<'_>], at: &At<'_>) -> Result<()> {
    let mut passed_by = vec![NO_PARENT; parents.len()];
    for start in 0..parents.len() {
        let mut node = start;
        while passed_by[node] == NO_PARENT {
            passed_by[node] = start as u32;
            if parents[node] == NO_PARENT {
                break;
            }
            node = parents[node] as usize;
            if passed_by[node] == start as u32 {
                let fault = ImportFault::Cycle { node, name: nodes[node].name.clone() };
                return Err((at.index(node).place(), fault));
            }
        }
    }
    Ok(())
}
