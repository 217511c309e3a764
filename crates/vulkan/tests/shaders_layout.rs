//! Every struct that crosses to the shaders has the same members at the same offsets on both sides.

use orthant_resident::batch::TextureRow;
use orthant_resident::rows::{
    EmitterRow, EmitterTriangle, LightRow, Mat3x4, MaterialRow, MeshDesc, RenderNodeRow, TextureSlot, VertexRow,
};
use orthant_resident::sampling::light_tree::{LightBounds, LightNode};
use orthant_resident::world::{BlockRow, LeafRow, WorldNode};
use orthant_vulkan::abi::{
    CenterHit, Constants, FrameTable, ImageRow, InstancePush, LightTable, QuadRow, RowSpan, SceneTable, TracePush,
};
use orthant_vulkan::raster::abi::{CullPush, DrawCommand, EnvironmentPush, RasterPush, RasterTable, ResolvePush};
use orthant_vulkan::world::abi::{ScatterPush, WordSpan, WorldTable};
use orthant_vulkan::world::view::{LayerRow, WorldFrame, WorldPush};
use rspirv::dr::{Instruction, Module, Operand, load_bytes};
use rspirv::spirv::{Decoration, Op, StorageClass};
use std::collections::{BTreeMap, BTreeSet};
use std::mem::offset_of;
use std::path::{Path, PathBuf};

/// A member: name, offset, size in bytes.
type Member = (String, u32, u32);

/// A struct: its members by offset, and its size, where there is an array of it.
#[derive(Clone, Debug, PartialEq)]
struct Layout {
    members: Vec<Member>,
    size: Option<u32>,
}

/// The structs with a layout in a compiled module.
struct Reflection {
    module: Module,
    /// Place of a type's instruction.
    types: BTreeMap<u32, usize>,
    array_strides: BTreeMap<u32, u32>,
    offsets: BTreeMap<(u32, u32), u32>,
    names: BTreeMap<u32, String>,
    member_names: BTreeMap<(u32, u32), String>,
    constants: BTreeMap<u32, u32>,
}

fn id(operand: &Operand) -> u32 {
    operand.unwrap_id_ref()
}

fn number(operand: &Operand) -> u32 {
    operand.unwrap_literal_bit32()
}

impl Reflection {
    fn new(bytes: Vec<u8>) -> Self {
        let module = load_bytes(bytes).expect("the module is SPIR-V");
        let (mut array_strides, mut offsets) = (BTreeMap::new(), BTreeMap::new());
        for i in &module.annotations {
            match (i.class.opcode, &i.operands[..]) {
                (Op::Decorate, [target, Operand::Decoration(Decoration::ArrayStride), stride]) => {
                    array_strides.insert(id(target), number(stride));
                }
                (Op::MemberDecorate, [target, member, Operand::Decoration(Decoration::Offset), offset]) => {
                    offsets.insert((id(target), number(member)), number(offset));
                }
                _ => {}
            }
        }
        let (mut names, mut member_names) = (BTreeMap::new(), BTreeMap::new());
        for i in &module.debug_names {
            match (i.class.opcode, &i.operands[..]) {
                (Op::Name, [target, Operand::LiteralString(name)]) => {
                    names.insert(id(target), name.clone());
                }
                (Op::MemberName, [target, member, Operand::LiteralString(name)]) => {
                    member_names.insert((id(target), number(member)), name.clone());
                }
                other => panic!("a name of {other:?}"),
            }
        }
        let (mut types, mut constants) = (BTreeMap::new(), BTreeMap::new());
        for (at, i) in module.types_global_values.iter().enumerate() {
            let Some(result) = i.result_id else { continue };
            types.insert(result, at);
            if let (Op::Constant, [Operand::LiteralBit32(value)]) = (i.class.opcode, &i.operands[..]) {
                constants.insert(result, *value);
            }
        }
        Self { module, types, array_strides, offsets, names, member_names, constants }
    }

    fn instruction(&self, type_id: u32) -> &Instruction {
        &self.module.types_global_values[self.types[&type_id]]
    }

    /// Bytes of a value of a type.
    fn size(&self, type_id: u32) -> u32 {
        let i = self.instruction(type_id);
        match (i.class.opcode, &i.operands[..]) {
            (Op::TypeInt | Op::TypeFloat, [width, ..]) => number(width) / 8,
            (Op::TypeVector, [part, count]) => self.size(id(part)) * number(count),
            (Op::TypePointer, [Operand::StorageClass(StorageClass::PhysicalStorageBuffer), _]) => 8,
            (Op::TypeArray, [_, count]) => self.array_strides[&type_id] * self.constants[&id(count)],
            (Op::TypeStruct, members) => {
                let last = members.len() as u32 - 1;
                self.offsets[&(type_id, last)] + self.size(id(&members[last as usize]))
            }
            other => panic!("a member of the type {other:?}"),
        }
    }

