//! Typed reads of accessors.
//!
//! Every component type, normalised integers, sparse replacement, interleaved views, padded matrix columns and accessors
//! without a view (zeros) are understood. Bounds are checked before the first element is read, so that no accessor can
//! make a reader panic or read elsewhere. Tightly packed floats are copied as a block.
//!
//! Values are not judged: a file may hold NaN or infinity, and readers hand them on.

mod decode;
mod error;
mod layout;
#[cfg(test)]
mod tests;

pub use error::{AccessorError, AccessorFault};

use crate::Scene;
use crate::model::{AccessorId, ComponentType, ElementType};
use layout::Layout;

type Result<T> = std::result::Result<T, AccessorError>;

/// Checks that an accessor lies in its view, the view in its buffer, that strides hold an element, and that sparse
/// indices rise and are in range. Import does this for every accessor.
pub fn check(scene: &Scene, id: AccessorId) -> Result<()> {
    layout::resolve(scene, id).map(|_| ())
}

/// All elements as floats: `N` = 1, 2, 3, 4, 9 or 16 components (matrices column by column). Normalised integers become
/// 0..1 or -1..1, other integers their value.
pub fn read_f32<const N: usize>(scene: &Scene, id: AccessorId) -> Result<Vec<[f32; N]>> {
    let mut out = Vec::new();
    read_f32_into(scene, id, &mut out)?;
    Ok(out)
}

/// Like [`read_f32`], appended to `out`. On an error `out` is as it was.
pub fn read_f32_into<const N: usize>(scene: &Scene, id: AccessorId, out: &mut Vec<[f32; N]>) -> Result<()> {
    let layout = layout::resolve(scene, id)?;
    if layout.accessor.element_type.components() != N {
        return Err(wrong_type(id, &layout, wanted_components(N)));
    }
    append_floats(&layout, id, layout.accessor.normalized, out)
}

/// Tightly packed, aligned floats without sparse replacement, in place: nothing is copied. `None` where the accessor is
/// stored in any other way; then read it with [`read_f32`].
pub fn borrow_f32<const N: usize>(scene: &Scene, id: AccessorId) -> Result<Option<&[[f32; N]]>> {
    let layout = layout::resolve(scene, id)?;
    if layout.accessor.element_type.components() != N {
        return Err(wrong_type(id, &layout, wanted_components(N)));
    }
    if layout.sparse.is_some() {
        return Ok(None);
    }
    Ok(decode::as_packed_floats(&layout))
}

