//! From schema to scene: every index is followed and checked here.

mod animations;
mod buffers;
mod compressed;
mod draco;
mod extra;
mod geometry;
mod images;
mod materials;
mod node;
mod nodes;
mod references;

use super::extensions::SUPPORTED;
use super::nodes::NodeTexts;
use super::{Fault, schema};
use crate::Scene;
use crate::import::ImportFault;
use crate::import::budget::Budget;
use crate::import::files::Files;
use crate::import::gltf::parse::parse;
use crate::import::warning::{Warning, WarningKind, Warnings};
use crate::model::{Asset, Blob, Kind, Packet};
use crate::place::At;
use crate::visit;
use extra::Members;
use references::Counts;

type Result<T> = std::result::Result<T, Fault>;

/// What every conversion needs.
struct Converter<'c> {
    scene: Scene,
    counts: Counts,
    warnings: Warnings,
    files: &'c Files<'c>,
    budget: &'c Budget,
}

/// Builds the scene. `bin` is the second chunk of a GLB; `nodes` are those of the document, if `root` has none of them.
pub fn convert(
    mut root: schema::Root<'_>,
    nodes: Option<&NodeTexts<'_>>,
    bin: Option<Blob>,
    is_glb: bool,
    files: &Files<'_>,
    budget: &Budget,
    warnings: Warnings,
) -> Result<(Scene, Vec<Warning>)> {
    check_version(&root.asset)?;
    let mut c = Converter { scene: Scene::default(), counts: Counts::of(&root), warnings, files, budget };
    c.extensions(&root)?;
    if let Some(texts) = nodes {
        c.counts.nodes = texts.len();
    }
    let at = &At::Root;
    let mut members = Members::new(root.extensions.take(), std::mem::take(&mut root.rest));
    let compressed = c.compressed_views(&mut root)?;
    let lights: Option<schema::Lights<'_>> = members.take("KHR_lights_punctual", at)?;
    let variants: Option<schema::Variants<'_>> = members.take("KHR_materials_variants", at)?;
    let packets: Option<schema::Packets<'_>> = members.take("KHR_xmp_json_ld", at)?;
    c.counts.lights = lights.as_ref().map_or(0, |l| l.lights.len());
    c.counts.variants = variants.as_ref().map_or(0, |v| v.variants.len());

    c.scene.asset = asset(root.asset, at)?;
    c.scene.extensions_used = root.extensions_used;
    c.scene.extensions_required = root.extensions_required;
    c.buffers(root.buffers, bin, is_glb, &compressed)?;
    c.decode_views(&compressed)?;
    c.buffer_views(root.buffer_views, &compressed)?;
    c.draco_primitives(&mut root.meshes, &mut root.accessors, &root.images)?;
    c.accessors(root.accessors)?;
    c.samplers(root.samplers)?;
    c.images(root.images)?;
    c.textures(root.textures)?;
    c.materials(root.materials)?;
    if let Some(variants) = variants {
        c.variants(variants, &mut members)?;
    }
    c.meshes(root.meshes)?;
    c.cameras(root.cameras)?;
    if let Some(lights) = lights {
        c.lights(lights, &mut members)?;
    }
    if let Some(packets) = packets {
        c.packets(packets, &mut members)?;
    }
    c.skins(root.skins)?;
    match nodes {
        Some(texts) => c.node_texts(texts)?,
        None => c.nodes(root.nodes)?,
    }
    c.animations(root.animations)?;
    c.scenes(root.scenes)?;
    c.scene.default_scene = root.scene.map(|s| c.counts.scene(s, &at.key("scene"))).transpose()?;
    c.scene.extra = members.finish(root.extras, at)?;
    references::connect(&mut c.scene, &mut c.warnings)?;
    c.scene.extensions_declared_only = declared_only(&c.scene);
    Ok((c.scene, c.warnings.into_list()))
}

