//! The Disney BSDF's parameters and the material: the table of the format, both ways.
//!
//! What a glTF material cannot hold exactly (tints, textures on channels of their own) is kept beside it under
//! [`EXTENSION`], so that the parameters come back as they were for as long as nobody edits the material.

use super::schema::{DEFAULT_BASE_COLOR, SCALARS, Scalar};
use crate::model::*;
use serde_json::{Map, Value, json};

/// The extension that keeps the parameters as they were, where the material alone would not give them back:
/// `{ "base_color": [r, g, b], "base_color_texture": { "index" }, KEY: number, ...,
/// "textures": { KEY: { "index", "channel" } } }`. An `index` is that of a texture, whose channel (0 to 3) replaces the
/// factor; pixel values are those of the image's own colour space.
pub const EXTENSION: &str = "ORTHANT_materials_disney";

/// One channel of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Channel {
    pub texture: TextureId,
    /// 0 to 3.
    pub channel: u8,
}

/// The parameters that have an effect: where there is a texture, the factor is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Disney {
    /// Linear.
    pub base_color: [f64; 3],
    pub base_color_texture: Option<TextureId>,
    values: [f64; SCALARS],
    textures: [Option<Channel>; SCALARS],
}

impl Default for Disney {
    fn default() -> Self {
        Self {
            base_color: DEFAULT_BASE_COLOR,
            base_color_texture: None,
            values: Scalar::ALL.map(Scalar::default_value),
            textures: [None; SCALARS],
        }
    }
}

impl Disney {
    pub fn value(&self, scalar: Scalar) -> f64 {
        self.values[scalar as usize]
    }

    pub fn texture(&self, scalar: Scalar) -> Option<Channel> {
        self.textures[scalar as usize]
    }

