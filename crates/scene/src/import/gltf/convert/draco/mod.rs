//! KHR_draco_mesh_compression: compressed primitives become plain ones.
//!
//! This runs before accessors are converted. Every accessor that a compressed primitive maps gets a view of a new buffer
//! with the decoded elements, in the type that the accessor declares, and the extension goes: whatever comes after sees
//! plain accessors. The view that held the compressed bytes becomes the view of the primitive's indices, so that no bytes
//! stay referred to that nothing can read.
//!
//! A primitive whose accessors all have data besides the compressed form is left as it is, without the extension.

mod collect;
mod values;

use super::{Converter, Result};
use crate::codec::draco::{self, Component, DecodeLimits, DracoError, DracoMesh};
use crate::import::gltf::Fault;
use crate::import::gltf::extensions::DRACO;
use crate::import::gltf::schema;
use crate::import::{ImportFault, Place};
use crate::model::*;
use crate::place::push_key;
use rayon::prelude::*;

/// One compressed mesh. Primitives may share it.
struct Job {
    /// JSON pointer to the extension object of the first primitive that has it.
    pointer: String,
    /// The compressed bytes.
    source: Blob,
    header: draco::Header,
    outputs: Vec<Output>,
    /// The view of the compressed bytes, if nothing else uses it.
    view: Option<BufferViewId>,
}

/// What an accessor gets.
struct Output {
    what: What,
    /// Index of the accessor.
    accessor: usize,
    component: ComponentType,
    components: usize,
    count: usize,
    normalized: bool,
    /// Whether it declares `min` or `max`, of its compressed elements alone.
    has_bounds: bool,
}

enum What {
    Indices,
    /// An attribute, by its id in the compressed data.
    Attribute {
        id: u32,
        semantic: String,
    },
}

/// What a job decodes to.
struct Part {
    /// The elements of the outputs, one behind the other, each at a multiple of four bytes.
    bytes: Vec<u8>,
    /// By output: `min` and `max`, if they are declared. Those of the file are of the elements before compression, which
    /// may have rounded them.
    bounds: Vec<Option<values::Bounds>>,
}

impl Output {
    /// Bytes from one element to the next: vertex attributes begin at multiples of four.
    fn stride(&self) -> usize {
        let size = self.component.size() * self.components;
        match self.what {
            What::Indices => size,
            What::Attribute { .. } => size.next_multiple_of(4),
        }
    }

    /// Bytes of all elements, padded to four. `None` if they are more than this machine can address.
    fn padded_length(&self) -> Option<usize> {
        self.stride().checked_mul(self.count)?.checked_next_multiple_of(4)
    }
}

impl Job {
    /// Bytes of the decoded attributes: those that are mapped, held as the wider of their two types, and 16 bytes a
    /// vertex for what is not mapped.
    fn value_bytes(&self) -> u64 {
        let attributes = self.outputs.iter().filter(|o| matches!(o.what, What::Attribute { .. }));
        let (mut per_vertex, mut vertices) = (16, 0);
        for output in attributes {
            per_vertex += 4 * output.components as u64;
            vertices = vertices.max(output.count as u64);
        }
        vertices.saturating_mul(per_vertex)
    }

    /// Bytes of memory that decoding may take besides its part.
    fn peak_bytes(&self) -> u64 {
        self.header.peak_bytes(self.value_bytes())
    }

    /// Bytes of its part.
    fn length(&self) -> Option<usize> {
        self.outputs.iter().try_fold(0_usize, |sum, o| sum.checked_add(o.padded_length()?))
    }

    fn decode(&self) -> std::result::Result<Part, Fault> {
        let limits = DecodeLimits {
            max_bytes: self.peak_bytes(),
            max_value_bytes: self.value_bytes(),
            max_seam_attributes: self.outputs.len() as u32 + UNMAPPED_ATTRIBUTES,
        };
        let mesh = draco::decode(&self.source, &limits).map_err(|e| self.fault(e))?;
        let mut part = Part { bytes: Vec::new(), bounds: Vec::with_capacity(self.outputs.len()) };
        for output in &self.outputs {
            let start = part.bytes.len();
            self.append(output, &mesh, &mut part.bytes)?;
            let bounds = output
                .has_bounds
                .then(|| values::bounds(&part.bytes[start..], output.component, output.components, output.stride()));
            part.bounds.push(bounds);
            part.bytes.resize(part.bytes.len().next_multiple_of(4), 0);
        }
        Ok(part)
    }

    fn append(&self, output: &Output, mesh: &DracoMesh, part: &mut Vec<u8>) -> std::result::Result<(), Fault> {
        match &output.what {
            What::Indices => {
                if mesh.indices.len() != output.count {
                    return Err(self.count_fault("indices", mesh.indices.len(), output, &[]));
                }
                values::append_indices(&mesh.indices, output.component, part)
                    .map_err(|what| (self.place(&[]), ImportFault::Value(what)))
            }
            What::Attribute { id, semantic } => {
                let keys = ["attributes", semantic];
                if mesh.vertex_count != output.count {
                    return Err(self.count_fault("vertices", mesh.vertex_count, output, &keys));
                }
                let invalid = |what| (self.place(&keys), ImportFault::Value(what));
                let Some(attribute) = mesh.attribute(*id) else {
                    return Err(invalid(format!("the compressed mesh has no attribute {id}")));
                };
                if usize::from(attribute.components) != output.components {
                    let (found, declared) = (attribute.components, output.components);
                    return Err(invalid(format!(
                        "the compressed attribute has {found} components, but accessor {} declares {declared}",
                        output.accessor
                    )));
                }
                let start = part.len();
                values::append_attribute(attribute, output.component, output.normalized, output.stride(), part)
                    .map_err(invalid)?;
                if semantic.starts_with("COLOR_")
                    && (attribute.component, output.component) == (Component::F32, ComponentType::F32)
                {
                    values::clamp_colors(&mut part[start..]);
                }
                Ok(())
            }
        }
    }

