//! Meshes and material variants.

use super::{Converter, Members, Result, invalid};
use crate::import::gltf::schema;
use crate::model::*;
use crate::place::At;

impl Converter<'_> {
    pub(super) fn variants<'a>(&mut self, variants: schema::Variants<'a>, members: &mut Members<'a>) -> Result<()> {
        let name = "KHR_materials_variants";
        let at = &At::Root.key("extensions");
        let at = &at.key(name);
        let at = &at.key("variants");
        for (i, v) in variants.variants.into_iter().enumerate() {
            let extra = Members::new(v.extensions, v.rest).finish(v.extras, &at.index(i))?;
            self.scene.variants.insert_nth(i, Variant { name: v.name, extra });
        }
        members.keep_rest(name, variants.extensions, variants.extras, variants.rest, &At::Root)
    }

    pub(super) fn meshes(&mut self, meshes: Vec<schema::Mesh<'_>>) -> Result<()> {
        let at = &At::Root.key("meshes");
        self.scene.meshes.reserve(meshes.len());
        for (i, m) in meshes.into_iter().enumerate() {
            let mesh = self.mesh(m, &at.index(i))?;
            self.scene.meshes.insert_nth(i, mesh);
        }
        Ok(())
    }

    fn mesh(&mut self, m: schema::Mesh<'_>, at: &At<'_>) -> Result<Mesh> {
        let primitives_at = &at.key("primitives");
        let mut primitives = Vec::with_capacity(m.primitives.len());
        for (i, p) in m.primitives.into_iter().enumerate() {
            primitives.push(self.primitive(p, &primitives_at.index(i))?);
        }
        let targets = |p: &Primitive| p.targets.len();
        if let Some(first) = primitives.first().map(targets) {
            if let Some(i) = primitives.iter().position(|p| targets(p) != first) {
                let count = targets(&primitives[i]);
                let what =
                    format!("the primitive has {count} morph targets, but the first one of the mesh has {first}");
                return invalid(&primitives_at.index(i), what);
            }
            if !m.weights.is_empty() && m.weights.len() != first {
                self.tolerate("there are not as many weights as morph targets", &at.key("weights"));
            }
        }
        Ok(Mesh {
            name: m.name,
            primitives,
            weights: m.weights,
            extra: Members::new(m.extensions, m.rest).finish(m.extras, at)?,
        })
    }

    fn primitive(&mut self, p: schema::Primitive<'_>, at: &At<'_>) -> Result<Primitive> {
        let mut stated = Stated::default();
        let mode = mode(stated.note(Member::Mode, p.mode), &at.key("mode"))?;
        let mut members = Members::new(p.extensions, p.rest);
        let attributes = self.attributes(p.attributes, &at.key("attributes"))?;
        let indices = p.indices.map(|i| self.counts.accessor(i, &at.key("indices"))).transpose()?;
        let mut targets = Vec::with_capacity(p.targets.len());
        for (i, t) in p.targets.into_iter().enumerate() {
            targets.push(self.attributes(t, &at.key("targets").index(i))?);
        }
        self.check_attributes(&attributes, &targets, at)?;
        if let Some(indices) = indices {
            self.check_indices(indices, mode, &at.key("indices"))?;
        }

        let name = "KHR_materials_variants";
        let variants = match members.take::<schema::VariantMappings<'_>>(name, at)? {
            None => Vec::new(),
            Some(v) => {
                members.keep_rest(name, v.extensions, v.extras, v.rest, at)?;
                self.variant_mappings(v.mappings, &at.key("extensions").key(name).key("mappings"))?
            }
        };
        Ok(Primitive {
            attributes,
            indices,
            mode,
            targets,
            material: p.material.map(|m| self.counts.material(m, &at.key("material"))).transpose()?,
            variants,
            extra: members.finish(p.extras, at)?.stating(stated),
        })
    }

    fn attributes(&self, attributes: schema::Attributes, at: &At<'_>) -> Result<Attributes> {
        let mut out = Vec::with_capacity(attributes.0.len());
        for (semantic, index) in attributes.0 {
            let id = self.counts.accessor(index, &at.key(&semantic))?;
            out.push((semantic, id));
        }
        Ok(Attributes(out))
    }

    fn variant_mappings(&self, mappings: Vec<schema::VariantMapping<'_>>, at: &At<'_>) -> Result<Vec<VariantMapping>> {
        let mut out = Vec::with_capacity(mappings.len());
        for (i, m) in mappings.into_iter().enumerate() {
            let at = &at.index(i);
            let material = self.counts.material(m.material, &at.key("material"))?;
            let mut variants = Vec::with_capacity(m.variants.len());
            for (k, v) in m.variants.into_iter().enumerate() {
                variants.push(self.counts.variant(v, &at.key("variants").index(k))?);
            }
            let extra = Members::new(m.extensions, m.rest).finish(m.extras, at)?;
            out.push(VariantMapping { material, variants, name: m.name, extra });
        }
        Ok(out)
    }

    fn check_attributes(&mut self, attributes: &Attributes, targets: &[Attributes], at: &At<'_>) -> Result<()> {
        let attributes_at = &at.key("attributes");
        let Some(position) = attributes.get("POSITION") else {
            self.tolerate("a primitive without POSITION is not shown", attributes_at);
            return self.check_pairs(attributes, attributes_at);
        };
        let vertices = self.scene.accessors[position].count;
        for (semantic, id) in &attributes.0 {
            let at = &attributes_at.key(semantic);
            self.check_semantic(semantic, *id, false, at)?;
            self.check_count(*id, vertices, at)?;
        }
        let targets_at = &at.key("targets");
        for (i, target) in targets.iter().enumerate() {
            let at = &targets_at.index(i);
            for (semantic, id) in &target.0 {
                let at = &at.key(semantic);
                self.check_semantic(semantic, *id, true, at)?;
                self.check_count(*id, vertices, at)?;
            }
        }
        self.check_pairs(attributes, attributes_at)
    }

    fn check_count(&self, id: AccessorId, vertices: usize, at: &At<'_>) -> Result<()> {
        match self.scene.accessors[id].count {
            count if count == vertices => Ok(()),
            count => invalid(at, format!("the attribute has {count} elements, but POSITION has {vertices}")),
        }
    }

    /// The element type that a semantic asks for (glTF 2.0, sections 3.7.2.1 and 3.7.2.2). Component types beyond the
    /// core's are those of KHR_mesh_quantization, whether or not the file says so.
    fn check_semantic(&mut self, semantic: &str, id: AccessorId, is_target: bool, at: &At<'_>) -> Result<()> {
        use ComponentType::*;
        use ElementType::*;
        let accessor = &self.scene.accessors[id];
        let (element, component) = (accessor.element_type, accessor.component_type);
        let fits = match semantic.trim_end_matches(|c: char| c.is_ascii_digit()) {
            "POSITION" | "NORMAL" => element == Vec3 && component != U32,
            "TANGENT" => element == if is_target { Vec3 } else { Vec4 } && component != U32,
            "TEXCOORD_" => element == Vec2 && component != U32,
            "COLOR_" if is_target => matches!(element, Vec3 | Vec4) && component != U32,
            "COLOR_" => matches!(element, Vec3 | Vec4) && matches!(component, F32 | U8 | U16),
            "JOINTS_" => element == Vec4 && matches!(component, U8 | U16),
            "WEIGHTS_" => element == Vec4 && matches!(component, F32 | U8 | U16),
            custom => {
                if !custom.starts_with('_') {
                    self.tolerate("an attribute of unknown meaning is kept, and has no effect", at);
                }
                true
            }
        };
        if fits { Ok(()) } else { invalid(at, format!("{semantic} cannot be {element:?} of {component:?}")) }
    }

    /// Each set of joints has its weights.
    fn check_pairs(&self, attributes: &Attributes, at: &At<'_>) -> Result<()> {
        let sets = |prefix: &str| {
            let mut sets: Vec<&str> =
                attributes.0.iter().filter_map(|(semantic, _)| semantic.strip_prefix(prefix)).collect();
            sets.sort_unstable();
            sets
        };
        let (joints, weights) = (sets("JOINTS_"), sets("WEIGHTS_"));
        if joints == weights {
            return Ok(());
        }
        invalid(at, "each JOINTS_n needs its WEIGHTS_n, and each WEIGHTS_n its JOINTS_n")
    }

    fn check_indices(&mut self, id: AccessorId, mode: PrimitiveMode, at: &At<'_>) -> Result<()> {
        let accessor = &self.scene.accessors[id];
        let (element, component, count) = (accessor.element_type, accessor.component_type, accessor.count);
        let unsigned = matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if element != ElementType::Scalar || !unsigned {
            return invalid(at, format!("indices cannot be {element:?} of {component:?}"));
        }
        let whole = match mode {
            PrimitiveMode::Triangles => count % 3 == 0,
            PrimitiveMode::Lines => count % 2 == 0,
            PrimitiveMode::TriangleStrip | PrimitiveMode::TriangleFan => count >= 3,
            _ => true,
        };
        if !whole {
            self.tolerate("the number of indices does not fit the mode; the rest is not shown", at);
        }
        Ok(())
    }
}

fn mode(mode: Option<schema::Int>, at: &At<'_>) -> Result<PrimitiveMode> {
    Ok(match mode.map_or(4, |m| m.0) {
        0 => PrimitiveMode::Points,
        1 => PrimitiveMode::Lines,
        2 => PrimitiveMode::LineLoop,
        3 => PrimitiveMode::LineStrip,
        4 => PrimitiveMode::Triangles,
        5 => PrimitiveMode::TriangleStrip,
        6 => PrimitiveMode::TriangleFan,
        other => return invalid(at, format!("{other} is no primitive mode; it must be 0 to 6")),
    })
}
