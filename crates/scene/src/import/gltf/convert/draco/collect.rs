//! Which primitives are compressed, and what their accessors get.

use super::super::buffers::{component_type, element_type};
use super::super::{Converter, Members, Result, invalid, size};
use super::{Job, Output, What};
use crate::codec::draco::Header;
use crate::import::ImportFault;
use crate::import::gltf::extensions::DRACO;
use crate::import::gltf::schema::{self, Int, Rest};
use crate::model::*;
use crate::place::At;
use std::collections::{HashMap, HashSet};

/// Where the elements of an accessor come from: a compressed view, and an attribute of it (none for the indices).
type Source = (BufferViewId, Option<u32>);

/// What is known while the primitives are visited.
#[derive(Default)]
struct Found {
    jobs: Vec<Job>,
    by_view: HashMap<BufferViewId, usize>,
    sources: HashMap<usize, Source>,
    /// Views that something besides compressed primitives refers to.
    plain_views: HashSet<u64>,
}

impl Converter<'_> {
    /// Takes the extension out of all primitives.
    pub(super) fn collect_draco<'a>(
        &mut self,
        meshes: &mut [schema::Mesh<'a>],
        accessors: &mut Vec<schema::Accessor<'a>>,
        images: &[schema::Image<'_>],
    ) -> Result<Vec<Job>> {
        let mut found: Option<Found> = None;
        let at = &At::Root.key("meshes");
        for (m, mesh) in meshes.iter_mut().enumerate() {
            let at = &at.index(m);
            let at = &at.key("primitives");
            for (k, primitive) in mesh.primitives.iter_mut().enumerate() {
                if !primitive.extensions.as_ref().is_some_and(|e| e.0.iter().any(|(name, _)| name == DRACO)) {
                    continue;
                }
                let at = &at.index(k);
                let mut members = Members::new(primitive.extensions.take(), Rest::default());
                let object = members.take::<schema::Draco>(DRACO, at)?;
                primitive.extensions = members.into_extensions();
                let Some(object) = object else { continue };
                let found = found
                    .get_or_insert_with(|| Found { plain_views: plain_views(accessors, images), ..Found::default() });
                self.collect_primitive(primitive, &object, accessors, found, at)?;
            }
        }
        Ok(found.map(|f| f.jobs).unwrap_or_default())
    }

    fn collect_primitive<'a>(
        &mut self,
        primitive: &mut schema::Primitive<'a>,
        object: &schema::Draco,
        accessors: &mut Vec<schema::Accessor<'a>>,
        found: &mut Found,
        primitive_at: &At<'_>,
    ) -> Result<()> {
        let attributes_at = &primitive_at.key("attributes");
        let at = &primitive_at.key("extensions");
        let at = &at.key(DRACO);
        let view = self.counts.buffer_view(object.buffer_view, &at.key("bufferView"))?;
        let mut mapped = Vec::new();
        for (semantic, id) in &object.attributes.0 {
            let at = &at.key("attributes");
            let at = &at.key(semantic);
            let Ok(id) = u32::try_from(id.0) else {
                return invalid(at, "the id of a compressed attribute has 32 bits");
            };
            match primitive.attributes.0.iter().position(|(s, _)| s == semantic) {
                Some(slot) => mapped.push((slot, id)),
                None => self.tolerate("a compressed attribute that the primitive does not have is not used", at),
            }
        }
        for &(slot, _) in &mapped {
            let (semantic, index) = &primitive.attributes.0[slot];
            self.counts.accessor(*index, &attributes_at.key(semantic))?;
        }
        if let Some(indices) = primitive.indices {
            self.counts.accessor(indices, &primitive_at.key("indices"))?;
        }
        let has_data = |index: Int| accessors[index.0 as usize].buffer_view.is_some();
        let is_plain = primitive.indices.is_some_and(has_data)
            && mapped.iter().all(|&(slot, _)| has_data(primitive.attributes.0[slot].1));
        if is_plain {
            return Ok(());
        }
        if primitive.mode.is_some_and(|m| m.0 != 4) {
            return invalid(
                &primitive_at.key("mode"),
                "a compressed primitive can only be read if its mode is 4 (triangles); export it as triangles",
            );
        }

        let job = match found.by_view.get(&view) {
            Some(&job) => job,
            None => {
                let job = self.new_job(view, found.plain_views.contains(&object.buffer_view.0), at)?;
                found.by_view.insert(view, found.jobs.len());
                found.jobs.push(job);
                found.jobs.len() - 1
            }
        };
        let triangles = found.jobs[job].header.triangles as usize;
        let indices = match primitive.indices {
            Some(indices) => indices,
            None => {
                // Without them the triangles would be lost: they are what the compressed data is for.
                primitive.indices = Some(Int(accessors.len() as u64));
                accessors.push(index_accessor(3 * triangles as u64));
                primitive.indices.unwrap_or_default()
            }
        };
        let at_indices = &primitive_at.key("indices");
        let indices = self.output(indices, What::Indices, view, accessors, found, at_indices)?;
        if let Some(output) = indices {
            primitive.indices = Some(Int(output.accessor as u64));
            let (found_count, Output { accessor, count, .. }) = (3 * triangles, &output);
            if *count != found_count {
                let what =
                    format!("the compressed mesh has {found_count} indices, but accessor {accessor} declares {count}");
                return invalid(at, what);
            }
            // The first output takes the place of the compressed bytes.
            found.jobs[job].outputs.insert(0, output);
        }
        for (slot, id) in mapped {
            let (semantic, index) = &mut primitive.attributes.0[slot];
            let what = What::Attribute { id, semantic: semantic.clone() };
            let at = &attributes_at.key(semantic);
            if let Some(output) = self.output(*index, what, view, accessors, found, at)? {
                *index = Int(output.accessor as u64);
                found.jobs[job].outputs.push(output);
            }
        }
        self.counts.accessors = accessors.len();
        Ok(())
    }

    fn new_job(&self, view: BufferViewId, is_plain: bool, at: &At<'_>) -> Result<Job> {
        let v = &self.scene.buffer_views[view];
        // Views were checked to lie in their buffers.
        let source = self.scene.buffers[v.buffer].data.slice(v.offset..v.offset + v.length);
        let source = source.unwrap_or_else(|| Blob::new(Vec::new()));
        let header = Header::read(&source).map_err(|e| (at.place(), ImportFault::Draco(e)))?;
        let view = (!is_plain).then_some(view);
        Ok(Job { pointer: at.pointer(), source, header, outputs: Vec::new(), view })
    }

    /// What an accessor gets, unless it gets it already. If it gets something else, another accessor takes its place.
    fn output<'a>(
        &self,
        index: Int,
        what: What,
        view: BufferViewId,
        accessors: &mut Vec<schema::Accessor<'a>>,
        found: &mut Found,
        at: &At<'_>,
    ) -> Result<Option<Output>> {
        let id = match &what {
            What::Indices => None,
            What::Attribute { id, .. } => Some(*id),
        };
        let mut accessor = index.0 as usize;
        match found.sources.get(&accessor) {
            Some(&source) if source == (view, id) => return Ok(None),
            Some(_) => {
                accessors.push(twin(&accessors[accessor], at)?);
                accessor = accessors.len() - 1;
            }
            None => {}
        }
        found.sources.insert(accessor, (view, id));
        let a = &accessors[accessor];
        let accessor_at = &At::Root.key("accessors");
        let accessor_at = &accessor_at.index(accessor);
        let element = element_type(a.element_type);
        if matches!(element, ElementType::Mat2 | ElementType::Mat3 | ElementType::Mat4) {
            return invalid(at, "matrices cannot be compressed");
        }
        let output = Output {
            what,
            accessor,
            component: component_type(a.component_type, &accessor_at.key("componentType"))?,
            components: element.components(),
            count: size(a.count, &accessor_at.key("count"))?,
            normalized: a.normalized.unwrap_or(false),
            has_bounds: (a.min.is_some() || a.max.is_some()) && a.sparse.is_none(),
        };
        Ok(Some(output))
    }
}

