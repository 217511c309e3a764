//! MTL to metallic-roughness. MTL describes a Blinn-Phong surface without units, so this is a choice; it is:
//!
//! * base colour = `Kd`, taken as linear, as exporters write it; without `Kd` it is 1 under `map_Kd`, else 0.8.
//! * metallic = `Pm`, or 0. roughness = `Pr`; else from `Ns` by alpha = sqrt(2 / (Ns + 2)), which matches the lobe of
//!   Blinn-Phong to that of Beckmann (Walter et al., "Microfacet Models for Refraction", 2007, section 5.2), and
//!   roughness = sqrt(alpha); else 1.
//! * `Ks` of a dielectric: reflectance at normal incidence 0.08 `Ks`, so that the usual 0.5 is the 4 % of glTF:
//!   KHR_materials_specular with factor f = min(1, 2 max(Ks)) and colour 2 `Ks` / f. `illum` 0 and 1 have no highlight.
//! * `illum` 3 or 5 with `Kd` at most a twentieth of `Ks`, and no `Pm` or `Pr`, is a mirror: metallic 1, roughness 0, base
//!   colour `Ks`.
//! * `d`, or 1 - `Tr`, below 1: alpha with BLEND. `map_d` must be `map_Kd`, whose alpha is used.
//! * `illum` 6 or 7 is glass: KHR_materials_transmission with base colour `Tf`, KHR_materials_ior with `Ni`. Elsewhere `Ni`
//!   has no effect, as files have arbitrary values there.
//! * emission = `Ke` (1 under `map_Ke`), by KHR_materials_emissive_strength where above 1.
//! * `norm` is the normal map, its `-bm` the scale. Without it, `bump` is: as it is where its image is one (many exporters
//!   write that), else as the normals of its heights, for which an image is made. `map_Pr` and `map_Pm` of one file are the metallic-roughness texture
//!   (green and blue). `Ps`, `Pc` and `Pcr`, `aniso` and `anisor` are sheen, clearcoat and anisotropy.
//! * `-s` and `-o` become KHR_texture_transform: u s + o, where glTF's v runs the other way.
//! * Every surface is seen from both sides: OBJ knows no other.
//! * `Ka` has no meaning where ambient light is computed, and is left out.

use super::bump::{self, Bump};
use super::{Definition, Map};
use crate::Scene;
use crate::import::budget::OverBudget;
use crate::import::files::{FileFault, Files};
use crate::import::obj::parse::line_place;
use crate::import::warning::{WarningKind, Warnings};
use crate::model::*;
use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};
use std::collections::HashMap;

/// What a path may not have in a URI reference (RFC 3986): `%` begins an escape, `?` and `#` end the path, a colon ends a
/// scheme.
const NOT_IN_PATHS: &AsciiSet = &CONTROLS
    .add(b' ')
    .add(b'"')
    .add(b'#')
    .add(b'%')
    .add(b':')
    .add(b'<')
    .add(b'>')
    .add(b'?')
    .add(b'[')
    .add(b'\\')
    .add(b']')
    .add(b'^')
    .add(b'`')
    .add(b'{')
    .add(b'|')
    .add(b'}');

/// Reflectance of `Ks` 1 at normal incidence, over that of glTF's default index of refraction.
const SPECULAR_SCALE: f64 = 2.0;
/// `illum` 3 and 5 are mirrors where `Kd` is at most this part of `Ks`.
const MIRROR_DIFFUSE: f64 = 0.05;
/// KHR_materials_sheen asks for a roughness, and `Ps` has none: the middle.
const SHEEN_ROUGHNESS: f64 = 0.5;

/// Builds materials of a scene; images and textures are shared between them.
pub struct Converter<'c> {
    pub scene: &'c mut Scene,
    pub files: &'c Files<'c>,
    pub warnings: &'c mut Warnings,
    images: HashMap<String, ImageId>,
    textures: HashMap<(ImageId, bool), TextureId>,
    /// By image and multiplier: the normal map and its scale.
    bumps: HashMap<(ImageId, u64), Option<(ImageId, f64)>>,
    clamping: Option<SamplerId>,
}

/// A matte material for surfaces whose material is not known.
pub fn matte(name: Option<String>) -> Material {
    Material {
        name,
        base_color: [0.8, 0.8, 0.8, 1.0],
        metallic: 0.0,
        roughness: 1.0,
        double_sided: true,
        ..Material::default()
    }
}

