//! Wavefront OBJ with MTL materials (Wavefront, "Advanced Visualizer", appendices B1 and B2).
//!
//! `text` makes logical lines of bytes, `parse` makes arrays of lines, in parallel; `spans` says which material and
//! smoothing group hold where; `normals` adds what smoothing asks for; `triangulate` and `weld` make triangles and
//! vertices, and `assemble` puts them into a buffer with plain accessors, as if the file were glTF. The whole file is one
//! mesh with one primitive per material, shown by one node: groups and objects of OBJ have no transforms, and what they
//! are named is kept in the mesh's extras.
//!
//! Choices where the format leaves one: vertex colours after a position and `Kd` are linear; corners without a texture
//! coordinate have (0, 0) where others of their primitive have one; a fourth number of `v` and a third of `vt` have no
//! effect; curves and surfaces are not read. A file or texture that is missing is a warning, whatever the reason.
//!
//! The crate `tobj` was weighed: it cuts every polygon as a fan, has no smoothing groups, one material per shape and no
//! line numbers, so that little of it would remain.

mod assemble;
mod charged;
mod corner;
mod fault;
mod mtl;
mod normals;
mod number;
mod parse;
mod spans;
#[cfg(test)]
mod tests;
mod text;
mod triangulate;
mod weld;

pub use fault::ObjFault;

use super::budget::{Budget, OverBudget};
use super::files::{FileFault, Files};
use super::warning::{Warning, WarningKind, Warnings};
use super::{ImportFault, Place};
use crate::Scene;
use crate::model::*;
use mtl::Converter;
use serde_json::{Value, json};
use spans::Statements;
use std::borrow::Cow;
use std::collections::HashMap;

/// What is wrong, and where.
type Fault = (Place, ImportFault);

/// Whether the text reads like an OBJ: its first statement that is known comes before any line that no text would have.
/// Statements that are not known are passed over, as some exporters add their own.
pub fn looks_like(bytes: &[u8]) -> bool {
    const LOOK_AT: usize = 1 << 16;
    let head = &bytes[..bytes.len().min(LOOK_AT)];
    let Ok(head) = text::decode(head, &Budget::new(u64::MAX)) else { return false };
    for line in text::Lines::new(&head, 1) {
        let Some((keyword, _)) = text::word(&line.text) else { continue };
        if keyword[0] == b'#' {
            continue;
        }
        if parse::is_keyword(keyword) {
            return true;
        }
        if !keyword.iter().all(|b| b.is_ascii_alphanumeric() || *b == b'_') {
            return false;
        }
    }
    // A comment may be longer than what was looked at.
    bytes.len() > LOOK_AT && head.iter().find(|&&b| !text::is_blank(b)) == Some(&b'#')
}

/// Imports an OBJ file. Its own bytes have been charged already; `stem` is its name without folder and extension.
pub fn import(bytes: Vec<u8>, stem: &str, files: &Files<'_>, budget: &Budget) -> Result<(Scene, Vec<Warning>), Fault> {
    let over = |over: OverBudget| (Place::Whole, ImportFault::from(over));
    let mut warnings = Warnings::default();
    let text = text::decode(&bytes, budget).map_err(over)?;
    let mut parsed = parse::parse(&text, budget, &mut warnings)?;
    let text_bytes = if let Cow::Owned(text) = &text { text.len() } else { 0 };
    drop(text);
    budget.release((bytes.len() + text_bytes) as u64);
    drop(bytes);

    let statements = spans::statements(&parsed);
    if parsed.has_zero_normal {
        warnings.push(WarningKind::Tolerated("a vn has no direction; it counts as missing"), || Place::Whole);
        normals::drop_zero_normals(&mut parsed);
    }
    normals::generate(&mut parsed, &statements.spans, budget).map_err(over)?;

    let mut scene = Scene::default();
    let materials = materials(&mut scene, &statements, files, budget, &mut warnings)?;
    let material_of = |name: Option<usize>| materials[name.unwrap_or(statements.materials.len())];
    let primitives = assemble::primitives(&mut scene, &parsed, &statements.spans, material_of, budget, &mut warnings)
        .map_err(over)?;
    if primitives.is_empty() {
        warnings.push(WarningKind::Tolerated("the file has no faces, lines or points"), || Place::Whole);
    }
    budget.release(value_bytes(&parsed));
    drop(parsed);
    show(&mut scene, primitives, statements, stem);
    scene.extensions_used = used_extensions(&scene).into_iter().map(str::to_owned).collect();
    Ok((scene, warnings.into_list()))
}

/// What `parse` charged for values; normals that were added since are charged elsewhere.
fn value_bytes(parsed: &parse::Parsed<'_>) -> u64 {
    (12 * (parsed.positions.len() + parsed.colors.len()) + 8 * parsed.uvs.len()) as u64
}

/// One mesh, one node, one scene.
fn show(scene: &mut Scene, primitives: Vec<Primitive>, statements: Statements, stem: &str) {
    let name = match &statements.objects[..] {
        [object] if !object.is_empty() => object.clone(),
        _ => stem.to_owned(),
    };
    let mesh = (!primitives.is_empty()).then(|| {
        let extra = Extra { extras: names(&statements).map(Box::new), ..Extra::default() };
        scene.meshes.insert(Mesh { name: Some(name.clone()), primitives, weights: Vec::new(), extra })
    });
    let node = scene.nodes.insert(Node { name: Some(name), mesh, ..Node::default() });
    let roots = Children::from(vec![node]);
    let root = scene.scenes.insert(SceneRoots { name: None, roots, extra: Extra::default() });
    scene.default_scene = Some(root);
}

