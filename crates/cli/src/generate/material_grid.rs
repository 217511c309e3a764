//! A showcase of materials: spheres on shelves, one property a row, under soft boxes in a grey studio.

use super::document::{Document, Index, Node, looking};
use super::shapes::{Geometry, cuboid, inverted, sphere};
use super::textures::{byte, mix, normal_map, opaque, paint, tiling_noise};
use glam::{Quat, Vec3};
use serde_json::{Value, json};

const COLUMNS: usize = 9;
const SPACING: f32 = 1.0;
const ROW_HEIGHT: f32 = 1.12;
const RADIUS: f32 = 0.42;

/// Builds the scene.
pub fn material_grid() -> Document {
    let mut doc = Document::default();
    studio(&mut doc);
    let ball = ball();
    let mut shape = None;
    let rows: [(&str, Vec<Index>); 5] = [
        ("dielectric by roughness", sweep(&mut doc, "dielectric", [0.05, 0.18, 0.50], |t| (0.0, t))),
        ("gold by roughness", sweep(&mut doc, "gold", [1.0, 0.77, 0.34], |t| (1.0, 0.08 + 0.92 * t))),
        ("copper paint by metalness", sweep(&mut doc, "copper", [0.93, 0.42, 0.28], |t| (t, 0.25))),
        ("textures", textured(&mut doc)),
        ("emission, unlit, alpha", special(&mut doc)),
    ];
    let shelf_material = doc.plain_material("shelf", [0.55, 0.50, 0.45], 0.0, 0.6);
    let shelf = doc.mesh("shelf", &[(&cuboid([COLUMNS as f32 * SPACING + 0.3, 0.06, 1.05]), shelf_material)]);
    for (r, (name, materials)) in rows.into_iter().enumerate() {
        let y = (4 - r) as f32 * ROW_HEIGHT;
        let row = doc.root(Node::named(name).at(Vec3::Y * y));
        doc.child(row, Node::mesh(shelf).called("shelf").at(Vec3::Y * -0.03));
        for (c, material) in materials.into_iter().enumerate() {
            let x = (c as f32 - (COLUMNS - 1) as f32 * 0.5) * SPACING;
            // One geometry for all: the first mesh makes the accessors, the others share them.
            let mesh = match shape {
                Some(shape) => doc.recoloured_mesh("ball", shape, material),
                None => doc.mesh("ball", &[(&ball, material)]),
            };
            shape = Some(mesh);
            // Turned a little, so that the seam of the texture is behind.
            let turn = Quat::from_rotation_y(std::f32::consts::PI);
            doc.child(row, Node::mesh(mesh).at(Vec3::new(x, RADIUS, 0.0)).turned(turn));
        }
    }
    doc.look_at("camera", Vec3::new(0.0, 3.0, 12.2), Vec3::new(0.0, 2.68, 0.0), 26.5);
    doc
}

/// A sphere with two texture sets: once around in two tiles, and four times as fine.
fn ball() -> Geometry {
    let mut g = sphere(RADIUS, 64, 32).tiled(2.0, 1.0);
    g.uvs1 = g.uvs.iter().map(|uv| [uv[0] * 4.0, uv[1] * 4.0]).collect();
    g
}

fn studio(doc: &mut Document) {
    let grey = doc.plain_material("studio", [0.48, 0.49, 0.50], 0.0, 0.9);
    let room = doc.mesh("studio", &[(&inverted(cuboid([24.0, 14.0, 26.0])), grey)]);
    doc.root(Node::mesh(room).called("studio").at(Vec3::new(0.0, 5.8, 8.0)));
    let back = doc.plain_material("back", [0.30, 0.31, 0.33], 0.0, 0.8);
    let back = doc.mesh("back", &[(&cuboid([COLUMNS as f32 + 0.5, 5.0 * ROW_HEIGHT + 0.3, 0.08]), back)]);
    doc.root(Node::mesh(back).called("back").at(Vec3::new(0.0, 2.75, -0.56)));

    for (name, at, target, size, colour, strength) in [
        ("key light", Vec3::new(-6.5, 8.0, 9.0), Vec3::new(0.0, 2.5, 0.0), [5.0, 3.0], [1.0, 0.93, 0.82], 24.0),
        ("fill light", Vec3::new(8.5, 5.0, 8.0), Vec3::new(0.0, 2.5, 0.0), [1.5, 5.0], [0.72, 0.85, 1.0], 15.0),
        ("top light", Vec3::new(0.0, 11.5, 5.5), Vec3::new(0.0, 2.0, 0.0), [8.0, 2.0], [1.0, 1.0, 1.0], 6.0),
    ] {
        let material = doc.emissive_material(name, colour, strength);
        let (x, y) = (size[0] * 0.5, size[1] * 0.5);
        let mut panel = Geometry::default();
        // It faces -Z, as glTF's lights do.
        panel.quad([[x, -y], [-x, -y], [-x, y], [x, y]].map(|[x, y]| Vec3::new(x, y, 0.0)));
        let mesh = doc.mesh(name, &[(&panel, material)]);
        doc.root(Node::mesh(mesh).called(name).at(at).turned(looking(target - at)));
    }
}

