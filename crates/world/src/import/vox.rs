//! MagicaVoxel: the RIFF-like chunks of version 150 and 200, the scene graph, palette and materials.
//!
//! Follows the format's two published descriptions, `MagicaVoxel-file-format-vox.txt` and its extension. MagicaVoxel has z up:
//! its (x, y, z) is (x, z, -y) here. Of animations the first frame is taken. Hidden nodes and layers are left out.

use super::grid::{Budget, Grid};
use super::{Fault, ImportFault, Imported, content};
use crate::block::Block;
use crate::palette::{Material, Transparency};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Levels of the scene graph.
const MOST_LEVELS: usize = 256;
/// Instances of nodes; groups may be shared, and shared groups of shared groups are many.
const MOST_INSTANCES: usize = 1 << 20;
/// Voxels of all instances.
const MOST_VOXELS: u64 = 1 << 30;

/// A part of the file, with its place.
#[derive(Clone)]
struct Cursor<'a> {
    bytes: &'a [u8],
    at: u64,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], Fault> {
        let Some((taken, rest)) = self.bytes.split_at_checked(count) else {
            return Err((Some(self.at), ImportFault::Truncated(what)));
        };
        self.bytes = rest;
        self.at += count as u64;
        Ok(taken)
    }

    fn u32(&mut self, what: &'static str) -> Result<u32, Fault> {
        let bytes = self.take(4, what)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    fn part(&mut self, count: usize, what: &'static str) -> Result<Self, Fault> {
        let at = self.at;
        Ok(Self { bytes: self.take(count, what)?, at })
    }

    fn string(&mut self) -> Result<String, Fault> {
        let length = self.u32("a string")? as usize;
        Ok(String::from_utf8_lossy(self.take(length, "a string")?).into_owned())
    }

    fn dict(&mut self) -> Result<HashMap<String, String>, Fault> {
        let count = self.u32("a dictionary")?;
        let mut dict = HashMap::new();
        for _ in 0..count {
            let key = self.string()?;
            dict.insert(key, self.string()?);
        }
        Ok(dict)
    }
}

/// A model: its size, and x, y, z and colour of each voxel.
struct Model<'a> {
    size: [u32; 3],
    voxels: &'a [u8],
}

enum Node {
    Transform { child: u32, layer: u32, hidden: bool, transform: Transform },
    Group { children: Vec<u32> },
    Shape { model: u32 },
}

/// A rotation by signed axes, then a translation, in MagicaVoxel's axes.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Transform {
    /// Row by row: the axis that the entry is in, and its sign.
    rows: [(usize, i64); 3],
    translation: [i64; 3],
}

impl Transform {
    const IDENTITY: Self = Self { rows: [(0, 1), (1, 1), (2, 1)], translation: [0; 3] };

    /// The frame's rotation (`_r`: two bits for the axis of the first and of the second row, then three signs) and
    /// translation (`_t`).
    fn of_frame(frame: &HashMap<String, String>, at: u64) -> Result<Self, Fault> {
        let mut transform = Self::IDENTITY;
        if let Some(rotation) = frame.get("_r") {
            let bits: u8 = rotation.parse().or_else(|_| content(at, format!("{rotation:?} is no rotation")))?;
            let (first, second) = (usize::from(bits & 3), usize::from(bits >> 2 & 3));
            if first > 2 || second > 2 || first == second {
                return content(at, format!("{bits} is no rotation"));
            }
            let sign = |bit: u8| if bits >> bit & 1 == 1 { -1 } else { 1 };
            transform.rows = [(first, sign(4)), (second, sign(5)), (3 - first - second, sign(6))];
        }
        if let Some(translation) = frame.get("_t") {
            let parts: Result<Vec<i32>, _> = translation.split_ascii_whitespace().map(str::parse).collect();
            match parts.as_deref() {
                Ok(&[x, y, z]) => transform.translation = [x, y, z].map(i64::from),
                _ => return content(at, format!("{translation:?} is no translation")),
            }
        }
        Ok(transform)
    }

    fn rotated(&self, at: [i64; 3]) -> [i64; 3] {
        self.rows.map(|(axis, sign)| sign * at[axis])
    }

