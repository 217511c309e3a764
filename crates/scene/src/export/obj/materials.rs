//! MTL: the choices of `import::obj::mtl` the other way round, with statements for readers that know only the Phong model.

use super::Notes;
use crate::Scene;
use crate::export::beside::{Name, Output, SideFile};
use crate::export::{ExportError, ExportFault, names};
use crate::import::files::local_path;
use crate::model::*;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::fmt::Write;
use std::path::Path;

type Result<T> = std::result::Result<T, ExportFault>;

/// The materials of the file.
#[derive(Default)]
pub struct Library {
    names: HashMap<MaterialId, String>,
    /// The name of glTF's default material, if a primitive has it.
    default: Option<String>,
    /// The path of each image that a map names, relative to the document.
    paths: HashMap<ImageId, String>,
    files: Vec<(SideFile, Vec<ImageId>)>,
}

impl Library {
    /// Gives every material a name, and every image that a map shows a file.
    pub fn new(scene: &Scene, stem: &str, document: &Path, notes: &mut Notes) -> Self {
        let mut library = Self::default();
        let mut taken = HashSet::new();
        for (i, (id, material)) in scene.materials().iter().enumerate() {
            let name = line_name(material.name.as_deref().unwrap_or_default());
            let name = if name.is_empty() { format!("material{i}") } else { name };
            library.names.insert(id, free(name, &mut taken));
        }
        let mut primitives = scene.meshes().iter().flat_map(|(_, mesh)| &mesh.primitives);
        if primitives.any(|p| scene.shown_material(p).is_none()) {
            library.default = Some(free("default".to_owned(), &mut taken));
        }
        let own = document.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let mut by_path: HashMap<String, usize> = HashMap::new();
        for (_, material) in scene.materials().iter() {
            let material = &plain(material).0;
            let textures = maps(material).into_iter().flatten().map(|info| info.texture);
            for id in textures.filter_map(|texture| shown_image(scene, texture)) {
                if !library.paths.contains_key(&id) {
                    library.image(scene, id, stem, &own, &mut by_path, notes);
                }
            }
        }
        library
    }

    fn image(
        &mut self,
        scene: &Scene,
        id: ImageId,
        stem: &str,
        own: &str,
        by_path: &mut HashMap<String, usize>,
        notes: &mut Notes,
    ) {
        let image = &scene.images()[id];
        let i = Store::<ImageId, Image>::slot(id);
        let local = match &image.source {
            ImageSource::Uri(uri) => local_path(uri),
            _ => None,
        };
        let Some(data) = &image.data else {
            let path = local.unwrap_or_else(|| format!("{stem}-image{i}.png"));
            notes.add(format!("/images/{i}"), "its file was not there when the scene was loaded, and is not written");
            self.paths.insert(id, map_path(&path));
            return;
        };
        if !matches!(media_type(data), Some("image/png" | "image/jpeg")) {
            notes.add(format!("/images/{i}"), "few readers of OBJ know its kind; it is copied as it is");
        }
        let extension = names::image_extension(data);
        let mut path = map_path(&local.unwrap_or_else(|| {
            let name = match image.name.as_deref() {
                Some(name) if !name.is_empty() => names::file_name(name, stem),
                _ => format!("{stem}-image{i}"),
            };
            let has_extension = name.to_ascii_lowercase().ends_with(&format!(".{extension}"));
            if has_extension { name } else { format!("{name}.{extension}") }
        }));
        for _ in 0..2 {
            // Some file systems do not tell upper from lower case.
            let key = path.to_lowercase();
            let taken = key == own || by_path.get(&key).is_some_and(|&file| self.files[file].0.data != *data);
            if !taken {
                let file = *by_path.entry(key).or_insert_with(|| {
                    self.files.push((SideFile { path: path.clone(), data: data.clone() }, Vec::new()));
                    self.files.len() - 1
                });
                self.files[file].1.push(id);
                self.paths.insert(id, path);
                return;
            }
            path = names::with_hash(&path, [data.as_slice()]);
        }
    }

