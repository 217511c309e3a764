//! A forest: few meshes, many nodes, nine levels of hierarchy, leaves cut out by alpha masks.
//!
//! forest > quarter > quarter of it > stand > tree > trunk > branch > twig > foliage

use super::document::{Document, Index, Node};
use super::random::{Random, fractal_noise};
use super::shapes::{Geometry, frustum, sphere, terrain};
use super::sky_dome::{self, Sky};
use super::textures::{byte, leaves, mix, opaque, paint, tiling_noise};
use glam::{Affine3A, Quat, Vec3};
use serde_json::json;
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

/// Mean distance between trees in metres.
const SPACING: f32 = 5.2;

/// Meshes that all trees share.
struct Parts {
    trunk: Index,
    branch: Index,
    foliage: [Index; 3],
    needles: [Index; 2],
    pole: Index,
}

/// Builds a forest of `trees` trees.
pub fn forest(trees: u32, seed: u64) -> Document {
    let mut doc = Document::default();
    let parts = parts(&mut doc, seed);
    let mut random = Random::new(seed);

    let columns = (trees.max(1) as f32).sqrt().ceil() as u32;
    let size = columns as f32 * SPACING;
    let half = size * 0.5;
    let height = move |x: f32, z: f32| ground_height(seed, x, z);
    ground(&mut doc, size, height);

    // Trees on a jittered grid, kept off the path
    let forest = doc.root(Node::named("forest"));
    let mut groups: BTreeMap<Vec<u32>, Index> = BTreeMap::new();
    for i in 0..trees {
        let (column, row) = (i % columns, i / columns);
        let jitter = |random: &mut Random| random.range(0.12, 0.88) * SPACING;
        let mut x = column as f32 * SPACING - half + jitter(&mut random);
        let z = row as f32 * SPACING - half + jitter(&mut random);
        let off_path = x - path(z);
        if off_path.abs() < 2.6 {
            x += (2.6 - off_path.abs()) * if off_path < 0.0 { -1.0 } else { 1.0 };
        }
        let stand = group(&mut doc, &mut groups, forest, columns, (column, row));
        let at = Vec3::new(x, height(x, z) - 0.1, z);
        let tree = match random.below(5) {
            0..=2 => broadleaf(&mut doc, stand, &parts, &mut random),
            _ => conifer(&mut doc, stand, &parts, &mut random),
        };
        place(&mut doc, tree, at, random.range(0.0, TAU), random.range(0.8, 1.25));
    }
    undergrowth(&mut doc, seed, half, height);

    let sky = Sky {
        sun_direction: Vec3::new(-0.62, 0.58, 0.42),
        sun_colour: [1.0, 0.92, 0.78],
        sun_illuminance: 9.0,
        zenith: [0.36, 0.56, 0.86],
        horizon: [0.78, 0.86, 0.93],
        glow: [0.98, 0.95, 0.86],
        strength: 1.6,
    };
    sky_dome::add(&mut doc, &sky, Vec3::ZERO, (size * 2.0).max(200.0));

    let z = half + 3.0;
    let eye = Vec3::new(path(z) + 0.4, height(path(z), z) + 2.2, z);
    let target_z = z - 16.0;
    doc.look_at("camera", eye, Vec3::new(path(target_z) - 0.6, eye.y + 1.4, target_z), 52.0);
    doc
}

/// The path winds along -Z.
fn path(z: f32) -> f32 {
    2.2 * (z * 0.13).sin() + 1.1 * (z * 0.31).sin()
}

fn ground_height(seed: u64, x: f32, z: f32) -> f32 {
    let hills = 2.6 * fractal_noise(seed ^ 11, x * 0.025, z * 0.025) + 0.5 * fractal_noise(seed ^ 12, x * 0.2, z * 0.2);
    let d = (x - path(z)) / 1.8;
    hills - 0.35 * (-d * d).exp()
}

fn place(doc: &mut Document, node: Index, at: Vec3, yaw: f32, scale: f32) {
    doc.set_transform(node, at, Quat::from_rotation_y(yaw), Vec3::splat(scale));
}