    /// Every texture that a parameter has.
    pub fn all_textures(&self) -> impl Iterator<Item = TextureId> + '_ {
        self.base_color_texture.into_iter().chain(self.textures.iter().flatten().map(|c| c.texture))
    }

    pub fn set_base_color(&mut self, color: [f64; 3], texture: Option<TextureId>) {
        self.base_color = if texture.is_some() { [1.0; 3] } else { color };
        self.base_color_texture = texture;
    }

    pub fn set(&mut self, scalar: Scalar, value: f64, texture: Option<Channel>) {
        self.values[scalar as usize] = if texture.is_some() { 1.0 } else { value };
        self.textures[scalar as usize] = texture;
    }

    /// The material without its textures. A factor that a texture replaces is 1.
    pub fn factors(&self) -> Material {
        use Scalar::*;
        let is_there = |scalar: Scalar| self.value(scalar) != 0.0 || self.texture(scalar).is_some();
        let hue = hue(self.base_color);
        let [r, g, b] = self.base_color;
        let mut material = Material {
            base_color: [r, g, b, 1.0],
            metallic: self.value(Metallic),
            roughness: self.value(Roughness),
            ..Material::default()
        };
        // A textured index of refraction has no place in a material.
        let ior = if self.texture(Ior).is_some() { Ior.default_value() } else { self.value(Ior) };
        // Half is the reflectance that the index of refraction gives; a textured factor reaches from 0 to 1.
        let specular = self.value(Specular) / 0.5;
        let ior = if specular > 1.0 { brighter_ior(ior, specular) } else { ior };
        material.ior = (ior != 1.5).then_some(ior);
        let factor = specular.min(1.0);
        let color = tinted(hue, self.tint(SpecularTint));
        if factor != 1.0 || color != [1.0; 3] || self.texture(Specular).is_some() {
            material.specular = Some(Box::new(self::Specular {
                factor,
                texture: None,
                color,
                color_texture: None,
                extra: Extra::default(),
            }));
        }
        if is_there(Anisotropic) {
            material.anisotropy =
                Some(Box::new(Anisotropy { strength: self.value(Anisotropic), ..Anisotropy::default() }));
        }
        if is_there(Sheen) {
            let color = tinted(hue, self.tint(SheenTint)).map(|c| c * self.value(Sheen));
            material.sheen =
                Some(Box::new(self::Sheen { color, roughness: SHEEN_ROUGHNESS, ..self::Sheen::default() }));
        }
        if is_there(Clearcoat) || is_there(ClearcoatRoughness) {
            material.clearcoat = Some(Box::new(self::Clearcoat {
                factor: self.value(Clearcoat),
                roughness: self.value(ClearcoatRoughness),
                ..self::Clearcoat::default()
            }));
        }
        if is_there(Transmission) {
            material.transmission = Some(Box::new(self::Transmission {
                factor: self.value(Transmission),
                ..self::Transmission::default()
            }));
        }
        material
    }

    /// A textured tint has no place in a material, and neither has one towards the hue of a texture.
    fn tint(&self, scalar: Scalar) -> f64 {
        if self.texture(scalar).is_some() || self.base_color_texture.is_some() { 0.0 } else { self.value(scalar) }
    }

    /// The parameters that have no effect in a material: a texture without a slot, a tint towards the hue of a texture.
    pub fn without_effect(&self) -> impl Iterator<Item = Scalar> + '_ {
        use Scalar::*;
        let no_slot = |s: &Scalar| matches!(s, Ior | SpecularTint | SheenTint) && self.texture(*s).is_some();
        let no_hue = |s: &Scalar| {
            matches!(s, SpecularTint | SheenTint) && self.base_color_texture.is_some() && self.value(*s) != 0.0
        };
        Scalar::ALL.into_iter().filter(move |s| no_slot(s) || no_hue(s))
    }

    /// The parameters that a material comes closest to, and what of it they leave out.
    pub fn of_material(material: &Material) -> (Self, Vec<&'static str>) {
        use Scalar::*;
        let mut left_out = Vec::new();
        let mut disney = Self::default();
        let [r, g, b, _] = material.base_color;
        let texture = material.base_color_texture.as_ref().map(|info| info.texture);
        if texture.is_some() && [r, g, b] != [1.0; 3] {
            left_out.push("the factor of a base colour that has a texture");
        }
        disney.set_base_color([r, g, b], texture);

        let mut scalar = |scalar: Scalar, factor: f64, info: Option<&TextureInfo>, channel: u8| {
            // Nothing times a texture is nothing.
            let texture = info.filter(|_| factor != 0.0).map(|info| Channel { texture: info.texture, channel });
            if texture.is_some() && factor != 1.0 {
                left_out.push("the factor of a parameter that has a texture");
            }
            disney.set(scalar, factor, texture);
        };
        let packed = material.metallic_roughness_texture.as_ref();
        scalar(Metallic, material.metallic, packed, 2);
        scalar(Roughness, material.roughness, packed, 1);
        scalar(Ior, material.ior.unwrap_or(1.5), None, 0);
        if let Some(a) = &material.anisotropy {
            scalar(Anisotropic, a.strength, a.texture.as_ref(), 2);
        }
        if let Some(c) = &material.clearcoat {
            scalar(Clearcoat, c.factor, c.texture.as_ref(), 0);
            scalar(ClearcoatRoughness, c.roughness, c.roughness_texture.as_ref(), 1);
        }
        if let Some(t) = &material.transmission {
            scalar(Transmission, t.factor, t.texture.as_ref(), 0);
        }
        let hue = hue(disney.base_color);
        if let Some(s) = &material.specular {
            // The texture is 1 where the reflectance is that of the index of refraction, which the parameter calls 0.5.
            disney.set(Specular, s.factor * 0.5, None);
            let (tint, is_exact) = tint_of(s.color, hue);
            disney.set(SpecularTint, tint, None);
            if !is_exact {
                left_out.push("a specular colour that is no tint of the base colour");
            }
            if s.texture.is_some() || s.color_texture.is_some() {
                left_out.push("textures of KHR_materials_specular");
            }
        }
        if let Some(s) = &material.sheen {
            let (sheen, tint, is_exact) = sheen_of(s.color, hue);
            disney.set(Sheen, sheen, None);
            disney.set(SheenTint, tint, None);
            if !is_exact || s.roughness != SHEEN_ROUGHNESS {
                left_out.push("a sheen that is no tint of the base colour, or not of roughness 0.5");
            }
            if s.color_texture.is_some() || s.roughness_texture.is_some() {
                left_out.push("textures of KHR_materials_sheen");
            }
        }
        (disney, left_out)
    }

    /// What [`EXTENSION`] holds.
    pub fn to_json(&self) -> Value {
        let index = |texture: TextureId| Store::<TextureId, Texture>::slot(texture);
        let mut members = Map::new();
        members.insert("base_color".to_owned(), json!(self.base_color));
        if let Some(texture) = self.base_color_texture {
            members.insert("base_color_texture".to_owned(), json!({ "index": index(texture) }));
        }
        let mut textures = Map::new();
        for scalar in Scalar::ALL {
            match self.texture(scalar) {
                None => drop(members.insert(scalar.key().to_owned(), json!(self.value(scalar)))),
                Some(Channel { texture, channel }) => {
                    let value = json!({ "index": index(texture), "channel": channel });
                    textures.insert(scalar.key().to_owned(), value);
                }
            }
        }
        if !textures.is_empty() {
            members.insert("textures".to_owned(), Value::Object(textures));
        }
        Value::Object(members)
    }

    /// From what [`EXTENSION`] holds. `texture` follows the index at a JSON pointer below the extension. `None` if it is
    /// not what [`Disney::to_json`] writes.
    pub fn from_json(value: &Value, texture: impl Fn(&str) -> Option<TextureId>) -> Option<Self> {
        let mut disney = Self::default();
        let base_color = value.get("base_color")?.as_array()?;
        let [r, g, b] = base_color.as_slice() else { return None };
        let base_color_texture = match value.get("base_color_texture") {
            Some(_) => Some(texture("/base_color_texture/index")?),
            None => None,
        };
        disney.set_base_color([r.as_f64()?, g.as_f64()?, b.as_f64()?], base_color_texture);
        for scalar in Scalar::ALL {
            let key = scalar.key();
            match value.get("textures").and_then(|t| t.get(key)) {
                None => disney.set(scalar, value.get(key)?.as_f64()?, None),
                Some(reference) => {
                    let channel = u8::try_from(reference.get("channel")?.as_u64()?).ok().filter(|&c| c < 4)?;
                    let texture = texture(&format!("/textures/{key}/index"))?;
                    disney.set(scalar, 1.0, Some(Channel { texture, channel }));
                }
            }
        }
        Some(disney)
    }
}