    /// This after another. Sums of so few 32-bit numbers stay far within 64 bits.
    fn after(&self, inner: &Self) -> Self {
        let moved = self.rotated(inner.translation);
        Self {
            rows: self.rows.map(|(axis, sign)| (inner.rows[axis].0, sign * inner.rows[axis].1)),
            translation: std::array::from_fn(|a| self.translation[a] + moved[a]),
        }
    }

    /// The lower corner of the image of a voxel, given by its lower corner: the image of a unit cube is one.
    fn voxel(&self, at: [i64; 3]) -> [i64; 3] {
        let (low, high) = (self.rotated(at), self.rotated(at.map(|c| c + 1)));
        std::array::from_fn(|a| low[a].min(high[a]) + self.translation[a])
    }
}

#[derive(Default)]
struct Scene<'a> {
    models: Vec<Model<'a>>,
    nodes: HashMap<u32, Node>,
    hidden_layers: BTreeSet<u32>,
    palette: Option<&'a [u8]>,
    materials: HashMap<u32, HashMap<String, String>>,
    ignored: BTreeMap<String, usize>,
}

pub fn import(bytes: &[u8], limit: u64) -> Result<Imported, Fault> {
    let mut cursor = Cursor { bytes, at: 0 };
    if cursor.take(4, "the header").ok() != Some(b"VOX ") {
        return content(0, "this is no MagicaVoxel file; it does not begin with \"VOX \"");
    }
    cursor.u32("the version")?;
    let mut scene = Scene::default();
    scene.read(&mut cursor)?;
    let mut grid = Grid::new(Budget::new(limit));
    scene.place(&mut grid)?;
    if !scene.ignored.is_empty() {
        let kinds: Vec<String> = scene.ignored.iter().map(|(id, count)| format!("{id:?} ({count})")).collect();
        grid.warnings.push(format!("chunks of these kinds are not known, and ignored: {}", kinds.join(", ")));
    }
    grid.finish()
}

impl<'a> Scene<'a> {
    /// All chunks. Only `MAIN` has children, so one level is walked; what is nested elsewhere comes in the same order.
    fn read(&mut self, cursor: &mut Cursor<'a>) -> Result<(), Fault> {
        let mut size = None;
        while !cursor.bytes.is_empty() {
            let start = cursor.at;
            let id = cursor.take(4, "a chunk")?;
            let (length, _children) = (cursor.u32("a chunk")? as usize, cursor.u32("a chunk")?);
            let mut part = cursor.part(length, "a chunk")?;
            match id {
                b"SIZE" => {
                    let axes = [part.u32("a size")?, part.u32("a size")?, part.u32("a size")?];
                    size = Some(axes);
                }
                b"XYZI" => {
                    let count = part.u32("voxels")? as usize;
                    let voxels = part.take(count.saturating_mul(4), "voxels")?;
                    let Some(size) = size.take() else { return content(start, "a model has no size") };
                    self.models.push(Model { size, voxels });
                }
                // Some programs write fewer colours than 256; the others are the default ones.
                b"RGBA" => self.palette = Some(part.bytes),
                b"MATL" => {
                    let number = part.u32("a material")?;
                    self.materials.insert(number, part.dict()?);
                }
                b"nTRN" | b"nGRP" | b"nSHP" => {
                    let (number, node) = read_node(id, &mut part)?;
                    self.nodes.insert(number, node);
                }
                b"LAYR" => {
                    let number = part.u32("a layer")?;
                    if part.dict()?.get("_hidden").is_some_and(|hidden| hidden == "1") {
                        self.hidden_layers.insert(number);
                    }
                }
                // They say nothing about blocks: the number of models, notes, the order in which colours are shown, and how
                // MagicaVoxel renders (camera, sun, air, ...).
                b"MAIN" | b"PACK" | b"NOTE" | b"IMAP" | b"META" | b"POST" | [b'r', ..] => {}
                _ => *self.ignored.entry(String::from_utf8_lossy(id).into_owned()).or_default() += 1,
            }
        }
        Ok(())
    }