/// The stand that a grid cell belongs to: quarters, sixteenths, then stands of 4 x 4 cells.
fn group(
    doc: &mut Document,
    groups: &mut BTreeMap<Vec<u32>, Index>,
    forest: Index,
    columns: u32,
    (column, row): (u32, u32),
) -> Index {
    let half = columns.div_ceil(2).max(1);
    let quarter = columns.div_ceil(4).max(1);
    let levels = [
        ("quarter", vec![column / half, row / half]),
        ("part", vec![column / half, row / half, column / quarter, row / quarter]),
        ("stand", vec![column / half, row / half, column / quarter, row / quarter, column / 4, row / 4]),
    ];
    let mut parent = forest;
    for (name, key) in levels {
        parent = match groups.get(&key) {
            Some(&index) => index,
            None => {
                let index = doc.child(parent, Node::named(name));
                groups.insert(key, index);
                index
            }
        };
    }
    parent
}

/// A trunk with branches in a spiral, twigs on them, and foliage at the ends.
fn broadleaf(doc: &mut Document, stand: Index, parts: &Parts, random: &mut Random) -> Index {
    let tree = doc.child(stand, Node::named("broadleaf"));
    let tall = random.range(0.9, 1.3);
    let foliage = parts.foliage[random.below(3)];
    let trunk = doc.child(tree, Node::mesh(parts.trunk).scaled(Vec3::new(1.0, tall, 1.0)));
    let crown = Node::mesh(foliage).at(Vec3::Y * 6.3).turned(Quat::from_rotation_y(random.range(0.0, TAU)));
    doc.child(trunk, crown.scaled(Vec3::new(2.2, 1.9 / tall, 2.2)));
    for b in 0..6 {
        let up = 2.4 + 0.55 * b as f32 + random.range(-0.2, 0.2);
        let turn = Quat::from_rotation_y(b as f32 * 2.4 + random.range(-0.4, 0.4));
        let lean = Quat::from_rotation_x(random.range(0.85, 1.15));
        let length = 1.15 - 0.12 * b as f32;
        let branch = Node::mesh(parts.branch).at(Vec3::Y * up).turned(turn * lean);
        let branch = doc.child(trunk, branch.scaled(Vec3::splat(length)));
        for t in 0..3 {
            let turn = Quat::from_rotation_y(t as f32 * TAU / 3.0 + random.range(-0.5, 0.5));
            let lean = Quat::from_rotation_x(random.range(0.35, 0.8));
            let twig = Node::mesh(parts.branch).at(Vec3::Y * (1.2 + 0.45 * t as f32)).turned(turn * lean);
            let twig = doc.child(branch, twig.scaled(Vec3::splat(0.45)));
            let turn = Quat::from_rotation_y(random.range(0.0, TAU)) * Quat::from_rotation_x(random.range(0.0, PI));
            doc.child(twig, Node::mesh(foliage).at(Vec3::Y * 2.0).turned(turn).scaled(Vec3::splat(3.2)));
        }
    }
    tree
}

/// A pole with whorls of needled branches, shorter towards the top.
fn conifer(doc: &mut Document, stand: Index, parts: &Parts, random: &mut Random) -> Index {
    let tree = doc.child(stand, Node::named("conifer"));
    let needles = parts.needles[random.below(2)];
    let pole = doc.child(tree, Node::mesh(parts.pole));
    for layer in 0..9 {
        let t = layer as f32 / 8.0;
        let whorl =
            Node::named("whorl").at(Vec3::Y * (1.5 + 7.6 * t)).turned(Quat::from_rotation_y(random.range(0.0, TAU)));
        let whorl = doc.child(pole, whorl);
        let count = if layer < 6 { 6 } else { 4 };
        for b in 0..count {
            let turn = Quat::from_rotation_y(b as f32 * TAU / count as f32 + random.range(-0.2, 0.2));
            let droop = Quat::from_rotation_x(random.range(0.02, 0.3) - 0.5 * t);
            let length = (2.3 * (1.0 - t) + 0.55) * random.range(0.9, 1.1);
            doc.child(whorl, Node::mesh(needles).turned(turn * droop).scaled(Vec3::splat(length)));
        }
    }
    tree
}