/// Disney's sheen has no roughness; this is the one that looks most like it.
const SHEEN_ROUGHNESS: f64 = 0.5;

/// The base colour at luminance 1: C_tint of Burley, "Physically Based Shading at Disney" (2012), with the weights of its
/// reference implementation.
fn hue(color: [f64; 3]) -> [f64; 3] {
    let luminance = 0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2];
    if luminance > 0.0 { color.map(|c| c / luminance) } else { [1.0; 3] }
}

/// From white to the hue.
fn tinted(hue: [f64; 3], tint: f64) -> [f64; 3] {
    if tint == 0.0 { [1.0; 3] } else { hue.map(|h| 1.0 + tint * (h - 1.0)) }
}

/// The index of refraction at which a dielectric in air reflects `factor` times as much at normal incidence
/// (F0 = ((n - 1) / (n + 1))^2).
fn brighter_ior(ior: f64, factor: f64) -> f64 {
    let root = ((ior - 1.0) / (ior + 1.0)).abs() * factor.sqrt();
    // A reflectance of 1 has no finite index.
    let root = root.min(0.99);
    (1.0 + root) / (1.0 - root)
}

/// How far a colour may be from the one that a tint gives to count as that tint.
const TINT_TOLERANCE: f64 = 1e-6;

/// The tint whose colour is nearest, and whether it is the colour.
fn tint_of(color: [f64; 3], hue: [f64; 3]) -> (f64, bool) {
    if color == [1.0; 3] {
        return (0.0, true);
    }
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let towards = hue.map(|h| h - 1.0);
    let length = dot(towards, towards);
    let tint = if length > 0.0 { (dot(color.map(|c| c - 1.0), towards) / length).clamp(0.0, 1.0) } else { 0.0 };
    (tint, is_near(tinted(hue, tint), color))
}