/// Names that nothing else of the scene carries.
fn names(statements: &Statements) -> Option<Value> {
    let mut extras = serde_json::Map::new();
    if statements.objects.len() > 1 {
        extras.insert("objects".to_owned(), json!(statements.objects));
    }
    if !statements.groups.is_empty() {
        extras.insert("groups".to_owned(), json!(statements.groups));
    }
    (!extras.is_empty()).then(|| Value::Object(extras))
}

/// All materials of the libraries, in their order, then one per name that none defines. Returns the material of each
/// name, and last that of elements without one.
fn materials(
    scene: &mut Scene,
    statements: &Statements,
    files: &Files<'_>,
    budget: &Budget,
    warnings: &mut Warnings,
) -> Result<Vec<MaterialId>, Fault> {
    let libraries = libraries(&statements.libraries, files, warnings)?;
    let mut by_name: HashMap<String, MaterialId> = HashMap::new();
    let mut converter = Converter::new(scene, files, warnings);
    for (file, bytes) in libraries {
        let over = |over: OverBudget| (Place::Whole, ImportFault::from(over));
        let text = text::decode(&bytes, budget).map_err(over)?;
        for definition in mtl::parse(&text, &file, budget, converter.warnings).map_err(over)? {
            if by_name.contains_key(&definition.name) {
                let what = format!("material {:?} is defined before; the first definition is used", definition.name);
                let kind = WarningKind::MaterialLibrary { file: file.clone(), what };
                converter.warnings.push(kind, || parse::line_place(definition.line));
                continue;
            }
            let name = definition.name.clone();
            by_name.insert(name, converter.add(definition, &file).map_err(over)?);
        }
        budget.release(bytes.len() as u64);
    }
    let mut materials = Vec::with_capacity(statements.materials.len() + 1);
    for named in &statements.materials {
        let id = match by_name.get(&named.name) {
            Some(&id) => id,
            None => {
                let bytes = 3 * size_of::<Material>() as u64;
                budget.charge(bytes).map_err(|over| (named.place.clone(), over.into()))?;
                warnings.push(WarningKind::UndefinedMaterial(named.name.clone()), || named.place.clone());
                let id = scene.materials.insert(mtl::matte(Some(named.name.clone())));
                by_name.insert(named.name.clone(), id);
                id
            }
        };
        materials.push(id);
    }
    if statements.spans.iter().any(|span| span.material.is_none()) {
        materials.push(scene.materials.insert(mtl::matte(None)));
    }
    Ok(materials)
}

/// The files that `mtllib` statements name, each once, with their names. A line is one name with spaces if there is such a
/// file, else several names.
fn libraries(
    lines: &[(Box<[u8]>, Place)],
    files: &Files<'_>,
    warnings: &mut Warnings,
) -> Result<Vec<(String, Vec<u8>)>, Fault> {
    let mut read: Vec<(String, Vec<u8>)> = Vec::new();
    let mut seen: HashMap<String, bool> = HashMap::new();
    // Whether the file is there; it is read the first time. Otherwise, why not.
    let mut load = |name: &str, place: &Place| -> Result<Result<(), FileFault>, Fault> {
        if let Some(true) = seen.get(name) {
            return Ok(Ok(()));
        }
        match files.read(name, None) {
            Ok(bytes) => {
                seen.insert(name.to_owned(), true);
                read.push((name.to_owned(), bytes));
                Ok(Ok(()))
            }
            Err(fault @ FileFault::OverBudget { .. }) => Err((place.clone(), fault.into())),
            Err(fault) => Ok(Err(fault)),
        }
    };
    for (line, place) in lines {
        let whole = mtl::file_name(line);
        let Err(fault) = load(&whole, place)? else { continue };
        let names = mtl::file_names(line);
        if names.len() < 2 {
            warnings.push(WarningKind::MissingMaterialLibrary(fault.to_string()), || place.clone());
            continue;
        }
        for name in names {
            if let Err(fault) = load(&name, place)? {
                warnings.push(WarningKind::MissingMaterialLibrary(fault.to_string()), || place.clone());
            }
        }
    }
    Ok(read)
}

/// How an extension is named, and whether a material uses it.
type Use = (&'static str, fn(&Material) -> bool);

/// The extensions that `mtl` makes use of, in alphabetical order.
fn used_extensions(scene: &Scene) -> Vec<&'static str> {
    fn has_transform(material: &Material) -> bool {
        let infos = [
            &material.base_color_texture,
            &material.emissive_texture,
            &material.normal_texture,
            &material.metallic_roughness_texture,
        ];
        infos.into_iter().flatten().any(|info| info.transform.is_some())
    }
    const USES: &[Use] = &[
        ("KHR_materials_anisotropy", |m| m.anisotropy.is_some()),
        ("KHR_materials_clearcoat", |m| m.clearcoat.is_some()),
        ("KHR_materials_emissive_strength", |m| m.emissive_strength.is_some()),
        ("KHR_materials_ior", |m| m.ior.is_some()),
        ("KHR_materials_sheen", |m| m.sheen.is_some()),
        ("KHR_materials_specular", |m| m.specular.is_some()),
        ("KHR_materials_transmission", |m| m.transmission.is_some()),
        ("KHR_texture_transform", has_transform),
    ];
    USES.iter().filter(|(_, used)| scene.materials.iter().any(|(_, m)| used(m))).map(|&(name, _)| name).collect()
}