impl<'c> Converter<'c> {
    pub fn new(scene: &'c mut Scene, files: &'c Files<'c>, warnings: &'c mut Warnings) -> Self {
        Self {
            scene,
            files,
            warnings,
            images: HashMap::new(),
            textures: HashMap::new(),
            bumps: HashMap::new(),
            clamping: None,
        }
    }

    /// Adds the material of a definition. `library` is the file that defines it: textures are looked for beside it, then
    /// beside the scene.
    pub fn add(&mut self, definition: Definition, library: &str) -> Result<MaterialId, OverBudget> {
        let d = &definition;
        let mut material = matte(Some(d.name.clone()));
        let diffuse = d.diffuse.unwrap_or([if d.map_diffuse.is_some() { 1.0 } else { 0.8 }; 3]);
        let unclamped = diffuse;
        material.base_color = [unclamped[0].min(1.0), unclamped[1].min(1.0), unclamped[2].min(1.0), 1.0];
        surface(d, diffuse, &mut material);
        lobes(d, &mut material);
        emission(d, &mut material);
        self.textures(d, library, &mut material)?;
        Ok(self.scene.materials.insert(material))
    }

    fn textures(&mut self, d: &Definition, library: &str, material: &mut Material) -> Result<(), OverBudget> {
        if let Some(map) = &d.map_diffuse {
            material.base_color_texture = Some(self.texture(map, library, d.line)?);
        }
        if let Some(map) = &d.map_emission {
            material.emissive_texture = Some(self.texture(map, library, d.line)?);
        }
        if let Some(map) = &d.map_normal {
            let info = self.texture(map, library, d.line)?;
            material.normal_texture = Some(TextureInfo { scale: map.multiplier, ..info });
        } else if let Some(map) = &d.map_bump {
            material.normal_texture = self.bump(map, library, d.line)?;
        }
        if let Some(map) = &d.map_dissolve {
            if d.map_diffuse.as_ref().is_some_and(|diffuse| diffuse.file == map.file) {
                material.alpha_mode = AlphaMode::Blend;
            } else {
                self.warn(
                    library,
                    d.line,
                    "map_d is not the file of map_Kd, and is not rendered; put it into the alpha of map_Kd",
                );
            }
        }
        match (&d.map_roughness, &d.map_metallic) {
            (Some(roughness), Some(metallic)) if roughness.file == metallic.file => {
                material.metallic_roughness_texture = Some(self.texture(metallic, library, d.line)?);
                material.roughness = d.roughness.unwrap_or(1.0).clamp(0.0, 1.0);
                material.metallic = d.metallic.unwrap_or(1.0).clamp(0.0, 1.0);
            }
            (None, None) => {}
            _ => self.warn(
                library,
                d.line,
                "map_Pr and map_Pm are not rendered unless they are one file with roughness in green and metalness in blue",
            ),
        }
        Ok(())
    }

    fn warn(&mut self, library: &str, line: usize, what: &str) {
        let kind = WarningKind::MaterialLibrary { file: library.to_owned(), what: what.to_owned() };
        self.warnings.push(kind, || line_place(line));
    }

    fn texture(&mut self, map: &Map, library: &str, line: usize) -> Result<TextureInfo, OverBudget> {
        let image = self.image(&map.file, library, line)?;
        Ok(self.info(image, map))
    }

    /// A reference to an image, laid out as a map says.
    fn info(&mut self, image: ImageId, map: &Map) -> TextureInfo {
        let texture = match self.textures.get(&(image, map.clamp)) {
            Some(&known) => known,
            None => {
                let sampler = if map.clamp { Some(self.clamping_sampler()) } else { None };
                let texture = Texture { source: Some(image), sampler, ..Texture::default() };
                let id = self.scene.textures.insert(texture);
                self.textures.insert((image, map.clamp), id);
                id
            }
        };
        let ([su, sv], [ou, ov]) = (map.scale, map.offset);
        let is_identity = map.scale == [1.0; 2] && map.offset == [0.0; 2];
        // v' = v sv + ov, and glTF's V is 1 - v: V' = V sv + (1 - sv - ov).
        let transform = (!is_identity).then(|| {
            Box::new(TextureTransform {
                offset: [ou, 1.0 - sv - ov],
                rotation: 0.0,
                scale: [su, sv],
                tex_coord: None,
                extra: Extra::default(),
            })
        });
        TextureInfo { texture, tex_coord: 0, transform, scale: 1.0, extra: Extra::default() }
    }