/// Scalars of an unsigned type where they are stored, if they are stored one behind the other.
#[derive(Clone, Debug)]
pub enum Indices<'a> {
    /// U8.
    U8(&'a [u8]),
    /// U16, little-endian.
    U16(&'a [[u8; 2]]),
    /// U32, little-endian.
    U32(&'a [[u8; 4]]),
    /// Stored in any other way, and decoded.
    Decoded(Vec<u32>),
}

impl Indices<'_> {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::U8(indices) => indices.len(),
            Self::U16(indices) => indices.len(),
            Self::U32(indices) => indices.len(),
            Self::Decoded(indices) => indices.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One of them.
    ///
    /// # Panics
    /// If there are not as many.
    #[inline]
    pub fn get(&self, i: usize) -> u32 {
        match self {
            Self::U8(indices) => indices[i].into(),
            Self::U16(indices) => u16::from_le_bytes(indices[i]).into(),
            Self::U32(indices) => u32::from_le_bytes(indices[i]),
            Self::Decoded(indices) => indices[i],
        }
    }

    /// Copies those from `first` on, as many as `out` has room for, and gives the largest.
    ///
    /// # Panics
    /// If there are not as many.
    pub fn copy_to(&self, first: usize, out: &mut [u32]) -> Option<u32> {
        fn copy<T: Copy>(from: &[T], out: &mut [u32], value: impl Fn(T) -> u32) -> u32 {
            // The largest is kept on the way: the indices are not read a second time.
            from.iter().zip(out).fold(0, |largest, (&from, to)| {
                *to = value(from);
                largest.max(*to)
            })
        }
        let range = first..first + out.len();
        let largest = match self {
            Self::U8(indices) => copy(&indices[range], out, u32::from),
            Self::U16(indices) => copy(&indices[range], out, |b| u16::from_le_bytes(b).into()),
            Self::U32(indices) => copy(&indices[range], out, u32::from_le_bytes),
            Self::Decoded(indices) => copy(&indices[range], out, |i| i),
        };
        (!out.is_empty()).then_some(largest)
    }
}

/// Whether the elements are stored one behind the other, and none of them is replaced.
pub fn is_packed(scene: &Scene, id: AccessorId) -> bool {
    layout::resolve(scene, id).is_ok_and(|layout| {
        let element = layout.accessor.element_type.stored_size(layout.accessor.component_type);
        layout.sparse.is_none() && layout.base.is_some_and(|base| base.stride == element)
    })
}

/// Scalars of an unsigned type, in place where that is possible.
pub fn indices(scene: &Scene, id: AccessorId) -> Result<Indices<'_>> {
    let layout = layout::resolve(scene, id)?;
    let (Some(base), None, ElementType::Scalar) = (layout.base, &layout.sparse, layout.accessor.element_type) else {
        return read_indices(scene, id).map(Indices::Decoded);
    };
    match layout.accessor.component_type {
        ComponentType::U8 if base.stride == 1 => Ok(Indices::U8(base.bytes)),
        ComponentType::U16 if base.stride == 2 => Ok(Indices::U16(base.bytes.as_chunks().0)),
        ComponentType::U32 if base.stride == 4 => Ok(Indices::U32(base.bytes.as_chunks().0)),
        _ => read_indices(scene, id).map(Indices::Decoded),
    }
}

/// Scalars of an unsigned type: vertex indices, feature ids.
pub fn read_indices(scene: &Scene, id: AccessorId) -> Result<Vec<u32>> {
    let mut out = Vec::new();
    read_indices_into(scene, id, &mut out)?;
    Ok(out)
}

