//! Geometry. A mesh of the file has no material: objects give it one, so that it can have many.

use super::schema::{self, Dtype};
use super::views::GENERATED_BUFFER;
use super::{Converter, Result, at, index, invalid, name, nth};
use crate::accessor::AccessorFault;
use crate::import::ImportFault;
use crate::model::*;

/// One geometry of the file.
pub struct Geometry {
    pub name: Option<String>,
    attributes: Attributes,
    indices: AccessorId,
}

impl Geometry {
    /// The mesh that shows it with a material. All of them share the accessors.
    pub fn mesh(&self, material: Option<MaterialId>) -> Mesh {
        let primitive = Primitive {
            attributes: self.attributes.clone(),
            indices: Some(self.indices),
            mode: PrimitiveMode::Triangles,
            targets: Vec::new(),
            material,
            variants: Vec::new(),
            extra: Extra::default(),
        };
        Mesh { name: self.name.clone(), primitives: vec![primitive], ..Mesh::default() }
    }
}

/// What a view holds for meshes. A view has one element type, hence one accessor at most.
struct Accessors {
    by_view: Vec<Option<AccessorId>>,
    /// Whether a mesh has its positions there.
    is_positions: Vec<bool>,
}

impl Converter<'_> {
    pub(super) fn geometries(&mut self, meshes: &[schema::Mesh], dtypes: &[Dtype]) -> Result<Vec<Geometry>> {
        let mut accessors = Accessors { by_view: vec![None; dtypes.len()], is_positions: vec![false; dtypes.len()] };
        for mesh in meshes {
            if let Some(is) = usize::try_from(mesh.positions).ok().and_then(|i| accessors.is_positions.get_mut(i)) {
                *is = true;
            }
        }
        let mut geometries = Vec::with_capacity(meshes.len());
        for (i, mesh) in meshes.iter().enumerate() {
            geometries.push(self.geometry(mesh, i, dtypes, &mut accessors)?);
        }
        Ok(geometries)
    }

    fn geometry(&mut self, mesh: &schema::Mesh, i: usize, dtypes: &[Dtype], known: &mut Accessors) -> Result<Geometry> {
        let view = |c: &Self, value, dtype, key| c.view_of(value, dtype, dtypes, "meshes", i, key);
        let positions = view(self, mesh.positions, Dtype::VEC3_F32, "positions")?;
        let indices = view(self, mesh.indices, Dtype::VEC3_U32, "indices")?;
        let texcoords = mesh.texcoords.map(|v| view(self, v, Dtype::VEC2_F32, "texcoords")).transpose()?;
        let normals = match mesh.normals {
            Some(value) => Some(index(value, "buffer view", dtypes.len(), || at("meshes", i, "normals"))?),
            None => None,
        };

        let position_accessor = self.accessor(positions, dtypes, known, i, "positions")?;
        self.bound_positions(position_accessor);
        let vertices = self.scene.accessors[position_accessor].count;
        let mut attributes = vec![("POSITION".to_owned(), position_accessor)];
        if let Some(view) = normals {
            // Some writers say view 0 where a mesh has normals, but no texture coordinates.
            let count = self.scene.buffer_views[nth(view)].length / dtypes[view].size();
            if dtypes[view] == Dtype::VEC3_F32 && count == vertices && !known.is_positions[view] {
                attributes.push(("NORMAL".to_owned(), self.accessor(view, dtypes, known, i, "normals")?));
            } else {
                let what = "the normals are no VEC3_F32 view of as many elements as there are vertices, or are \
                            positions; the mesh is shown without them";
                self.tolerate(what, || at("meshes", i, "normals"));
            }
        }
        if let Some(view) = texcoords {
            let id = self.accessor(view, dtypes, known, i, "texcoords")?;
            let count = self.scene.accessors[id].count;
            if count != vertices {
                let what = format!("there are {count} texture coordinates, but {vertices} positions");
                return invalid(at("meshes", i, "texcoords"), what);
            }
            attributes.push(("TEXCOORD_0".to_owned(), id));
        }

        let indices = self.accessor(indices, dtypes, known, i, "indices")?;
        self.check_vertex_indices(indices, vertices, i)?;
        if self.scene.accessors[indices].count == 0 {
            self.tolerate("the mesh has no triangles", || at("meshes", i, "indices"));
        }
        Ok(Geometry { name: name(&mesh.name), attributes: Attributes(attributes), indices })
    }

    /// The accessor of a view, made where it is used first.
    fn accessor(
        &mut self,
        view: usize,
        dtypes: &[Dtype],
        known: &mut Accessors,
        mesh: usize,
        key: &'static str,
    ) -> Result<AccessorId> {
        if let Some(id) = known.by_view[view] {
            return Ok(id);
        }
        let (element_type, component_type, per_element) = match dtypes[view] {
            Dtype::VEC2_F32 => (ElementType::Vec2, ComponentType::F32, 1),
            Dtype::VEC3_U32 => (ElementType::Scalar, ComponentType::U32, 3),
            _ => (ElementType::Vec3, ComponentType::F32, 1),
        };
        let BufferView { offset, length, .. } = self.scene.buffer_views[nth(view)];
        let count = length / dtypes[view].size() * per_element;
        let turns = dtypes[view] == Dtype::VEC2_F32;
        if turns || !offset.is_multiple_of(4) {
            let start = self.make_room(length, || at("meshes", mesh, key))?;
            let source = self.blob.clone();
            let source = &source[offset..offset + length];
            if turns {
                let turned = source.as_chunks::<4>().0.iter().enumerate().flat_map(|(k, &bytes)| {
                    let value = f32::from_le_bytes(bytes);
                    if k % 2 == 0 { bytes } else { (1.0 - value).to_le_bytes() }
                });
                self.generated.bytes.extend(turned);
            } else {
                self.generated.bytes.extend_from_slice(source);
            }
            self.redirect(view, start);
        }
        let accessor = Accessor::packed(nth(view), component_type, element_type, count);
        let id = self.scene.accessors.insert(accessor);
        known.by_view[view] = Some(id);
        Ok(id)
    }

    /// The bytes of an accessor that a mesh uses: of the blob, or of what is made anew.
    fn accessor_bytes(&self, id: AccessorId) -> &[u8] {
        let Some(view) = self.scene.accessors[id].view.map(|view| &self.scene.buffer_views[view]) else { return &[] };
        let is_generated = view.buffer == nth(GENERATED_BUFFER);
        let bytes: &[u8] = if is_generated { &self.generated.bytes } else { &self.blob };
        &bytes[view.offset..view.offset + view.length]
    }

    /// glTF asks for the box of positions. Infinite ones have none.
    fn bound_positions(&mut self, id: AccessorId) {
        if self.scene.accessors[id].min.is_some() {
            return;
        }
        let (mut min, mut max) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for vertex in self.accessor_bytes(id).as_chunks::<12>().0 {
            for (k, &bytes) in vertex.as_chunks::<4>().0.iter().enumerate() {
                let value = f32::from_le_bytes(bytes);
                min[k] = min[k].min(value);
                max[k] = max[k].max(value);
            }
        }
        if min.iter().chain(&max).all(|v| v.is_finite())
            && let Some(accessor) = self.scene.accessors.get_mut(id)
        {
            accessor.min = Some(min.map(f64::from).to_vec());
            accessor.max = Some(max.map(f64::from).to_vec());
        }
    }

    fn check_vertex_indices(&self, id: AccessorId, vertices: usize, mesh: usize) -> Result<()> {
        let read = || self.accessor_bytes(id).as_chunks::<4>().0.iter().map(|&bytes| u32::from_le_bytes(bytes));
        // The maximum is found in a loop that vectorises; the culprit is looked for only if there is one.
        if read().max().is_none_or(|max| (max as usize) < vertices) {
            return Ok(());
        }
        match read().enumerate().find(|&(_, index)| index as usize >= vertices) {
            None => Ok(()),
            Some((position, index)) => {
                let fault = AccessorFault::VertexIndexRange { position, index, vertices };
                Err((at("meshes", mesh, "indices"), ImportFault::Accessor(fault)))
            }
        }
    }
}
