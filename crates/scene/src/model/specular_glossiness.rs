//! KHR_materials_pbrSpecularGlossiness: a material as a diffuse and a specular colour. The document keeps it as its file has
//! it; what is shown, and what formats without it get, is the metallic-roughness material that looks the same.

use super::{AnyId, Extra, Material, TextureId, TextureInfo, TextureTransform};
use serde_json::Value;

/// The name of the extension.
const EXTENSION: &str = "KHR_materials_pbrSpecularGlossiness";

/// What the extension says. Where there is a texture, the factor is multiplied by it.
#[derive(Clone, Debug, PartialEq)]
pub struct SpecularGlossiness {
    /// `diffuseFactor`, linear RGBA.
    pub diffuse: [f64; 4],
    /// `diffuseTexture` (sRGB).
    pub diffuse_texture: Option<TextureInfo>,
    /// `specularFactor`: linear reflectance at normal incidence.
    pub specular: [f64; 3],
    /// `glossinessFactor`.
    pub glossiness: f64,
    /// `specularGlossinessTexture`: specular in sRGB, glossiness in alpha.
    pub texture: Option<TextureInfo>,
}

/// A point of a metallic-roughness surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// Linear RGBA.
    pub base_color: [f64; 4],
    /// 0 to 1.
    pub metallic: f64,
    /// 0 to 1.
    pub roughness: f64,
}

impl SpecularGlossiness {
    /// What a material says, if it has the extension. A member that is no number counts as missing.
    pub fn of(material: &Material) -> Option<Self> {
        let value = material.extra.extensions.as_ref()?.get(EXTENSION)?;
        Some(Self {
            diffuse: numbers(value, "diffuseFactor", [1.0; 4]),
            diffuse_texture: texture(&material.extra, value, "diffuseTexture"),
            specular: numbers(value, "specularFactor", [1.0; 3]),
            glossiness: value.get("glossinessFactor").and_then(Value::as_f64).unwrap_or(1.0).clamp(0.0, 1.0),
            texture: texture(&material.extra, value, "specularGlossinessTexture"),
        })
    }

    /// The metallic-roughness surface of the factors alone.
    pub fn factors(&self) -> MetallicRoughness {
        metallic_roughness(self.diffuse, self.specular, self.glossiness)
    }
}

impl Material {
    /// The metallic-roughness material that comes closest without making a texture, for a material that is given by specular
    /// and glossiness; and whether textures of it are left out. `None` for any other material, which is one already.
    pub fn without_specular_glossiness(&self) -> Option<(Self, bool)> {
        let given = SpecularGlossiness::of(self)?;
        let mut material = self.clone();
        let mut surface = given.factors();
        if given.diffuse_texture.is_some() || given.texture.is_some() {
            // How metallic it is depends on every texel. Most surfaces are not.
            surface = MetallicRoughness { base_color: given.diffuse, metallic: 0.0, ..surface };
        }
        material.base_color = surface.base_color;
        (material.metallic, material.roughness) = (surface.metallic, surface.roughness);
        material.base_color_texture = given.diffuse_texture;
        material.metallic_roughness_texture = None;
        if let Some(extensions) = &mut material.extra.extensions {
            extensions.shift_remove(EXTENSION);
        }
        Some((material, given.texture.is_some()))
    }
}

/// Reflectance of a dielectric at normal incidence.
const DIELECTRIC: f64 = 0.04;
const EPSILON: f64 = 1e-6;

/// Converts a point of a surface, by the formulas that Khronos gives with the extension ("Converting between workflows"):
/// metallic solves the quadratic equation in which a metallic-roughness surface has these diffuse and specular
/// brightnesses, and the base colour is the mean of what either gives, weighted by metallic squared. Colours are linear.
pub fn metallic_roughness(diffuse: [f64; 4], specular: [f64; 3], glossiness: f64) -> MetallicRoughness {
    let [r, g, b, alpha] = diffuse;
    let diffuse = [r, g, b];
    let one_minus_specular = 1.0 - specular.into_iter().fold(0.0, f64::max);
    let metallic = solve_metallic(brightness(diffuse), brightness(specular), one_minus_specular);
    let from_diffuse = one_minus_specular / (1.0 - DIELECTRIC) / (1.0 - metallic).max(EPSILON);
    let weight = metallic * metallic;
    let color = |c: usize| {
        let by_diffuse = diffuse[c] * from_diffuse;
        let by_specular = (specular[c] - DIELECTRIC * (1.0 - metallic)) / metallic.max(EPSILON);
        (by_diffuse + (by_specular - by_diffuse) * weight).clamp(0.0, 1.0)
    };
    MetallicRoughness {
        base_color: [color(0), color(1), color(2), alpha],
        metallic,
        roughness: (1.0 - glossiness).clamp(0.0, 1.0),
    }
}

/// Perceived brightness of a linear colour.
fn brightness([r, g, b]: [f64; 3]) -> f64 {
    (0.299 * r * r + 0.587 * g * g + 0.114 * b * b).sqrt()
}