    /// Finds out under which names the images will be copied beside the document.
    pub fn place_images(&mut self, output: &Output<'_>) -> std::result::Result<Vec<Name>, ExportError> {
        let mut names = Vec::with_capacity(self.files.len());
        for (file, images) in &self.files {
            let name = output.place(file)?;
            images.iter().for_each(|&id| drop(self.paths.insert(id, name.path.clone())));
            names.push(name);
        }
        Ok(names)
    }

    /// Copies the images beside the document, under these names.
    pub fn write_images(&self, names: Vec<Name>, output: &mut Output<'_>) -> std::result::Result<(), ExportError> {
        self.files.iter().zip(names).try_for_each(|((file, _), name)| output.write(name, [file.data.as_slice()]))
    }

    /// Whether there is nothing to write.
    pub fn is_empty(&self) -> bool {
        self.names.is_empty() && self.default.is_none()
    }

    /// The name of a material; `None` is glTF's default one.
    pub fn name(&self, material: Option<MaterialId>) -> &str {
        material.and_then(|id| self.names.get(&id)).or(self.default.as_ref()).map_or("", String::as_str)
    }

    /// The MTL file.
    pub fn text(&self, scene: &Scene, notes: &mut Notes) -> Result<Vec<u8>> {
        let mut text = String::from("# Written by Orthant\n");
        for (id, material) in scene.materials().iter() {
            let pointer = format!("/materials/{}", Store::<MaterialId, Material>::slot(id));
            let (material, loses_textures) = plain(material);
            let material = &*material;
            if loses_textures {
                notes.add(pointer.clone(), "MTL does not hold textures of specular and glossiness");
            }
            for what in unheld(material) {
                notes.add(pointer.clone(), &format!("MTL does not hold {what}"));
            }
            Definition { library: self, scene, text: &mut text, pointer: &pointer, notes }
                .write(&self.names[&id], material)?;
        }
        if let Some(name) = &self.default {
            let material = Material::default();
            Definition { library: self, scene, text: &mut text, pointer: "/meshes", notes }.write(name, &material)?;
        }
        Ok(text.into_bytes())
    }
}

/// The material in terms of metallic and roughness, and whether textures are left out.
fn plain(material: &Material) -> (Cow<'_, Material>, bool) {
    match material.without_specular_glossiness() {
        Some((converted, loses_textures)) => (Cow::Owned(converted), loses_textures),
        None => (Cow::Borrowed(material), false),
    }
}

/// The textures that have a statement.
fn maps(m: &Material) -> [Option<&TextureInfo>; 4] {
    [&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture, &m.emissive_texture].map(Option::as_ref)
}

/// The image of a texture that most readers of OBJ know, else the one to show.
fn shown_image(scene: &Scene, texture: TextureId) -> Option<ImageId> {
    let texture = &scene.textures()[texture];
    let is_plain = |id: &ImageId| matches!(scene.images()[*id].media_type(), Some("image/png" | "image/jpeg"));
    texture.source.filter(is_plain).or_else(|| texture.best_source(scene.images()))
}

/// One `newmtl`.
struct Definition<'l> {
    library: &'l Library,
    scene: &'l Scene,
    text: &'l mut String,
    pointer: &'l str,
    notes: &'l mut Notes,
}

