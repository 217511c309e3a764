//! Decoding Draco data takes no more memory than its header says it may, whatever the data.
//!
//! The bound is a contract: importers charge it before they decode. It is held here by counting what is allocated, for
//! meshes of both methods, with many attributes, seams at every edge and values that compress to nothing, and for the
//! same data damaged. Everything is one test, so that nothing else allocates meanwhile.

mod counting;

use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::{GeometryAttributeType, PointAttribute};
use draco_core::{EncoderBuffer, EncoderOptions, Mesh, MeshEncoder};
use orthant_scene::codec::draco::{DecodeLimits, DracoFault, Header, decode};

/// What is not in proportion to anything: tables of the entropy coder, messages.
const CONSTANT: u64 = 256 << 10;

struct Case {
    /// 0: sequential, 1: edgebreaker.
    method: i32,
    /// 0: valence traversal, 5: standard.
    speed: i32,
    attributes: usize,
    components: u8,
    /// All values equal, which compresses to nothing.
    is_constant: bool,
    /// No vertex is shared, so that every edge is a seam.
    has_seams: bool,
}

/// A bumpy grid of so many squares a side.
const SIDE: usize = 60;

fn encoded(case: &Case) -> Vec<u8> {
    let mut positions = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    let mut vertex = |x: usize, y: usize| {
        positions.extend([x as f32, y as f32, ((x * 7 + y * 13) % 11) as f32].map(f32::to_le_bytes).as_flattened());
        positions.len() as u32 / 12 - 1
    };
    if case.has_seams {
        for (x, y) in (0..SIDE).flat_map(|x| (0..SIDE).map(move |y| (x, y))) {
            triangles.push([vertex(x, y), vertex(x + 1, y), vertex(x, y + 1)]);
            triangles.push([vertex(x, y + 1), vertex(x + 1, y), vertex(x + 1, y + 1)]);
        }
    } else {
        let index = |x: usize, y: usize| (x * (SIDE + 1) + y) as u32;
        for (x, y) in (0..=SIDE).flat_map(|x| (0..=SIDE).map(move |y| (x, y))) {
            vertex(x, y);
        }
        for (x, y) in (0..SIDE).flat_map(|x| (0..SIDE).map(move |y| (x, y))) {
            triangles.push([index(x, y), index(x + 1, y), index(x, y + 1)]);
            triangles.push([index(x, y + 1), index(x + 1, y), index(x + 1, y + 1)]);
        }
    }
    let vertices = positions.len() / 12;
    let value = |i: usize| if case.is_constant { 3 } else { (i.wrapping_mul(2_654_435_761) >> 7) as u8 };
    let values: Vec<u8> = (0..vertices * usize::from(case.components)).map(value).collect();

    let mut mesh = Mesh::new();
    mesh.set_num_points(vertices);
    mesh.set_num_faces(triangles.len());
    triangles.iter().enumerate().for_each(|(i, t)| mesh.set_face_from_indices(i, *t));
    let mut add = |kind, components, data_type, bytes: &[u8]| {
        let mut attribute = PointAttribute::new();
        attribute.init(kind, components, data_type, false, vertices);
        attribute.buffer_mut().write(0, bytes);
        mesh.add_attribute(attribute);
    };
    add(GeometryAttributeType::Position, 3, DataType::Float32, &positions);
    for _ in 0..case.attributes {
        add(GeometryAttributeType::Generic, case.components, DataType::Uint8, &values);
    }
    if case.has_seams {
        mesh.deduplicate_attribute_values().unwrap();
    }

    let mut options = EncoderOptions::new();
    options.set_encoding_method(case.method);
    options.set_global_int("encoding_speed", case.speed);
    options.set_global_int("decoding_speed", case.speed);
    options.set_attribute_quantization(0, 11);
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    let mut out = EncoderBuffer::new();
    encoder.encode(&options, &mut out).unwrap();
    out.data().to_vec()
}

/// The height of memory while it is decoded, above what was taken before.
fn peak_of(bytes: &[u8], limits: &DecodeLimits) -> (u64, Result<u64, DracoFault>) {
    let (peak, result) = counting::peak_of(|| decode(bytes, limits));
    (peak, result.map(|m| m.attributes.iter().map(|a| a.data.len() as u64).sum()).map_err(|e| e.fault))
}

#[test]
fn decoding_takes_no_more_memory_than_the_header_says() {
    let mut tightest: f64 = 0.0;
    let mut random = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random as usize
    };
    for (method, speed) in [(0, 5), (1, 0), (1, 5)] {
        for (attributes, components) in [(0, 1), (1, 1), (1, 64), (8, 1), (8, 4), (60, 1)] {
            for (is_constant, has_seams) in [(true, false), (false, false), (false, true)] {
                if has_seams && components > 16 {
                    continue; // The encoder cannot find equal values that are so long.
                }
                let case = Case { method, speed, attributes, components, is_constant, has_seams };
                let data = encoded(&case);
                let header = Header::read(&data).unwrap();
                let (peak, values) = peak_of(&data, &DecodeLimits::new(u64::MAX));
                let values = values.unwrap();
                let bound = header.peak_bytes(values);
                let what = format!("{method} {speed} {attributes} {components} {is_constant} {has_seams}");
                assert!(peak <= bound + CONSTANT, "{what}: {peak} bytes taken, {bound} said");
                tightest = tightest.max(peak as f64 / bound as f64);

                // The bound as the limit suffices, and damaged data keeps to it.
                let limits = DecodeLimits { max_value_bytes: values, ..DecodeLimits::new(bound) };
                assert_eq!(peak_of(&data, &limits).1, Ok(values), "{what}");
                for _ in 0..20 {
                    let mut damaged = data.clone();
                    for _ in 0..=next() % 4 {
                        // Half of the damage is where the counts and attributes are declared.
                        let reach = if next() % 2 == 0 { 80 } else { data.len() };
                        let i = 11 + next() % (reach - 11);
                        damaged[i] = next() as u8;
                    }
                    let limit = DecodeLimits::new(bound);
                    let (peak, _) = peak_of(&damaged, &limit);
                    assert!(peak <= bound + CONSTANT, "{what}, damaged: {peak} bytes taken, {bound} allowed");
                }
            }
        }
    }
    println!("at most {:.0} % of the bound is taken", 100.0 * tightest);
    assert!(tightest > 0.3, "the bound is looser than it needs to be: {tightest}");
}
