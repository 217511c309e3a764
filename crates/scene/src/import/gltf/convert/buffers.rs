//! Buffers, views and accessors.

use super::compressed::CompressedViews;
use super::{Converter, Members, Result, invalid, size, small};
use crate::accessor;
use crate::import::ImportFault;
use crate::import::data_uri;
use crate::import::files::FileFault;
use crate::import::gltf::extensions::COMPRESSED_VIEWS;
use crate::import::gltf::schema::{self, Int};
use crate::model::*;
use crate::place::At;

impl Converter<'_> {
    /// A buffer without any data becomes an empty one. So does one that compressed views alone refer to: it is not read,
    /// and filled with what they decode to.
    pub(super) fn buffers(
        &mut self,
        buffers: Vec<schema::Buffer<'_>>,
        mut bin: Option<Blob>,
        is_glb: bool,
        compressed: &CompressedViews,
    ) -> Result<()> {
        let at = &At::Root.key("buffers");
        self.scene.buffers.reserve(buffers.len());
        for (i, b) in buffers.into_iter().enumerate() {
            let at = &at.index(i);
            let declared = b.byte_length.0;
            let mut members = Members::new(b.extensions, b.rest);
            let mut fallback = compressed.decoded_only[i];
            for &name in COMPRESSED_VIEWS {
                let marker: Option<schema::MeshoptBuffer> = members.take(name, at)?;
                fallback |= marker.is_some_and(|m| m.fallback) && b.uri.is_none();
            }
            if compressed.decoded_only[i] {
                bin = bin.filter(|_| i > 0 || b.uri.is_some());
                let extra = members.finish(b.extras, at)?;
                let buffer = Buffer { name: b.name, uri: None, data: Blob::new(Vec::new()), extra };
                self.scene.buffers.insert_nth(i, buffer);
                continue;
            }
            let (uri, data) = match b.uri {
                Some(schema::Text(text)) => self.buffer_data(&text, declared, at)?,
                None if i == 0 && bin.is_some() => (None, bin.take()),
                None => (None, None),
            };
            let data = match data {
                Some(data) => {
                    if is_glb && uri.is_none() && data.len() as u64 > declared.saturating_add(3) {
                        self.tolerate("the buffer is shorter than its data by more than padding", at);
                    }
                    let range = 0..usize::try_from(declared).unwrap_or(usize::MAX);
                    match data.slice(range) {
                        Some(data) => data,
                        None => {
                            let available = data.len() as u64;
                            return Err((at.place(), ImportFault::Truncated { declared, available }));
                        }
                    }
                }
                None if fallback => Blob::new(Vec::new()),
                None => {
                    self.tolerate("the buffer has neither a uri nor a BIN chunk", at);
                    Blob::new(Vec::new())
                }
            };
            let extra = members.finish(b.extras, at)?;
            self.scene.buffers.insert_nth(i, Buffer { name: b.name, uri, data, extra });
        }
        if bin.is_some() {
            self.tolerate("no buffer uses the BIN chunk", at);
        }
        Ok(())
    }

    fn buffer_data(&mut self, uri: &str, declared: u64, at: &At<'_>) -> Result<(Option<String>, Option<Blob>)> {
        if let Some(decoded) = data_uri::decode(uri, self.budget) {
            let (_, data) = decoded.map_err(|fault| data_uri_fault(fault, &at.key("uri")))?;
            return Ok((None, Some(Blob::new(data))));
        }
        let data = self
            .files
            .read_uri(uri, Some(declared))
            .map_err(|fault: FileFault| (at.key("uri").place(), ImportFault::from(fault)))?;
        Ok((Some(uri.to_owned()), Some(Blob::new(data))))
    }

    pub(super) fn buffer_views(
        &mut self,
        views: Vec<schema::BufferView<'_>>,
        compressed: &CompressedViews,
    ) -> Result<()> {
        let at = &At::Root.key("bufferViews");
        self.scene.buffer_views.reserve(views.len());
        for (i, v) in views.into_iter().enumerate() {
            let at = &at.index(i);
            let buffer = self.counts.buffer(v.buffer, &at.key("buffer"))?;
            let mut stated = Stated::default();
            let offset = stated.note(Member::ByteOffset, v.byte_offset).unwrap_or_default();
            let (buffer, offset, length) = match compressed.place(i) {
                Some(decoded) => decoded,
                None => (buffer, size(offset, &at.key("byteOffset"))?, size(v.byte_length, &at.key("byteLength"))?),
            };
            let available = self.scene.buffers[buffer].data.len();
            let end = offset as u128 + length as u128;
            if end > available as u128 {
                if available == 0 {
                    return invalid(at, "the view's buffer has no data: neither a uri nor a BIN chunk");
                }
                return invalid(at, format!("the view ends at byte {end}, but its buffer has {available} bytes"));
            }
            let mut stride = v.byte_stride.map(|s| size(s, &at.key("byteStride"))).transpose()?;
            if stride == Some(0) {
                self.tolerate("a byteStride of 0 is taken as none", &at.key("byteStride"));
                stride = None;
            } else if stride.is_some_and(|s| s % 4 != 0 || s > 252) {
                self.tolerate("a byteStride should be a multiple of 4 up to 252", &at.key("byteStride"));
            }
            let view = BufferView {
                name: v.name,
                buffer,
                offset,
                length,
                stride,
                target: v.target.map(|t| small(t, &at.key("target"))).transpose()?,
                extra: Members::new(v.extensions, v.rest).finish(v.extras, at)?.stating(stated),
            };
            self.scene.buffer_views.insert_nth(i, view);
        }
        Ok(())
    }

    pub(super) fn accessors(&mut self, accessors: Vec<schema::Accessor<'_>>) -> Result<()> {
        let at = &At::Root.key("accessors");
        self.scene.accessors.reserve(accessors.len());
        for (i, a) in accessors.into_iter().enumerate() {
            let at = &at.index(i);
            let accessor = self.accessor(a, at)?;
            let id = self.scene.accessors.insert_nth(i, accessor);
            accessor::check(&self.scene, id).map_err(|e| (at.place(), ImportFault::Accessor(e.fault)))?;
        }
        Ok(())
    }

    fn accessor(&mut self, a: schema::Accessor<'_>, at: &At<'_>) -> Result<Accessor> {
        let component_type = component_type(a.component_type, &at.key("componentType"))?;
        let element_type = element_type(a.element_type);
        let count = size(a.count, &at.key("count"))?;
        if count == 0 {
            self.tolerate("an accessor should have at least one element", &at.key("count"));
        }
        let mut stated = Stated::default();
        let normalized = stated.note(Member::Normalized, a.normalized).unwrap_or(false);
        let offset = stated.note(Member::ByteOffset, a.byte_offset).unwrap_or_default();
        if normalized && matches!(component_type, ComponentType::F32 | ComponentType::U32) {
            self.tolerate("this component type cannot be normalized; the flag is ignored", &at.key("normalized"));
        }
        let view = a.buffer_view.map(|v| self.counts.buffer_view(v, &at.key("bufferView"))).transpose()?;
        if view.is_none() {
            // Nothing in the file bounds how many zeros it declares.
            let decoded = (count as u64).saturating_mul(4 * element_type.components() as u64);
            self.budget.charge(decoded).map_err(|fault| (at.place(), fault.into()))?;
        }
        for (bounds, key) in [(&a.min, "min"), (&a.max, "max")] {
            if bounds.as_ref().is_some_and(|b| b.len() != element_type.components()) {
                self.tolerate("the bounds have another number of components than the accessor", &at.key(key));
            }
        }
        let sparse = a.sparse.map(|s| self.sparse(s, &at.key("sparse"))).transpose()?;
        Ok(Accessor {
            name: a.name,
            view,
            offset: size(offset, &at.key("byteOffset"))?,
            component_type,
            normalized,
            count,
            element_type,
            min: a.min,
            max: a.max,
            sparse: sparse.map(Box::new),
            extra: Members::new(a.extensions, a.rest).finish(a.extras, at)?.stating(stated),
        })
    }

    fn sparse(&self, s: schema::Sparse<'_>, at: &At<'_>) -> Result<Sparse> {
        let (indices, values) = (&at.key("indices"), &at.key("values"));
        let (mut of_indices, mut of_values) = (Stated::default(), Stated::default());
        let indices_offset = of_indices.note(Member::ByteOffset, s.indices.byte_offset).unwrap_or_default();
        let values_offset = of_values.note(Member::ByteOffset, s.values.byte_offset).unwrap_or_default();
        Ok(Sparse {
            count: size(s.count, &at.key("count"))?,
            indices_view: self.counts.buffer_view(s.indices.buffer_view, &indices.key("bufferView"))?,
            indices_offset: size(indices_offset, &indices.key("byteOffset"))?,
            indices_type: component_type(s.indices.component_type, &indices.key("componentType"))?,
            indices_extra: Members::new(s.indices.extensions, s.indices.rest)
                .finish(s.indices.extras, indices)?
                .stating(of_indices),
            values_view: self.counts.buffer_view(s.values.buffer_view, &values.key("bufferView"))?,
            values_offset: size(values_offset, &values.key("byteOffset"))?,
            values_extra: Members::new(s.values.extensions, s.values.rest)
                .finish(s.values.extras, values)?
                .stating(of_values),
            extra: Members::new(s.extensions, s.rest).finish(s.extras, at)?,
        })
    }
}

