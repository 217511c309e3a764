//! Whether a material can be applied to a primitive: "a mesh primitive MUST have the corresponding texture coordinate
//! attributes for the material to be applicable to it" (glTF 2.0, section 3.9.2).

use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::model::*;
use std::collections::BTreeSet;

/// The texture coordinate sets that the textures of a material are mapped by.
fn sets(material: &Material) -> BTreeSet<u32> {
    let core = [
        &material.base_color_texture,
        &material.metallic_roughness_texture,
        &material.normal_texture,
        &material.occlusion_texture,
        &material.emissive_texture,
    ];
    let clearcoat = material.clearcoat.iter().flat_map(|e| [&e.texture, &e.roughness_texture, &e.normal_texture]);
    let transmission = material.transmission.iter().map(|e| &e.texture);
    let diffuse = material.diffuse_transmission.iter().flat_map(|e| [&e.texture, &e.color_texture]);
    let volume = material.volume.iter().map(|e| &e.thickness_texture);
    let specular = material.specular.iter().flat_map(|e| [&e.texture, &e.color_texture]);
    let sheen = material.sheen.iter().flat_map(|e| [&e.color_texture, &e.roughness_texture]);
    let iridescence = material.iridescence.iter().flat_map(|e| [&e.texture, &e.thickness_texture]);
    let anisotropy = material.anisotropy.iter().map(|e| &e.texture);
    let lobes = clearcoat.chain(transmission).chain(diffuse).chain(volume).chain(specular);
    let all = core.into_iter().chain(lobes).chain(sheen).chain(iridescence).chain(anisotropy);
    let set = |info: &TextureInfo| info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
    all.flatten().map(set).collect()
}

/// The first set that a primitive lacks.
fn lacking(primitive: &Primitive, sets: &BTreeSet<u32>) -> Option<u32> {
    sets.iter().copied().find(|set| primitive.attributes.get(&format!("TEXCOORD_{set}")).is_none())
}

/// Refuses a material for a primitive that lacks what its textures are mapped by.
pub fn to_primitive(p: &Plan<'_>, material: MaterialId, mesh: MeshId, primitive: usize) -> Result<()> {
    let sets = sets(p.material(material)?);
    let lacks = p.mesh(mesh)?.primitives.get(primitive).and_then(|primitive| lacking(primitive, &sets));
    match lacks {
        Some(set) => {
            let what = format!(
                "a texture of it is mapped by TEXCOORD_{set}, which primitive {primitive} of mesh {} does not have",
                Store::<MeshId, ()>::slot(mesh)
            );
            Err(EditError::missing(material, what))
        }
        None => Ok(()),
    }
}

/// Refuses a material for a primitive that is about to be made.
pub fn to_new(p: &Plan<'_>, material: MaterialId, primitive: &Primitive) -> Result<()> {
    match lacking(primitive, &sets(p.material(material)?)) {
        Some(set) => {
            let what = format!("a texture of it is mapped by TEXCOORD_{set}, which the new shape does not have");
            Err(EditError::missing(material, what))
        }
        None => Ok(()),
    }
}

/// Refuses a change of a material after which a primitive that has it lacks what its textures are mapped by, and did not
/// before. O(its users), if the change needs sets that it did not need.
pub fn change(p: &mut Plan<'_>, id: MaterialId, new: &Material) -> Result<()> {
    let old = sets(p.material(id)?);
    let added: BTreeSet<u32> = sets(new).difference(&old).copied().collect();
    if added.is_empty() {
        return Ok(());
    }
    for owner in p.referrers(id) {
        let AnyId::Mesh(mesh) = owner else { continue };
        for (i, primitive) in p.mesh(mesh)?.primitives.iter().enumerate() {
            let has = primitive.material == Some(id) || primitive.variants.iter().any(|mapping| mapping.material == id);
            if has && let Some(set) = lacking(primitive, &added) {
                let what = format!(
                    "a texture would be mapped by TEXCOORD_{set}, which primitive {i} of mesh {} does not have",
                    Store::<MeshId, ()>::slot(mesh)
                );
                return Err(EditError::value("/set", what));
            }
        }
    }
    Ok(())
}