impl Definition<'_> {
    fn write(&mut self, name: &str, m: &Material) -> Result<()> {
        let [r, g, b, alpha] = m.base_color;
        let base = [r, g, b];
        let is_glass = m.transmission.as_ref().is_some_and(|t| t.factor >= GLASS);
        self.line(format_args!("\nnewmtl {name}"));
        self.color("Kd", base)?;
        let (specular, tint) = m.specular.as_ref().map_or((1.0, [1.0; 3]), |s| (s.factor, s.color));
        // Reflectance at normal incidence: the usual 0.5 is the 4 % of glTF.
        self.color("Ks", tint.map(|c| 0.5 * specular * c))?;
        let strength = m.emissive_strength.unwrap_or(1.0);
        self.color("Ke", m.emissive.map(|c| c * strength))?;
        self.scalar("Ns", phong_exponent(m.roughness))?;
        self.scalar("Ni", m.ior.unwrap_or(1.5))?;
        if is_glass {
            self.color("Tf", base)?;
        } else if m.alpha_mode == AlphaMode::Blend {
            self.scalar("d", alpha)?;
        } else if m.alpha_mode == AlphaMode::Mask && alpha < m.alpha_cutoff.unwrap_or(0.5) && no_texture(m) {
            self.scalar("d", 0.0)?;
        }
        self.line(format_args!("illum {}", if is_glass { 7 } else { 2 }));
        self.scalar("Pr", m.roughness)?;
        self.scalar("Pm", m.metallic)?;
        if let Some(c) = &m.clearcoat {
            self.scalar("Pc", c.factor)?;
            self.scalar("Pcr", c.roughness)?;
        }
        if let Some(s) = &m.sheen {
            self.scalar("Ps", s.color.into_iter().fold(0.0, f64::max))?;
        }
        if let Some(a) = &m.anisotropy {
            self.scalar("aniso", a.strength)?;
            self.scalar("anisor", (a.rotation / std::f64::consts::TAU).rem_euclid(1.0))?;
        }
        self.map("map_Kd", "", m.base_color_texture.as_ref())?;
        if m.alpha_mode != AlphaMode::Opaque && !is_glass {
            self.map("map_d", "-imfchan m ", m.base_color_texture.as_ref())?;
        }
        self.map("map_Ke", "", m.emissive_texture.as_ref())?;
        self.map("map_Pr", "-imfchan g ", m.metallic_roughness_texture.as_ref())?;
        self.map("map_Pm", "-imfchan b ", m.metallic_roughness_texture.as_ref())?;
        if let Some(info) = &m.normal_texture {
            let scale = format!("-bm {} ", finite(info.scale, "scale")?);
            self.map("norm", if info.scale == 1.0 { "" } else { &scale }, Some(info))?;
        }
        Ok(())
    }

    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.text, "{text}");
    }

    fn color(&mut self, statement: &'static str, [r, g, b]: [f64; 3]) -> Result<()> {
        let (r, g, b) = (finite(r, statement)?, finite(g, statement)?, finite(b, statement)?);
        self.line(format_args!("{statement} {r} {g} {b}"));
        Ok(())
    }

    fn scalar(&mut self, statement: &'static str, value: f64) -> Result<()> {
        let value = finite(value, statement)?;
        self.line(format_args!("{statement} {value}"));
        Ok(())
    }

    fn map(&mut self, statement: &str, options: &str, info: Option<&TextureInfo>) -> Result<()> {
        let Some(info) = info else { return Ok(()) };
        let scene = self.scene;
        let image = shown_image(scene, info.texture);
        let Some(path) = image.and_then(|image| self.library.paths.get(&image)) else {
            self.notes.add(self.pointer.to_owned(), "a texture without an image is left out");
            return Ok(());
        };
        let mut options = options.to_owned();
        let sampler = scene.textures()[info.texture].sampler.map(|id| &scene.samplers()[id]);
        match sampler.map(|s| [s.wrap_s, s.wrap_t].map(|w| w.unwrap_or(WrapMode::Repeat))) {
            None | Some([WrapMode::Repeat, WrapMode::Repeat]) => {}
            Some([WrapMode::ClampToEdge, WrapMode::ClampToEdge]) => options.push_str("-clamp on "),
            Some(_) => self.notes.add(self.pointer.to_owned(), "MTL textures repeat or are clamped, both ways alike"),
        }
        if let Some(t) = &info.transform {
            let ([su, sv], [ou, ov]) = (t.scale, t.offset);
            // The inverse of what import does: V = 1 - v.
            let ov = 1.0 - sv - ov;
            for value in [su, sv, ou, ov] {
                finite(value, "KHR_texture_transform")?;
            }
            if t.rotation != 0.0 {
                self.notes.add(self.pointer.to_owned(), "MTL does not rotate textures");
            }
            // Three numbers, so that a file name that looks like one is not taken for the third.
            let _ = write!(options, "-s {su} {sv} 1 -o {ou} {ov} 0 ");
        }
        if info.transform.as_ref().and_then(|t| t.tex_coord).unwrap_or(info.tex_coord) != 0 {
            self.notes.add(
                self.pointer.to_owned(),
                "OBJ has one set of texture coordinates; a texture that uses another one is laid out by the first",
            );
        }
        self.line(format_args!("{statement} {options}{path}"));
        Ok(())
    }
}