/// Like [`read_indices`], appended to `out`. On an error `out` is as it was.
pub fn read_indices_into(scene: &Scene, id: AccessorId, out: &mut Vec<u32>) -> Result<()> {
    let layout = layout::resolve(scene, id)?;
    let unsigned =
        matches!(layout.accessor.component_type, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
    if layout.accessor.element_type != ElementType::Scalar || !unsigned {
        return Err(wrong_type(id, &layout, "a scalar of U8, U16 or U32"));
    }
    let start = out.len();
    // A `Vec<u32>` and a `Vec<[u32; 1]>` are the same memory.
    let mut arrays: Vec<[u32; 1]> = bytemuck::allocation::cast_vec(std::mem::take(out));
    let result = match layout.accessor.component_type {
        ComponentType::U8 => decode::append(&layout, id, &mut arrays, |c: u8| u32::from(c)),
        ComponentType::U16 => decode::append(&layout, id, &mut arrays, |c: u16| u32::from(c)),
        _ => decode::append(&layout, id, &mut arrays, |c: u32| c),
    };
    *out = bytemuck::allocation::cast_vec(arrays);
    if result.is_err() {
        out.truncate(start);
    }
    result
}

/// Like [`read_indices_into`], and every index is checked to be less than `vertices`.
pub fn read_vertex_indices_into(scene: &Scene, id: AccessorId, vertices: usize, out: &mut Vec<u32>) -> Result<()> {
    let start = out.len();
    read_indices_into(scene, id, out)?;
    let read = &out[start..];
    // The maximum is found first, in a loop that vectorises; the culprit is looked for only if there is one.
    if read.iter().copied().max().is_none_or(|m| (m as usize) < vertices) {
        return Ok(());
    }
    let culprit = read.iter().enumerate().find(|&(_, &index)| index as usize >= vertices);
    let (position, &index) = culprit.expect("the maximum is one of them");
    out.truncate(start);
    Err(layout::error(id, AccessorFault::VertexIndexRange { position, index, vertices }))
}

/// `JOINTS_n`: VEC4 of U8 or U16.
pub fn read_joints(scene: &Scene, id: AccessorId) -> Result<Vec<[u16; 4]>> {
    let layout = layout::resolve(scene, id)?;
    let mut out = Vec::new();
    match (layout.accessor.element_type, layout.accessor.component_type) {
        (ElementType::Vec4, ComponentType::U8) => decode::append(&layout, id, &mut out, |c: u8| u16::from(c))?,
        (ElementType::Vec4, ComponentType::U16) => decode::append(&layout, id, &mut out, |c: u16| c)?,
        _ => return Err(wrong_type(id, &layout, "VEC4 of U8 or U16")),
    }
    Ok(out)
}

/// `COLOR_n`: VEC3 (alpha becomes 1) or VEC4, as linear RGBA. Integers always stand for 0..1 here: glTF knows no other
/// integer colours, whether or not the file sets `normalized`.
pub fn read_colors(scene: &Scene, id: AccessorId) -> Result<Vec<[f32; 4]>> {
    let layout = layout::resolve(scene, id)?;
    let known = matches!(layout.accessor.component_type, ComponentType::F32 | ComponentType::U8 | ComponentType::U16);
    match layout.accessor.element_type {
        ElementType::Vec4 if known => {
            let mut out = Vec::new();
            append_floats(&layout, id, true, &mut out)?;
            Ok(out)
        }
        ElementType::Vec3 if known => {
            let mut rgb: Vec<[f32; 3]> = Vec::new();
            append_floats(&layout, id, true, &mut rgb)?;
            let mut out = Vec::new();
            decode::reserve(id, rgb.len(), &mut out)?;
            out.extend(rgb.iter().map(|&[r, g, b]| [r, g, b, 1.0]));
            Ok(out)
        }
        _ => Err(wrong_type(id, &layout, "VEC3 or VEC4 of F32, U8 or U16")),
    }
}

/// The caller has checked the number of components.
fn append_floats<const N: usize>(
    layout: &Layout<'_>,
    id: AccessorId,
    unit: bool,
    out: &mut Vec<[f32; N]>,
) -> Result<()> {
    use decode::{Component, append};
    if layout.sparse.is_none()
        && let Some(floats) = decode::as_packed_floats(layout)
    {
        decode::reserve(id, floats.len(), out)?;
        out.extend_from_slice(floats);
        return Ok(());
    }
    match (layout.accessor.component_type, unit) {
        (ComponentType::F32, _) => append(layout, id, out, f32::value),
        (ComponentType::U32, _) => append(layout, id, out, <u32 as Component>::value),
        (ComponentType::I8, true) => append(layout, id, out, i8::unit),
        (ComponentType::I8, false) => append(layout, id, out, i8::value),
        (ComponentType::U8, true) => append(layout, id, out, u8::unit),
        (ComponentType::U8, false) => append(layout, id, out, u8::value),
        (ComponentType::I16, true) => append(layout, id, out, i16::unit),
        (ComponentType::I16, false) => append(layout, id, out, i16::value),
        (ComponentType::U16, true) => append(layout, id, out, u16::unit),
        (ComponentType::U16, false) => append(layout, id, out, u16::value),
    }
}

fn wrong_type(id: AccessorId, layout: &Layout<'_>, wanted: &'static str) -> AccessorError {
    let (element_type, component_type) = (layout.accessor.element_type, layout.accessor.component_type);
    layout::error(id, AccessorFault::WrongType { wanted, element_type, component_type })
}

fn wanted_components(n: usize) -> &'static str {
    match n {
        1 => "SCALAR",
        2 => "VEC2",
        3 => "VEC3",
        4 => "VEC4",
        9 => "MAT3",
        16 => "MAT4",
        _ => "another number of components",
    }
}
