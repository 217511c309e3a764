//! A city of shared boxes: districts, blocks, buildings and their parts as nodes, in low sunlight.

use super::document::{Document, Index, Node, looking};
use super::random::{Random, fractal_noise};
use super::shapes::{Geometry, frustum, ground, standing_cuboid};
use super::sky_dome::{self, Sky};
use super::textures::{byte, opaque, paint, tiling_noise};
use glam::{Vec2, Vec3};
use serde_json::json;

/// The fewest nodes that make a city.
pub const MIN_NODES: u32 = 64;

/// Width of a block with half of the streets around it, in metres.
const BLOCK: f32 = 84.0;
/// Width of a street.
const STREET: f32 = 18.0;
/// Lots along a block's side.
const LOTS: u32 = 3;
/// Nodes of a building, on average: what the number of blocks is estimated from.
const NODES_PER_BLOCK: f32 = 50.0;
/// Heights in storeys of the facades that exist as meshes; a building takes the nearest.
const STOREYS: [u32; 6] = [2, 4, 8, 14, 24, 40];
/// Height of a storey in metres.
const STOREY: f32 = 3.6;

struct Parts {
    /// Unit boxes by style and index into [`STOREYS`]; scaled to a lot and its height.
    facades: Vec<[Index; 6]>,
    roof: Index,
    machine: Index,
    mast: Index,
    tree: Index,
    car: [Index; 3],
    pavement: Index,
}

/// Builds a city of exactly `nodes` nodes, the camera, the ground and the sky included.
///
/// # Panics
/// If `nodes` is less than [`MIN_NODES`].
pub fn city(nodes: u32, seed: u64) -> Document {
    assert!(nodes >= MIN_NODES, "the command line asks for at least that many");
    let mut doc = Document::default();
    let parts = parts(&mut doc);
    let blocks_wide = ((nodes as f32 / NODES_PER_BLOCK).sqrt().ceil() as i32).max(2);
    let extent = blocks_wide as f32 * BLOCK;

    let asphalt = paint(256, 256, |u, v| opaque([0.24 + 0.10 * tiling_noise(81, u, v, 20.0); 3]));
    let asphalt = doc.texture("asphalt", 256, 256, &asphalt, false);
    let asphalt = doc.material(json!({ "name": "asphalt", "pbrMetallicRoughness": {
        "baseColorTexture": { "index": asphalt }, "metallicFactor": 0.0, "roughnessFactor": 0.85 } }));
    // The ground goes on beyond the sky's dome, so that there is a horizon and no edge
    let dome = extent * 1.5 + 1500.0;
    let plane = dome * 2.2;
    let plane_mesh = doc.mesh("ground", &[(&ground(plane, plane).tiled(plane / 12.0, plane / 12.0), asphalt)]);
    doc.root(Node::mesh(plane_mesh).called("ground"));
    let sky = Sky {
        sun_direction: Vec3::new(-0.78, 0.40, 0.22),
        sun_colour: [1.0, 0.76, 0.50],
        sun_illuminance: 13.0,
        zenith: [0.33, 0.47, 0.72],
        horizon: [0.72, 0.74, 0.80],
        glow: [1.0, 0.82, 0.58],
        strength: 1.5,
    };
    sky_dome::add(&mut doc, &sky, Vec3::ZERO, dome);
    camera(&mut doc, extent);
    lamps(&mut doc);

    // Blocks from the centre outwards, until the nodes are used up
    let mut cells: Vec<(i32, i32)> = (0..blocks_wide * blocks_wide * 4)
        .map(|i| (i % (2 * blocks_wide) - blocks_wide, i / (2 * blocks_wide) - blocks_wide))
        .collect();
    cells.sort_by_key(|&(x, z)| ((2 * x + 1).pow(2) + (2 * z + 1).pow(2), x, z));
    let root = doc.root(Node::named("city"));
    let mut budget = Budget { limit: nodes as usize };
    let mut districts = std::collections::BTreeMap::new();
    for (x, z) in cells {
        if budget.left(&doc) < 3 {
            break;
        }
        let district = *districts
            .entry((x.div_euclid(8), z.div_euclid(8)))
            .or_insert_with(|| doc.child(root, Node::named("district")));
        let centre = Vec3::new((x as f32 + 0.5) * BLOCK, 0.0, (z as f32 + 0.5) * BLOCK);
        let block = doc.child(district, Node::named("block").at(centre));
        fill_block(&mut doc, &mut budget, block, centre, extent, &parts, seed, (x, z));
    }
    // What is left over when the plan of the city is full: empty groups, so that the count is what was asked for
    while budget.left(&doc) > 0 {
        doc.child(root, Node::named("reserve"));
    }
    doc
}