    /// The structs by name, without what the compiler adds to it.
    fn layouts(&self) -> BTreeMap<String, Layout> {
        let mut layouts = BTreeMap::new();
        for (&type_id, name) in &self.names {
            // Arrays are wrapped into structs of one member.
            if name.starts_with("_Array") {
                continue;
            }
            let known = name.strip_suffix("_natural").or_else(|| name.strip_suffix("_std430"));
            let name = known.unwrap_or_else(|| panic!("{name} is laid out by rules that are not known here"));
            let members = &self.instruction(type_id).operands;
            let member = |(at, member_type): (u32, &Operand)| {
                let name = self.member_names[&(type_id, at)].clone();
                (name, self.offsets[&(type_id, at)], self.size(id(member_type)))
            };
            let stride = |i: &Instruction| match (i.class.opcode, &i.operands[..]) {
                (Op::TypePointer, [_, to]) if id(to) == type_id => self.array_strides.get(&i.result_id?).copied(),
                _ => None,
            };
            let size = self.module.types_global_values.iter().find_map(stride);
            let layout = Layout { members: (0..).zip(members).map(member).collect(), size };
            layouts.insert(name.to_owned(), layout);
        }
        layouts
    }
}

fn size_of_member<S, M>(_: impl FnOnce(&S) -> &M) -> u32 {
    size_of::<M>() as u32
}

/// The layout of a Rust struct, of which all members are to be named.
macro_rules! layout {
    ($s:ident { $($member:ident),* $(,)? }) => {{
        // A member that is left out does not compile.
        let _complete = |s: &$s| { let $s { $($member: _),* } = s; };
        let members = vec![
            $((stringify!($member).to_owned(), offset_of!($s, $member) as u32, size_of_member(|s: &$s| &s.$member))),*
        ];
        (stringify!($s), Layout { members, size: Some(size_of::<$s>() as u32) })
    }};
}

#[rustfmt::skip]
fn rust_layouts() -> BTreeMap<&'static str, Layout> {
    BTreeMap::from([
        layout!(TracePush { frame, first_row, first_sample, end_sample, counters }),
        layout!(FrameTable {
            scene, lights, film, block, albedo, normal, centers, counters, position, projection, right, size, up,
            lens_radius, forward, focus_distance, near, far, width, height, tile_x, tile_y, tile_width, tile_height,
            seed, max_depth, roulette_depth, firefly_clamp, estimator, filter, filter_radius, end_sample, paths,
            path_stride, reserved,
        }),
        layout!(CenterHit { position, depth, node, primitive, material, block, face, cell, reserved }),
        layout!(SceneTable {
            positions, vertices, indices, tangents, mesh_descs, materials, textures, images, lights,
            emitter_triangles, emitters, render_nodes, constants, material_count, texture_count, image_count,
            emitter_count, emitter_triangle_count, tangent_count,
        }),
        layout!(Constants {
            default_material, energy, reversed_sobol, srgb8, averages, blackman_harris, reserved,
        }),
        layout!(ImageRow { width, height, levels, srgb, descriptor, reserved }),
        layout!(LightTable {
            emitter_nodes, emitter_leaves, quads, punctual_nodes, directional, local, map, marginal, conditional,
            cos_edges, emitter_node_count, emitter_leaf_count, quad_count, punctual_node_count, directional_count,
            local_count, map_width, map_height, has_distribution, has_sun, kind_emitters, kind_environment, kind_sun,
            intensity, rotation_sin, rotation_cos, map_integral, sun_direction, sun_radiance, sun_cos_radius,
        }),
        layout!(QuadRow { corner, width, x, height, y, flags, z, reserved }),
        layout!(InstancePush { render_nodes, blas, instances, spans, span_count, row_count, blas_count, reserved }),
        layout!(RowSpan { first, before }),
        layout!(RasterTable {
            frame, commands, group_counts, counts, filtered, capacity, row_count, group_count, has_environment,
            inverse_focus, blend_scale,
        }),
        layout!(RasterPush {
            table, offset, lens, depth, tile_x, tile_y, tile_width, tile_height, view, sample,
        }),
        layout!(CullPush { table, culls, reserved, planes }),
        layout!(ResolvePush { table, sums, x, y, width, height, weight, reserved }),
        layout!(EnvironmentPush { lights, pyramid, filtered, level, reserved }),
        layout!(DrawCommand { vertex_count, instance_count, first_vertex, first_instance }),
        layout!(RenderNodeRow { world, inverse, primitive, material, node, flags, emitter, reserved }),
        layout!(MeshDesc {
            first_vertex, vertex_count, first_index, index_count, first_tangent, flags, first_emitter_triangle,
            reserved, bounds_min, area, bounds_max, reserved2,
        }),
        layout!(VertexRow { uv0, uv1, color, normal, reserved }),
        layout!(TextureSlot { texture, uv_set, transform }),
        layout!(MaterialRow {
            base_color, emissive, alpha_cutoff, metallic, roughness, normal_scale, occlusion_strength, ior, flags, id,
            reserved, base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture,
            emissive_texture,
        }),
        layout!(LightRow { position, kind, direction, range, color, angle_scale, angle_offset, node, reserved }),
        layout!(EmitterRow { render_node, first_triangle, triangle_count, area, power, reserved }),
        layout!(EmitterTriangle { cumulative }),
        layout!(TextureRow { image, sampling }),
        layout!(LightBounds { lower, intensity, upper, cos_spread, axis, cos_end }),
        layout!(LightNode { bounds, first, parent, light, reserved }),
        layout!(WorldTable {
            nodes, leaves, payload, palette, origin, root, node_count, leaf_count, payload_count, palette_count, reserved,
        }),
        layout!(ScatterPush {
            world, list, node_rows, leaf_rows, palette_rows, span_count, word_count, reserved,
        }),
        layout!(WordSpan { first, before }),
        layout!(WorldFrame {
            world, layers, counters, anchor, offset, layer_count, step_budget, combine, mix, distance, edges, direction, sun,
            ambient, zenith, horizon, nadir, place, reserved,
        }),
        layout!(LayerRow { axes, right, runs, up, up_reserved, forward, forward_reserved }),
        layout!(WorldPush { trace, world, rows, reserved }),
        layout!(WorldNode { bounds, children, reserved }),
        layout!(LeafRow { min, max, kind, block, payload, coarse }),
        layout!(BlockRow {
            color, flags, emission, weight, absorption, roughness, metallic, pattern, cells, contrast, width, texture_size,
            reserved,
        }),
        ("Mat3x4", rows_by_themselves()),
        ("InstanceRow", instance()),
        ("Packed3", three_floats()),
    ])
}

