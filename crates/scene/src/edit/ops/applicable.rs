//! Whether a material can be applied to a primitive: "a mesh primitive MUST have the corresponding texture coordinate
//! attributes for the material to be applicable to it" (glTF 2.0, section 3.9.2). A clear coat's normal map and a texture of
//! anisotropy need a tangent space besides, which the primitive has to bring along where the material has no normal map
//! from whose coordinates it could be made.

use crate::edit::EditError;
use crate::edit::plan::{Plan, Result};
use crate::model::*;
use std::collections::BTreeSet;

/// What a material asks of a primitive.
struct Needs {
    /// The texture coordinate sets that its textures are mapped by.
    sets: BTreeSet<u32>,
    /// Normals and tangents.
    tangent_space: bool,
}

impl Needs {
    fn of(material: &Material) -> Self {
        let coat = material.clearcoat.as_ref().is_some_and(|coat| coat.normal_texture.is_some());
        let anisotropy = material.anisotropy.as_ref().is_some_and(|lobe| lobe.texture.is_some());
        Self { sets: sets(material), tangent_space: (coat || anisotropy) && material.normal_texture.is_none() }
    }

    fn is_nothing(&self) -> bool {
        self.sets.is_empty() && !self.tangent_space
    }

    /// What is needed now and was not before.
    fn beyond(mut self, before: &Self) -> Self {
        self.sets.retain(|set| !before.sets.contains(set));
        self.tangent_space &= !before.tangent_space;
        self
    }

    /// What of it a primitive lacks, in words.
    fn lacking(&self, primitive: &Primitive) -> Option<String> {
        let has = |semantic: &str| primitive.attributes.get(semantic).is_some();
        let set = self.sets.iter().map(|set| format!("TEXCOORD_{set}")).find(|semantic| !has(semantic));
        let of_set = set.map(|semantic| format!("by {semantic}, which"));
        let lacks_tangents = self.tangent_space && !(has("NORMAL") && has("TANGENT"));
        let of_tangents =
            || "in a tangent space, for which the material needs a normalTexture, or NORMAL and TANGENT, which";
        of_set.or_else(|| lacks_tangents.then(|| of_tangents().to_owned()))
    }
}

/// The texture coordinate sets that the textures of a material are mapped by.
fn sets(material: &Material) -> BTreeSet<u32> {
    let given = SpecularGlossiness::of(material);
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
    let glossiness = given.iter().flat_map(|e| [&e.diffuse_texture, &e.texture]);
    let lobes = clearcoat.chain(transmission).chain(diffuse).chain(volume).chain(specular);
    let all = core.into_iter().chain(lobes).chain(sheen).chain(iridescence).chain(anisotropy).chain(glossiness);
    let set = |info: &TextureInfo| info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
    all.flatten().map(set).collect()
}

/// Refuses a material for a primitive that lacks what its textures are mapped by.
pub fn to_primitive(p: &Plan<'_>, material: MaterialId, mesh: MeshId, primitive: usize) -> Result<()> {
    let needs = Needs::of(p.material(material)?);
    match p.mesh(mesh)?.primitives.get(primitive).and_then(|primitive| needs.lacking(primitive)) {
        Some(lacks) => {
            let what = format!(
                "a texture of it is mapped {lacks} primitive {primitive} of mesh {} does not have",
                Store::<MeshId, ()>::slot(mesh)
            );
            Err(EditError::missing(material, what))
        }
        None => Ok(()),
    }
}

/// Refuses a material for a primitive that is about to be made.
pub fn to_new(p: &Plan<'_>, material: MaterialId, primitive: &Primitive) -> Result<()> {
    match Needs::of(p.material(material)?).lacking(primitive) {
        Some(lacks) => {
            let what = format!("a texture of it is mapped {lacks} the new shape does not have");
            Err(EditError::missing(material, what))
        }
        None => Ok(()),
    }
}

/// Refuses a change of a material after which a primitive that has it lacks what its textures are mapped by, and did not
/// before. O(its users), if the change needs what it did not need.
pub fn change(p: &mut Plan<'_>, id: MaterialId, new: &Material) -> Result<()> {
    let added = Needs::of(new).beyond(&Needs::of(p.material(id)?));
    if added.is_nothing() {
        return Ok(());
    }
    for owner in p.referrers(id) {
        let AnyId::Mesh(mesh) = owner else { continue };
        for (i, primitive) in p.mesh(mesh)?.primitives.iter().enumerate() {
            let has = primitive.material == Some(id) || primitive.variants.iter().any(|mapping| mapping.material == id);
            if has && let Some(lacks) = added.lacking(primitive) {
                let what = format!(
                    "a texture would be mapped {lacks} primitive {i} of mesh {} does not have",
                    Store::<MeshId, ()>::slot(mesh)
                );
                return Err(EditError::value("/set", what));
            }
        }
    }
    Ok(())
}
