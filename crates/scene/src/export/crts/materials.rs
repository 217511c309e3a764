//! Materials, by the Disney table.

use super::images::{Images, is_generated};
use super::objects::LightParts;
use super::{Result, Writer, finite};
use crate::Scene;
use crate::import::crts::disney::{Disney, EXTENSION};
use crate::import::crts::schema::{self, Scalar, ScalarTexture};
use crate::model::*;
use std::collections::HashMap;

/// The index of each material in the file.
pub type Materials = HashMap<MaterialId, i64>;

/// The parameters of a material: as a file had them, if nobody has edited it since, else those that come closest.
pub fn disney(scene: &Scene, material: &Material) -> (Disney, Vec<&'static str>) {
    match kept(scene, material) {
        Some(kept) => (kept, Vec::new()),
        None => Disney::of_material(material),
    }
}

fn kept(scene: &Scene, material: &Material) -> Option<Disney> {
    let value = material.extra.extensions.as_ref()?.get(EXTENSION)?;
    let texture = |pointer: &str| {
        let path = format!("/{EXTENSION}{pointer}");
        material.extra.links().iter().find(|link| *link.path == *path).and_then(|link| match link.target {
            AnyId::Texture(id) if scene.textures().get(id).is_some() => Some(id),
            _ => None,
        })
    };
    let disney = Disney::from_json(value, texture)?;
    let is_made = |info: &&TextureInfo| {
        scene.textures()[info.texture]
            .best_source(scene.images())
            .is_some_and(|image| is_generated(&scene.images()[image]))
    };
    // Textures are those of the parameters, or made from them.
    let textures = textures(material);
    let is_known = |info: &&TextureInfo| is_made(info) || disney.all_textures().any(|t| t == info.texture);
    let is_same = without_textures(material) == disney.factors() && textures.iter().all(is_known);
    is_same.then_some(disney)
}

/// The textures of the slots that the Disney parameters fill.
fn textures(m: &Material) -> Vec<&TextureInfo> {
    let slots = [
        m.base_color_texture.as_ref(),
        m.metallic_roughness_texture.as_ref(),
        m.specular.as_ref().and_then(|l| l.texture.as_ref()),
        m.anisotropy.as_ref().and_then(|l| l.texture.as_ref()),
        m.sheen.as_ref().and_then(|l| l.color_texture.as_ref()),
        m.clearcoat.as_ref().and_then(|l| l.texture.as_ref()),
        m.clearcoat.as_ref().and_then(|l| l.roughness_texture.as_ref()),
        m.transmission.as_ref().and_then(|l| l.texture.as_ref()),
    ];
    slots.into_iter().flatten().collect()
}

/// The material with its factors alone, as [`Disney::factors`] makes it.
fn without_textures(material: &Material) -> Material {
    let mut m = Material { name: None, extra: Extra::default(), ..material.clone() };
    m.pbr_extra = Extra::default();
    m.base_color_texture = None;
    m.metallic_roughness_texture = None;
    if let Some(l) = &mut m.specular {
        (l.texture, l.extra) = (None, Extra::default());
    }
    if let Some(l) = &mut m.anisotropy {
        (l.texture, l.extra) = (None, Extra::default());
    }
    if let Some(l) = &mut m.sheen {
        (l.color_texture, l.extra) = (None, Extra::default());
    }
    if let Some(l) = &mut m.clearcoat {
        (l.texture, l.roughness_texture, l.extra) = (None, None, Extra::default());
    }
    if let Some(l) = &mut m.transmission {
        (l.texture, l.extra) = (None, Extra::default());
    }
    m
}

impl Writer<'_> {
    pub(super) fn materials(&mut self, lights: &LightParts, images: &Images) -> Result<Materials> {
        let scene = self.scene;
        let mut materials = Materials::new();
        for (id, material) in scene.materials().iter().filter(|(id, _)| !lights.materials.contains(id)) {
            let pointer = format!("/materials/{}", Store::<MaterialId, Material>::slot(id));
            let converted = material.without_specular_glossiness();
            if let Some((_, true)) = converted {
                self.note(pointer.clone(), "CRTS does not hold textures of specular and glossiness");
            }
            let material = converted.as_ref().map_or(material, |(converted, _)| converted);
            let (disney, left_out) = disney(scene, material);
            for what in left_out.into_iter().chain(unheld(material)) {
                self.note(pointer.clone(), &format!("CRTS does not hold {what}"));
            }
            materials.insert(id, self.material(&disney, material.name.clone(), images)?);
        }
        Ok(materials)
    }

    /// Adds a material; its index.
    pub(super) fn material(&mut self, disney: &Disney, name: Option<String>, images: &Images) -> Result<i64> {
        let scene = self.scene;
        let index = |texture: TextureId| images.get(&scene.textures()[texture].best_source(scene.images())?).copied();
        let mut out = schema::Material { name: Some(name.unwrap_or_default()), ..schema::Material::default() };
        for value in disney.base_color {
            finite(value, "base_color")?;
        }
        out.base_color = Some(disney.base_color);
        out.base_color_texture = disney.base_color_texture.and_then(index);
        for scalar in Scalar::ALL {
            let texture = disney
                .texture(scalar)
                .and_then(|c| Some(ScalarTexture { texture: index(c.texture)?, channel: i64::from(c.channel) }));
            out.set_scalar(scalar, finite(disney.value(scalar), scalar.key())?, texture);
        }
        self.header.materials.push(out);
        Ok(self.header.materials.len() as i64 - 1)
    }
}

/// What the format has no place for.
fn unheld(m: &Material) -> impl Iterator<Item = &'static str> + use<> {
    let infos = textures(m);
    [
        (m.emissive != [0.0; 3], "emission of surfaces"),
        (m.alpha_mode != AlphaMode::Opaque, "transparency by alpha"),
        (m.normal_texture.is_some(), "normal maps"),
        (m.occlusion_texture.is_some(), "occlusion maps"),
        (m.unlit, "unlit materials"),
        (m.volume.as_ref().is_some_and(|v| v.thickness != 0.0), "volumes"),
        (m.iridescence.is_some(), "iridescence"),
        (m.dispersion.is_some(), "dispersion"),
        (m.diffuse_transmission.is_some(), "diffuse transmission"),
        (infos.iter().any(|i| i.transform.is_some()), "texture transforms"),
        (infos.iter().any(|i| i.tex_coord != 0), "a second set of texture coordinates"),
    ]
    .into_iter()
    .filter_map(|(is_there, what)| is_there.then_some(what))
}