/// The shaders have no array of rows: a row is loaded at once.
fn rows_by_themselves() -> Layout {
    let (_, rust) = layout!(Mat3x4 { rows });
    assert_eq!(rust.members, [("rows".to_owned(), 0, 48)]);
    let members = (0..3).map(|row| (format!("row{row}"), 16 * row, 16)).collect();
    Layout { members, size: rust.size }
}

fn instance() -> Layout {
    use ash::vk::AccelerationStructureInstanceKHR as Instance;
    let at = [
        ("transform", offset_of!(Instance, transform), 48),
        ("custom_index_and_mask", offset_of!(Instance, instance_custom_index_and_mask), 4),
        ("sbt_offset_and_flags", offset_of!(Instance, instance_shader_binding_table_record_offset_and_flags), 4),
        ("reference", offset_of!(Instance, acceleration_structure_reference), 8),
    ];
    let members = at.map(|(name, offset, size)| (name.to_owned(), offset as u32, size)).into();
    Layout { members, size: Some(size_of::<Instance>() as u32) }
}

fn three_floats() -> Layout {
    let members = [("x", 0), ("y", 4), ("z", 8)].map(|(name, offset)| (name.to_owned(), offset, 4)).into();
    Layout { members, size: Some(size_of::<[f32; 3]>() as u32) }
}

/// All modules below a folder.
fn modules(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the modules are committed");
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    paths.flat_map(|path| if path.is_dir() { modules(&path) } else { vec![path] }).collect()
}

#[test]
fn structs_have_the_same_layout_on_both_sides() {
    let rust = rust_layouts();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders/spirv");
    let mut met = BTreeSet::new();
    for path in modules(&folder) {
        let reflection = Reflection::new(std::fs::read(&path).expect("the module can be read"));
        for (name, layout) in reflection.layouts() {
            let module = path.display();
            let expected = rust.get(name.as_str()).unwrap_or_else(|| panic!("{module}: {name} has no twin"));
            assert_eq!(layout.members, expected.members, "{module}: {name}");
            if layout.size.is_some() {
                assert_eq!(layout.size, expected.size, "{module}: size of {name}");
            }
            met.insert(name);
        }
    }
    let missing: Vec<_> = rust.keys().filter(|name| !met.contains(**name)).collect();
    assert!(missing.is_empty(), "no module has {missing:?}");
}
