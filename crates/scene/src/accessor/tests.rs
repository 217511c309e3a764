use super::*;
use crate::model::*;

/// A scene with one buffer, one view of all of it, and one accessor of that.
struct Sample {
    scene: Scene,
    view: BufferViewId,
    buffer: BufferId,
}

impl Sample {
    fn new(bytes: Vec<u8>, stride: Option<usize>) -> Self {
        let mut scene = Scene::default();
        let length = bytes.len();
        let buffer =
            scene.buffers.insert(Buffer { name: None, uri: None, data: Blob::new(bytes), extra: Extra::default() });
        let view = scene.buffer_views.insert(view(buffer, 0, length, stride));
        Self { scene, view, buffer }
    }

    fn part(&mut self, offset: usize, length: usize) -> BufferViewId {
        self.scene.buffer_views.insert(view(self.buffer, offset, length, None))
    }

    fn accessor(&mut self, component_type: ComponentType, element_type: ElementType, count: usize) -> AccessorId {
        let view = Some(self.view);
        self.scene.accessors.insert(accessor(view, component_type, element_type, count))
    }

    fn edit(&mut self, id: AccessorId) -> &mut Accessor {
        self.scene.accessors.get_mut(id).unwrap()
    }
}

fn view(buffer: BufferId, offset: usize, length: usize, stride: Option<usize>) -> BufferView {
    BufferView { name: None, buffer, offset, length, stride, target: None, extra: Extra::default() }
}