/// Transmission above this is written as glass: the format knows all or nothing.
const GLASS: f64 = 0.5;
/// What most programs take as the largest exponent.
const LARGEST_EXPONENT: f64 = 1000.0;

/// The exponent of the Blinn-Phong lobe that comes closest (Walter et al. 2007, section 5.2): 2 / alpha^2 - 2 with alpha the
/// square of the roughness.
fn phong_exponent(roughness: f64) -> f64 {
    (2.0 / roughness.clamp(0.0, 1.0).powi(4) - 2.0).clamp(0.0, LARGEST_EXPONENT)
}

fn no_texture(m: &Material) -> bool {
    m.base_color_texture.is_none()
}

fn finite(value: f64, name: &'static str) -> Result<f64> {
    if value.is_finite() { Ok(value) } else { Err(ExportFault::NotFinite(name)) }
}

/// A name as the rest of a line: no line ends, no backslash that would join the next line, no blanks around it.
pub fn line_name(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    plain.trim_end_matches(|c: char| c.is_whitespace() || c == '\\').trim_start().to_owned()
}

/// A name that is not taken yet.
fn free(name: String, taken: &mut HashSet<String>) -> String {
    if taken.insert(name.clone()) {
        return name;
    }
    let mut number = 2u64;
    loop {
        let other = format!("{name}.{number}");
        if taken.insert(other.clone()) {
            return other;
        }
        number += 1;
    }
}

/// A path that is read as one file name behind the options of a map.
fn map_path(path: &str) -> String {
    let is_plain = !path.split(' ').any(|word| word.is_empty() || word.starts_with('-'))
        && !path.chars().any(|c| c.is_control() || (c.is_whitespace() && c != ' ') || "\"\\".contains(c));
    if is_plain {
        return path.to_owned();
    }
    let name = |part: &str| {
        let part = names::file_name(part, "image").replace(char::is_whitespace, "_");
        if part.starts_with('-') { format!("_{part}") } else { part }
    };
    path.split('/').map(name).collect::<Vec<_>>().join("/")
}

/// What the format has no place for.
fn unheld(m: &Material) -> impl Iterator<Item = &'static str> + use<> {
    let specular_textures = m.specular.as_ref().is_some_and(|s| s.texture.is_some() || s.color_texture.is_some());
    let lobe_textures = m.sheen.as_ref().is_some_and(|s| s.color_texture.is_some() || s.roughness_texture.is_some())
        || m.anisotropy.as_ref().is_some_and(|a| a.texture.is_some())
        || m.transmission.as_ref().is_some_and(|t| t.texture.is_some())
        || m.clearcoat
            .as_ref()
            .is_some_and(|c| c.texture.is_some() || c.roughness_texture.is_some() || c.normal_texture.is_some());
    let is_grey = |c: [f64; 3]| c[0] == c[1] && c[1] == c[2];
    let factors = m.base_color_texture.is_some() && m.base_color[..3] != [1.0; 3]
        || m.emissive_texture.is_some() && m.emissive != [1.0; 3];
    [
        (!m.double_sided, "that a surface has one side; its readers show both"),
        (m.alpha_mode == AlphaMode::Mask && m.base_color_texture.is_some(), "alpha cut-offs; they become transparency"),
        (factors, "for all readers that a texture is multiplied by its factor"),
        (m.unlit, "unlit materials"),
        (m.occlusion_texture.is_some(), "occlusion maps"),
        (m.transmission.as_ref().is_some_and(|t| t.factor > 0.0 && t.factor < 1.0), "transmission in part"),
        (m.volume.as_ref().is_some_and(|v| v.thickness != 0.0), "volumes"),
        (m.iridescence.is_some(), "iridescence"),
        (m.dispersion.is_some(), "dispersion"),
        (m.diffuse_transmission.is_some(), "diffuse transmission"),
        (
            m.sheen.as_ref().is_some_and(|s| !is_grey(s.color) || s.roughness != 0.5),
            "the colour and roughness of sheen",
        ),
        (specular_textures || lobe_textures, "textures of specular, sheen, clearcoat, anisotropy or transmission"),
    ]
    .into_iter()
    .filter_map(|(is_there, what)| is_there.then_some(what))
}
