//! The inner loops: bytes of one component type to numbers.

use super::layout::{Elements, Layout};
use super::{AccessorError, AccessorFault, layout};
use crate::model::{AccessorId, ComponentType, ElementType};

/// A component as it is stored, little-endian.
pub(super) trait Component: Copy {
    const SIZE: usize;
    /// Reads the first `SIZE` bytes.
    fn read(bytes: &[u8]) -> Self;
    /// Its value.
    fn value(self) -> f32;
    /// What it stands for if it is normalised (glTF 2.0, section 3.6.2.2).
    fn unit(self) -> f32;
}

macro_rules! component {
    ($type:ty, $size:literal, $unit:expr) => {
        impl Component for $type {
            const SIZE: usize = $size;
            #[inline(always)]
            fn read(bytes: &[u8]) -> Self {
                let mut b = [0; $size];
                b.copy_from_slice(&bytes[..$size]);
                <$type>::from_le_bytes(b)
            }
            #[inline(always)]
            fn value(self) -> f32 {
                self as f32
            }
            #[inline(always)]
            fn unit(self) -> f32 {
                let f: fn($type) -> f32 = $unit;
                f(self)
            }
        }
    };
}

component!(i8, 1, |c| (f32::from(c) / 127.0).max(-1.0));
component!(u8, 1, |c| f32::from(c) / 255.0);
component!(i16, 2, |c| (f32::from(c) / 32767.0).max(-1.0));
component!(u16, 2, |c| f32::from(c) / 65535.0);
// glTF allows `normalized` for neither of these; the flag has no meaning and is ignored.
component!(u32, 4, |c| c as f32);
component!(f32, 4, |c| c);

/// Bytes from one column of a matrix to the next, and components in a column.
fn columns(element: ElementType, component: usize) -> (usize, usize) {
    let rows = match element {
        ElementType::Mat2 => 2,
        ElementType::Mat3 => 3,
        ElementType::Mat4 => 4,
        _ => return (0, usize::MAX),
    };
    ((rows * component).next_multiple_of(4), rows)
}

/// Where in an element each component begins.
fn offsets<const N: usize>(element: ElementType, component: usize) -> [usize; N] {
    let (pitch, rows) = columns(element, component);
    std::array::from_fn(|k| (k / rows) * pitch + (k % rows) * component)
}

/// Appends all elements, each of `N` components, mapped by `map`.
pub(super) fn append<C: Component, T: Copy + Default, const N: usize>(
    layout: &Layout<'_>,
    id: AccessorId,
    out: &mut Vec<[T; N]>,
    map: impl Fn(C) -> T + Copy,
) -> Result<(), AccessorError> {
    let accessor = layout.accessor;
    debug_assert_eq!(accessor.element_type.components(), N);
    let start = out.len();
    reserve(id, accessor.count, out)?;
    match layout.base {
        None => out.resize(start + accessor.count, [T::default(); N]),
        Some(e) => append_elements::<C, T, N>(e, accessor.element_type, out, map),
    }
    if let Some(sparse) = &layout.sparse {
        let at = offsets::<N>(accessor.element_type, C::SIZE);
        for (index, value) in sparse.indices().zip(sparse.values.bytes.chunks_exact(sparse.values.stride)) {
            // `resolve` has checked that the index is below the count.
            out[start + index as usize] = std::array::from_fn(|k| map(C::read(&value[at[k]..])));
        }
    }
    Ok(())
}

pub(super) fn reserve<T>(id: AccessorId, count: usize, out: &mut Vec<T>) -> Result<(), AccessorError> {
    out.try_reserve(count).map_err(|_| layout::error(id, AccessorFault::OutOfMemory { count }))
}

fn append_elements<C: Component, T: Copy, const N: usize>(
    elements: Elements<'_>,
    element: ElementType,
    out: &mut Vec<[T; N]>,
    map: impl Fn(C) -> T + Copy,
) {
    let packed = N * C::SIZE;
    if elements.stride == packed && element.stored_size_of(C::SIZE) == packed {
        // Constant chunk sizes let the compiler vectorise.
        out.extend(
            elements.bytes.chunks_exact(packed).map(|c| std::array::from_fn(|k| map(C::read(&c[k * C::SIZE..])))),
        );
    } else {
        let at = offsets::<N>(element, C::SIZE);
        // The last chunk ends with its element and may be shorter than the stride.
        out.extend(elements.bytes.chunks(elements.stride).map(|c| std::array::from_fn(|k| map(C::read(&c[at[k]..])))));
    }
}

/// Tightly packed little-endian floats in a little-endian machine, aligned: the elements as they are.
pub(super) fn as_packed_floats<'a, const N: usize>(layout: &Layout<'a>) -> Option<&'a [[f32; N]]> {
    let elements = layout.base?;
    let direct = cfg!(target_endian = "little")
        && layout.accessor.component_type == ComponentType::F32
        && elements.stride == 4 * N;
    if !direct {
        return None;
    }
    let floats: &[f32] = bytemuck::try_cast_slice(elements.bytes).ok()?;
    Some(floats.as_chunks().0)
}