/// One material, light or camera from its JSON text, as the only object of a scene. `bounds` says how many objects of each
/// kind it may refer to. All that an import of it would warn about comes with it.
pub fn convert_object(kind: Kind, text: &str, bounds: &dyn Fn(Kind) -> usize) -> Result<(Scene, Vec<Warning>)> {
    let budget = Budget::new(u64::MAX);
    let files = Files::new(None, false, &budget);
    let counts = Counts { textures: bounds(Kind::Texture), ..Counts::default() };
    let mut c =
        Converter { scene: Scene::default(), counts, warnings: Warnings::default(), files: &files, budget: &budget };
    let array = At::Root.path(kind.array());
    let at = &array.index(0);
    match kind {
        Kind::Material => c.materials(vec![parse(text, at)?])?,
        Kind::Camera => c.cameras(vec![parse(text, at)?])?,
        _ => {
            let lights = format!("{{\"lights\":[{text}]}}");
            let lights = parse(&lights, &At::Root.path("/extensions/KHR_lights_punctual"))?;
            c.lights(lights, &mut Members::default())?;
        }
    }
    references::connect_to(&mut c.scene, bounds, &mut c.warnings)?;
    Ok((c.scene, c.warnings.into_list()))
}

/// The extensions that the file declares and that nothing in it shows.
fn declared_only(scene: &Scene) -> Vec<String> {
    let in_use = visit::extensions_in_use(scene);
    scene.extensions_used.iter().filter(|name| !in_use.contains(*name)).cloned().collect()
}

/// A file is understood if it asks for 2.0 at least; a later minor version may not break what 2.0 says.
fn check_version(asset: &schema::Asset<'_>) -> Result<()> {
    let at = &At::Root.key("asset");
    let (key, wanted) = match &asset.min_version {
        Some(minimum) => ("minVersion", minimum),
        None => ("version", &asset.version),
    };
    let (major, minor) = wanted.split_once('.').unwrap_or((wanted, ""));
    let is_number = |s: &str| !s.is_empty() && s.bytes().all(|b| b.is_ascii_digit());
    let understood = major == "2" && is_number(minor) && (key == "version" || minor.bytes().all(|b| b == b'0'));
    if understood { Ok(()) } else { Err((at.key(key).place(), ImportFault::Version(wanted.clone()))) }
}

fn asset(asset: schema::Asset<'_>, at: &At<'_>) -> Result<Asset> {
    let at = &at.key("asset");
    Ok(Asset {
        version: Some(asset.version).filter(|version| version != "2.0"),
        generator: asset.generator,
        copyright: asset.copyright,
        min_version: asset.min_version,
        extra: Members::new(asset.extensions, asset.rest).finish(asset.extras, at)?,
    })
}

impl Converter<'_> {
    /// Refuses what is required and not supported, and says what is used and not known.
    fn extensions(&mut self, root: &schema::Root<'_>) -> Result<()> {
        let required = &At::Root.key("extensionsRequired");
        for (i, name) in root.extensions_required.iter().enumerate() {
            if !SUPPORTED.contains(&name.as_str()) {
                return Err((required.index(i).place(), ImportFault::RequiredExtension(name.clone())));
            }
        }
        let used = &At::Root.key("extensionsUsed");
        for (i, name) in root.extensions_used.iter().enumerate() {
            if !SUPPORTED.contains(&name.as_str()) {
                self.warn(WarningKind::UnknownExtension(name.clone()), &used.index(i));
            }
        }
        Ok(())
    }

    fn packets<'a>(&mut self, packets: schema::Packets<'a>, members: &mut Members<'a>) -> Result<()> {
        for (i, packet) in packets.packets.into_iter().enumerate() {
            self.scene.packets.insert_nth(i, Packet(packet));
        }
        members.keep_rest("KHR_xmp_json_ld", packets.extensions, packets.extras, packets.rest, &At::Root)
    }

    fn warn(&mut self, kind: WarningKind, at: &At<'_>) {
        self.warnings.push(kind, || at.place());
    }

    fn tolerate(&mut self, what: &'static str, at: &At<'_>) {
        self.warn(WarningKind::Tolerated(what), at);
    }
}

fn invalid<T>(at: &At<'_>, what: impl Into<String>) -> Result<T> {
    Err((at.place(), ImportFault::Value(what.into())))
}

/// A number of the file as a size in memory.
fn size(value: schema::Int, at: &At<'_>) -> Result<usize> {
    match usize::try_from(value.0) {
        Ok(size) => Ok(size),
        Err(_) => invalid(at, format!("{} is too large for this machine", value.0)),
    }
}

/// A number of the file that must be small.
fn small(value: schema::Int, at: &At<'_>) -> Result<u32> {
    match u32::try_from(value.0) {
        Ok(small) => Ok(small),
        Err(_) => invalid(at, format!("{} is out of range", value.0)),
    }
}
