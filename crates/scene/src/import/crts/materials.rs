//! Materials: Disney parameters to glTF's, with the textures where glTF wants them.

use super::disney::{Channel, Disney, EXTENSION};
use super::packing::{Packed, Packing, Source};
use super::schema::{self, Header, ObjectKind, Scalar};
use super::{Converter, Result, at, index, invalid, name, nth};
use crate::model::*;
use crate::place::At;
use crate::visit;
use serde_json::Map;

/// A slot of a material that textured parameters go to.
#[derive(Clone, Copy, Debug)]
enum Slot {
    BaseColor,
    MetallicRoughness,
    Specular,
    Anisotropy,
    Sheen,
    Clearcoat,
    ClearcoatRoughness,
    Transmission,
}

const NEUTRAL: Source = Source::Constant(255);

impl Converter<'_> {
    /// Material number i is material number i of the file; the default material follows, if an object has it.
    pub(super) fn materials(&mut self, header: &Header) -> Result<()> {
        let images = header.images.len();
        let mut packed = Packed::default();
        let is_default = |o: &schema::Object| o.kind == ObjectKind::Mesh && o.material.is_none_or(|m| m == -1);
        self.scene.materials.reserve(header.materials.len() + 1);
        for (i, m) in header.materials.iter().enumerate() {
            let disney = disney(m, i, images)?;
            let material = self.material(&disney, name(&m.name), &mut packed, i)?;
            self.scene.materials.insert_nth(i, material);
        }
        if header.objects.iter().any(is_default) {
            self.scene.materials.insert_nth(header.materials.len(), Disney::default().factors());
        }
        Ok(())
    }

    fn material(&mut self, disney: &Disney, name: Option<String>, packed: &mut Packed, i: usize) -> Result<Material> {
        let place = || at("materials", i, "");
        let mut material = disney.factors();
        for (slot, packing) in slots(disney) {
            let Some(texture) = self.packed(packing, packed, place)? else {
                self.tolerate("an image of the material cannot be decoded; the texture is left out", place);
                continue;
            };
            set_texture(&mut material, slot, texture);
        }
        for scalar in disney.without_effect() {
            self.tolerate(without_effect(scalar), place);
        }
        if Disney::of_material(&material).0 != *disney {
            let mut extensions = Map::new();
            extensions.insert(EXTENSION.to_owned(), disney.to_json());
            material.extra.extensions = Some(Box::new(extensions));
            let textures = self.scene.textures.len();
            let count = |kind| if kind == Kind::Texture { textures } else { 0 };
            visit::connect(&mut material.extra, &At::Root.key("materials").index(i), count, |_| {});
        }
        material.name = name;
        Ok(material)
    }
}

fn without_effect(scalar: Scalar) -> &'static str {
    match scalar {
        Scalar::Ior => "a textured ior is kept, but has no effect",
        Scalar::SpecularTint => {
            "a specular_tint by texture, or towards the hue of a texture, is kept, but has no effect"
        }
        _ => "a sheen_tint by texture, or towards the hue of a texture, is kept, but has no effect",
    }
}

/// The parameters of a material of the file.
fn disney(m: &schema::Material, i: usize, images: usize) -> Result<Disney> {
    let mut disney = Disney::default();
    let texture = match m.base_color_texture {
        None => None,
        Some(value) => Some(nth(index(value, "image", images, || at("materials", i, "base_color_texture"))?)),
    };
    disney.set_base_color(m.base_color.unwrap_or(schema::DEFAULT_BASE_COLOR), texture);
    for scalar in Scalar::ALL {
        let (factor, texture) = m.scalar(scalar);
        let place = |member: &str| at("materials", i, &format!("{}_texture/{member}", scalar.key()));
        let texture = match texture {
            None => None,
            Some(t) => {
                let image = index(t.texture, "image", images, || place("texture"))?;
                match u8::try_from(t.channel) {
                    Ok(channel @ 0..=3) => Some(Channel { texture: nth(image), channel }),
                    _ => return invalid(place("channel"), format!("{} is no channel; it must be 0 to 3", t.channel)),
                }
            }
        };
        disney.set(scalar, factor.unwrap_or(scalar.default_value()), texture);
    }
    Ok(disney)
}

/// Which textures a material needs.
fn slots(disney: &Disney) -> Vec<(Slot, Packing)> {
    use Scalar as S;
    use Source::Any;
    let of = |c: Channel| Source::Of { image: Store::<TextureId, Texture>::slot(c.texture), channel: c.channel };
    let source = |scalar| disney.texture(scalar).map(of);
    // Beside a texture, a factor that is not textured has its value only if the texture is 1 there, or the factor is 0.
    let beside = |scalar| source(scalar).unwrap_or(if disney.value(scalar) == 0.0 { Any } else { NEUTRAL });
    let mut slots = Vec::new();
    let mut push =
        |slot, channels| slots.push((slot, Packing { channels, srgb: matches!(slot, Slot::BaseColor | Slot::Sheen) }));
    if let Some(texture) = disney.base_color_texture {
        let channel = |channel| of(Channel { texture, channel });
        push(Slot::BaseColor, [channel(0), channel(1), channel(2), Any]);
    }
    if source(S::Metallic).or(source(S::Roughness)).is_some() {
        push(Slot::MetallicRoughness, [Any, beside(S::Roughness), beside(S::Metallic), Any]);
    }
    if let Some(s) = source(S::Specular) {
        push(Slot::Specular, [Any, Any, Any, s]);
    }
    if let Some(s) = source(S::Anisotropic) {
        // The direction is (1, 0), which 255 and 128 stand for.
        push(Slot::Anisotropy, [NEUTRAL, Source::Constant(128), s, Any]);
    }
    if let Some(s) = source(S::Sheen) {
        push(Slot::Sheen, [s, s, s, Any]);
    }
    if let Some(s) = source(S::Clearcoat) {
        push(Slot::Clearcoat, [s, Any, Any, Any]);
    }
    if let Some(s) = source(S::ClearcoatRoughness) {
        push(Slot::ClearcoatRoughness, [Any, s, Any, Any]);
    }
    if let Some(s) = source(S::Transmission) {
        push(Slot::Transmission, [s, Any, Any, Any]);
    }
    slots
}

fn set_texture(material: &mut Material, slot: Slot, texture: TextureId) {
    let info = Some(TextureInfo { texture, tex_coord: 0, transform: None, scale: 1.0, extra: Extra::default() });
    match slot {
        Slot::BaseColor => material.base_color_texture = info,
        Slot::MetallicRoughness => material.metallic_roughness_texture = info,
        // `Disney::factors` makes the lobe of every textured parameter.
        Slot::Specular => set(&mut material.specular, |lobe| lobe.texture = info),
        Slot::Anisotropy => set(&mut material.anisotropy, |lobe| lobe.texture = info),
        Slot::Sheen => set(&mut material.sheen, |lobe| lobe.color_texture = info),
        Slot::Clearcoat => set(&mut material.clearcoat, |lobe| lobe.texture = info),
        Slot::ClearcoatRoughness => set(&mut material.clearcoat, |lobe| lobe.roughness_texture = info),
        Slot::Transmission => set(&mut material.transmission, |lobe| lobe.texture = info),
    }
}

fn set<T>(lobe: &mut Option<Box<T>>, change: impl FnOnce(&mut T)) {
    if let Some(lobe) = lobe {
        change(lobe);
    }
}
