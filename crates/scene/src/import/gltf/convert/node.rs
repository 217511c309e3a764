//! One node.

use super::references::Counts;
use super::{Members, Result, invalid};
use crate::Scene;
use crate::import::gltf::schema;
use crate::model::*;
use crate::place::At;

/// How far a rotation's length may be from 1 before it is worth a warning. It is normalised when used in any case.
const UNIT_TOLERANCE: f64 = 1e-3;
/// How far the last row of a matrix may be from (0, 0, 0, 1).
const AFFINE_TOLERANCE: f64 = 1e-5;

/// Is told of what is tolerated, and where.
pub(super) type Warn<'w> = dyn FnMut(&'static str, &At<'_>) + 'w;

/// What the conversion of a node needs: it reads, so that many nodes can be converted at once.
#[derive(Clone, Copy)]
pub(super) struct NodeConverter<'c> {
    pub scene: &'c Scene,
    pub counts: &'c Counts,
}

impl NodeConverter<'_> {
    /// The node, without its parent.
    pub fn node(self, n: schema::Node<'_>, at: &At<'_>, warn: &mut Warn<'_>) -> Result<Node> {
        let mut stated = Stated::default();
        let transform = transform(&n, &mut stated, at, warn)?;
        let children_at = &at.key("children");
        let mut children = Vec::with_capacity(n.children.len());
        for (k, &child) in n.children.iter().enumerate() {
            children.push(self.counts.node(child, &children_at.index(k))?);
        }
        let mesh = n.mesh.map(|m| self.counts.mesh(m, &at.key("mesh"))).transpose()?;
        let skin = n.skin.map(|s| self.counts.skin(s, &at.key("skin"))).transpose()?;
        let camera = n.camera.map(|c| self.counts.camera(c, &at.key("camera"))).transpose()?;
        self.check_deformation(mesh, skin, n.weights.as_deref(), at, warn);
        let mut node = Node {
            name: n.name,
            children: Children::from(children),
            transform,
            mesh,
            skin,
            camera,
            weights: n.weights,
            ..Node::default()
        };
        if n.extensions.is_some() || n.extras.is_some() || n.rest.0.is_some() {
            let mut members = Members::new(n.extensions, n.rest);
            self.extensions(&mut members, &mut node, &mut stated, at, warn)?;
            node.extra = members.finish(n.extras, at)?;
        }
        node.extra.stated = stated;
        Ok(node)
    }

    /// Says what a skin or weights cannot do here.
    fn check_deformation(
        self,
        mesh: Option<MeshId>,
        skin: Option<SkinId>,
        weights: Option<&[f64]>,
        at: &At<'_>,
        warn: &mut Warn<'_>,
    ) {
        let primitives = mesh.map_or(&[][..], |m| &self.scene.meshes[m].primitives);
        let targets = primitives.first().map_or(0, |p| p.targets.len());
        let bound = primitives.iter().all(|p| p.attributes.get("JOINTS_0").is_some());
        if skin.is_some() && mesh.is_none() {
            warn("the node has a skin, but no mesh", &at.key("skin"));
        } else if skin.is_some() && !bound {
            warn("the mesh has no joints; the skin does not move it", &at.key("skin"));
        }
        if weights.is_some_and(|w| w.len() != targets) {
            warn("there are not as many weights as morph targets", &at.key("weights"));
        }
    }

    fn extensions<'a>(
        self,
        members: &mut Members<'a>,
        node: &mut Node,
        stated: &mut Stated,
        at: &At<'_>,
        warn: &mut Warn<'_>,
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
            node.instancing = Some(Box::new(self.instancing(e, &extensions.key(name), warn)?));
        }
        Ok(())
    }

    fn instancing(self, e: schema::Instancing<'_>, at: &At<'_>, warn: &mut Warn<'_>) -> Result<Instancing> {
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
            warn("there are no instance attributes; the mesh is shown once", at);
        }
        Ok(out)
    }
}

fn transform(n: &schema::Node<'_>, stated: &mut Stated, at: &At<'_>, warn: &mut Warn<'_>) -> Result<Transform> {
    let has_trs = n.translation.is_some() || n.rotation.is_some() || n.scale.is_some();
    if let Some(m) = &n.matrix {
        if has_trs {
            warn("the node has a matrix besides translation, rotation or scale; the matrix counts", at);
        }
        let last_row = [m[3], m[7], m[11], m[15] - 1.0];
        if last_row.iter().any(|v| v.abs() > AFFINE_TOLERANCE) {
            return invalid(&at.key("matrix"), "the last row of the matrix must be 0, 0, 0, 1");
        }
        return Ok(Transform::Matrix(m.clone()));
    }
    if !has_trs {
        return Ok(Transform::default());
    }
    let rotation = stated.note(Member::Rotation, n.rotation).unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let length = rotation.iter().map(|v| v * v).sum::<f64>().sqrt();
    if (length - 1.0).abs() > UNIT_TOLERANCE {
        warn("the rotation is not of unit length; it is normalised", &at.key("rotation"));
    }
    Ok(Transform::Trs {
        translation: stated.note(Member::Translation, n.translation).unwrap_or([0.0; 3]),
        rotation,
        scale: stated.note(Member::Scale, n.scale).unwrap_or([1.0; 3]),
    })
}
