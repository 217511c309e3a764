//! From parsed arrays to a mesh: one primitive per material and kind of element, in one buffer.

use super::corner::{Corner, NONE};
use super::parse::{Kind, Parsed};
use super::spans::Span;
use super::triangulate::{Cut, SPARE_WORK, Triangulator};
use super::weld::Welder;
use crate::Scene;
use crate::import::Place;
use crate::import::budget::{Budget, OverBudget};
use crate::import::warning::{WarningKind, Warnings};
use crate::model::*;
use rayon::prelude::*;
use std::collections::HashMap;

/// What becomes one primitive.
struct Group {
    material: Option<usize>,
    kind: Kind,
    /// Positions in the list of spans.
    spans: Vec<usize>,
    corners: usize,
    indices: usize,
}

/// A group with its vertices.
struct Built {
    material: Option<usize>,
    kind: Kind,
    indices: Vec<u32>,
    vertices: Vec<Corner>,
    has_uvs: bool,
    has_normals: bool,
    has_colors: bool,
    /// Polygons that became fans: the first and how many.
    fans: Option<(Place, usize)>,
}

impl Built {
    fn bytes(&self) -> usize {
        let per_vertex =
            12 + 12 * usize::from(self.has_normals) + 8 * usize::from(self.has_uvs) + 12 * usize::from(self.has_colors);
        4 * self.indices.len() + per_vertex * self.vertices.len()
    }
}

/// A primitive, two views and accessors each of up to five kinds, the group itself, with room for vectors that double.
const GROUP_BYTES: u64 = 2
    * (size_of::<Primitive>() + 5 * (size_of::<Accessor>() + size_of::<BufferView>() + 64) + 2 * size_of::<Built>())
        as u64;

/// Builds the primitives in order of first use and adds their buffer to the scene. `materials` gives the material of
/// each name, and of elements without one.
pub fn primitives(
    scene: &mut Scene,
    parsed: &Parsed<'_>,
    spans: &[Span],
    material_of: impl Fn(Option<usize>) -> MaterialId,
    budget: &Budget,
    warnings: &mut Warnings,
) -> Result<Vec<Primitive>, OverBudget> {
    let groups = groups(parsed, spans);
    budget.charge(GROUP_BYTES * groups.len() as u64)?;
    let built: Vec<Result<Built, OverBudget>> =
        groups.par_iter().map(|group| build(parsed, spans, group, budget)).collect();
    let built = built.into_iter().collect::<Result<Vec<_>, _>>()?;
    for group in &built {
        if let Some((place, count)) = &group.fans {
            let what = "a polygon has no area, crosses itself or is too intricate; its triangles may overlap";
            warnings.push_many(WarningKind::Tolerated(what), *count, || place.clone());
        }
    }
    let total: usize = built.iter().map(Built::bytes).sum();
    if total == 0 {
        return Ok(Vec::new());
    }
    budget.charge(total as u64)?;
    let mut bytes = vec![0u8; total];
    let mut parts = Vec::with_capacity(built.len());
    let mut rest = &mut bytes[..];
    for group in &built {
        let (part, after) = rest.split_at_mut(group.bytes());
        parts.push((group, part));
        rest = after;
    }
    let bounds: Vec<[[f32; 3]; 2]> = parts.into_par_iter().map(|(group, part)| fill(parsed, group, part)).collect();

    let data = Blob::new(bytes);
    let buffer = scene.buffers.insert(Buffer { name: None, uri: None, data, extra: Extra::default() });
    let mut views = Views { scene, buffer, offset: 0 };
    let mut primitives = Vec::with_capacity(built.len());
    for (group, bounds) in built.into_iter().zip(bounds) {
        primitives.push(views.primitive(&group, bounds, material_of(group.material)));
    }
    let scratch = groups.iter().map(|group| scratch_bytes(parsed, group.corners, group.indices)).sum();
    budget.release(scratch);
    Ok(primitives)
}