/// One material per column, from (metallic, roughness) at 0..=1 along the row.
fn sweep(doc: &mut Document, name: &str, rgb: [f32; 3], at: impl Fn(f32) -> (f32, f32)) -> Vec<Index> {
    (0..COLUMNS)
        .map(|i| {
            let (metallic, roughness) = at(i as f32 / (COLUMNS - 1) as f32);
            doc.plain_material(&format!("{name}, metallic {metallic}, roughness {roughness}"), rgb, metallic, roughness)
        })
        .collect()
}

/// Every texture slot by itself, two together, a second texture set, and a texture transform.
fn textured(doc: &mut Document) -> Vec<Index> {
    let tiles = paint(256, 256, |u, v| {
        let even = ((u * 8.0) as u32 + (v * 8.0) as u32).is_multiple_of(2);
        let shade = 0.85 + 0.15 * tiling_noise(1, u, v, 8.0);
        opaque(if even { [0.86, 0.83, 0.76] } else { [0.16, 0.42, 0.44] }.map(|c: f32| c * shade))
    });
    let tiles = doc.texture("tiles", 256, 256, &tiles, false);
    // Green is roughness, blue metalness: polished metal inlays in rough stone.
    let inlay = |u: f32, v: f32| ((u * 4.0).fract() - 0.5).hypot((v * 4.0).fract() - 0.5) < 0.32;
    let metal_rough = paint(256, 256, |u, v| {
        let scratches = tiling_noise(2, u, v, 12.0);
        let (metal, rough) = if inlay(u, v) { (1.0, 0.12 + 0.25 * scratches) } else { (0.0, 0.75 + 0.2 * scratches) };
        [255, byte(rough), byte(metal), 255]
    });
    let metal_rough = doc.texture("inlays", 256, 256, &metal_rough, false);
    let inlay_colour = paint(256, 256, |u, v| {
        let veins = tiling_noise(3, u, v, 6.0);
        opaque(if inlay(u, v) { [0.98, 0.86, 0.57] } else { mix([0.30, 0.28, 0.30], [0.62, 0.60, 0.58], veins) })
    });
    let inlay_colour = doc.texture("inlay colour", 256, 256, &inlay_colour, false);
    let studs = |u: f32, v: f32| {
        let d = ((u * 8.0).fract() - 0.5).hypot((v * 8.0).fract() - 0.5);
        (1.0 - (d / 0.38) * (d / 0.38)).max(0.0).sqrt()
    };
    let bumps = doc.texture("studs", 256, 256, &normal_map(256, 14.0, studs), false);
    let hammered = doc.texture("hammered", 256, 256, &normal_map(256, 30.0, |u, v| tiling_noise(4, u, v, 10.0)), false);
    let cracks = paint(256, 256, |u, v| {
        let ridge = (1.0 - (tiling_noise(5, u, v, 7.0) - 0.5).abs() * 22.0).max(0.0);
        opaque([ridge, ridge * ridge * 0.45, ridge * ridge * ridge * 0.08])
    });
    let cracks = doc.texture("glowing cracks", 256, 256, &cracks, false);
    let pixels = paint(8, 8, |u, v| {
        let hash = ((u * 8.0) as u32 * 7 + (v * 8.0) as u32 * 13) % 5;
        opaque([[0.9, 0.2, 0.2], [0.95, 0.75, 0.2], [0.2, 0.6, 0.3], [0.2, 0.4, 0.8], [0.9, 0.9, 0.9]][hash as usize])
    });
    let pixels = doc.texture("pixels", 8, 8, &pixels, true);
    let occlusion = paint(256, 256, |u, v| opaque([0.3 + 0.7 * studs(u, v); 3]));
    let occlusion = doc.texture("occlusion", 256, 256, &occlusion, false);

    let stone = json!({
        "baseColorTexture": { "index": inlay_colour },
        "metallicRoughnessTexture": { "index": metal_rough },
    });
    let turned = json!({ "KHR_texture_transform": { "rotation": std::f32::consts::FRAC_PI_4, "scale": [2.0, 1.0], "offset": [0.1, 0.0] } });
    let pbr = |base: [f32; 3], metallic: f32, roughness: f32| {
        let [r, g, b] = base;
        json!({ "baseColorFactor": [r, g, b, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness })
    };
    let textured = |texture: Index, roughness: f32| json!({ "baseColorTexture": { "index": texture }, "metallicFactor": 0.0, "roughnessFactor": roughness });
    let materials: [Value; COLUMNS] = [
        json!({ "name": "base colour texture", "pbrMetallicRoughness": textured(tiles, 0.3) }),
        json!({ "name": "metallic-roughness texture", "pbrMetallicRoughness": stone }),
        json!({ "name": "normal texture", "pbrMetallicRoughness": pbr([0.55, 0.08, 0.07], 0.0, 0.35),
            "normalTexture": { "index": bumps } }),
        json!({ "name": "normal texture on metal", "pbrMetallicRoughness": pbr([0.95, 0.93, 0.88], 1.0, 0.2),
            "normalTexture": { "index": hammered, "scale": 0.6 } }),
        json!({ "name": "emissive texture", "pbrMetallicRoughness": pbr([0.03, 0.03, 0.035], 0.0, 0.7),
            "emissiveTexture": { "index": cracks }, "emissiveFactor": [1.0, 1.0, 1.0],
            "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 6.0 } } }),
        json!({ "name": "nearest filter", "pbrMetallicRoughness": textured(pixels, 0.5) }),
        json!({ "name": "second texture set", "pbrMetallicRoughness": {
            "baseColorTexture": { "index": tiles, "texCoord": 1 }, "metallicFactor": 0.0, "roughnessFactor": 0.3 } }),
        json!({ "name": "texture transform", "pbrMetallicRoughness": {
            "baseColorTexture": { "index": tiles, "extensions": turned }, "metallicFactor": 0.0,
            "roughnessFactor": 0.3 } }),
        json!({ "name": "everything", "pbrMetallicRoughness": {
            "baseColorTexture": { "index": inlay_colour }, "metallicRoughnessTexture": { "index": metal_rough } },
            "normalTexture": { "index": bumps, "scale": 0.5 }, "occlusionTexture": { "index": occlusion } }),
    ];
    materials.into_iter().map(|m| doc.material(m)).collect()
}

/// Emission, unlit, alpha mask and alpha blending.
fn special(doc: &mut Document) -> Vec<Index> {
    let lattice = paint(256, 256, |u, v| {
        let hole = ((u * 10.0).fract() - 0.5).hypot((v * 10.0).fract() - 0.5) < 0.36;
        [222, 184, 90, if hole { 0 } else { 255 }]
    });
    let lattice = doc.texture("lattice", 256, 256, &lattice, false);
    let fade = paint(64, 256, |_, v| [70, 150, 190, byte((v - 0.2) / 0.6)]);
    let fade = doc.texture("fade", 64, 256, &fade, false);
    let mut list = vec![
        doc.emissive_material("emissive, warm", [1.0, 0.50, 0.16], 2.5),
        doc.emissive_material("emissive, cold", [0.25, 0.55, 1.0], 2.5),
    ];
    let unlit = |name: &str, rgba: [f32; 4]| {
        json!({ "name": name, "pbrMetallicRoughness": { "baseColorFactor": rgba },
            "extensions": { "KHR_materials_unlit": {} } })
    };
    list.push(doc.material(unlit("unlit", [0.85, 0.12, 0.25, 1.0])));
    let mask = json!({ "name": "alpha mask", "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorTexture": { "index": lattice }, "metallicFactor": 1.0,
            "roughnessFactor": 0.3 } });
    list.push(doc.material(mask));
    for alpha in [0.25, 0.5, 0.75] {
        list.push(doc.material(json!({ "name": format!("alpha blend {alpha}"), "alphaMode": "BLEND",
            "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.5, 0.25, alpha], "metallicFactor": 0.0,
                "roughnessFactor": 0.2 } })));
    }
    list.push(doc.material(json!({ "name": "alpha blend texture", "alphaMode": "BLEND", "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorTexture": { "index": fade }, "metallicFactor": 0.0,
            "roughnessFactor": 0.4 } })));
    list.push(doc.plain_material("polished silver", [0.97, 0.96, 0.92], 1.0, 0.06));
    list
}