/// Keeps the number of nodes exact.
struct Budget {
    limit: usize,
}

impl Budget {
    fn left(&self, doc: &Document) -> usize {
        self.limit - doc.node_count()
    }

    /// Adds a node if one is left.
    fn add(&mut self, doc: &mut Document, parent: Index, node: Node) -> Option<Index> {
        (self.left(doc) > 0).then(|| doc.child(parent, node))
    }
}

fn fill_block(
    doc: &mut Document,
    budget: &mut Budget,
    block: Index,
    centre: Vec3,
    extent: f32,
    parts: &Parts,
    seed: u64,
    (x, z): (i32, i32),
) {
    let mut random =
        Random::new(seed ^ ((x as u32 as u64) << 32 | z as u32 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let width = BLOCK - STREET;
    budget.add(doc, block, Node::mesh(parts.pavement).scaled(Vec3::new(width + 4.0, 0.18, width + 4.0)));
    let park = random.below(9) == 0 && (x, z) != (0, 0);
    let downtown = (-centre.length_squared() / (0.16 * extent * extent + 40_000.0)).exp();
    let lot = width / LOTS as f32;
    for i in 0..LOTS * LOTS {
        let at = Vec3::new(((i % LOTS) as f32 - 1.0) * lot, 0.18, ((i / LOTS) as f32 - 1.0) * lot);
        if park || (i == 4 && random.below(3) > 0) {
            for _ in 0..3 {
                let spot = at + Vec3::new(random.range(-0.4, 0.4), 0.0, random.range(-0.4, 0.4)) * lot;
                let size = random.range(0.7, 1.3);
                budget.add(doc, block, Node::mesh(parts.tree).at(spot).scaled(Vec3::splat(size)));
            }
            continue;
        }
        let Some(building) = budget.add(doc, block, Node::named("building").at(at)) else { return };
        let rough = fractal_noise(seed ^ 5, (centre.x + at.x) * 0.006, (centre.z + at.z) * 0.006);
        let storeys = 3.0
            + 9.0 * rough * random.range(0.5, 1.3)
            + 52.0 * downtown * downtown * random.unit().powi(2) * rough * 1.6;
        raise(doc, budget, building, parts, storeys.round(), lot, &mut random);
    }
    // Cars in the streets on two sides
    for _ in 0..5 {
        let along = random.range(-0.5, 0.5) * BLOCK;
        let lane = BLOCK * 0.5 + if random.below(2) == 0 { -3.2 } else { 3.2 };
        let mesh = parts.car[random.below(3)];
        let node = if random.below(2) == 0 {
            Node::mesh(mesh).at(Vec3::new(lane, 0.0, along))
        } else {
            Node::mesh(mesh)
                .at(Vec3::new(along, 0.0, lane))
                .turned(glam::Quat::from_rotation_y(std::f32::consts::FRAC_PI_2))
        };
        budget.add(doc, block, node);
    }
}

/// A building: one to three setbacks, a roof with machines, a mast on the tallest.
fn raise(
    doc: &mut Document,
    budget: &mut Budget,
    building: Index,
    parts: &Parts,
    storeys: f32,
    lot: f32,
    random: &mut Random,
) {
    let style = &parts.facades[random.below(parts.facades.len())];
    let tiers = if storeys > 18.0 {
        3
    } else if storeys > 9.0 {
        2
    } else {
        1
    };
    let mut footprint = Vec2::new(random.range(0.78, 0.96), random.range(0.78, 0.96)) * lot;
    let mut base = 0.0;
    let mut left = storeys;
    for tier in 0..tiers {
        let height = if tier + 1 == tiers { left } else { (left * random.range(0.4, 0.65)).round() }.max(1.0);
        left -= height;
        let nearest = (0..STOREYS.len())
            .min_by(|&a, &b| (STOREYS[a] as f32 - height).abs().total_cmp(&(STOREYS[b] as f32 - height).abs()))
            .unwrap_or(0);
        let metres = height * STOREY;
        let body = Node::mesh(style[nearest]).at(Vec3::Y * base).scaled(Vec3::new(footprint.x, metres, footprint.y));
        budget.add(doc, building, body);
        base += metres;
        let roof =
            Node::mesh(parts.roof).at(Vec3::Y * base).scaled(Vec3::new(footprint.x + 0.5, 0.6, footprint.y + 0.5));
        budget.add(doc, building, roof);
        if tier + 1 < tiers {
            footprint *= random.range(0.68, 0.86);
        }
    }
    for _ in 0..random.below(3) {
        let spot =
            Vec3::new(random.range(-0.32, 0.32) * footprint.x, base + 0.5, random.range(-0.32, 0.32) * footprint.y);
        let size = Vec3::new(random.range(1.5, 4.0), random.range(1.2, 2.6), random.range(1.5, 4.0));
        budget.add(doc, building, Node::mesh(parts.machine).at(spot).scaled(size));
    }
    if storeys > 30.0 {
        budget.add(doc, building, Node::mesh(parts.mast).at(Vec3::Y * base).scaled(Vec3::new(1.0, storeys * 0.4, 1.0)));
    }
}

fn camera(doc: &mut Document, extent: f32) {
    let reach = extent.clamp(300.0, 1500.0);
    let eye = Vec3::new(reach * 0.26, 50.0 + reach * 0.13, reach * 0.44);
    doc.look_at("camera", eye, Vec3::new(-reach * 0.02, 30.0 + reach * 0.035, 0.0), 42.0);
}

/// A few street lamps at the central crossing.
fn lamps(doc: &mut Document) {
    let parent = doc.root(Node::named("street lamps"));
    let light = doc
        .light(json!({ "name": "street lamp", "type": "spot", "color": [1.0, 0.82, 0.55], "intensity": 400.0,
        "range": 60.0, "spot": { "innerConeAngle": 0.6, "outerConeAngle": 1.1 } }));
    for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        let at = Vec3::new(x * STREET * 0.5, 8.0, z * STREET * 0.5);
        let mut node = Node::named("street lamp").at(at).turned(looking(Vec3::NEG_Y));
        node.extensions = Document::light_reference(light);
        doc.child(parent, node);
    }
}

fn parts(doc: &mut Document) -> Parts {
    // One window per texture: wall, frame and pane; the pane is smooth and dark, a few reflect like metal
    let styles: [([f32; 3], [f32; 3], f32, f32); 5] = [
        ([0.72, 0.66, 0.58], [0.10, 0.13, 0.17], 0.52, 0.58),
        ([0.62, 0.46, 0.38], [0.12, 0.14, 0.16], 0.44, 0.56),
        ([0.56, 0.58, 0.60], [0.16, 0.22, 0.28], 0.80, 0.66),
        ([0.30, 0.36, 0.42], [0.20, 0.30, 0.38], 0.92, 0.86),
        ([0.82, 0.80, 0.76], [0.14, 0.16, 0.20], 0.62, 0.50),
    ];
    let facades = styles.iter().enumerate().map(|(i, &(wall, pane, wide, tall))| {
        let is_pane = move |u: f32, v: f32| (u - 0.5).abs() < wide * 0.5 && (v - 0.48).abs() < tall * 0.5;
        let colour = paint(64, 64, |u, v| {
            let grain = 0.92 + 0.08 * tiling_noise(91 + i as u64, u, v, 6.0);
            let sill = (v - 0.48 - tall * 0.5 - 0.03).abs() < 0.03 && (u - 0.5).abs() < wide * 0.5 + 0.04;
            opaque(if is_pane(u, v) {
                pane
            } else if sill {
                wall.map(|c| c * 0.7)
            } else {
                wall.map(|c| c * grain)
            })
        });
        let colour = doc.texture("facade", 64, 64, &colour, false);
        let surface = paint(64, 64, |u, v| {
            let (rough, metal) = if is_pane(u, v) { (0.08, 0.55) } else { (0.85, 0.0) };
            [255, byte(rough), byte(metal), 255]
        });
        let surface = doc.texture("facade surface", 64, 64, &surface, false);
        let material = doc.material(json!({ "name": "facade", "pbrMetallicRoughness": {
            "baseColorTexture": { "index": colour }, "metallicRoughnessTexture": { "index": surface } } }));
        STOREYS.map(|storeys| doc.mesh("facade", &[(&facade(storeys), material)]))
    });
    let facades = facades.collect();

    let unit = standing_cuboid([1.0; 3]);
    let roofing = doc.plain_material("roofing", [0.30, 0.28, 0.26], 0.0, 0.9);
    let metal = doc.plain_material("machine", [0.55, 0.56, 0.58], 0.6, 0.5);
    let paving = doc.plain_material("paving", [0.34, 0.33, 0.31], 0.0, 0.9);
    let roof = doc.mesh("roof", &[(&unit, roofing)]);
    let machine = doc.recoloured_mesh("machine", roof, metal);
    let pavement = doc.recoloured_mesh("pavement", roof, paving);
    let mast = doc.mesh("mast", &[(&frustum(0.6, 0.1, 1.0, 8), metal)]);

    let bark = doc.plain_material("trunk", [0.12, 0.08, 0.05], 0.0, 0.9);
    let leaf = doc.plain_material("crown", [0.07, 0.15, 0.03], 0.0, 0.8);
    let mut crown = Geometry::default();
    for (at, radius) in
        [(Vec3::new(0.0, 5.2, 0.0), 2.2), (Vec3::new(0.9, 4.3, 0.6), 1.7), (Vec3::new(-0.8, 4.2, -0.7), 1.8)]
    {
        crown.append(&super::shapes::sphere(radius, 10, 6), glam::Affine3A::from_translation(at));
    }
    let tree = doc.mesh("tree", &[(&frustum(0.25, 0.15, 3.5, 6), bark), (&crown, leaf)]);

    let glass = doc.plain_material("car glass", [0.03, 0.04, 0.05], 0.0, 0.05);
    let mut body = standing_cuboid([1.9, 0.75, 4.4]);
    for p in &mut body.positions {
        p[1] += 0.3;
    }
    let mut cabin = frustum(1.2, 0.95, 0.6, 4);
    for p in &mut cabin.positions {
        *p = [p[0] * 0.9, p[1] + 1.05, p[2] * 1.35];
    }
    let colours = [("red", [0.50, 0.03, 0.03]), ("white", [0.75, 0.75, 0.74]), ("blue", [0.04, 0.10, 0.35])];
    let car = colours.map(|(name, rgb)| {
        let paint = doc.plain_material(&format!("{name} car paint"), rgb, 0.0, 0.2);
        doc.mesh("car", &[(&body, paint), (&cabin, glass)])
    });
    Parts { facades, roof, machine, mast, tree, car, pavement }
}

/// The four walls of a unit box that stands on y = 0, with one window per storey and bay; bays are about as wide as
/// storeys are high on a usual lot.
fn facade(storeys: u32) -> Geometry {
    let bays = 5.0;
    let mut g = Geometry::default();
    for (right, front) in
        [(Vec3::X, Vec3::Z), (Vec3::NEG_X, Vec3::NEG_Z), (Vec3::NEG_Z, Vec3::X), (Vec3::Z, Vec3::NEG_X)]
    {
        let (r, f) = (right * 0.5, front * 0.5);
        g.quad([f - r, f + r, f + r + Vec3::Y, f - r + Vec3::Y]);
    }
    g.tiled(bays, storeys as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_city_has_exactly_the_nodes_that_were_asked_for() {
        for nodes in [64, 65, 100, 1000, 12_345] {
            assert_eq!(city(nodes, 0).node_count(), nodes as usize);
        }
    }
}