fn groups(parsed: &Parsed<'_>, spans: &[Span]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known: HashMap<(Option<usize>, Kind), usize> = HashMap::new();
    for (number, span) in spans.iter().enumerate() {
        let elements = &parsed.pieces[span.piece].elements[span.elements.clone()];
        for run in elements.chunk_by(|a, b| a.kind() == b.kind()) {
            let kind = run[0].kind();
            let index = *known.entry((span.material, kind)).or_insert(groups.len());
            if index == groups.len() {
                groups.push(Group { material: span.material, kind, spans: Vec::new(), corners: 0, indices: 0 });
            }
            let group = &mut groups[index];
            if group.spans.last() != Some(&number) {
                group.spans.push(number);
            }
            for element in run {
                let corners = element.corners();
                group.corners += corners;
                group.indices += match kind {
                    Kind::Polygon => 3 * (corners - 2),
                    Kind::Line => 2 * (corners - 1),
                    Kind::Points => corners,
                };
            }
        }
    }
    groups
}

fn build(parsed: &Parsed<'_>, spans: &[Span], group: &Group, budget: &Budget) -> Result<Built, OverBudget> {
    budget.charge(scratch_bytes(parsed, group.corners, group.indices))?;
    let mut welder = Welder::new(parsed.positions.len(), group.corners);
    let mut triangulator = Triangulator::new(spare_work(parsed, group));
    let mut indices = Vec::with_capacity(group.indices);
    let mut polygon: Vec<u32> = Vec::new();
    let mut fans: Option<(Place, usize)> = None;
    for span in group.spans.iter().map(|&number| &spans[number]) {
        let piece = &parsed.pieces[span.piece];
        let mut start = span.corner;
        for element in &piece.elements[span.elements.clone()] {
            let corners = &piece.corners[start..start + element.corners()];
            start += corners.len();
            if element.kind() != group.kind {
                continue;
            }
            match group.kind {
                Kind::Polygon if corners.len() == 3 => {
                    indices.extend(corners.iter().map(|&corner| welder.add(corner)));
                }
                Kind::Polygon => {
                    polygon.clear();
                    polygon.extend(corners.iter().map(|&corner| welder.add(corner)));
                    let points = corners.iter().map(|corner| parsed.positions[corner.v as usize]);
                    let cut = triangulator
                        .cut(points, |triangle| indices.extend(triangle.map(|corner| polygon[corner as usize])));
                    if cut == Cut::Fan {
                        fans.get_or_insert_with(|| (element.place(), 0)).1 += 1;
                    }
                }
                Kind::Line | Kind::Points => {
                    polygon.clear();
                    // Lines and points are not shaded.
                    polygon.extend(corners.iter().map(|&corner| welder.add(Corner { n: NONE, ..corner })));
                    if group.kind == Kind::Points {
                        indices.extend_from_slice(&polygon);
                    } else {
                        indices.extend(polygon.windows(2).flatten());
                    }
                }
            }
        }
    }
    let vertices = welder.vertices;
    let has = |value: fn(&Corner) -> u32| vertices.iter().any(|corner| value(corner) != NONE);
    Ok(Built {
        material: group.material,
        kind: group.kind,
        has_uvs: has(|corner| corner.t),
        has_normals: has(|corner| corner.n),
        has_colors: !parsed.colors.is_empty() && vertices.iter().any(|c| !parsed.colors[c.v as usize][0].is_nan()),
        indices,
        vertices,
        fans,
    })
}

/// Each group's part is that of its corners, so that the result does not depend on which group is built first.
fn spare_work(parsed: &Parsed<'_>, group: &Group) -> u64 {
    let corners: usize = parsed.pieces.iter().map(|piece| piece.corners.len()).sum();
    (u128::from(SPARE_WORK) * group.corners as u128 / corners.max(1) as u128) as u64
}

/// What building a group takes: indices, vertices with their chains while these double, and the table over positions.
fn scratch_bytes(parsed: &Parsed<'_>, corners: usize, indices: usize) -> u64 {
    let table = if corners >= parsed.positions.len() / 4 { 4 * parsed.positions.len() } else { 24 * corners };
    (4 * indices + 32 * corners + table) as u64
}

