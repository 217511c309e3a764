//! Geometry that comes and goes: what is resident is what is in use, and holes do not grow.

#[allow(dead_code, reason = "shared by test binaries that need different parts of it")]
mod common;

use common::Document;
use orthant_render::geometry::store::{GeometryWrites, Piece};
use orthant_render::geometry::{GeometryStore, GeometryStreams};
use orthant_resident::batch::RowWrites;
use orthant_resident::rows::{EmitterTriangle, MeshDesc, NONE, VertexRow};
use orthant_resident::sampling::hash_mix;
use serde_json::json;

/// Random numbers that are the same every time.
struct Random(u32);

impl Random {
    fn below(&mut self, n: u32) -> u32 {
        self.0 += 1;
        hash_mix(self.0) % n
    }
}

/// The streams as a backend has them. It refuses what a backend refuses: new rows that nothing covers.
#[derive(Default)]
struct Resident {
    positions: Vec<[f32; 3]>,
    vertices: Vec<VertexRow>,
    indices: Vec<u32>,
    tangents: Vec<u32>,
    emitter_triangles: Vec<EmitterTriangle>,
}

fn apply<T: bytemuck::Pod>(writes: RowWrites<T>, rows: &mut Vec<T>) {
    let mut covered = rows.len() as u32;
    let mut end = 0;
    for range in &writes.ranges {
        assert!(range.first >= end, "ranges ascend");
        end = range.first + range.rows.len() as u32;
        assert!(end <= writes.len && range.first <= covered, "row {covered} is new, but not written");
        covered = covered.max(end);
    }
    assert!(covered >= writes.len, "row {covered} is new, but not written");
    writes.apply_to(rows);
}

impl Resident {
    fn apply(&mut self, writes: GeometryWrites) {
        apply(writes.positions, &mut self.positions);
        apply(writes.vertices, &mut self.vertices);
        apply(writes.indices, &mut self.indices);
        apply(writes.tangents, &mut self.tangents);
        apply(writes.emitter_triangles, &mut self.emitter_triangles);
    }

    fn has(&self, desc: &MeshDesc, piece: &Piece<'_>) {
        let range = |first: u32, count: usize| if count == 0 { 0..0 } else { first as usize..first as usize + count };
        let vertices = range(desc.first_vertex, piece.positions.len());
        assert!(self.positions[vertices.clone()] == *piece.positions && self.vertices[vertices] == *piece.vertices);
        assert!(self.indices[range(desc.first_index, piece.indices.len())] == *piece.indices);
        assert!(self.tangents[range(desc.first_tangent, piece.tangents.len())] == *piece.tangents);
        let triangles = range(desc.first_emitter_triangle, piece.emitter_triangles.len());
        assert!(self.emitter_triangles[triangles] == *piece.emitter_triangles);
    }
}

/// A file with meshes of so many triangles; every third one shines, every second one has a normal map.
fn file(triangles: &[u32]) -> GeometryStreams {
    let mut document = Document::new(json!({
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "images": [{ "uri": "data:image/png;base64,iVBORw==" }],
        "textures": [{ "source": 0 }],
        "materials": [{ "emissiveFactor": [1, 1, 1] }, { "normalTexture": { "index": 0 } }, {}],
        "scenes": [{ "nodes": (0..triangles.len()).collect::<Vec<_>>() }],
        "nodes": (0..triangles.len()).map(|mesh| json!({ "mesh": mesh })).collect::<Vec<_>>(),
    }));
    let mut meshes = Vec::new();
    for (i, &n) in triangles.iter().enumerate() {
        let points: Vec<[f32; 3]> = (0..3 * n).map(|v| [v as f32, (v * v % 17) as f32, i as f32]).collect();
        let position = document.floats("VEC3", &points);
        let uv = document.floats("VEC2", &points.iter().map(|p| [p[0], p[1]]).collect::<Vec<_>>());
        let material = if i % 3 == 0 { 0 } else { 1 + i % 2 };
        meshes.push(json!({ "primitives": [
            { "attributes": { "POSITION": position, "TEXCOORD_0": uv }, "material": material }
        ] }));
    }
    document.json["meshes"] = json!(meshes);
    let (_, mut derived) = document.derive();
    let batch = derived.load_batch();
    fn whole<T>(writes: RowWrites<T>) -> Vec<T> {
        writes.ranges.into_iter().next().map_or_else(Vec::new, |range| range.rows)
    }
    GeometryStreams {
        positions: whole(batch.positions),
        vertices: whole(batch.vertices),
        indices: whole(batch.indices),
        tangents: whole(batch.tangents),
        mesh_descs: derived.mesh_descs,
        emitter_triangles: whole(batch.emitter_triangles),
    }
}

fn insert(store: &mut GeometryStore, streams: &GeometryStreams) -> Vec<MeshDesc> {
    let place = |desc: &MeshDesc| store.insert(&Piece::of(streams, desc)).expect("it fits");
    streams.mesh_descs.iter().map(place).collect()
}