    fn count_fault(&self, what: &str, found: usize, output: &Output, keys: &[&str]) -> Fault {
        let Output { accessor, count, .. } = output;
        let what = format!("the compressed mesh has {found} {what}, but accessor {accessor} declares {count}");
        (self.place(keys), ImportFault::Value(what))
    }

    fn fault(&self, error: DracoError) -> Fault {
        (self.place(&[]), ImportFault::Draco(error))
    }

    fn place(&self, keys: &[&str]) -> Place {
        let mut pointer = self.pointer.clone();
        keys.iter().for_each(|key| push_key(&mut pointer, key));
        Place::Pointer(pointer)
    }
}

/// Attributes with seams that compressed data may have besides those that are mapped.
const UNMAPPED_ATTRIBUTES: u32 = 4;

impl Converter<'_> {
    /// Decodes all compressed primitives, in parallel. Buffers and views are there; accessors are not yet.
    pub(super) fn draco_primitives<'a>(
        &mut self,
        meshes: &mut [schema::Mesh<'a>],
        accessors: &mut Vec<schema::Accessor<'a>>,
        images: &[schema::Image<'_>],
    ) -> Result<()> {
        let jobs = self.collect_draco(meshes, accessors, images)?;
        for list in [&mut self.scene.extensions_used, &mut self.scene.extensions_required] {
            list.retain(|name| name != DRACO);
        }
        if jobs.is_empty() {
            return Ok(());
        }
        let parts = self.decode_draco(&jobs)?;
        self.place_draco(&jobs, parts, accessors)
    }

    /// As many jobs at once as the memory allows for.
    fn decode_draco(&mut self, jobs: &[Job]) -> Result<Vec<Part>> {
        let mut parts = Vec::with_capacity(jobs.len());
        while parts.len() < jobs.len() {
            let waiting = &jobs[parts.len()..];
            let (mut wave, mut working) = (0, 0);
            for job in waiting {
                let length = job.length().map_or(u64::MAX, |n| n as u64);
                match self.budget.charge(job.peak_bytes().saturating_add(length)) {
                    Ok(()) => (wave, working) = (wave + 1, working + job.peak_bytes()),
                    Err(over) if wave == 0 => return Err((job.place(&[]), over.into())),
                    Err(_) => break,
                }
            }
            let decoded: Vec<_> = waiting[..wave].par_iter().map(Job::decode).collect();
            self.budget.release(working);
            for part in decoded {
                parts.push(part?);
            }
        }
        Ok(parts)
    }

    /// Puts all parts into a new buffer, and gives each accessor its view.
    fn place_draco(&mut self, jobs: &[Job], parts: Vec<Part>, accessors: &mut [schema::Accessor<'_>]) -> Result<()> {
        let total: usize = parts.iter().map(|p| p.bytes.len()).sum();
        self.budget.charge(total as u64).map_err(|over| (jobs[0].place(&[]), over.into()))?;
        let mut data = Vec::with_capacity(total);
        let buffer = Store::<BufferId, ()>::nth_id(self.scene.buffers.len());
        for (job, part) in jobs.iter().zip(parts) {
            let mut free_view = job.view;
            let mut offset = data.len();
            for (output, bounds) in job.outputs.iter().zip(part.bounds) {
                let length = output.stride() * output.count;
                let (target, stride) = match output.what {
                    What::Indices => (34963, None),
                    What::Attribute { .. } => (34962, Some(output.stride())),
                };
                // The stride of tightly packed elements goes without saying.
                let stride = stride.filter(|&s| s != output.component.size() * output.components);
                let place = |view: &mut BufferView| {
                    (view.buffer, view.offset, view.length) = (buffer, offset, length);
                    (view.stride, view.target) = (stride, Some(target));
                };
                let view = match free_view.take() {
                    Some(id) => {
                        place(self.scene.buffer_views.get_mut(id).expect("the view was read from"));
                        Store::<BufferViewId, ()>::slot(id)
                    }
                    None => {
                        let mut view = BufferView {
                            name: None,
                            buffer,
                            offset,
                            length,
                            stride,
                            target: Some(target),
                            extra: Extra::default(),
                        };
                        place(&mut view);
                        let index = self.scene.buffer_views.len();
                        self.scene.buffer_views.insert_nth(index, view);
                        index
                    }
                };
                let accessor = &mut accessors[output.accessor];
                accessor.buffer_view = Some(schema::Int(view as u64));
                accessor.byte_offset = None;
                if let Some(values::Bounds { min, max }) = bounds {
                    // What was not declared stays so.
                    accessor.min = accessor.min.take().and(min);
                    accessor.max = accessor.max.take().and(max);
                }
                offset += length.next_multiple_of(4);
            }
            data.extend_from_slice(&part.bytes);
        }
        self.counts.buffer_views = self.scene.buffer_views.len();
        self.budget.release(total as u64);
        let index = self.scene.buffers.len();
        self.scene
            .buffers
            .insert_nth(index, Buffer { name: None, uri: None, data: Blob::new(data), extra: Extra::default() });
        self.counts.buffers = self.scene.buffers.len();
        Ok(())
    }
}