/// The sheen and tint whose colour is near, and whether it is the colour.
fn sheen_of(color: [f64; 3], hue: [f64; 3]) -> (f64, f64, bool) {
    if color[0] == color[1] && color[1] == color[2] {
        return (color[0], 0.0, true);
    }
    // Mixing keeps the luminance of the hue, which is 1, so that of the colour is the sheen.
    let sheen = 0.3 * color[0] + 0.6 * color[1] + 0.1 * color[2];
    let (tint, _) = tint_of(color.map(|c| c / sheen), hue);
    (sheen, tint, is_near(tinted(hue, tint).map(|c| c * sheen), color))
}

fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TINT_TOLERANCE)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(values: &[(Scalar, f64)]) -> Disney {
        let mut disney = Disney::default();
        disney.set_base_color([0.8, 0.2, 0.1], None);
        for &(scalar, value) in values {
            disney.set(scalar, value, None);
        }
        disney
    }

    #[test]
    fn specular_of_one_half_is_the_reflectance_of_the_index() {
        assert_eq!(with(&[(Scalar::Specular, 0.5)]).factors().specular, None);
        let weaker = with(&[(Scalar::Specular, 0.2)]).factors();
        assert_eq!((weaker.specular.unwrap().factor, weaker.ior), (0.4, None));
        // F0 = 0.08: twice that of glass.
        let brighter = with(&[(Scalar::Specular, 1.0)]).factors();
        let ior = brighter.ior.unwrap();
        assert!((((ior - 1.0) / (ior + 1.0)).powi(2) - 0.08).abs() < 1e-12, "{ior}");
        assert_eq!(brighter.specular, None);
    }

    #[test]
    fn tints_go_from_white_to_the_hue() {
        let material = with(&[(Scalar::SpecularTint, 1.0), (Scalar::Sheen, 0.5), (Scalar::SheenTint, 0.0)]).factors();
        let luminance = 0.3 * 0.8 + 0.6 * 0.2 + 0.1 * 0.1;
        let expected = [0.8 / luminance, 0.2 / luminance, 0.1 / luminance];
        assert!(is_near(material.specular.unwrap().color, expected));
        let sheen = material.sheen.unwrap();
        assert_eq!((sheen.color, sheen.roughness), ([0.5; 3], 0.5));
    }

    #[test]
    fn parameters_come_back_from_the_material() {
        for scalar in Scalar::ALL {
            if scalar == Scalar::SheenTint {
                continue;
            }
            let disney = with(&[(scalar, 0.25)]);
            let (back, left_out) = Disney::of_material(&disney.factors());
            assert_eq!(left_out, Vec::<&str>::new(), "{scalar:?}");
            for s in Scalar::ALL {
                assert!((back.value(s) - disney.value(s)).abs() < 1e-12, "{scalar:?}: {s:?} is {}", back.value(s));
            }
        }
        let disney = with(&[(Scalar::Sheen, 0.75), (Scalar::SheenTint, 0.25)]);
        let (back, left_out) = Disney::of_material(&disney.factors());
        assert!((back.value(Scalar::Sheen) - 0.75).abs() < 1e-12 && left_out.is_empty());
        assert!((back.value(Scalar::SheenTint) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn what_is_kept_is_read_back_and_its_indices_are_where_they_are_said_to_be() {
        let nth = Store::<TextureId, Texture>::nth_id;
        let mut disney = with(&[(Scalar::SheenTint, 0.3)]);
        disney.set_base_color([0.1; 3], Some(nth(4)));
        disney.set(Scalar::Ior, 9.0, Some(Channel { texture: nth(2), channel: 3 }));
        let json = disney.to_json();
        let follow = |pointer: &str| Some(nth(json.pointer(pointer)?.as_u64()? as usize));
        assert_eq!(Disney::from_json(&json, follow), Some(disney));
        assert_eq!(json.pointer("/textures/ior/index"), Some(&json!(2)));
        assert_eq!(json.pointer("/base_color_texture/index"), Some(&json!(4)));
        assert_eq!(Disney::from_json(&json!({}), |_| None), None);
    }
}
