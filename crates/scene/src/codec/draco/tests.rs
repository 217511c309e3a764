use super::fixtures::{self, bytes};
use super::*;
use std::time::{Duration, Instant};

const GENEROUS: u64 = 64 << 20;

fn decoded(hex: &str) -> DracoMesh {
    decode(&bytes(hex), &DecodeLimits::new(GENEROUS)).unwrap()
}

fn floats<const N: usize>(mesh: &DracoMesh, kind: AttributeKind) -> Vec<[f32; N]> {
    let attribute = mesh.attributes.iter().find(|a| a.kind == kind).unwrap();
    assert_eq!((attribute.component, usize::from(attribute.components)), (Component::F32, N));
    let floats: Vec<f32> = attribute.data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
    floats.as_chunks::<N>().0.to_vec()
}

/// The corner of the box that each vertex is.
fn corners(mesh: &DracoMesh) -> Vec<u8> {
    let generic = mesh.attribute(7).unwrap();
    assert_eq!((generic.kind, generic.component, generic.components), (AttributeKind::Generic, Component::U8, 4));
    generic.data.as_chunks::<4>().0.iter().map(|v| v[0]).collect()
}

fn close<const N: usize>(a: [f32; N], b: [f32; N], tolerance: f32) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn every_coding_of_the_box_gives_the_box() {
    for hex in fixtures::ALL {
        let mesh = decoded(hex);
        assert_eq!((mesh.vertex_count, mesh.indices.len(), mesh.attributes.len()), (8, 36, 4));
        let corners = corners(&mesh);
        let (positions, normals) =
            (floats::<3>(&mesh, AttributeKind::Position), floats::<3>(&mesh, AttributeKind::Normal));
        let uvs = floats::<2>(&mesh, AttributeKind::TexCoord);
        for (v, &i) in corners.iter().enumerate() {
            let bit = |n: u8| f32::from(i >> n & 1);
            // Half a step of 4 / (2^11 - 1), of 7/8 / (2^12 - 1) and of a 10-bit octahedron.
            assert!(close(positions[v], [bit(2), 2.0 * bit(1), 4.0 * bit(0)], 0.001), "{:?}", positions[v]);
            assert!(close(uvs[v], [f32::from(i) / 8.0, 1.0 - f32::from(i) / 8.0], 0.0002), "{:?}", uvs[v]);
            let towards = [bit(2) - 0.5, 2.0 * bit(1) - 1.0, 4.0 * bit(0) - 2.0].map(|c| c / 5.25_f32.sqrt());
            assert!(close(normals[v], towards, 0.003), "{:?}", normals[v]);
            assert_eq!(&mesh.attribute(7).unwrap().data[4 * v..4 * v + 4], [i, 0, 2 * i, 255]);
        }
        let mut triangles: Vec<[u8; 3]> =
            mesh.indices.as_chunks::<3>().0.iter().map(|t| from_least(t.map(|v| corners[v as usize]))).collect();
        let mut expected = fixtures::TRIANGLES.map(from_least);
        triangles.sort_unstable();
        expected.sort_unstable();
        assert_eq!(triangles, expected);
    }
}

/// The same triangle, of the same winding, with its least corner first.
fn from_least(mut triangle: [u8; 3]) -> [u8; 3] {
    let least = (0..3).min_by_key(|&k| triangle[k]).unwrap();
    triangle.rotate_left(least);
    triangle
}

#[test]
fn sequential_data_keeps_the_order_of_vertices_and_triangles() {
    let mesh = decoded(fixtures::SEQUENTIAL);
    assert_eq!(corners(&mesh), [0, 1, 2, 3, 4, 5, 6, 7]);
    let expected: Vec<u32> = fixtures::TRIANGLES.as_flattened().iter().copied().map(u32::from).collect();
    assert_eq!(mesh.indices, expected);
}

#[test]
fn metadata_changes_nothing() {
    assert_eq!(decoded(fixtures::METADATA), decoded(fixtures::EDGEBREAKER_STANDARD));
}

#[test]
fn an_offset_counts_the_metadata_that_was_skipped() {
    let (plain, with) = (bytes(fixtures::EDGEBREAKER_STANDARD), bytes(fixtures::METADATA));
    let cut = |bytes: &[u8]| decode(&bytes[..bytes.len() - 1], &DecodeLimits::new(GENEROUS)).unwrap_err();
    let (a, b) = (cut(&plain), cut(&with));
    assert_eq!(a.fault, b.fault);
    assert_eq!(b.offset - a.offset, with.len() - plain.len());
}