    /// The normal map of a `bump` statement. An image that cannot be decoded is a warning, and none.
    fn bump(&mut self, map: &Map, library: &str, line: usize) -> Result<Option<TextureInfo>, OverBudget> {
        let heights = self.image(&map.file, library, line)?;
        let key = (heights, map.multiplier.to_bits());
        let made = match self.bumps.get(&key) {
            Some(known) => *known,
            None => {
                let Some(data) = self.scene.images[heights].data.clone() else { return Ok(None) };
                let made = match bump::read(&data, map.multiplier, self.files.budget())? {
                    Ok(Bump::Normals) => Some((heights, map.multiplier)),
                    Ok(Bump::Heights(png)) => Some((self.made_image(heights, png), 1.0)),
                    Err(why) => {
                        let what = format!("the bump map {} cannot be decoded ({why}), and is not shown", map.file);
                        let kind = WarningKind::MaterialLibrary { file: library.to_owned(), what };
                        self.warnings.push(kind, || line_place(line));
                        None
                    }
                };
                self.bumps.insert(key, made);
                made
            }
        };
        Ok(made.map(|(image, scale)| TextureInfo { scale, ..self.info(image, map) }))
    }

    /// An image that was made of another.
    fn made_image(&mut self, source: ImageId, png: Vec<u8>) -> ImageId {
        let name = match &self.scene.images[source].source {
            ImageSource::Uri(uri) => {
                let last = uri.rsplit('/').next().unwrap_or_default();
                let last = percent_encoding::percent_decode_str(last).decode_utf8_lossy().into_owned();
                last.rsplit_once('.').map_or(last.clone(), |(stem, _)| stem.to_owned()) + "-normals"
            }
            _ => "normals".to_owned(),
        };
        self.scene.images.insert(Image {
            name: Some(name),
            source: ImageSource::DataUri("image/png".to_owned()),
            mime_type: None,
            data: Some(Blob::new(png)),
            extra: Extra::default(),
        })
    }

    fn clamping_sampler(&mut self) -> SamplerId {
        *self.clamping.get_or_insert_with(|| {
            let wrap = Some(WrapMode::ClampToEdge);
            self.scene.samplers.insert(Sampler { wrap_s: wrap, wrap_t: wrap, ..Sampler::default() })
        })
    }

    fn image(&mut self, file: &str, library: &str, line: usize) -> Result<ImageId, OverBudget> {
        let beside_library = match library.rsplit_once('/') {
            Some((folder, _)) => format!("{folder}/{file}"),
            None => file.to_owned(),
        };
        if let Some(&known) = self.images.get(&beside_library) {
            return Ok(known);
        }
        let mut path = beside_library.clone();
        let mut read = self.files.read(&path, None);
        if path != file
            && matches!(read, Err(FileFault::Missing(_) | FileFault::Outside(_)))
            && let Ok(found) = self.files.read(file, None)
        {
            (path, read) = (file.to_owned(), Ok(found));
        }
        let data = match read {
            Ok(bytes) => Some(Blob::new(bytes)),
            Err(FileFault::OverBudget { fault, .. }) => return Err(fault),
            Err(fault) => {
                self.warnings.push(WarningKind::MissingImage(fault.to_string()), || line_place(line));
                None
            }
        };
        let uri = utf8_percent_encode(&path, NOT_IN_PATHS).to_string();
        let source = ImageSource::Uri(uri);
        let image = Image { name: None, source, mime_type: None, data, extra: Extra::default() };
        if image.data.is_some() && !image.is_decodable() {
            let kind = WarningKind::UndecodableImage(image.media_type().unwrap_or("of no known type"));
            self.warnings.push(kind, || line_place(line));
        }
        let id = self.scene.images.insert(image);
        self.images.insert(beside_library, id);
        Ok(id)
    }
}

fn largest(color: [f64; 3]) -> f64 {
    color.into_iter().fold(0.0, f64::max)
}