fn accessor(
    view: Option<BufferViewId>,
    component_type: ComponentType,
    element_type: ElementType,
    count: usize,
) -> Accessor {
    Accessor {
        name: None,
        view,
        offset: 0,
        component_type,
        normalized: false,
        count,
        element_type,
        min: None,
        max: None,
        sparse: None,
        extra: Extra::default(),
    }
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

use ComponentType::*;
use ElementType::*;

#[test]
fn packed_floats_are_read_at_any_alignment() {
    for shift in 0..4 {
        let mut bytes = vec![0; shift];
        bytes.extend(floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let mut s = Sample::new(bytes, None);
        let id = s.accessor(F32, Vec3, 2);
        s.edit(id).offset = shift;
        assert_eq!(read_f32::<3>(&s.scene, id).unwrap(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
    }
}

#[test]
fn packed_aligned_floats_are_borrowed_and_others_are_not() {
    let mut s = Sample::new(floats(&[1.0, 2.0, 3.0, 4.0]), None);
    let id = s.accessor(F32, Vec2, 2);
    assert_eq!(borrow_f32::<2>(&s.scene, id).unwrap().unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
    let bytes = s.accessor(U8, Vec2, 2);
    assert_eq!(borrow_f32::<2>(&s.scene, bytes).unwrap(), None);
}

#[test]
fn interleaved_elements_are_read_up_to_the_last_byte_of_the_view() {
    let mut s = Sample::new(floats(&[1.0, 2.0, 9.0, 3.0, 4.0]), Some(12));
    let id = s.accessor(F32, Vec2, 2);
    assert_eq!(read_f32::<2>(&s.scene, id).unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
}

#[test]
fn integers_are_values_or_units() {
    let mut s = Sample::new(vec![0x80, 0x81, 0x7f, 0xff], None);
    let signed = s.accessor(I8, Scalar, 4);
    assert_eq!(read_f32::<1>(&s.scene, signed).unwrap(), [[-128.0], [-127.0], [127.0], [-1.0]]);
    s.edit(signed).normalized = true;
    assert_eq!(read_f32::<1>(&s.scene, signed).unwrap(), [[-1.0], [-1.0], [1.0], [-1.0 / 127.0]]);
    let unsigned = s.accessor(U8, Vec4, 1);
    s.edit(unsigned).normalized = true;
    assert_eq!(read_f32::<4>(&s.scene, unsigned).unwrap(), [[128.0, 129.0, 127.0, 255.0].map(|v: f32| v / 255.0)]);
    let short = s.accessor(I16, Vec2, 1);
    assert_eq!(read_f32::<2>(&s.scene, short).unwrap(), [[-32384.0, -129.0]]);
    s.edit(short).normalized = true;
    assert_eq!(read_f32::<2>(&s.scene, short).unwrap(), [[-32384.0 / 32767.0, -129.0 / 32767.0]]);
    let ushort = s.accessor(U16, Vec2, 1);
    s.edit(ushort).normalized = true;
    assert_eq!(read_f32::<2>(&s.scene, ushort).unwrap(), [[33152.0 / 65535.0, 65407.0 / 65535.0]]);
    let uint = s.accessor(U32, Scalar, 1);
    assert_eq!(read_f32::<1>(&s.scene, uint).unwrap(), [[0xff7f8180u32 as f32]]);
}

#[test]
fn matrix_columns_are_padded_to_four_bytes() {
    let mut bytes: Vec<u8> = (0..12).collect();
    bytes.extend(100..112);
    let mut s = Sample::new(bytes, None);
    let mat3 = s.accessor(U8, Mat3, 2);
    assert_eq!(
        read_f32::<9>(&s.scene, mat3).unwrap(),
        [
            [0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 8.0, 9.0, 10.0],
            [100.0, 101.0, 102.0, 104.0, 105.0, 106.0, 108.0, 109.0, 110.0]
        ]
    );
    let mat2 = s.accessor(U8, Mat2, 3);
    assert_eq!(
        read_f32::<4>(&s.scene, mat2).unwrap(),
        [[0.0, 1.0, 4.0, 5.0], [8.0, 9.0, 100.0, 101.0], [104.0, 105.0, 108.0, 109.0]]
    );
    let mat3_short = s.accessor(U16, Mat3, 1);
    let at = |i: u8| f32::from(u16::from_le_bytes([i, i + 1]));
    let expected = [at(0), at(2), at(4), at(8), at(10), f32::from(u16::from_le_bytes([100, 101]))];
    assert_eq!(read_f32::<9>(&s.scene, mat3_short).unwrap()[0][..6], expected);
}

#[test]
fn sparse_elements_replace_those_of_the_view_or_zeros() {
    let mut bytes = floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 10.0, 20.0]);
    bytes.extend([2, 0]);
    for (view_less, expected) in
        [(false, [[1.0, 2.0], [3.0, 4.0], [10.0, 20.0]]), (true, [[0.0, 0.0], [0.0, 0.0], [10.0, 20.0]])]
    {
        let mut s = Sample::new(bytes.clone(), None);
        let (values_view, indices_view) = (s.part(24, 8), s.part(32, 2));
        let id = s.accessor(F32, Vec2, 3);
        let a = s.edit(id);
        if view_less {
            a.view = None;
        }
        a.sparse = Some(Box::new(Sparse {
            count: 1,
            indices_view,
            indices_offset: 0,
            indices_type: U16,
            values_view,
            values_offset: 0,
            indices_extra: Extra::default(),
            values_extra: Extra::default(),
            extra: Extra::default(),
        }));
        assert_eq!(read_f32::<2>(&s.scene, id).unwrap(), expected);
        assert_eq!(borrow_f32::<2>(&s.scene, id).unwrap(), None);
    }
}

#[test]
fn sparse_indices_must_rise_and_be_in_range() {
    for (indices, fault) in [
        ([1u8, 1], AccessorFault::SparseIndexOrder { position: 1, index: 1 }),
        ([2, 0], AccessorFault::SparseIndexOrder { position: 1, index: 0 }),
        ([0, 3], AccessorFault::SparseIndexRange { position: 1, index: 3, count: 3 }),
    ] {
        let mut s = Sample::new(indices.to_vec(), None);
        let id = s.accessor(U8, Scalar, 3);
        let view = s.view;
        let a = s.edit(id);
        a.view = None;
        a.sparse = Some(Box::new(Sparse {
            count: 2,
            indices_view: view,
            indices_offset: 0,
            indices_type: U8,
            values_view: view,
            values_offset: 0,
            indices_extra: Extra::default(),
            values_extra: Extra::default(),
            extra: Extra::default(),
        }));
        assert_eq!(read_indices(&s.scene, id).unwrap_err(), AccessorError { accessor: 0, fault });
    }
}

#[test]
fn an_accessor_may_not_end_behind_its_view_nor_its_view_behind_the_buffer() {
    let mut s = Sample::new(vec![0; 24], None);
    let id = s.accessor(F32, Vec3, 2);
    assert!(check(&s.scene, id).is_ok());
    s.edit(id).offset = 1;
    let e = read_f32::<3>(&s.scene, id).unwrap_err();
    assert_eq!(e.to_string(), "accessor 0: its 2 elements need 25 bytes of buffer view 0, which has 24");
    s.edit(id).offset = usize::MAX;
    s.edit(id).count = usize::MAX;
    assert!(matches!(read_f32::<3>(&s.scene, id).unwrap_err().fault, AccessorFault::OutsideView { .. }));
    let part = s.part(20, 5);
    let outside = s.accessor(U8, Scalar, 1);
    s.edit(outside).view = Some(part);
    let e = read_indices(&s.scene, outside).unwrap_err();
    assert_eq!(e.to_string(), "accessor 1: buffer view 1 ends at byte 25, but its buffer 0 has 24 bytes");
    let wrapping = s.part(usize::MAX, 2);
    s.edit(outside).view = Some(wrapping);
    assert!(matches!(read_indices(&s.scene, outside).unwrap_err().fault, AccessorFault::OutsideBuffer { .. }));
}

#[test]
fn a_stride_below_the_element_is_refused() {
    let mut s = Sample::new(vec![0; 64], Some(8));
    let id = s.accessor(F32, Vec3, 2);
    assert!(read_f32::<3>(&s.scene, id).unwrap_err().to_string().contains("byteStride of 8"));
}

#[test]
fn reading_the_wrong_type_is_an_error_that_says_both() {
    let mut s = Sample::new(vec![0; 64], None);
    let id = s.accessor(F32, Vec3, 2);
    assert_eq!(read_f32::<2>(&s.scene, id).unwrap_err().to_string(), "accessor 0: VEC2 wanted, but it is Vec3 of F32");
    assert!(read_indices(&s.scene, id).is_err());
    assert!(read_joints(&s.scene, id).is_err());
    let signed = s.accessor(I8, Vec4, 2);
    assert!(read_colors(&s.scene, signed).is_err());
}

#[test]
fn indices_of_every_unsigned_type_append_to_what_is_there() {
    let mut s = Sample::new(vec![1, 0, 0, 0, 2, 0, 0, 0], None);
    let (byte, short, int) = (s.accessor(U8, Scalar, 5), s.accessor(U16, Scalar, 3), s.accessor(U32, Scalar, 2));
    let mut out = vec![7];
    read_indices_into(&s.scene, byte, &mut out).unwrap();
    read_indices_into(&s.scene, short, &mut out).unwrap();
    read_indices_into(&s.scene, int, &mut out).unwrap();
    assert_eq!(out, [7, 1, 0, 0, 0, 2, 1, 0, 2, 1, 2]);
}

#[test]
fn indices_in_place_are_those_that_are_read() {
    let bytes: Vec<u8> = (0..24u8).map(|i| i.wrapping_mul(77)).collect();
    for (component, shift, stride, in_place) in
        [(U8, 3, None, true), (U16, 1, None, true), (U32, 5, None, true), (U16, 0, Some(4), false)]
    {
        let mut s = Sample::new(bytes.clone(), stride);
        let id = s.accessor(component, Scalar, 4);
        s.edit(id).offset = shift;
        let (read, found) = (read_indices(&s.scene, id).unwrap(), indices(&s.scene, id).unwrap());
        assert_eq!(!matches!(found, Indices::Decoded(_)), in_place);
        assert_eq!((0..found.len()).map(|i| found.get(i)).collect::<Vec<_>>(), read);
        let mut copy = [0; 2];
        assert_eq!(found.copy_to(1, &mut copy), read[1..3].iter().copied().max());
        assert_eq!(copy, read[1..3]);
        assert_eq!(found.copy_to(4, &mut []), None);
    }
    let mut s = Sample::new(bytes, None);
    let floats = s.accessor(F32, Scalar, 1);
    assert!(indices(&s.scene, floats).is_err());
}

#[test]
fn a_vertex_index_out_of_range_is_an_error_that_names_it() {
    let mut s = Sample::new(vec![0, 3, 2], None);
    let id = s.accessor(U8, Scalar, 3);
    let mut out = vec![9];
    let e = read_vertex_indices_into(&s.scene, id, 3, &mut out).unwrap_err();
    assert_eq!(e.to_string(), "accessor 0: index 1 is 3, but there are 3 vertices");
    assert_eq!(out, [9]);
    read_vertex_indices_into(&s.scene, id, 4, &mut out).unwrap();
    assert_eq!(out, [9, 0, 3, 2]);
}

#[test]
fn colours_of_three_components_get_alpha_one_and_integers_are_units() {
    let mut s = Sample::new(vec![255, 0, 51, 255], None);
    let rgb = s.accessor(U8, Vec3, 1);
    assert_eq!(read_colors(&s.scene, rgb).unwrap(), [[1.0, 0.0, 0.2, 1.0]]);
    let rgba = s.accessor(U8, Vec4, 1);
    assert_eq!(read_colors(&s.scene, rgba).unwrap(), [[1.0, 0.0, 0.2, 1.0]]);
}

#[test]
fn joints_are_read_from_bytes_and_shorts() {
    let mut s = Sample::new(vec![1, 0, 2, 0, 3, 0, 4, 1], None);
    let (bytes, shorts) = (s.accessor(U8, Vec4, 2), s.accessor(U16, Vec4, 1));
    assert_eq!(read_joints(&s.scene, bytes).unwrap(), [[1, 0, 2, 0], [3, 0, 4, 1]]);
    assert_eq!(read_joints(&s.scene, shorts).unwrap(), [[1, 2, 3, 260]]);
}

#[test]
fn an_accessor_without_a_view_is_zeros_and_one_without_end_is_refused() {
    let mut s = Sample::new(vec![1], None);
    let id = s.accessor(F32, Vec3, 2);
    s.edit(id).view = None;
    assert_eq!(read_f32::<3>(&s.scene, id).unwrap(), [[0.0; 3]; 2]);
    s.edit(id).count = usize::MAX / 2;
    assert!(matches!(read_f32::<3>(&s.scene, id).unwrap_err().fault, AccessorFault::OutOfMemory { .. }));
}