fn parts(doc: &mut Document, seed: u64) -> Parts {
    let bark = paint(128, 256, |u, v| {
        let ridge = tiling_noise(21, u, (v * 0.25).fract(), 10.0);
        opaque(mix([0.20, 0.15, 0.11], [0.47, 0.39, 0.31], ridge * ridge * 1.3))
    });
    let bark = doc.texture("bark", 128, 256, &bark, false);
    let bark = doc.material(json!({ "name": "bark", "pbrMetallicRoughness": {
        "baseColorTexture": { "index": bark }, "metallicFactor": 0.0, "roughnessFactor": 0.95 } }));
    let trunk = doc.mesh("trunk", &[(&frustum(0.26, 0.10, 6.2, 10).tiled(2.0, 3.0), bark)]);
    let branch = doc.mesh("branch", &[(&frustum(0.09, 0.03, 2.3, 6).tiled(1.0, 2.0), bark)]);
    let pole = doc.mesh("pole", &[(&frustum(0.24, 0.02, 10.0, 10).tiled(2.0, 4.0), bark)]);

    let greens: [([f32; 3], [f32; 3]); 3] = [
        ([0.16, 0.33, 0.09], [0.45, 0.60, 0.18]),
        ([0.24, 0.36, 0.08], [0.60, 0.66, 0.20]),
        ([0.12, 0.29, 0.12], [0.36, 0.52, 0.20]),
    ];
    let foliage = [0, 1, 2].map(|i| {
        let (dark, light) = greens[i];
        let texels = leaves(256, seed ^ (31 + i as u64), 70, [0.085, 0.036], dark, light);
        let texture = doc.texture("leaves", 256, 256, &texels, false);
        let material = masked(doc, "leaves", texture);
        doc.mesh("foliage", &[(&clump(41 + i as u64), material)])
    });
    let needles = [0, 1].map(|i| {
        let (dark, light) = [([0.07, 0.19, 0.12], [0.22, 0.38, 0.22]), ([0.09, 0.22, 0.10], [0.28, 0.42, 0.20])][i];
        let texture = doc.texture("needles", 128, 256, &needle_texels(dark, light), false);
        let material = masked(doc, "needles", texture);
        doc.mesh("needled branch", &[(&needled_branch(), material)])
    });
    Parts { trunk, branch, foliage, needles, pole }
}

fn masked(doc: &mut Document, name: &str, texture: Index) -> Index {
    doc.material(json!({ "name": name, "alphaMode": "MASK", "alphaCutoff": 0.4, "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorTexture": { "index": texture }, "metallicFactor": 0.0,
            "roughnessFactor": 0.7 } }))
}

/// Cards in a ball of radius 0.6, their normals half turned outwards, so that the ball is shaded as a whole.
fn clump(seed: u64) -> Geometry {
    let mut random = Random::new(seed);
    let mut g = Geometry::default();
    for _ in 0..14 {
        let turn = Quat::from_euler(
            glam::EulerRot::YXZ,
            random.range(0.0, TAU),
            random.range(-1.1, 1.1),
            random.range(0.0, TAU),
        );
        let centre = turn * Vec3::Z * random.range(0.05, 0.38);
        let (right, up) = (turn * Vec3::X * 0.42, turn * Vec3::Y * 0.42);
        let corners = [centre - right - up, centre + right - up, centre + right + up, centre - right + up];
        let face = turn * Vec3::Z;
        g.quad_with_normals(corners, corners.map(|c| (face + c.normalize_or(face)).normalize()));
    }
    g
}

/// Three cards along +Z, 1 m long: one flat, two like a roof.
fn needled_branch() -> Geometry {
    let mut g = Geometry::default();
    for (angle, width) in [(0.0f32, 0.34f32), (0.75, 0.26), (-0.75, 0.26)] {
        let side = Quat::from_rotation_z(angle) * Vec3::X * width;
        let tip = Vec3::new(0.0, -0.12, 1.0);
        let normal = (Quat::from_rotation_z(angle) * Vec3::Y + Vec3::Z * 0.15).normalize();
        g.quad_with_normals([side, -side, tip - side * 0.5, tip + side * 0.5].map(|c| c + Vec3::Y * 0.02), [normal; 4]);
    }
    g
}

/// A stem along v with needles aslant, denser at the stem.
fn needle_texels(dark: [f32; 3], light: [f32; 3]) -> Vec<[u8; 4]> {
    paint(128, 256, |u, v| {
        let x = (u - 0.5).abs() * 2.0;
        // Side twigs every 1/14 of the length; needles on them.
        let along = (v * 14.0 + x * 2.6).fract();
        let twig = (along - 0.5).abs() < 0.36 * (1.0 - x * 0.6);
        let needle = ((v * 14.0 - x * 9.0) * 4.0).fract() < 0.62;
        let inside = x < 0.94 * (v * 6.0).min(1.0) && (twig && needle || x < 0.03);
        let shade = (1.0 - x) * 0.4 + 0.6 * along;
        let [r, g, b] = mix(dark, light, shade).map(byte);
        [r, g, b, if inside { 255 } else { 0 }]
    })
}