/// Views that accessors and images refer to.
fn plain_views(accessors: &[schema::Accessor<'_>], images: &[schema::Image<'_>]) -> HashSet<u64> {
    let mut views: HashSet<u64> = images.iter().filter_map(|i| i.buffer_view).map(|v| v.0).collect();
    for accessor in accessors {
        views.extend(accessor.buffer_view.map(|v| v.0));
        if let Some(sparse) = &accessor.sparse {
            views.extend([sparse.indices.buffer_view.0, sparse.values.buffer_view.0]);
        }
    }
    views
}

/// The accessor of indices that the document does not declare.
fn index_accessor<'a>(count: u64) -> schema::Accessor<'a> {
    schema::Accessor {
        name: None,
        buffer_view: None,
        byte_offset: None,
        component_type: Int(ComponentType::U32 as u64),
        normalized: None,
        count: Int(count),
        element_type: schema::ElementType::Scalar,
        min: None,
        max: None,
        sparse: None,
        extensions: None,
        extras: None,
        rest: Rest::default(),
    }
}

/// Another accessor like this one, for a primitive that shares it with a primitive that is compressed on its own.
fn twin<'a>(accessor: &schema::Accessor<'a>, at: &At<'_>) -> Result<schema::Accessor<'a>> {
    if accessor.sparse.is_some() {
        return invalid(at, "two compressed primitives give different elements to one sparse accessor");
    }
    Ok(schema::Accessor {
        name: accessor.name.clone(),
        normalized: accessor.normalized,
        component_type: accessor.component_type,
        element_type: accessor.element_type,
        min: accessor.min.clone(),
        max: accessor.max.clone(),
        extras: accessor.extras,
        rest: Rest(accessor.rest.0.clone()),
        ..index_accessor(accessor.count.0)
    })
}
