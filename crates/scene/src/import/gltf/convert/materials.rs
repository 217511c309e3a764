//! Materials with every extension that the model types.

use super::{Converter, Members, Result, small};
use crate::import::gltf::schema;
use crate::model::*;
use crate::place::At;
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
        let mut stated = Stated::default();
        if let Some(pbr) = stated.note(Member::PbrMetallicRoughness, m.pbr_metallic_roughness) {
            self.pbr(*pbr, &mut out, &at.key("pbrMetallicRoughness"))?;
        }
        out.normal_texture =
            self.texture_info(m.normal_texture.map(|t| *t), Strength::OfNormals, &at.key("normalTexture"))?;
        out.occlusion_texture =
            self.texture_info(m.occlusion_texture.map(|t| *t), Strength::OfOcclusion, &at.key("occlusionTexture"))?;
        out.emissive_texture = self.texture(m.emissive_texture.map(|t| *t), &at.key("emissiveTexture"))?;
        out.emissive = self.color(
            stated.note(Member::EmissiveFactor, m.emissive_factor),
            [0.0; 3],
            UNIT,
            &at.key("emissiveFactor"),
        );
        out.alpha_mode = match stated.note(Member::AlphaMode, m.alpha_mode) {
            None | Some(schema::AlphaMode::Opaque) => AlphaMode::Opaque,
            Some(schema::AlphaMode::Mask) => AlphaMode::Mask,
            Some(schema::AlphaMode::Blend) => AlphaMode::Blend,
        };
        out.alpha_cutoff = m.alpha_cutoff;
        out.double_sided = stated.note(Member::DoubleSided, m.double_sided).unwrap_or(false);
        let mut members = Members::new(m.extensions, m.rest);
        self.scalar_extensions(&mut members, &mut out, &mut stated, at)?;
        self.lobe_extensions(&mut members, &mut out, at)?;
        out.extra = members.finish(m.extras, at)?.stating(stated);
        Ok(out)
    }

    fn pbr(&mut self, p: schema::PbrMetallicRoughness<'_>, out: &mut Material, at: &At<'_>) -> Result<()> {
        let mut stated = Stated::default();
        out.base_color = self.color(
            stated.note(Member::BaseColorFactor, p.base_color_factor),
            [1.0; 4],
            UNIT,
            &at.key("baseColorFactor"),
        );
        out.base_color_texture = self.texture(p.base_color_texture.map(|t| *t), &at.key("baseColorTexture"))?;
        out.metallic =
            self.factor(stated.note(Member::MetallicFactor, p.metallic_factor), 1.0, UNIT, &at.key("metallicFactor"));
        out.roughness = self.factor(
            stated.note(Member::RoughnessFactor, p.roughness_factor),
            1.0,
            UNIT,
            &at.key("roughnessFactor"),
        );
        out.metallic_roughness_texture =
            self.texture(p.metallic_roughness_texture.map(|t| *t), &at.key("metallicRoughnessTexture"))?;
        out.pbr_extra = Members::new(p.extensions, p.rest).finish(p.extras, at)?.stating(stated);
        Ok(())
    }

    fn scalar_extensions(
        &mut self,
        members: &mut Members<'_>,
        out: &mut Material,
        stated: &mut Stated,
        at: &At<'_>,
    ) -> Result<()> {
        let extensions = &at.key("extensions");
        let name = "KHR_materials_unlit";
        if let Some(e) = members.take::<schema::Unlit<'_>>(name, at)? {
            out.unlit = true;
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        let name = "KHR_materials_emissive_strength";
        if let Some(e) = members.take::<schema::EmissiveStrength<'_>>(name, at)? {
            out.emissive_strength = Some(self.factor(
                stated.note(Member::EmissiveStrength, e.emissive_strength),
                1.0,
                POSITIVE,
                &extensions.key(name),
            ));
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        let name = "KHR_materials_ior";
        if let Some(e) = members.take::<schema::Ior<'_>>(name, at)? {
            out.ior = Some(self.factor(stated.note(Member::Ior, e.ior), 1.5, POSITIVE, &extensions.key(name)));
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        let name = "KHR_materials_dispersion";
        if let Some(e) = members.take::<schema::Dispersion<'_>>(name, at)? {
            out.dispersion =
                Some(self.factor(stated.note(Member::Dispersion, e.dispersion), 0.0, POSITIVE, &extensions.key(name)));
            members.keep_rest(name, e.extensions, e.extras, e.rest, at)?;
        }
        Ok(())
    }

    fn lobe_extensions(&mut self, members: &mut Members<'_>, out: &mut Material, at: &At<'_>) -> Result<()> {
        let extensions = &at.key("extensions");
        let name = "KHR_materials_clearcoat";
        if let Some(e) = members.take::<schema::Clearcoat<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            let normal_at = &at.key("clearcoatNormalTexture");
            out.clearcoat = Some(Box::new(Clearcoat {
                factor: self.factor(
                    stated.note(Member::ClearcoatFactor, e.clearcoat_factor),
                    0.0,
                    UNIT,
                    &at.key("clearcoatFactor"),
                ),
                texture: self.texture(e.clearcoat_texture, &at.key("clearcoatTexture"))?,
                roughness: self.factor(
                    stated.note(Member::ClearcoatRoughnessFactor, e.clearcoat_roughness_factor),
                    0.0,
                    UNIT,
                    &at.key("clearcoatRoughnessFactor"),
                ),
                roughness_texture: self.texture(e.clearcoat_roughness_texture, &at.key("clearcoatRoughnessTexture"))?,
                normal_texture: self.texture_info(e.clearcoat_normal_texture, Strength::OfNormals, normal_at)?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_transmission";
        if let Some(e) = members.take::<schema::Transmission<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            out.transmission = Some(Box::new(Transmission {
                factor: self.factor(
                    stated.note(Member::TransmissionFactor, e.transmission_factor),
                    0.0,
                    UNIT,
                    &at.key("transmissionFactor"),
                ),
                texture: self.texture(e.transmission_texture, &at.key("transmissionTexture"))?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_diffuse_transmission";
        if let Some(e) = members.take::<schema::DiffuseTransmission<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            let color_at = &at.key("diffuseTransmissionColorFactor");
            let color_texture_at = &at.key("diffuseTransmissionColorTexture");
            out.diffuse_transmission = Some(Box::new(DiffuseTransmission {
                factor: self.factor(
                    stated.note(Member::DiffuseTransmissionFactor, e.diffuse_transmission_factor),
                    0.0,
                    UNIT,
                    &at.key("diffuseTransmissionFactor"),
                ),
                texture: self.texture(e.diffuse_transmission_texture, &at.key("diffuseTransmissionTexture"))?,
                color: self.color(
                    stated.note(Member::DiffuseTransmissionColorFactor, e.diffuse_transmission_color_factor),
                    [1.0; 3],
                    UNIT,
                    color_at,
                ),
                color_texture: self.texture(e.diffuse_transmission_color_texture, color_texture_at)?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_volume";
        if let Some(e) = members.take::<schema::Volume<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            out.volume = Some(Box::new(Volume {
                thickness: self.factor(
                    stated.note(Member::ThicknessFactor, e.thickness_factor),
                    0.0,
                    POSITIVE,
                    &at.key("thicknessFactor"),
                ),
                thickness_texture: self.texture(e.thickness_texture, &at.key("thicknessTexture"))?,
                attenuation_distance: e.attenuation_distance,
                attenuation_color: self.color(
                    stated.note(Member::AttenuationColor, e.attenuation_color),
                    [1.0; 3],
                    UNIT,
                    &at.key("attenuationColor"),
                ),
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_specular";
        if let Some(e) = members.take::<schema::Specular<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            out.specular = Some(Box::new(Specular {
                factor: self.factor(
                    stated.note(Member::SpecularFactor, e.specular_factor),
                    1.0,
                    UNIT,
                    &at.key("specularFactor"),
                ),
                texture: self.texture(e.specular_texture, &at.key("specularTexture"))?,
                color: self.color(
                    stated.note(Member::SpecularColorFactor, e.specular_color_factor),
                    [1.0; 3],
                    POSITIVE,
                    &at.key("specularColorFactor"),
                ),
                color_texture: self.texture(e.specular_color_texture, &at.key("specularColorTexture"))?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_sheen";
        if let Some(e) = members.take::<schema::Sheen<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            out.sheen = Some(Box::new(Sheen {
                color: self.color(
                    stated.note(Member::SheenColorFactor, e.sheen_color_factor),
                    [0.0; 3],
                    UNIT,
                    &at.key("sheenColorFactor"),
                ),
                color_texture: self.texture(e.sheen_color_texture, &at.key("sheenColorTexture"))?,
                roughness: self.factor(
                    stated.note(Member::SheenRoughnessFactor, e.sheen_roughness_factor),
                    0.0,
                    UNIT,
                    &at.key("sheenRoughnessFactor"),
                ),
                roughness_texture: self.texture(e.sheen_roughness_texture, &at.key("sheenRoughnessTexture"))?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_iridescence";
        if let Some(e) = members.take::<schema::Iridescence<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            let (minimum_at, maximum_at) =
                (&at.key("iridescenceThicknessMinimum"), &at.key("iridescenceThicknessMaximum"));
            let thickness_at = &at.key("iridescenceThicknessTexture");
            out.iridescence = Some(Box::new(Iridescence {
                factor: self.factor(
                    stated.note(Member::IridescenceFactor, e.iridescence_factor),
                    0.0,
                    UNIT,
                    &at.key("iridescenceFactor"),
                ),
                texture: self.texture(e.iridescence_texture, &at.key("iridescenceTexture"))?,
                ior: self.factor(
                    stated.note(Member::IridescenceIor, e.iridescence_ior),
                    1.3,
                    1.0..=f64::INFINITY,
                    &at.key("iridescenceIor"),
                ),
                thickness_minimum: self.factor(
                    stated.note(Member::IridescenceThicknessMinimum, e.iridescence_thickness_minimum),
                    100.0,
                    POSITIVE,
                    minimum_at,
                ),
                thickness_maximum: self.factor(
                    stated.note(Member::IridescenceThicknessMaximum, e.iridescence_thickness_maximum),
                    400.0,
                    POSITIVE,
                    maximum_at,
                ),
                thickness_texture: self.texture(e.iridescence_thickness_texture, thickness_at)?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
            }));
        }
        let name = "KHR_materials_anisotropy";
        if let Some(e) = members.take::<schema::Anisotropy<'_>>(name, at)? {
            let (at, mut stated) = (&extensions.key(name), Stated::default());
            out.anisotropy = Some(Box::new(Anisotropy {
                strength: self.factor(
                    stated.note(Member::AnisotropyStrength, e.anisotropy_strength),
                    0.0,
                    UNIT,
                    &at.key("anisotropyStrength"),
                ),
                rotation: stated.note(Member::AnisotropyRotation, e.anisotropy_rotation).unwrap_or(0.0),
                texture: self.texture(e.anisotropy_texture, &at.key("anisotropyTexture"))?,
                extra: Members::new(e.extensions, e.rest).finish(e.extras, at)?.stating(stated),
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
        let Some(mut info) = info else { return Ok(None) };
        let mut stated = Stated::default();
        // A member that means nothing here is one that nobody knows.
        for (name, value, means) in [
            ("scale", &mut info.scale, matches!(strength, Strength::OfNormals)),
            ("strength", &mut info.strength, matches!(strength, Strength::OfOcclusion)),
        ] {
            if let Some(value) = value.take_if(|_| !means) {
                info.rest.0.get_or_insert_default().insert(name.to_owned(), value.into());
            }
        }
        let mut members = Members::new(info.extensions, info.rest);
        let name = "KHR_texture_transform";
        let transform = match members.take::<schema::TextureTransform<'_>>(name, at)? {
            None => None,
            Some(t) => {
                let at = &at.key("extensions");
                let (at, mut stated) = (&at.key(name), Stated::default());
                Some(Box::new(TextureTransform {
                    offset: stated.note(Member::Offset, t.offset).unwrap_or([0.0; 2]),
                    rotation: stated.note(Member::Rotation, t.rotation).unwrap_or(0.0),
                    scale: stated.note(Member::Scale, t.scale).unwrap_or([1.0; 2]),
                    tex_coord: t.tex_coord.map(|c| small(c, &at.key("texCoord"))).transpose()?,
                    extra: Members::new(t.extensions, t.rest).finish(t.extras, at)?.stating(stated),
                }))
            }
        };
        Ok(Some(TextureInfo {
            texture: self.counts.texture(info.index, &at.key("index"))?,
            tex_coord: small(stated.note(Member::TexCoord, info.tex_coord).unwrap_or_default(), &at.key("texCoord"))?,
            transform,
            scale: match strength {
                Strength::None => 1.0,
                Strength::OfNormals => stated.note(Member::Scale, info.scale).unwrap_or(1.0),
                Strength::OfOcclusion => {
                    self.factor(stated.note(Member::Strength, info.strength), 1.0, UNIT, &at.key("strength"))
                }
            },
            extra: members.finish(info.extras, at)?.stating(stated),
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