    fn material(&self, color: u8) -> Material {
        let entry = usize::from(color) - 1;
        let rgba = match self.palette.and_then(|palette| palette.get(4 * entry..4 * entry + 3)) {
            Some(rgb) => [rgb[0], rgb[1], rgb[2]],
            None => default_color(color),
        };
        // The colour is in the name, so that the materials of several files in one world rarely clash.
        let [r, g, b] = rgba;
        let mut material = Material::colored(format!("vox-{color}-{r:02x}{g:02x}{b:02x}"), Material::linear(rgba));
        let Some(properties) = self.materials.get(&u32::from(color)) else { return material };
        let number =
            |key: &str| properties.get(key).and_then(|value| value.parse::<f32>().ok()).filter(|v| v.is_finite());
        let fraction = |key: &str| number(key).map(|value| value.clamp(0.0, 1.0));
        let kind = properties.get("_type").map_or("_diffuse", String::as_str);
        // Before version 200 one weight said how much of its type a material has.
        let weight = fraction("_weight").unwrap_or(1.0);
        if kind != "_diffuse" {
            material.roughness = fraction("_rough").unwrap_or(0.1);
        }
        match kind {
            "_metal" => material.metallic = fraction("_metal").unwrap_or(weight),
            "_glass" | "_blend" | "_media" | "_cloud" => {
                // What passes one voxel is the colour, and more of it the more transparent it is.
                let passes = fraction("_trans").or_else(|| fraction("_alpha")).unwrap_or(weight).max(0.01);
                let absorption = material.color.map(|c| -(c.clamp(0.02, 0.98) * passes).ln());
                material.transparency = Some(Transparency { absorption });
            }
            "_emit" => {
                let strength =
                    fraction("_emit").unwrap_or(weight) * 10.0_f32.powf(number("_flux").unwrap_or(0.0).clamp(0.0, 4.0));
                material.emission = material.color.map(|c| c * strength);
            }
            _ => {}
        }
        material
    }

    /// Puts all visible models where the scene graph has them.
    fn place(&self, grid: &mut Grid) -> Result<(), Fault> {
        let mut used = [false; 256];
        for model in &self.models {
            model.voxels.chunks_exact(4).for_each(|voxel| used[usize::from(voxel[3])] = true);
        }
        let mut blocks = [Block::AIR; 256];
        for color in 1..=255_u8 {
            if used[usize::from(color)] {
                blocks[usize::from(color)] = grid.add_material(self.material(color))?;
            }
        }
        let mut voxels = 0;
        if self.nodes.is_empty() {
            // Files before the scene graph: models stand where they are, their lower corners at the origin.
            for model in &self.models {
                put(model, &Transform::IDENTITY, [0; 3], &blocks, &mut voxels, grid)?;
            }
            return Ok(());
        }
        let mut waiting = vec![(0_u32, Transform::IDENTITY, 0)];
        let (mut instances, mut missing) = (0, 0);
        while let Some((number, transform, level)) = waiting.pop() {
            instances += 1;
            if level > MOST_LEVELS || instances > MOST_INSTANCES {
                return content(None, "the scene graph has a cycle, or too many nodes");
            }
            match self.nodes.get(&number) {
                None => return content(None, format!("the scene graph has no node {number}")),
                Some(Node::Transform { hidden: true, .. }) => {}
                Some(Node::Transform { layer, .. }) if self.hidden_layers.contains(layer) => {}
                Some(Node::Transform { child, transform: own, .. }) => {
                    waiting.push((*child, transform.after(own), level + 1));
                }
                Some(Node::Group { children }) => {
                    waiting.extend(children.iter().rev().map(|&child| (child, transform, level + 1)));
                }
                Some(Node::Shape { model }) => {
                    let Some(model) = self.models.get(*model as usize) else {
                        missing += 1;
                        continue;
                    };
                    // Models turn about their middle, rounded down to a voxel's corner.
                    let pivot = model.size.map(|extent| i64::from(extent / 2));
                    put(model, &transform, pivot, &blocks, &mut voxels, grid)?;
                }
            }
        }
        if missing > 0 {
            grid.warnings.push(format!("{missing} shapes show models that the file does not have"));
        }
        Ok(())
    }
}

fn put(
    model: &Model,
    transform: &Transform,
    pivot: [i64; 3],
    blocks: &[Block; 256],
    voxels: &mut u64,
    grid: &mut Grid,
) -> Result<(), Fault> {
    *voxels += model.voxels.len() as u64 / 4;
    if *voxels > MOST_VOXELS {
        return content(None, format!("the scene has more than {MOST_VOXELS} voxels"));
    }
    for voxel in model.voxels.chunks_exact(4) {
        let at: [i64; 3] = std::array::from_fn(|a| i64::from(voxel[a]) - pivot[a]);
        let [x, y, z] = transform.voxel(at);
        // y points away from us there and towards us here: the voxel from y to y + 1 is the one from -y - 1 to -y.
        grid.set([x, z, -y - 1], blocks[usize::from(voxel[3])])?;
    }
    Ok(())
}