/// Base colour, metalness, roughness, reflectance and transparency.
fn surface(d: &Definition, diffuse: [f64; 3], material: &mut Material) {
    let is_pbr = d.metallic.is_some() || d.roughness.is_some();
    let specular = d.specular.unwrap_or([0.5; 3]);
    let from_exponent = |ns: f64| (2.0 / (ns.max(0.0) + 2.0)).powf(0.25);
    material.metallic = d.metallic.unwrap_or(0.0).clamp(0.0, 1.0);
    material.roughness = d.roughness.or(d.exponent.map(from_exponent)).unwrap_or(1.0).clamp(0.0, 1.0);

    let is_mirror = matches!(d.model, Some(3 | 5))
        && !is_pbr
        && largest(specular) > 0.0
        && largest(diffuse) <= MIRROR_DIFFUSE * largest(specular)
        && d.map_diffuse.is_none();
    if is_mirror {
        let [r, g, b] = specular.map(|c| c.min(1.0));
        material.base_color = [r, g, b, 1.0];
        (material.metallic, material.roughness) = (1.0, 0.0);
    } else if d.specular.is_some() || matches!(d.model, Some(0 | 1)) {
        let strength = if matches!(d.model, Some(0 | 1)) && !is_pbr { [0.0; 3] } else { specular };
        let factor = (SPECULAR_SCALE * largest(strength)).min(1.0);
        let color = strength.map(|c| if factor > 0.0 { SPECULAR_SCALE * c / factor } else { 1.0 });
        // A metal reflects by its base colour.
        if material.metallic < 1.0 && (factor, color) != (1.0, [1.0; 3]) {
            let (texture, color_texture, extra) = (None, None, Extra::default());
            material.specular = Some(Box::new(Specular { factor, texture, color, color_texture, extra }));
        }
    }

    if matches!(d.model, Some(6 | 7)) {
        material.transmission = Some(Box::new(Transmission { factor: 1.0, ..Transmission::default() }));
        material.ior = d.ior.filter(|&ior| ior >= 1.0);
        let [r, g, b] = d.filter.unwrap_or([1.0; 3]).map(|c| c.min(1.0));
        material.base_color = [r, g, b, 1.0];
    } else if let Some(alpha) = d.dissolve
        && alpha < 1.0
    {
        material.base_color[3] = alpha.max(0.0);
        material.alpha_mode = AlphaMode::Blend;
    }
}

/// What the PBR extension of MTL adds.
fn lobes(d: &Definition, material: &mut Material) {
    if let Some(sheen) = d.sheen.filter(|&s| s > 0.0) {
        let color = [sheen.min(1.0); 3];
        material.sheen = Some(Box::new(Sheen { color, roughness: SHEEN_ROUGHNESS, ..Sheen::default() }));
    }
    if let Some(factor) = d.clearcoat.filter(|&c| c > 0.0) {
        let roughness = d.clearcoat_roughness.unwrap_or(0.0).clamp(0.0, 1.0);
        material.clearcoat = Some(Box::new(Clearcoat { factor: factor.min(1.0), roughness, ..Clearcoat::default() }));
    }
    if let Some(strength) = d.anisotropy.filter(|&a| a > 0.0) {
        let rotation = d.anisotropy_rotation.unwrap_or(0.0) * std::f64::consts::TAU;
        material.anisotropy =
            Some(Box::new(Anisotropy { strength: strength.min(1.0), rotation, ..Anisotropy::default() }));
    }
}

