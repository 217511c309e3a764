//! `orthant info`: what a scene file holds. Worlds are counted by `orthant world info`.

use crate::args::{Common, InfoArgs};
use crate::commands;
use crate::failure::Failure;
use crate::job::{LoadOptions, Loaded, WorldFormat, load};
use crate::output::{print, print_json};
use orthant_render::geometry::triangle_index_count;
use orthant_resident::rows::{MeshFlags, NodeFlags};
use orthant_scene::Scene;
use orthant_scene::model::{MeshId, NodeId, Primitive};
use serde_json::{Map, Value, json};
use std::collections::HashMap;

/// Prints the counts.
///
/// # Errors
/// A bad scene (bad input).
pub fn run(args: &InfoArgs, common: &Common) -> Result<(), Failure> {
    if WorldFormat::of(&args.file).is_some() {
        for (option, is_given) in
            [("--mesh-descs", args.mesh_descs), ("--allow-external-files", args.allow_external_files)]
        {
            if is_given {
                return Err(Failure::usage(format!("{option} is for scenes: leave it out with a world")));
            }
        }
        return commands::world::info::run(&args.file, args.json, args.salvage, common);
    }
    if args.salvage {
        return Err(Failure::usage("--salvage is for .orw files: leave it out with a scene"));
    }
    let options = LoadOptions {
        scene: None,
        variant: None,
        moment: None,
        allow_external_files: args.allow_external_files,
        max_memory: common.max_memory(),
    };
    let mut loaded = load(&args.file, &options)?;
    let mut info = describe(&mut loaded);
    if args.mesh_descs {
        info.insert("mesh_descs".into(), mesh_descs(&loaded));
    }
    if !args.json && !common.quiet {
        loaded.print_warnings();
    }
    print_info(info, args.json)
}

/// Prints counts: as one JSON document, or a line each, without the warnings, which have been said.
///
/// # Errors
/// Stdout cannot be written.
pub fn print_info(mut info: Map<String, Value>, as_json: bool) -> Result<(), Failure> {
    if as_json {
        return print_json(&Value::Object(info));
    }
    info.shift_remove("warnings");
    let lines: Vec<String> = info.iter().map(|(key, value)| format!("{key:<20} {}\n", plain(value))).collect();
    print(&lines.concat())
}

/// A value for people: lists by commas, one MeshDesc a line.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(list) if list.iter().any(Value::is_object) => {
            list.iter().map(|v| format!("\n  {v}")).collect::<String>()
        }
        Value::Array(list) => list.iter().map(plain).collect::<Vec<_>>().join(", "),
        Value::Object(map) => map.iter().map(|(k, v)| format!("{k} {}", plain(v))).collect::<Vec<_>>().join("; "),
        other => other.to_string(),
    }
}

/// Triangles that a primitive of the document makes, and its vertices.
fn primitive_size(scene: &Scene, primitive: &Primitive) -> (u64, u64) {
    let Some(position) = primitive.attributes.get("POSITION") else { return (0, 0) };
    let vertices = scene.accessors()[position].count;
    let indices = primitive.indices.map_or(vertices, |a| scene.accessors()[a].count);
    (triangle_index_count(primitive.mode, indices) as u64 / 3, vertices as u64)
}

fn describe(loaded: &mut Loaded) -> Map<String, Value> {
    let scene = &loaded.scene;
    let derived = &mut loaded.derived;
    let sizes: Vec<(u64, u64)> =
        scene.meshes().iter().flat_map(|(_, m)| &m.primitives).map(|p| primitive_size(scene, p)).collect();
    let occupied = || derived.render_nodes.iter().filter(|n| n.flags & NodeFlags::OCCUPIED != 0);
    let instanced: u64 = occupied().map(|n| u64::from(derived.mesh_descs[n.primitive as usize].triangle_count())).sum();
    let render_nodes = occupied().count();
    let bounds = derived.bounds().map(|(lo, hi)| json!({ "min": lo.to_array(), "max": hi.to_array() }));
    let batch = derived.load_batch();
    let geometry = batch.positions.bytes() + batch.vertices.bytes() + batch.indices.bytes() + batch.tangents.bytes();
    let images: u64 = batch.images.iter().filter_map(|w| w.image.as_ref()).map(|i| i.texels.len() as u64).sum();

    let info = json!({
        "format": loaded.format.name(),
        "scenes": scene.scenes().len(),
        "nodes": scene.nodes().len(),
        "meshes": scene.meshes().len(),
        "primitives": sizes.len(),
        "triangles": sizes.iter().map(|s| s.0).sum::<u64>(),
        "instanced_triangles": instanced,
        "vertices": sizes.iter().map(|s| s.1).sum::<u64>(),
        "materials": scene.materials().len(),
        "textures": scene.textures().len(),
        "images": scene.images().len(),
        "animations": scene.animations().len(),
        "skins": scene.skins().len(),
        "cameras": scene.cameras().len(),
        "lights": scene.lights().len(),
        "variants": scene.variants().iter().map(|(_, v)| v.name.as_str()).collect::<Vec<_>>(),
        "render_primitives": derived.primitives.len(),
        "render_nodes": render_nodes,
        "extensions_used": scene.extensions_used(),
        "bounds": bounds,
        "bytes": { "geometry": geometry, "images": images },
        "warnings": loaded.warnings,
    });
    let Value::Object(info) = info else { unreachable!("the macro was given an object") };
    info
}

/// The distinct pieces of geometry, in RenderPrimitive order.
fn mesh_descs(loaded: &Loaded) -> Value {
    let meshes: HashMap<MeshId, usize> = loaded.scene.meshes().ids().enumerate().map(|(i, id)| (id, i)).collect();
    let nodes: HashMap<NodeId, usize> = loaded.scene.nodes().ids().enumerate().map(|(i, id)| (id, i)).collect();
    let rows = loaded.derived.primitives.iter().zip(&loaded.derived.mesh_descs).map(|(primitive, desc)| {
        let flag = |bit: u32, name: &'static str| (desc.flags & bit != 0).then_some(name);
        let normal = (desc.flags & MeshFlags::FLAT == 0).then_some("normal");
        let has: Vec<&str> = [
            normal,
            flag(MeshFlags::TANGENT, "tangent"),
            flag(MeshFlags::UV0, "uv0"),
            flag(MeshFlags::UV1, "uv1"),
            flag(MeshFlags::COLOR, "color"),
        ]
        .into_iter()
        .flatten()
        .collect();
        let mut row = json!({
            "mesh": meshes.get(&primitive.mesh),
            "primitive": primitive.primitive,
            "first_vertex": desc.first_vertex,
            "vertex_count": desc.vertex_count,
            "first_index": desc.first_index,
            "index_count": desc.index_count,
            "has": has,
        });
        if let Some(node) = primitive.deformed_by {
            row["deformed_by"] = json!(nodes.get(&node));
        }
        row
    });
    rows.collect()
}
