//! From accessor to bytes, with every bound checked once, before the first element is read.

use super::{AccessorError, AccessorFault};
use crate::Scene;
use crate::model::{Accessor, AccessorId, BufferViewId, ComponentType, Store};

/// Elements in memory: element `i` begins at byte `i * stride`. `bytes` ends with the last element.
#[derive(Clone, Copy)]
pub(super) struct Elements<'a> {
    pub bytes: &'a [u8],
    pub stride: usize,
}

/// Replaced elements.
pub(super) struct SparseElements<'a> {
    pub indices: &'a [u8],
    pub index_type: ComponentType,
    pub values: Elements<'a>,
}

/// An accessor whose bounds hold.
pub(super) struct Layout<'a> {
    pub accessor: &'a Accessor,
    /// `None`: all zeros.
    pub base: Option<Elements<'a>>,
    pub sparse: Option<SparseElements<'a>>,
}

pub(super) fn error(id: AccessorId, fault: AccessorFault) -> AccessorError {
    AccessorError { accessor: Store::<AccessorId, Accessor>::slot(id), fault }
}

/// Finds the bytes of an accessor. Cost: O(1), and O(n) in its sparse indices.
pub(super) fn resolve(scene: &Scene, id: AccessorId) -> Result<Layout<'_>, AccessorError> {
    let accessor = scene.accessors.get(id).ok_or_else(|| error(id, AccessorFault::Stale))?;
    let layout = resolve_checked(scene, accessor).map_err(|fault| error(id, fault))?;
    Ok(layout)
}

fn resolve_checked<'a>(scene: &'a Scene, accessor: &'a Accessor) -> Result<Layout<'a>, AccessorFault> {
    let element = accessor.element_type.stored_size(accessor.component_type);
    let base = match accessor.view {
        Some(view) => Some(elements(scene, view, accessor.offset, accessor.count, element, None)?),
        None => None,
    };
    let sparse = match &accessor.sparse {
        None => None,
        Some(s) => {
            if !matches!(s.indices_type, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
                return Err(AccessorFault::SparseIndexType(s.indices_type));
            }
            if s.count > accessor.count {
                return Err(AccessorFault::TooManySparse { sparse: s.count, count: accessor.count });
            }
            let index = s.indices_type.size();
            let indices = elements(scene, s.indices_view, s.indices_offset, s.count, index, Some(index))?.bytes;
            let values = elements(scene, s.values_view, s.values_offset, s.count, element, Some(element))?;
            let sparse = SparseElements { indices, index_type: s.indices_type, values };
            sparse.check_order(accessor.count)?;
            Some(sparse)
        }
    };
    Ok(Layout { accessor, base, sparse })
}

/// The bytes of `count` elements of `size` bytes that begin at `offset` of a view. `packed` overrides the view's
/// stride. Arithmetic is in u128, so that no sum of file values can wrap.
fn elements(
    scene: &Scene,
    view_id: BufferViewId,
    offset: usize,
    count: usize,
    size: usize,
    packed: Option<usize>,
) -> Result<Elements<'_>, AccessorFault> {
    let view = scene.buffer_views.get(view_id).ok_or(AccessorFault::Stale)?;
    let slot = Store::<BufferViewId, ()>::slot(view_id);
    let bytes = scene.view_bytes(view_id).ok_or_else(|| AccessorFault::OutsideBuffer {
        view: slot,
        buffer: Store::<_, ()>::slot(view.buffer),
        end: view.offset as u128 + view.length as u128,
        available: scene.buffers.get(view.buffer).map_or(0, |b| b.data.len()),
    })?;
    let stride = packed.or(view.stride).unwrap_or(size);
    if stride < size {
        return Err(AccessorFault::StrideTooSmall { view: slot, stride, element: size });
    }
    if count == 0 {
        return Ok(Elements { bytes: &[], stride });
    }
    let needed = offset as u128 + (count as u128 - 1) * stride as u128 + size as u128;
    if needed > bytes.len() as u128 {
        return Err(AccessorFault::OutsideView { view: slot, count, needed, available: bytes.len() });
    }
    Ok(Elements { bytes: &bytes[offset..needed as usize], stride })
}

impl SparseElements<'_> {
    /// Which elements are replaced.
    pub fn indices(&self) -> impl Iterator<Item = u32> + '_ {
        let size = self.index_type.size();
        self.indices.chunks_exact(size).map(move |c| match size {
            1 => u32::from(c[0]),
            2 => u32::from(u16::from_le_bytes([c[0], c[1]])),
            _ => u32::from_le_bytes([c[0], c[1], c[2], c[3]]),
        })
    }

    fn check_order(&self, count: usize) -> Result<(), AccessorFault> {
        let mut previous = None;
        for (position, index) in self.indices().enumerate() {
            if index as usize >= count {
                return Err(AccessorFault::SparseIndexRange { position, index, count });
            }
            if previous.is_some_and(|p| index <= p) {
                return Err(AccessorFault::SparseIndexOrder { position, index });
            }
            previous = Some(index);
        }
        Ok(())
    }
}