#[test]
fn a_file_that_is_inserted_has_the_ranges_of_one_that_is_derived() {
    let streams = file(&[4, 1, 7, 2]);
    assert!(streams.mesh_descs.iter().any(|d| d.first_tangent != NONE));
    assert!(streams.mesh_descs.iter().any(|d| d.first_emitter_triangle != NONE));
    let mut store = GeometryStore::default();
    assert_eq!(insert(&mut store, &streams), streams.mesh_descs);
    let mut resident = Resident::default();
    resident.apply(store.take_writes());
    assert!(resident.positions == streams.positions && resident.tangents == streams.tangents);
    assert_eq!(store.take_writes().bytes(), 0, "what is resident is not written again");
    let mut derived = GeometryStore::of(&streams.mesh_descs);
    assert_eq!(derived.take_writes().bytes(), 0);
    assert!(derived.occupancy().into_iter().eq(store.occupancy()));
}

#[test]
fn removing_a_mesh_moves_no_other_and_its_place_is_used_again() {
    let streams = file(&[4, 6, 5]);
    let mut store = GeometryStore::default();
    let descs = insert(&mut store, &streams);
    let mut resident = Resident::default();
    resident.apply(store.take_writes());
    store.remove(&descs[1]);
    let writes = store.take_writes();
    assert_eq!(writes.bytes(), 0);
    resident.apply(writes);
    for i in [0, 2] {
        resident.has(&descs[i], &Piece::of(&streams, &descs[i]));
    }
    let other = file(&[5]);
    let placed = insert(&mut store, &other)[0];
    assert_eq!(placed.first_vertex, descs[1].first_vertex);
    let writes = store.take_writes();
    assert_eq!(writes.positions.bytes(), 15 * 12, "only the new mesh is written");
    resident.apply(writes);
    resident.has(&placed, &Piece::of(&other, &other.mesh_descs[0]));
}

#[test]
fn geometry_that_goes_before_it_was_written_is_not_written() {
    let (first, second) = (file(&[10]), file(&[3]));
    let mut store = GeometryStore::default();
    let gone = insert(&mut store, &first);
    let stays = insert(&mut store, &second);
    store.remove(&gone[0]);
    let mut resident = Resident::default();
    resident.apply(store.take_writes());
    resident.has(&stays[0], &Piece::of(&second, &second.mesh_descs[0]));
    assert!(resident.positions[..30].iter().all(|p| *p == [0.0; 3]));
}

#[test]
fn an_area_table_comes_and_goes_with_emission() {
    let streams = file(&[2, 2]);
    let mut store = GeometryStore::default();
    let mut descs = insert(&mut store, &streams);
    assert_eq!(descs[1].first_emitter_triangle, NONE);
    let rows = [0.5, 1.0].map(|cumulative| EmitterTriangle { cumulative });
    store.set_emitter_triangles(&mut descs[1], &rows).expect("it fits");
    let mut resident = Resident::default();
    resident.apply(store.take_writes());
    let first = descs[1].first_emitter_triangle as usize;
    assert_eq!(resident.emitter_triangles[first..first + 2], rows);
    store.set_emitter_triangles(&mut descs[0], &[]).expect("it fits");
    assert_eq!(descs[0].first_emitter_triangle, NONE);
    descs.iter().for_each(|desc| store.remove(desc));
    assert!(store.occupancy().iter().all(|spans| spans.used() == 0 && spans.end() == 0));
}

#[test]
fn files_that_are_loaded_merged_and_dropped_leave_no_holes_that_grow() {
    let mut random = Random(1);
    // Twenty files, from one triangle to a few thousand.
    let files: Vec<GeometryStreams> = (0..20)
        .map(|i| {
            let largest = if i % 5 == 0 { 800 } else { 30 };
            let meshes: Vec<u32> = (0..1 + random.below(12)).map(|_| 1 + random.below(largest)).collect();
            file(&meshes)
        })
        .collect();
    let mut store = GeometryStore::default();
    let mut resident = Resident::default();
    let mut live: Vec<(usize, Vec<MeshDesc>)> = Vec::new();
    let (mut peak, mut highest) = ([0u32; 4], [0u32; 4]);
    for step in 0..4000 {
        let wanted = if step / 500 % 2 == 0 { 40 } else { 8 };
        if live.is_empty() || (live.len() < wanted && random.below(3) > 0) {
            let which = random.below(files.len() as u32) as usize;
            live.push((which, insert(&mut store, &files[which])));
        } else {
            let (_, descs) = live.swap_remove(random.below(live.len() as u32) as usize);
            descs.iter().for_each(|desc| store.remove(desc));
        }
        for (i, spans) in store.occupancy().into_iter().enumerate() {
            (peak[i], highest[i]) = (peak[i].max(spans.used()), highest[i].max(spans.end()));
        }
        // Several changes are one batch.
        if random.below(3) == 0 {
            resident.apply(store.take_writes());
        }
        if step % 200 == 0 {
            resident.apply(store.take_writes());
            for (which, descs) in &live {
                for (desc, source) in descs.iter().zip(&files[*which].mesh_descs) {
                    resident.has(desc, &Piece::of(&files[*which], source));
                }
            }
        }
    }
    println!("rows at most in use {peak:?}, streams at most {highest:?}");
    for (peak, highest) in peak.iter().zip(&highest) {
        assert!(f64::from(*highest) <= 1.3 * f64::from(*peak), "{highest} rows for {peak} in use");
    }
    for (_, descs) in live {
        descs.iter().for_each(|desc| store.remove(desc));
    }
    resident.apply(store.take_writes());
    assert!(resident.positions.is_empty() && resident.indices.is_empty(), "nothing stays");
}
