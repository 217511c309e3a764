//! Buffers, views, accessors and meshes.

use super::{Document, Typed};
use crate::export::json::Object;
use crate::model::*;

impl Document<'_> {
    pub(super) fn buffers(&self, o: &mut Object<'_>) {
        if self.packed.len() == 0 {
            return;
        }
        o.lines("buffers", [()], |o, ()| {
            if let Some(uri) = self.buffer_uri {
                o.string("uri", uri);
            }
            o.integer("byteLength", self.packed.len() as u64);
            // Of several buffers none is the one that is written.
            let mut buffers = self.scene.buffers.values();
            if let (Some(buffer), None) = (buffers.next(), buffers.next()) {
                o.optional_string("name", &buffer.name);
                self.rest(o, &buffer.extra);
            }
        });
    }

    pub(super) fn buffer_views(&self, o: &mut Object<'_>) {
        enum View<'v> {
            Kept(&'v BufferView),
            New(usize, usize),
        }
        let kept = self.scene.buffer_views.iter().filter(|(id, _)| self.indices.has(*id));
        let kept = kept.map(|(_, view)| View::Kept(view));
        let new = self.images.new_views.iter().map(|&(offset, length)| View::New(offset, length));
        o.lines("bufferViews", kept.chain(new), |o, view| {
            o.integer("buffer", 0);
            match view {
                View::Kept(view) => {
                    let offset = self.packed.offset(view.buffer, view.offset) as u64;
                    if offset != 0 || view.extra.stated.has(Member::ByteOffset) {
                        o.integer(Member::ByteOffset.name(), offset);
                    }
                    o.integer("byteLength", view.length as u64);
                    if let Some(stride) = view.stride {
                        o.integer("byteStride", stride as u64);
                    }
                    if let Some(target) = view.target {
                        o.integer("target", target.into());
                    }
                    o.optional_string("name", &view.name);
                    self.rest(o, &view.extra);
                }
                View::New(offset, length) => {
                    o.integer(Member::ByteOffset.name(), offset as u64);
                    o.integer("byteLength", length as u64);
                }
            }
        });
    }

    pub(super) fn accessor(&self, o: &mut Object<'_>, x: &Accessor) {
        let stated = x.extra.stated;
        o.optional_string("name", &x.name);
        self.index(o, "bufferView", x.view);
        byte_offset(o, x.offset, stated);
        o.integer("componentType", u64::from(x.component_type as u32));
        if x.normalized || stated.has(Member::Normalized) {
            o.boolean(Member::Normalized.name(), x.normalized);
        }
        o.integer("count", x.count as u64);
        o.string(
            "type",
            match x.element_type {
                ElementType::Scalar => "SCALAR",
                ElementType::Vec2 => "VEC2",
                ElementType::Vec3 => "VEC3",
                ElementType::Vec4 => "VEC4",
                ElementType::Mat2 => "MAT2",
                ElementType::Mat3 => "MAT3",
                ElementType::Mat4 => "MAT4",
            },
        );
        for (key, bounds) in [("max", &x.max), ("min", &x.min)] {
            if let Some(bounds) = bounds {
                o.numbers(key, bounds);
            }
        }
        if let Some(sparse) = &x.sparse {
            o.object("sparse", |o| self.sparse(o, sparse));
        }
        self.rest(o, &x.extra);
    }

    fn sparse(&self, o: &mut Object<'_>, x: &Sparse) {
        o.integer("count", x.count as u64);
        o.object("indices", |o| {
            self.index(o, "bufferView", Some(x.indices_view));
            byte_offset(o, x.indices_offset, x.indices_extra.stated);
            o.integer("componentType", u64::from(x.indices_type as u32));
            self.rest(o, &x.indices_extra);
        });
        o.object("values", |o| {
            self.index(o, "bufferView", Some(x.values_view));
            byte_offset(o, x.values_offset, x.values_extra.stated);
            self.rest(o, &x.values_extra);
        });
        self.rest(o, &x.extra);
    }

    pub(super) fn mesh(&self, o: &mut Object<'_>, x: &Mesh) {
        o.optional_string("name", &x.name);
        o.array("primitives", &x.primitives, |json, primitive| json.object(|o| self.primitive(o, primitive)));
        if !x.weights.is_empty() {
            o.numbers("weights", &x.weights);
        }
        self.rest(o, &x.extra);
    }

    fn primitive(&self, o: &mut Object<'_>, x: &Primitive) {
        o.object("attributes", |o| self.attributes(o, &x.attributes.0));
        self.index(o, "indices", x.indices);
        if x.mode != PrimitiveMode::default() || x.extra.stated.has(Member::Mode) {
            o.integer(Member::Mode.name(), u64::from(x.mode as u32));
        }
        self.index(o, "material", x.material);
        o.objects("targets", &x.targets, |o, target| self.attributes(o, &target.0));
        let variants = |o: &mut Object<'_>| {
            o.objects("mappings", &x.variants, |o, mapping| {
                o.optional_string("name", &mapping.name);
                self.index(o, "material", Some(mapping.material));
                self.indices(o, "variants", mapping.variants.iter().copied());
                self.rest(o, &mapping.extra);
            });
        };
        let typed: Typed<'_> = ("KHR_materials_variants", &variants);
        self.rest_with(o, &x.extra, (!x.variants.is_empty()).then_some(typed));
    }

    pub(super) fn attributes(&self, o: &mut Object<'_>, attributes: &[(String, AccessorId)]) {
        for (semantic, id) in attributes {
            self.index(o, semantic, Some(*id));
        }
    }
}

fn byte_offset(o: &mut Object<'_>, offset: usize, stated: Stated) {
    if offset != 0 || stated.has(Member::ByteOffset) {
        o.integer(Member::ByteOffset.name(), offset as u64);
    }
}