fn ground(doc: &mut Document, size: f32, height: impl Fn(f32, f32) -> f32) {
    let extent = size + 60.0;
    let cells = ((extent / 0.8) as u32).clamp(32, 512);
    // Moss and litter by vertex colour, with a fine texture over it
    let grain = paint(256, 256, |u, v| opaque([0.72 + 0.28 * tiling_noise(61, u, v, 24.0); 3]));
    let grain = doc.texture("soil", 256, 256, &grain, false);
    let material = doc.material(json!({ "name": "soil", "pbrMetallicRoughness": {
        "baseColorTexture": { "index": grain }, "metallicFactor": 0.0, "roughnessFactor": 1.0 } }));
    let soil = terrain(extent, cells, height).tiled(0.5, 0.5).coloured(|p| {
        let track = (1.0 - ((p.x - path(p.z)).abs() - 0.7).max(0.0) / 0.9).clamp(0.0, 1.0);
        let moss = mix([0.055, 0.075, 0.018], [0.10, 0.13, 0.03], fractal_noise(62, p.x * 0.4, p.z * 0.4));
        mix(moss, [0.26, 0.19, 0.12], track)
    });
    let mesh = doc.mesh("ground", &[(&soil, material)]);
    doc.root(Node::mesh(mesh).called("ground"));
}

/// Tufts of grass beside the path and stones.
fn undergrowth(doc: &mut Document, seed: u64, half: f32, height: impl Fn(f32, f32) -> f32) {
    let blades = paint(128, 128, |u, v| {
        let blade = (u * 9.0 + (1.0 - v) * (1.0 - v) * 0.8).fract();
        let tall = 0.45 + 0.55 * super::random::value_noise(7, (u * 9.0).floor(), 0.0);
        let top = (1.0 - v) / tall;
        let inside = top < 1.0 && (blade - 0.5).abs() < 0.34 * (1.0 - top);
        let [r, g, b] = mix([0.18, 0.30, 0.08], [0.58, 0.66, 0.25], 1.0 - v).map(byte);
        [r, g, b, if inside { 255 } else { 0 }]
    });
    let texture = doc.texture("grass", 128, 128, &blades, false);
    let material = masked(doc, "grass", texture);
    let mut tuft = Geometry::default();
    for i in 0..3 {
        let turn = Quat::from_rotation_y(i as f32 * PI / 3.0);
        let corner = |x: f32, y: f32| turn * Vec3::new(x * 0.4, y * 0.5, 0.0);
        tuft.quad_with_normals(
            [corner(-1.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
            [Vec3::Y; 4],
        );
    }
    let tuft = doc.mesh("tuft", &[(&tuft, material)]);
    let stone_material = doc.plain_material("stone", [0.22, 0.21, 0.20], 0.0, 0.9);
    let mut stone = Geometry::default();
    stone.append(&sphere(1.0, 10, 6), Affine3A::from_scale(Vec3::new(1.0, 0.6, 0.8)));
    let stone = doc.mesh("stone", &[(&stone, stone_material)]);

    let mut random = Random::new(seed ^ 71);
    let parent = doc.root(Node::named("undergrowth"));
    // As dense as the path is long: the camera stands on it
    let count = ((half * 60.0) as u32).clamp(200, 4000);
    for i in 0..count {
        let z = half + 6.0 - (2.0 * half + 6.0) * random.unit() * random.unit();
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let x = path(z) + side * (1.15 + 5.0 * random.unit() * random.unit());
        let at = Vec3::new(x, height(x, z) - 0.03, z);
        let turn = Quat::from_rotation_y(random.range(0.0, TAU));
        let node = if random.below(25) == 0 {
            Node::mesh(stone).scaled(Vec3::splat(random.range(0.08, 0.35)))
        } else {
            Node::mesh(tuft).scaled(Vec3::splat(random.range(0.5, 1.1)))
        };
        doc.child(parent, node.at(at).turned(turn));
    }
}
