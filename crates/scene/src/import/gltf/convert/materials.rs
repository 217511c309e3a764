//! Materials with every extension that the model types.

use super::{Converter, Members, Result, small};
use crate::import::gltf::place::At;
use crate::import::gltf::schema;
use crate::model::*;
use std::ops::RangeInclusive;

const UNIT: RangeInclusive<f64> = 0.0..=1.0;
const POSITIVE: RangeInclusive<f64> = 0.0..=f64::INFINITY;

/// Which member of a texture reference says how strong it is.
enum Strength {
    None,
    /// `scale`.
    OfNormals,
    /// `strength`.
    OfOcclusion,
}

impl Converter<'_> {
    pub(super) fn materials(&mut self, materials: Vec<schema::Material<'_>>) -> Result<()> {
        let at = &At::Root.key("materials");
        self.scene.materials.reserve(materials.len());
        for (i, m) in materials.into_iter().enumerate() {
            let material = self.material(m, &at.index(i))?;
            self.scene.materials.insert_nth(i, material);
        }
        Ok(())
    }

    fn material(&mut self, m: schema::Material<'_>, at: &At<'_>) -> Result<Material> {
        let mut out = Material { name: m.name, ..Material::default() };
        if let Some(pbr) = m.pbr_metallic_roughness {
            self.pbr(*pbr, &mut out, &at.key("pbrMetallicRoughness"))?;
        }
        out.normal_texture =
            self.texture_info(m.normal_texture.map(|t| *t), Strength::OfNormals, &at.key("normalTexture"))?;
        out.occlusion_texture =
            self.texture_info(m.occlusion_texture.map(|t| *t), Strength::OfOcclusion, &at.key("occlusionTexture"))?;
        out.emissive_texture = self.texture(m.emissive_texture.map(|t| *t), &at.key("emissiveTexture"))?;
        out.emissive = self.color(m.emissive_factor, [0.0; 3], UNIT, &at.key("emissiveFactor"));
        out.alpha_mode = match m.alpha_mode {
            None | Some(schema::AlphaMode::Opaque) => AlphaMode::Opaque,
            Some(schema::AlphaMode::Mask) => AlphaMode::Mask,
            Some(schema::AlphaMode::Blend) => AlphaMode::Blend,
        };
        out.alpha_cutoff = m.alpha_cutoff;
        out.double_sided = m.double_sided.unwrap_or(false);
        let mut members = Members::new(m.extensions);
        self.scalar_extensions(&mut members, &mut out, at)?;
        self.lobe_extensions(&mut members, &mut out, at)?;
        out.extra = members.finish(m.extras, at)?;
        Ok(out)
    }

    fn pbr(&mut self, p: schema::PbrMetallicRoughness<'_>, out: &mut Material, at: &At<'_>) -> Result<()> {
        out.base_color = self.color(p.base_color_factor, [1.0; 4], UNIT, &at.key("baseColorFactor"));
        out.base_color_texture = self.texture(p.base_color_texture.map(|t| *t), &at.key("baseColorTexture"))?;
        out.metallic = self.factor(p.metallic_factor, 1.0, UNIT, &at.key("metallicFactor"));
        out.roughness = self.factor(p.roughness_factor, 1.0, UNIT, &at.key("roughnessFactor"));
        out.metallic_roughness_texture =
            self.texture(p.metallic_roughness_texture.map(|t| *t), &at.key("metallicRoughnessTexture"))?;
        out.pbr_extra = Members::new(p.extensions).finish(p.extras, at)?;
        Ok(())
    }

    fn scalar_extensions(&mut self, members: &mut Members<'_>, out: &mut Material, at: &At<'_>) -> Result<()> {
        let extensions = &at.key("extensions");
        let name = "KHR_materials_unlit";
        if let Some(e) = members.take::<schema::Unlit<'_>>(name, at)? {
            out.unlit = true;
            members.keep_rest(name, e.extensions, e.extras, at)?;
        }
        let name = "KHR_materials_emissive_strength";
        if let Some(e) = members.take::<schema::EmissiveStrength<'_>>(name, at)? {
            out.emissive_strength = Some(self.factor(e.emissive_strength, 1.0, POSITIVE, &extensions.key(name)));
            members.keep_rest(name, e.extensions, e.extras, at)?;
        }
        let name = "KHR_materials_ior";
        if let Some(e) = members.take::<schema::Ior<'_>>(name, at)? {
            out.ior = Some(self.factor(e.ior, 1.5, POSITIVE, &extensions.key(name)));
            members.keep_rest(name, e.extensions, e.extras, at)?;
        }
        let name = "KHR_materials_dispersion";
        if let Some(e) = members.take::<schema::Dispersion<'_>>(name, at)? {
            out.dispersion = Some(self.factor(e.dispersion, 0.0, POSITIVE, &extensions.key(name)));
            members.keep_rest(name, e.extensions, e.extras, at)?;
        }
        Ok(())
    }

    fn lobe_extensions(&mut self, members: &mut Members<'_>, out: &mut Material, at: &At<'_>) -> Result<()> {
        let extensions = &at.key("extensions");
        let name = "KHR_materials_clearcoat";
        if let Some(e) = members.take::<schema::Clearcoat<'_>>(name, at)? {
            let at = &extensions.key(name);
            let normal_at = &at.key("clearcoatNormalTexture");
            out.clearcoat = Some(Box::new(Clearcoat {
                factor: self.factor(e.clearcoat_factor, 0.0, UNIT, &at.key("clearcoatFactor")),
                texture: self.texture(e.clearcoat_texture, &at.key("clearcoatTexture"))?,
                roughness: self.factor(e.clearcoat_roughness_factor, 0.0, UNIT, &at.key("clearcoatRoughnessFactor")),
                roughness_texture: self.texture(e.clearcoat_roughness_texture, &at.key("clearcoatRoughnessTexture"))?,
                normal_texture: self.texture_info(e.clearcoat_normal_texture, Strength::OfNormals, normal_at)?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_transmission";
        if let Some(e) = members.take::<schema::Transmission<'_>>(name, at)? {
            let at = &extensions.key(name);
            out.transmission = Some(Box::new(Transmission {
                factor: self.factor(e.transmission_factor, 0.0, UNIT, &at.key("transmissionFactor")),
                texture: self.texture(e.transmission_texture, &at.key("transmissionTexture"))?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_diffuse_transmission";
        if let Some(e) = members.take::<schema::DiffuseTransmission<'_>>(name, at)? {
            let at = &extensions.key(name);
            let color_at = &at.key("diffuseTransmissionColorFactor");
            let color_texture_at = &at.key("diffuseTransmissionColorTexture");
            out.diffuse_transmission = Some(Box::new(DiffuseTransmission {
                factor: self.factor(e.diffuse_transmission_factor, 0.0, UNIT, &at.key("diffuseTransmissionFactor")),
                texture: self.texture(e.diffuse_transmission_texture, &at.key("diffuseTransmissionTexture"))?,
                color: self.color(e.diffuse_transmission_color_factor, [1.0; 3], UNIT, color_at),
                color_texture: self.texture(e.diffuse_transmission_color_texture, color_texture_at)?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_volume";
        if let Some(e) = members.take::<schema::Volume<'_>>(name, at)? {
            let at = &extensions.key(name);
            out.volume = Some(Box::new(Volume {
                thickness: self.factor(e.thickness_factor, 0.0, POSITIVE, &at.key("thicknessFactor")),
                thickness_texture: self.texture(e.thickness_texture, &at.key("thicknessTexture"))?,
                attenuation_distance: e.attenuation_distance,
                attenuation_color: self.color(e.attenuation_color, [1.0; 3], UNIT, &at.key("attenuationColor")),
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_specular";
        if let Some(e) = members.take::<schema::Specular<'_>>(name, at)? {
            let at = &extensions.key(name);
            out.specular = Some(Box::new(Specular {
                factor: self.factor(e.specular_factor, 1.0, UNIT, &at.key("specularFactor")),
                texture: self.texture(e.specular_texture, &at.key("specularTexture"))?,
                color: self.color(e.specular_color_factor, [1.0; 3], POSITIVE, &at.key("specularColorFactor")),
                color_texture: self.texture(e.specular_color_texture, &at.key("specularColorTexture"))?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_sheen";
        if let Some(e) = members.take::<schema::Sheen<'_>>(name, at)? {
            let at = &extensions.key(name);
            out.sheen = Some(Box::new(Sheen {
                color: self.color(e.sheen_color_factor, [0.0; 3], UNIT, &at.key("sheenColorFactor")),
                color_texture: self.texture(e.sheen_color_texture, &at.key("sheenColorTexture"))?,
                roughness: self.factor(e.sheen_roughness_factor, 0.0, UNIT, &at.key("sheenRoughnessFactor")),
                roughness_texture: self.texture(e.sheen_roughness_texture, &at.key("sheenRoughnessTexture"))?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_iridescence";
        if let Some(e) = members.take::<schema::Iridescence<'_>>(name, at)? {
            let at = &extensions.key(name);
            let (minimum_at, maximum_at) =
                (&at.key("iridescenceThicknessMinimum"), &at.key("iridescenceThicknessMaximum"));
            let thickness_at = &at.key("iridescenceThicknessTexture");
            out.iridescence = Some(Box::new(Iridescence {
                factor: self.factor(e.iridescence_factor, 0.0, UNIT, &at.key("iridescenceFactor")),
                texture: self.texture(e.iridescence_texture, &at.key("iridescenceTexture"))?,
                ior: self.factor(e.iridescence_ior, 1.3, 1.0..=f64::INFINITY, &at.key("iridescenceIor")),
                thickness_minimum: self.factor(e.iridescence_thickness_minimum, 100.0, POSITIVE, minimum_at),
                thickness_maximum: self.factor(e.iridescence_thickness_maximum, 400.0, POSITIVE, maximum_at),
                thickness_texture: self.texture(e.iridescence_thickness_texture, thickness_at)?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        let name = "KHR_materials_anisotropy";
        if let Some(e) = members.take::<schema::Anisotropy<'_>>(name, at)? {
            let at = &extensions.key(name);
            out.anisotropy = Some(Box::new(Anisotropy {
                strength: self.factor(e.anisotropy_strength, 0.0, UNIT, &at.key("anisotropyStrength")),
                rotation: e.anisotropy_rotation.unwrap_or(0.0),
                texture: self.texture(e.anisotropy_texture, &at.key("anisotropyTexture"))?,
                extra: Members::new(e.extensions).finish(e.extras, at)?,
            }));
        }
        Ok(())
    }

    fn texture(&mut self, info: Option<schema::TextureInfo<'_>>, at: &At<'_>) -> Result<Option<TextureInfo>> {
        self.texture_info(info, Strength::None, at)
    }

    fn texture_info(
        &mut self,
        info: Option<schema::TextureInfo<'_>>,
        strength: Strength,
        at: &At<'_>,
    ) -> Result<Option<TextureInfo>> {
        let Some(info) = info else { return Ok(None) };
        let mut members = Members::new(info.extensions);
        let name = "KHR_texture_transform";
        let transform = match members.take::<schema::TextureTransform<'_>>(name, at)? {
            None => None,
            Some(t) => {
                let at = &at.key("extensions");
                let at = &at.key(name);
                Some(Box::new(TextureTransform {
                    offset: t.offset.unwrap_or([0.0; 2]),
                    rotation: t.rotation.unwrap_or(0.0),
                    scale: t.scale.unwrap_or([1.0; 2]),
                    tex_coord: t.tex_coord.map(|c| small(c, &at.key("texCoord"))).transpose()?,
                    extra: Members::new(t.extensions).finish(t.extras, at)?,
                }))
            }
        };
        Ok(Some(TextureInfo {
            texture: self.counts.texture(info.index, &at.key("index"))?,
            tex_coord: small(info.tex_coord.unwrap_or_default(), &at.key("texCoord"))?,
            transform,
            scale: match strength {
                Strength::None => 1.0,
                Strength::OfNormals => info.scale.unwrap_or(1.0),
                Strength::OfOcclusion => self.factor(info.strength, 1.0, UNIT, &at.key("strength")),
            },
            extra: members.finish(info.extras, at)?,
        }))
    }

    /// Values out of range are kept as they are: what they mean is for who uses them to say.
    fn factor(&mut self, value: Option<f64>, default: f64, range: RangeInclusive<f64>, at: &At<'_>) -> f64 {
        self.color(value.map(|v| [v]), [default], range, at)[0]
    }

    fn color<const N: usize>(
        &mut self,
        value: Option<[f64; N]>,
        default: [f64; N],
        range: RangeInclusive<f64>,
        at: &At<'_>,
    ) -> [f64; N] {
        let Some(value) = value else { return default };
        if value.iter().any(|v| !range.contains(v)) {
            self.tolerate("a factor of the material is outside its range", at);
        }
        value
    }
}
