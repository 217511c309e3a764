//! Own meshes and shared ones, over the same geometry.

use super::copy_name;
use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::edit::step::{NodeField, Step};
use crate::model::*;
use std::collections::{BTreeSet, HashMap};

fn shown_mesh(p: &Plan<'_>, node: NodeId) -> Result<MeshId> {
    p.node(node)?.mesh.ok_or_else(|| EditError::missing(node, "it shows no mesh; give it one with set_mesh"))
}

/// The materials of a mesh, in all its variants.
fn materials(mesh: &mut Mesh) -> impl Iterator<Item = &mut MaterialId> {
    mesh.primitives.iter_mut().flat_map(|primitive| {
        let variants = primitive.variants.iter_mut().map(|mapping| &mut mapping.material);
        primitive.material.as_mut().into_iter().chain(variants)
    })
}

pub fn split(p: &mut Plan<'_>, node: NodeId) -> Result<()> {
    let mut mesh = p.mesh(shown_mesh(p, node)?)?.clone();
    mesh.name = Some(copy_name(mesh.name.as_deref()));
    let mut copies: HashMap<MaterialId, MaterialId> = HashMap::new();
    for slot in materials(&mut mesh) {
        let original = *slot;
        if let Some(&copy) = copies.get(&original) {
            *slot = copy;
            continue;
        }
        let mut material = p.material(original)?.clone();
        material.name = Some(copy_name(material.name.as_deref()));
        *slot = p.add_material(material);
        copies.insert(original, *slot);
    }
    let copy = p.add_mesh(mesh);
    p.made = Some(copy.into());
    p.set(node, NodeField::Mesh(Some(copy)));
    Ok(())
}

pub fn merge(p: &mut Plan<'_>, node: NodeId) -> Result<()> {
    let own = shown_mesh(p, node)?;
    let found = equal_mesh(p, own)?.ok_or(EditError::NoEqualMesh(node))?;
    p.set(node, NodeField::Mesh(Some(found)));
    if p.has_other_referrer(own, node) {
        return Ok(());
    }
    // The orphan goes, and the materials that only it had.
    let mut parked = vec![own.into()];
    let mut mesh = p.mesh(own)?.clone();
    let materials: BTreeSet<MaterialId> = materials(&mut mesh).map(|slot| *slot).collect();
    for material in materials {
        if !p.has_other_referrer(material, own) {
            parked.push(material.into());
        }
    }
    p.step(Step::Park(parked));
    Ok(())
}

/// The first other mesh over the same geometry whose materials and extras are equal.
fn equal_mesh(p: &mut Plan<'_>, own: MeshId) -> Result<Option<MeshId>> {
    let mesh = p.mesh(own)?.clone();
    if mesh.primitives.iter().all(|primitive| primitive.attributes.0.is_empty()) {
        return Ok(None);
    }
    p.twin(own, |p, other| is_equal(p, &mesh, p.mesh(other)?))
}

fn is_equal(p: &Plan<'_>, a: &Mesh, b: &Mesh) -> Result<bool> {
    if a.primitives.len() != b.primitives.len() || a.weights != b.weights || a.extra != b.extra {
        return Ok(false);
    }
    for (a, b) in a.primitives.iter().zip(&b.primitives) {
        let same_geometry =
            a.attributes == b.attributes && a.indices == b.indices && a.mode == b.mode && a.targets == b.targets;
        let same_extra = a.extra == b.extra;
        let same_variants = a.variants.len() == b.variants.len()
            && a.variants.iter().zip(&b.variants).all(|(a, b)| a.variants == b.variants && a.extra == b.extra);
        if !same_geometry || !same_variants || !same_extra || !same_material(p, a.material, b.material)? {
            return Ok(false);
        }
        for (a, b) in a.variants.iter().zip(&b.variants) {
            if !same_material(p, Some(a.material), Some(b.material))? {
                return Ok(false);
            }
        }
    }
    Ok(true)
}

/// Whether two materials look the same: a name does not show.
fn same_material(p: &Plan<'_>, a: Option<MaterialId>, b: Option<MaterialId>) -> Result<bool> {
    match (a, b) {
        (Some(a), Some(b)) if a != b => {
            let [mut a, mut b] = [p.material(a)?.clone(), p.material(b)?.clone()];
            (a.name, b.name) = (None, None);
            Ok(a == b)
        }
        (a, b) => Ok(a == b),
    }
}