fn solve_metallic(diffuse: f64, specular: f64, one_minus_specular: f64) -> f64 {
    if specular < DIELECTRIC {
        return 0.0;
    }
    let a = DIELECTRIC;
    let b = diffuse * one_minus_specular / (1.0 - DIELECTRIC) + specular - 2.0 * DIELECTRIC;
    let c = DIELECTRIC - specular;
    let d = (b * b - 4.0 * a * c).max(0.0);
    ((-b + d.sqrt()) / (2.0 * a)).clamp(0.0, 1.0)
}

fn numbers<const N: usize>(value: &Value, key: &str, default: [f64; N]) -> [f64; N] {
    let list = || value.get(key)?.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?.try_into().ok();
    list().map_or(default, |list: [f64; N]| list.map(|v| v.clamp(0.0, 1.0)))
}

/// The texture that import has linked to a member.
fn texture(extra: &Extra, value: &Value, key: &str) -> Option<TextureInfo> {
    let value = value.get(key)?;
    let path = format!("/{EXTENSION}/{key}/index");
    let texture = extra.links().iter().find(|link| *link.path == *path).and_then(|link| match link.target {
        AnyId::Texture(id) => Some(id),
        _ => None,
    });
    let texture: TextureId = texture?;
    let tex_coord = |value: &Value| u32::try_from(value.get("texCoord")?.as_u64()?).ok();
    let transform = value.pointer("/extensions/KHR_texture_transform").map(|t| {
        let pair = |key: &str, default: [f64; 2]| {
            let list =
                || t.get(key)?.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?.try_into().ok();
            list().unwrap_or(default)
        };
        Box::new(TextureTransform {
            offset: pair("offset", [0.0; 2]),
            rotation: t.get("rotation").and_then(Value::as_f64).unwrap_or(0.0),
            scale: pair("scale", [1.0; 2]),
            tex_coord: tex_coord(t),
            extra: Extra::default(),
        })
    });
    Some(TextureInfo {
        texture,
        tex_coord: tex_coord(value).unwrap_or(0),
        transform,
        scale: 1.0,
        extra: Extra::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: MetallicRoughness, color: [f64; 3], metallic: f64, roughness: f64) {
        let near = |a: f64, b: f64| (a - b).abs() < 2e-3;
        let is_close = (0..3).all(|c| near(a.base_color[c], color[c]))
            && near(a.metallic, metallic)
            && near(a.roughness, roughness);
        assert!(is_close, "{a:?}, not {color:?} {metallic} {roughness}");
    }

    #[test]
    fn metallic_roughness_surfaces_come_back() {
        // A metallic-roughness surface has the diffuse colour base (1 - metallic) (1 - 0.04) / (1 - max specular) and the
        // specular colour mix(0.04, base, metallic).
        for (base, metallic) in [([0.8, 0.2, 0.1], 0.0), ([0.9, 0.6, 0.3], 1.0), ([0.5, 0.5, 0.5], 1.0)] {
            let specular = base.map(|c: f64| 0.04 + (c - 0.04) * metallic);
            let left = 1.0 - specular.into_iter().fold(0.0, f64::max);
            let [r, g, b] = base.map(|c| c * (1.0 - metallic) * 0.96 / left);
            close(metallic_roughness([r, g, b, 0.5], specular, 0.7), base, metallic, 0.3);
        }
    }

    #[test]
    fn the_formula_is_that_of_khronos() {
        // Worked by hand: diffuse and specular of one grey d and s, so the brightnesses are d and s.
        // d = 0.25, s = 0.5: b = 0.25 * 0.5 / 0.96 + 0.5 - 0.08 = 0.5502083, c = -0.46,
        // metallic = (-b + sqrt(b^2 + 0.0736)) / 0.08 = 0.79061.
        let surface = metallic_roughness([0.25, 0.25, 0.25, 1.0], [0.5; 3], 0.0);
        assert!((surface.metallic - 0.790_61).abs() < 1e-5, "{surface:?}");
        // By diffuse 0.25 * 0.5 / 0.96 / 0.20939 = 0.62183, and by specular (0.5 - 0.04 * 0.20939) / 0.79061 the same.
        assert!((surface.base_color[0] - 0.621_83).abs() < 1e-5, "{surface:?}");
        assert_eq!(surface.roughness, 1.0);
        // Below the reflectance of a dielectric there is no metal.
        let dark = metallic_roughness([0.5, 0.5, 0.5, 1.0], [0.0; 3], 1.0);
        assert_eq!((dark.metallic, dark.roughness), (0.0, 0.0));
        assert!((dark.base_color[0] - 0.5 / 0.96).abs() < 1e-12);
    }

    #[test]
    fn no_colour_leads_out_of_range() {
        let steps = [0.0, 0.03, 0.04, 0.05, 0.5, 1.0];
        for d in steps {
            for s in steps {
                let surface = metallic_roughness([d, 1.0 - d, d, 1.0], [s, d, 1.0 - s], d);
                let all = surface.base_color.into_iter().chain([surface.metallic, surface.roughness]);
                assert!(all.into_iter().all(|v| (0.0..=1.0).contains(&v)), "{d} {s}: {surface:?}");
            }
        }
    }
}
