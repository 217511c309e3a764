//! Materials with every extension that the model types.

use super::{Document, Typed, number, numbers};
use crate::export::json::Object;
use crate::model::*;

/// What a material without metallic-roughness members looks like.
fn is_default_pbr(x: &Material) -> bool {
    let default = Material::default();
    x.base_color == default.base_color
        && x.metallic == default.metallic
        && x.roughness == default.roughness
        && x.base_color_texture.is_none()
        && x.metallic_roughness_texture.is_none()
        && x.pbr_extra == Extra::default()
}

impl Document<'_> {
    pub(super) fn material(&self, o: &mut Object<'_>, x: &Material) {
        let stated = x.extra.stated;
        o.optional_string("name", &x.name);
        if !is_default_pbr(x) || stated.has(Member::PbrMetallicRoughness) {
            o.object(Member::PbrMetallicRoughness.name(), |o| {
                let stated = x.pbr_extra.stated;
                numbers(o, stated, Member::BaseColorFactor, &x.base_color, &[1.0; 4]);
                self.texture_info(o, "baseColorTexture", &x.base_color_texture);
                number(o, stated, Member::MetallicFactor, x.metallic, 1.0);
                number(o, stated, Member::RoughnessFactor, x.roughness, 1.0);
                self.texture_info(o, "metallicRoughnessTexture", &x.metallic_roughness_texture);
                self.rest(o, &x.pbr_extra);
            });
        }
        self.scaled_texture_info(o, "normalTexture", &x.normal_texture, Some(Member::Scale));
        self.scaled_texture_info(o, "occlusionTexture", &x.occlusion_texture, Some(Member::Strength));
        self.texture_info(o, "emissiveTexture", &x.emissive_texture);
        numbers(o, stated, Member::EmissiveFactor, &x.emissive, &[0.0; 3]);
        if x.alpha_mode != AlphaMode::default() || stated.has(Member::AlphaMode) {
            o.string(
                Member::AlphaMode.name(),
                match x.alpha_mode {
                    AlphaMode::Opaque => "OPAQUE",
                    AlphaMode::Mask => "MASK",
                    AlphaMode::Blend => "BLEND",
                },
            );
        }
        o.optional_number("alphaCutoff", x.alpha_cutoff);
        if x.double_sided || stated.has(Member::DoubleSided) {
            o.boolean(Member::DoubleSided.name(), x.double_sided);
        }
        self.material_extensions(o, x);
    }

    fn material_extensions(&self, o: &mut Object<'_>, x: &Material) {
        let stated = x.extra.stated;
        let unlit = |_: &mut Object<'_>| {};
        let emissive_strength =
            |o: &mut Object<'_>| scalar(o, stated, Member::EmissiveStrength, x.emissive_strength, 1.0);
        let ior = |o: &mut Object<'_>| scalar(o, stated, Member::Ior, x.ior, 1.5);
        let dispersion = |o: &mut Object<'_>| scalar(o, stated, Member::Dispersion, x.dispersion, 0.0);
        let clearcoat = |o: &mut Object<'_>| self.clearcoat(o, x.clearcoat.as_deref());
        let transmission = |o: &mut Object<'_>| self.transmission(o, x.transmission.as_deref());
        let diffuse_transmission = |o: &mut Object<'_>| self.diffuse_transmission(o, x.diffuse_transmission.as_deref());
        let volume = |o: &mut Object<'_>| self.volume(o, x.volume.as_deref());
        let specular = |o: &mut Object<'_>| self.specular(o, x.specular.as_deref());
        let sheen = |o: &mut Object<'_>| self.sheen(o, x.sheen.as_deref());
        let iridescence = |o: &mut Object<'_>| self.iridescence(o, x.iridescence.as_deref());
        let anisotropy = |o: &mut Object<'_>| self.anisotropy(o, x.anisotropy.as_deref());
        let typed: [(bool, Typed<'_>); 12] = [
            (x.unlit, ("KHR_materials_unlit", &unlit)),
            (x.emissive_strength.is_some(), ("KHR_materials_emissive_strength", &emissive_strength)),
            (x.ior.is_some(), ("KHR_materials_ior", &ior)),
            (x.dispersion.is_some(), ("KHR_materials_dispersion", &dispersion)),
            (x.clearcoat.is_some(), ("KHR_materials_clearcoat", &clearcoat)),
            (x.transmission.is_some(), ("KHR_materials_transmission", &transmission)),
            (x.diffuse_transmission.is_some(), ("KHR_materials_diffuse_transmission", &diffuse_transmission)),
            (x.volume.is_some(), ("KHR_materials_volume", &volume)),
            (x.specular.is_some(), ("KHR_materials_specular", &specular)),
            (x.sheen.is_some(), ("KHR_materials_sheen", &sheen)),
            (x.iridescence.is_some(), ("KHR_materials_iridescence", &iridescence)),
            (x.anisotropy.is_some(), ("KHR_materials_anisotropy", &anisotropy)),
        ];
        self.rest_with(o, &x.extra, typed.into_iter().filter_map(|(has, typed)| has.then_some(typed)));
    }

    fn clearcoat(&self, o: &mut Object<'_>, x: Option<&Clearcoat>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::ClearcoatFactor, x.factor, 0.0);
        self.texture_info(o, "clearcoatTexture", &x.texture);
        number(o, stated, Member::ClearcoatRoughnessFactor, x.roughness, 0.0);
        self.texture_info(o, "clearcoatRoughnessTexture", &x.roughness_texture);
        self.scaled_texture_info(o, "clearcoatNormalTexture", &x.normal_texture, Some(Member::Scale));
        self.rest(o, &x.extra);
    }

    fn transmission(&self, o: &mut Object<'_>, x: Option<&Transmission>) {
        let Some(x) = x else { return };
        number(o, x.extra.stated, Member::TransmissionFactor, x.factor, 0.0);
        self.texture_info(o, "transmissionTexture", &x.texture);
        self.rest(o, &x.extra);
    }

    fn diffuse_transmission(&self, o: &mut Object<'_>, x: Option<&DiffuseTransmission>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::DiffuseTransmissionFactor, x.factor, 0.0);
        self.texture_info(o, "diffuseTransmissionTexture", &x.texture);
        numbers(o, stated, Member::DiffuseTransmissionColorFactor, &x.color, &[1.0; 3]);
        self.texture_info(o, "diffuseTransmissionColorTexture", &x.color_texture);
        self.rest(o, &x.extra);
    }

    fn volume(&self, o: &mut Object<'_>, x: Option<&Volume>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::ThicknessFactor, x.thickness, 0.0);
        self.texture_info(o, "thicknessTexture", &x.thickness_texture);
        o.optional_number("attenuationDistance", x.attenuation_distance);
        numbers(o, stated, Member::AttenuationColor, &x.attenuation_color, &[1.0; 3]);
        self.rest(o, &x.extra);
    }

    fn specular(&self, o: &mut Object<'_>, x: Option<&Specular>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::SpecularFactor, x.factor, 1.0);
        self.texture_info(o, "specularTexture", &x.texture);
        numbers(o, stated, Member::SpecularColorFactor, &x.color, &[1.0; 3]);
        self.texture_info(o, "specularColorTexture", &x.color_texture);
        self.rest(o, &x.extra);
    }

    fn sheen(&self, o: &mut Object<'_>, x: Option<&Sheen>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        numbers(o, stated, Member::SheenColorFactor, &x.color, &[0.0; 3]);
        self.texture_info(o, "sheenColorTexture", &x.color_texture);
        number(o, stated, Member::SheenRoughnessFactor, x.roughness, 0.0);
        self.texture_info(o, "sheenRoughnessTexture", &x.roughness_texture);
        self.rest(o, &x.extra);
    }

    fn iridescence(&self, o: &mut Object<'_>, x: Option<&Iridescence>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::IridescenceFactor, x.factor, 0.0);
        self.texture_info(o, "iridescenceTexture", &x.texture);
        number(o, stated, Member::IridescenceIor, x.ior, 1.3);
        number(o, stated, Member::IridescenceThicknessMinimum, x.thickness_minimum, 100.0);
        number(o, stated, Member::IridescenceThicknessMaximum, x.thickness_maximum, 400.0);
        self.texture_info(o, "iridescenceThicknessTexture", &x.thickness_texture);
        self.rest(o, &x.extra);
    }

    fn anisotropy(&self, o: &mut Object<'_>, x: Option<&Anisotropy>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        number(o, stated, Member::AnisotropyStrength, x.strength, 0.0);
        number(o, stated, Member::AnisotropyRotation, x.rotation, 0.0);
        self.texture_info(o, "anisotropyTexture", &x.texture);
        self.rest(o, &x.extra);
    }

    fn texture_info(&self, o: &mut Object<'_>, key: &str, info: &Option<TextureInfo>) {
        self.scaled_texture_info(o, key, info, None);
    }

    /// `strength` is the member that says how strong the texture is, if it may have one.
    fn scaled_texture_info(&self, o: &mut Object<'_>, key: &str, info: &Option<TextureInfo>, strength: Option<Member>) {
        let Some(x) = info else { return };
        let stated = x.extra.stated;
        o.object(key, |o| {
            self.index(o, "index", Some(x.texture));
            if x.tex_coord != 0 || stated.has(Member::TexCoord) {
                o.integer(Member::TexCoord.name(), x.tex_coord.into());
            }
            if let Some(member) = strength {
                number(o, stated, member, x.scale, 1.0);
            }
            let transform = |o: &mut Object<'_>| self.texture_transform(o, x.transform.as_deref());
            let typed: Typed<'_> = ("KHR_texture_transform", &transform);
            self.rest_with(o, &x.extra, x.transform.is_some().then_some(typed));
        });
    }

    fn texture_transform(&self, o: &mut Object<'_>, x: Option<&TextureTransform>) {
        let Some(x) = x else { return };
        let stated = x.extra.stated;
        numbers(o, stated, Member::Offset, &x.offset, &[0.0; 2]);
        number(o, stated, Member::Rotation, x.rotation, 0.0);
        numbers(o, stated, Member::Scale, &x.scale, &[1.0; 2]);
        if let Some(set) = x.tex_coord {
            o.integer(Member::TexCoord.name(), set.into());
        }
        self.rest(o, &x.extra);
    }
}

fn scalar(o: &mut Object<'_>, stated: Stated, member: Member, value: Option<f64>, default: f64) {
    if let Some(value) = value {
        number(o, stated, member, value, default);
    }
}