pub(super) fn data_uri_fault(fault: data_uri::DataUriFault, at: &At<'_>) -> crate::import::gltf::Fault {
    match fault {
        data_uri::DataUriFault::OverBudget(over) => (at.place(), over.into()),
        other => (at.place(), ImportFault::Value(other.to_string())),
    }
}

pub(super) fn component_type(value: Int, at: &At<'_>) -> Result<ComponentType> {
    Ok(match value.0 {
        5120 => ComponentType::I8,
        5121 => ComponentType::U8,
        5122 => ComponentType::I16,
        5123 => ComponentType::U16,
        5125 => ComponentType::U32,
        5126 => ComponentType::F32,
        other => return invalid(at, format!("{other} is no componentType; it must be 5120 to 5123, 5125 or 5126")),
    })
}

pub(super) fn element_type(value: schema::ElementType) -> ElementType {
    match value {
        schema::ElementType::Scalar => ElementType::Scalar,
        schema::ElementType::Vec2 => ElementType::Vec2,
        schema::ElementType::Vec3 => ElementType::Vec3,
        schema::ElementType::Vec4 => ElementType::Vec4,
        schema::ElementType::Mat2 => ElementType::Mat2,
        schema::ElementType::Mat3 => ElementType::Mat3,
        schema::ElementType::Mat4 => ElementType::Mat4,
    }
}