#[test]
fn limits_are_held_before_anything_is_decoded() {
    let data = bytes(fixtures::EDGEBREAKER_STANDARD);
    let header = Header::read(&data).unwrap();
    assert_eq!((header.triangles, header.vertices, header.seam_attributes), (12, 8, 3));
    let fault = |limits| decode(&data, &limits).unwrap_err().fault;

    let needed = header.connectivity_bytes();
    let over = DracoFault::OverBudget { needed, limit: needed - 1 };
    assert_eq!(fault(DecodeLimits::new(needed - 1)), over);

    let few = DecodeLimits { max_seam_attributes: 2, ..DecodeLimits::new(GENEROUS) };
    assert_eq!(fault(few), DracoFault::TooManyAttributes { count: 3, limit: 2 });

    // Position, normal, UV and four bytes for eight vertices.
    let values = 8 * (12 + 12 + 8 + 4);
    let exact = DecodeLimits { max_value_bytes: values, ..DecodeLimits::new(GENEROUS) };
    assert!(decode(&data, &exact).is_ok());
    let less = DecodeLimits { max_value_bytes: values - 1, ..exact };
    assert!(matches!(fault(less), DracoFault::Limit(_)));
    assert!(decode(&data, &DecodeLimits::new(header.peak_bytes(values))).is_ok());
    assert!(matches!(fault(DecodeLimits::new(header.peak_bytes(values) - 10)), DracoFault::Limit(_)));
}

#[test]
fn a_count_that_the_data_cannot_hold_is_refused_at_once() {
    // Two billion triangles, in a header that allows the memory for them.
    let mut data = b"DRACO\x02\x02\x01\x01\x00\x00\x00".to_vec();
    data.extend([0x80, 0xa8, 0xd6, 0xb9, 0x07, 0x80, 0xa8, 0xd6, 0xb9, 0x07, 0, 0x80, 0xa8, 0xd6, 0xb9, 0x07, 0, 0]);
    let start = Instant::now();
    let error = decode(&data, &DecodeLimits::new(u64::MAX)).unwrap_err();
    assert!(matches!(error.fault, DracoFault::Malformed(_)), "{error}");
    assert!(start.elapsed() < Duration::from_secs(1));
}

#[test]
fn every_truncation_is_an_error() {
    for hex in fixtures::ALL {
        let whole = bytes(hex);
        for length in 0..whole.len() {
            let error = decode(&whole[..length], &DecodeLimits::new(GENEROUS)).unwrap_err();
            assert!(error.offset <= length, "{error} of {length} bytes");
            assert_ne!(error.fault, DracoFault::Malformed(PANICKED.to_owned()));
        }
    }
}

#[test]
fn a_changed_byte_gives_an_error_or_a_consistent_mesh() {
    let (mut meshes, mut errors) = (0, 0);
    for hex in fixtures::ALL {
        let whole = bytes(hex);
        for i in 0..whole.len() {
            let flips = (0..8).map(|bit| whole[i] ^ 1 << bit);
            for value in flips.chain([0, 0x7f, 0x80, 0xff]) {
                let mut data = whole.clone();
                data[i] = value;
                let start = Instant::now();
                match decode(&data, &DecodeLimits::new(GENEROUS)) {
                    Ok(mesh) => {
                        meshes += 1;
                        assert_consistent(&mesh);
                    }
                    Err(error) => {
                        errors += 1;
                        assert_ne!(error.fault, DracoFault::Malformed(PANICKED.to_owned()), "byte {i} = {value}");
                    }
                }
                assert!(start.elapsed() < Duration::from_secs(1), "byte {i} = {value}");
            }
        }
    }
    assert!(meshes > 500 && errors > 500, "{meshes} meshes, {errors} errors");
}

fn assert_consistent(mesh: &DracoMesh) {
    assert_eq!(mesh.indices.len() % 3, 0);
    assert!(mesh.indices.iter().all(|&i| (i as usize) < mesh.vertex_count));
    for a in &mesh.attributes {
        assert_eq!(a.data.len(), mesh.vertex_count * a.component.size() * usize::from(a.components));
    }
}