fn emission(d: &Definition, material: &mut Material) {
    let emission = d.emission.unwrap_or([if d.map_emission.is_some() { 1.0 } else { 0.0 }; 3]);
    let strength = largest(emission);
    if strength > 1.0 {
        material.emissive = emission.map(|c| c / strength);
        material.emissive_strength = Some(strength);
    } else {
        material.emissive = emission;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::budget::Budget;

    fn material(text: &str) -> Material {
        let (budget, mut warnings) = (Budget::new(1 << 20), Warnings::default());
        let text = format!("newmtl m\n{text}");
        let mut definitions = super::super::parse(text.as_bytes(), "m.mtl", &budget, &mut warnings).unwrap();
        let (mut scene, files) = (Scene::default(), Files::new(None, false, &budget));
        let mut converter = Converter::new(&mut scene, &files, &mut warnings);
        let id = converter.add(definitions.remove(0), "m.mtl").unwrap();
        scene.materials[id].clone()
    }

    #[test]
    fn a_phong_surface_becomes_a_dielectric() {
        let m = material("Kd .6 .4 .2\nKs .5 .5 .5\nNs 98\nNi 1.45\nillum 2");
        assert_eq!((m.base_color, m.metallic), ([0.6, 0.4, 0.2, 1.0], 0.0));
        assert!((m.roughness - 0.02f64.powf(0.25)).abs() < 1e-12);
        assert!(m.specular.is_none() && m.ior.is_none() && m.double_sided);
        assert_eq!(m.alpha_mode, AlphaMode::Opaque);
        let none = material("Ks 0 0 0").specular.unwrap();
        assert_eq!(none.factor, 0.0);
        let blue = material("Ks 0 0 .25").specular.unwrap();
        assert_eq!((blue.factor, blue.color), (0.5, [0.0, 0.0, 1.0]));
        let strong = material("Ks 1 1 1").specular.unwrap();
        assert_eq!((strong.factor, strong.color), (1.0, [2.0; 3]));
        assert_eq!(material("illum 1\nKs 1 1 1").specular.unwrap().factor, 0.0);
    }

    #[test]
    fn mirrors_glass_and_transparency_are_told_apart() {
        let mirror = material("Kd 0 0 0\nKs .9 .8 .7\nillum 5\nNs 10");
        assert_eq!((mirror.metallic, mirror.roughness, mirror.base_color), (1.0, 0.0, [0.9, 0.8, 0.7, 1.0]));
        assert_eq!(material("Kd .5 .5 .5\nKs .9 .8 .7\nillum 3").metallic, 0.0);
        let glass = material("Kd 0 0 0\nTf .9 1 1\nNi 1.5\nillum 7\nd 0.1");
        assert_eq!((glass.transmission.unwrap().factor, glass.ior), (1.0, Some(1.5)));
        assert_eq!((glass.base_color, glass.alpha_mode), ([0.9, 1.0, 1.0, 1.0], AlphaMode::Opaque));
        for text in ["d 0.25", "Tr 0.75", "d 0.25\nTr 0.25", "Tr 0.25\nd 0.25", "d -halo 0.25"] {
            let m = material(text);
            assert_eq!((m.base_color[3], m.alpha_mode), (0.25, AlphaMode::Blend), "{text}");
        }
    }

    #[test]
    fn the_pbr_extension_and_emission_are_read() {
        let m = material("Pr .2\nPm .3\nPs .4\nPc .5\nPcr .6\naniso .7\nanisor .25\nKe 17 12 4");
        assert_eq!((m.roughness, m.metallic), (0.2, 0.3));
        assert_eq!(m.sheen.unwrap().color, [0.4; 3]);
        let coat = m.clearcoat.unwrap();
        assert_eq!((coat.factor, coat.roughness), (0.5, 0.6));
        let anisotropy = m.anisotropy.unwrap();
        assert_eq!((anisotropy.strength, anisotropy.rotation), (0.7, std::f64::consts::FRAC_PI_2));
        assert_eq!((m.emissive, m.emissive_strength), ([1.0, 12.0 / 17.0, 4.0 / 17.0], Some(17.0)));
        assert_eq!(material("Ke .1 .2 .3").emissive, [0.1, 0.2, 0.3]);
    }

    #[test]
    fn texture_options_become_a_transform_in_gltf_coordinates() {
        let m = material("map_Kd -s 2 4 -o 0.5 0.25 a b.png");
        let transform = m.base_color_texture.unwrap().transform.unwrap();
        // The point (u, v) of the file looks up (2u + 0.5, 4v + 0.25).
        let (u, v) = (0.3, 0.7);
        let looked_up =
            [u * transform.scale[0] + transform.offset[0], (1.0 - v) * transform.scale[1] + transform.offset[1]];
        assert!((looked_up[0] - (2.0 * u + 0.5)).abs() < 1e-12);
        assert!((1.0 - looked_up[1] - (4.0 * v + 0.25)).abs() < 1e-12);
        assert_eq!(material("norm -bm 0.5 n.png").normal_texture.unwrap().scale, 0.5);
        assert_eq!(material("map_Kd a.png\nmap_d a.png").alpha_mode, AlphaMode::Blend);
        assert_eq!(material("map_Kd a.png\nmap_d b.png").alpha_mode, AlphaMode::Opaque);
        let packed = material("map_Pr rm.png\nmap_Pm rm.png");
        assert!(packed.metallic_roughness_texture.is_some());
        assert_eq!((packed.metallic, packed.roughness), (1.0, 1.0));
    }
}