fn read_node(id: &[u8], part: &mut Cursor) -> Result<(u32, Node), Fault> {
    let number = part.u32("a node")?;
    let attributes = part.dict()?;
    let node = match id {
        b"nTRN" => {
            let (child, _reserved) = (part.u32("a node")?, part.u32("a node")?);
            let (layer, frames) = (part.u32("a node")?, part.u32("a node")?);
            let at = part.at;
            let transform = if frames == 0 { Transform::IDENTITY } else { Transform::of_frame(&part.dict()?, at)? };
            let hidden = attributes.get("_hidden").is_some_and(|hidden| hidden == "1");
            Node::Transform { child, layer, hidden, transform }
        }
        b"nGRP" => {
            let count = part.u32("a node")? as usize;
            let children = part.take(count.saturating_mul(4), "the children of a node")?;
            let child = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            Node::Group { children: children.chunks_exact(4).map(child).collect() }
        }
        _ => {
            if part.u32("a node")? == 0 {
                return content(part.at, "a shape has no model");
            }
            Node::Shape { model: part.u32("a node")? }
        }
    };
    Ok((number, node))
}

/// MagicaVoxel's colours for files without a palette: a cube of six steps, then ramps of red, green, blue and grey.
fn default_color(color: u8) -> [u8; 3] {
    const STEPS: [u8; 6] = [0xff, 0xcc, 0x99, 0x66, 0x33, 0x00];
    const RAMP: [u8; 10] = [0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11];
    let index = usize::from(color) - 1;
    if index < 215 {
        return [STEPS[index / 36], STEPS[index / 6 % 6], STEPS[index % 6]];
    }
    let ramp = RAMP[(index - 215) % 10];
    match (index - 215) / 10 {
        0 => [ramp, 0, 0],
        1 => [0, ramp, 0],
        2 => [0, 0, ramp],
        _ => [ramp; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(rotation: &str, translation: &str) -> HashMap<String, String> {
        [("_r", rotation), ("_t", translation)].map(|(key, value)| (key.to_owned(), value.to_owned())).into()
    }

    #[test]
    fn rotations_are_read_row_by_row() {
        // The example of the format's description: rows (0 1 0), (0 0 -1), (-1 0 0).
        let bits = 1 | (2 << 2) | (1 << 5) | (1 << 6);
        let transform = Transform::of_frame(&frame(&bits.to_string(), "1 2 3"), 0).unwrap();
        assert_eq!(transform.rows, [(1, 1), (2, -1), (0, -1)]);
        assert_eq!(transform.rotated([5, 6, 7]), [6, -7, -5]);
        assert_eq!(transform.voxel([5, 6, 7]), [7, -6, -3]);
        for bad in ["3", "0", "5", "300", "x"] {
            assert!(Transform::of_frame(&frame(bad, "0 0 0"), 0).is_err(), "{bad}");
        }
        assert!(Transform::of_frame(&frame("4", "0 0"), 0).is_err());
    }

    #[test]
    fn transforms_compose_as_matrices_do() {
        let outer = Transform::of_frame(&frame("20", "1 2 3"), 0).unwrap();
        let inner = Transform::of_frame(&frame("33", "-4 5 6"), 0).unwrap();
        for at in [[1, 2, 3], [-7, 0, 9]] {
            let step = |t: &Transform, at| -> [i64; 3] {
                let turned = t.rotated(at);
                std::array::from_fn(|a| turned[a] + t.translation[a])
            };
            assert_eq!(step(&outer.after(&inner), at), step(&outer, step(&inner, at)));
        }
    }

    #[test]
    fn the_default_palette_ends_in_grey() {
        assert_eq!(default_color(1), [255; 3]);
        assert_eq!(default_color(2), [255, 255, 204]);
        assert_eq!(default_color(216), [0xee, 0, 0]);
        assert_eq!(default_color(255), [0x11; 3]);
    }
}
