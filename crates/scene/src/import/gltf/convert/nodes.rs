//! Nodes, scenes, and what hangs at nodes: skins, cameras, lights.

use super::node::NodeConverter;
use super::{Converter, Members, Result, invalid};
use crate::import::ImportFault;
use crate::import::gltf::nodes::{NodeTexts, read};
use crate::import::gltf::parse::parse;
use crate::import::gltf::schema::{self, Int};
use crate::import::warning::WarningKind;
use crate::model::*;
use crate::place::At;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};

const NO_PARENT: u32 = u32::MAX;
/// Nodes that one task reads, at least.
const TASK_NODES: usize = 256;

impl Converter<'_> {
    pub(super) fn nodes(&mut self, nodes: Vec<schema::Node<'_>>) -> Result<()> {
        let at = &At::Root.key("nodes");
        let parents = self.parents(&nodes, at)?;
        check_cycles(&parents, |i| nodes[i].name.clone(), at)?;
        let mut converted = Vec::with_capacity(nodes.len());
        for (i, n) in nodes.into_iter().enumerate() {
            let mut node = self.node(n, &at.index(i))?;
            node.parent = parent(parents[i]);
            converted.push(Some(node));
        }
        self.scene.nodes = Store::from_values(converted);
        Ok(())
    }

    fn node(&mut self, n: schema::Node<'_>, at: &At<'_>) -> Result<Node> {
        let Self { scene, counts, warnings, .. } = self;
        NodeConverter { scene, counts }
            .node(n, at, &mut |what, at| warnings.push(WarningKind::Tolerated(what), || at.place()))
    }

    /// From text to slots, by all threads. An error is some error of the document, and not always the one to show:
    /// [`Converter::nodes`] has an order.
    pub(super) fn node_texts(&mut self, texts: &NodeTexts<'_>) -> Result<()> {
        let at = &At::Root.key("nodes");
        let parents: Vec<AtomicU32> = (0..texts.len()).map(|_| AtomicU32::new(NO_PARENT)).collect();
        let (fault, warned) = (Mutex::new(None), Mutex::new(Vec::new()));
        let convert = NodeConverter { scene: &self.scene, counts: &self.counts };
        let convert_node = |i: usize| {
            let at = &at.index(i);
            let mut has_warning = false;
            let node = convert.node(read_node(texts, i, at)?, at, &mut |_, _| has_warning = true)?;
            for child in node.children.iter() {
                let parent = &parents[Store::<NodeId, Node>::slot(child)];
                if parent.swap(i as u32, Ordering::Relaxed) != NO_PARENT {
                    return invalid(at, "a child has two parents");
                }
            }
            if has_warning {
                lock(&warned).push(i);
            }
            Ok(node)
        };
        let of_index = |i: usize| convert_node(i).map_err(|e| *lock(&fault) = Some(e)).ok();
        let mut nodes = Vec::new();
        (0..texts.len()).into_par_iter().with_min_len(TASK_NODES).map(of_index).collect_into_vec(&mut nodes);
        if let Some(fault) = lock(&fault).take() {
            return Err(fault);
        }
        let parents: Vec<u32> = parents.into_iter().map(AtomicU32::into_inner).collect();
        check_cycles(&parents, |_| None, at)?;
        nodes.par_iter_mut().zip(&parents).with_min_len(TASK_NODES).for_each(|(node, &index)| {
            if let Some(node) = node {
                node.parent = parent(index);
            }
        });
        // Warnings are counted in the order of the document, so those nodes are converted again, one by one.
        let mut warned = std::mem::take(&mut *lock(&warned));
        warned.sort_unstable();
        for i in warned {
            let at = &at.index(i);
            self.node(read_node(texts, i, at)?, at)?;
        }
        self.scene.nodes = Store::from_values(nodes);
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
            self.scene.scenes.insert_nth(i, SceneRoots { name: s.name, roots: Children::from(roots), extra });
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

fn parent(index: u32) -> Option<NodeId> {
    (index != NO_PARENT).then(|| Store::<NodeId, Node>::nth_id(index as usize))
}

/// A node by its text: by the short way, if it is plain.
fn read_node<'a>(texts: &NodeTexts<'a>, i: usize, at: &At<'_>) -> Result<schema::Node<'a>> {
    let Some(text) = texts.get(i) else { return invalid(at, "the nodes are no list of objects") };
    match read(text) {
        Some(node) => Ok(node),
        None => parse(text, at),
    }
}

/// What is behind it is whole at any time, also after a panic.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Each node has one parent at most, so a cycle is a chain of parents that comes back. Every chain is climbed until it
/// meets a node that an earlier one has passed: O(n), without a stack.
fn check_cycles(parents: &[u32], name: impl Fn(usize) -> Option<String>, at: &At<'_>) -> Result<()> {
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
                let fault = ImportFault::Cycle { node, name: name(node) };
                return Err((at.index(node).place(), fault));
            }
        }
    }
    Ok(())
}