/// Writes indices, then each attribute. Returns the least and greatest coordinates.
fn fill(parsed: &Parsed<'_>, group: &Built, bytes: &mut [u8]) -> [[f32; 3]; 2] {
    let mut rest = bytes;
    let mut part = |size: usize| {
        let (part, after) = std::mem::take(&mut rest).split_at_mut(size);
        rest = after;
        part
    };
    let vertices = &group.vertices;
    for (out, index) in part(4 * group.indices.len()).chunks_exact_mut(4).zip(&group.indices) {
        out.copy_from_slice(&index.to_le_bytes());
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for (out, vertex) in part(12 * vertices.len()).chunks_exact_mut(12).zip(vertices) {
        let position = parsed.positions[vertex.v as usize];
        for axis in 0..3 {
            low[axis] = low[axis].min(position[axis]);
            high[axis] = high[axis].max(position[axis]);
        }
        write(out, position);
    }
    if group.has_normals {
        for (out, vertex) in part(12 * vertices.len()).chunks_exact_mut(12).zip(vertices) {
            write(out, parsed.normals[vertex.n as usize]);
        }
    }
    if group.has_uvs {
        for (out, vertex) in part(8 * vertices.len()).chunks_exact_mut(8).zip(vertices) {
            // glTF's origin is at the top left. Corners without a texture coordinate have (0, 0) there.
            let uv = match vertex.t {
                NONE => [0.0; 2],
                t => [parsed.uvs[t as usize][0], 1.0 - parsed.uvs[t as usize][1]],
            };
            write(out, uv);
        }
    }
    if group.has_colors {
        for (out, vertex) in part(12 * vertices.len()).chunks_exact_mut(12).zip(vertices) {
            let color = parsed.colors[vertex.v as usize];
            write(out, if color[0].is_nan() { [1.0; 3] } else { color });
        }
    }
    [low, high]
}

fn write<const N: usize>(out: &mut [u8], values: [f32; N]) {
    for (out, value) in out.chunks_exact_mut(4).zip(values) {
        out.copy_from_slice(&value.to_le_bytes());
    }
}

/// Hands out the parts of the buffer in the order in which `fill` writes them.
struct Views<'s> {
    scene: &'s mut Scene,
    buffer: BufferId,
    offset: usize,
}

/// `target` of buffer views.
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

impl Views<'_> {
    fn primitive(&mut self, group: &Built, [low, high]: [[f32; 3]; 2], material: MaterialId) -> Primitive {
        let count = group.vertices.len();
        let indices = self.accessor(ElementType::Scalar, ComponentType::U32, group.indices.len(), ELEMENT_ARRAY_BUFFER);
        let mut attributes = Attributes::default();
        let mut add = |semantic: &str, accessor| attributes.0.push((semantic.to_owned(), accessor));
        let position = self.accessor(ElementType::Vec3, ComponentType::F32, count, ARRAY_BUFFER);
        if let Some(accessor) = self.scene.accessors.get_mut(position) {
            accessor.min = Some(low.map(f64::from).to_vec());
            accessor.max = Some(high.map(f64::from).to_vec());
        }
        add("POSITION", position);
        if group.has_normals {
            add("NORMAL", self.accessor(ElementType::Vec3, ComponentType::F32, count, ARRAY_BUFFER));
        }
        if group.has_uvs {
            add("TEXCOORD_0", self.accessor(ElementType::Vec2, ComponentType::F32, count, ARRAY_BUFFER));
        }
        if group.has_colors {
            add("COLOR_0", self.accessor(ElementType::Vec3, ComponentType::F32, count, ARRAY_BUFFER));
        }
        Primitive {
            attributes,
            indices: Some(indices),
            mode: match group.kind {
                Kind::Polygon => PrimitiveMode::Triangles,
                Kind::Line => PrimitiveMode::Lines,
                Kind::Points => PrimitiveMode::Points,
            },
            targets: Vec::new(),
            material: Some(material),
            variants: Vec::new(),
            extra: Extra::default(),
        }
    }

    fn accessor(
        &mut self,
        element_type: ElementType,
        component_type: ComponentType,
        count: usize,
        target: u32,
    ) -> AccessorId {
        let length = count * element_type.stored_size(component_type);
        let view = BufferView::new(self.buffer, self.offset, length, Some(target));
        let view = self.scene.buffer_views.insert(view);
        self.offset += length;
        self.scene.accessors.insert(Accessor::packed(view, component_type, element_type, count))
    }
}
