//! Which shaders a tracer is made of.

use super::compute::ShaderModule;
use crate::abi::TracePush;
use crate::device::Device;
use crate::error::Result;
use crate::shaders;
use crate::world::view::WorldPush;
use ash::vk;
use std::ffi::CStr;
use std::mem::offset_of;

/// A shader: its module, and the name of its entry point.
pub(super) type Shader = (&'static [u8], &'static CStr);

/// The shaders of a path tracer, besides those of hits and misses.
#[derive(Clone, Copy)]
pub(super) struct Program {
    /// What begins a sentence about it that fails.
    pub what: &'static str,
    /// By [`super::Generation`]: what traces rays.
    pub rays: [Shader; 2],
    /// Where paths are traced in stages: those that trace no ray.
    pub stages: Option<[Shader; 2]>,
    /// Bytes of the push constants, which begin with a [`TracePush`].
    pub push: usize,
}

const STAGES: [Shader; 2] = [(shaders::PATH_STAGES, c"shade_paths"), (shaders::PATH_STAGES, c"light_paths")];
const WORLD_STAGES: [Shader; 2] =
    [(shaders::WORLD_PATH, c"shade_world_paths"), (shaders::WORLD_PATH, c"light_world_paths")];

const _: () = assert!(offset_of!(WorldPush, trace) == 0);

impl Program {
    /// A scene, in the ray tracing pipeline. Devices that sort threads by what their rays have hit take the whole path tracer in
    /// one shader, the others take it in stages.
    pub fn scene(reorders: bool) -> Self {
        let block: Shader =
            if reorders { (shaders::PATH_REORDER, c"trace_block") } else { (shaders::PATH, c"trace_paths") };
        Self {
            what: "cannot make the ray tracing pipeline",
            rays: [block, (shaders::PATH, c"trace_centers")],
            stages: (!reorders).then_some(STAGES),
            push: size_of::<TracePush>(),
        }
    }

    /// A scene, by ray queries.
    pub fn scene_by_queries() -> Self {
        Self {
            what: "cannot make the path tracer of ray queries",
            rays: [(shaders::PATH_QUERY, c"query_block"), (shaders::PATH_QUERY, c"query_centers")],
            stages: None,
            push: size_of::<TracePush>(),
        }
    }

    /// A world.
    pub fn world() -> Self {
        Self {
            what: "cannot make the path tracer of worlds",
            rays: [(shaders::WORLD_PATH, c"trace_world_paths"), (shaders::WORLD_PATH, c"trace_world_centers")],
            stages: Some(WORLD_STAGES),
            push: size_of::<WorldPush>(),
        }
    }

    /// A scene and a world, in the ray tracing pipeline.
    pub fn both() -> Self {
        let module = shaders::WORLD_PATH_SCENE;
        Self { rays: [(module, c"trace_scene_paths"), (module, c"trace_scene_centers")], ..Self::world() }
    }

    /// A scene and a world, by ray queries.
    pub fn both_by_queries() -> Self {
        let module = shaders::WORLD_PATH_QUERY;
        Self { rays: [(module, c"query_scene_paths"), (module, c"query_scene_centers")], ..Self::world() }
    }
}

/// The stages of a program that trace no ray; null handles where it has none.
#[derive(Clone, Copy)]
pub(super) struct Stages(pub [vk::Pipeline; 2]);

/// Threads of a group of them: pixels side by side.
const GROUP: u32 = 64;

impl Stages {
    pub const NONE: Self = Self([vk::Pipeline::null(); 2]);

    /// Makes them into `self`, so that what was made can be destroyed also where the rest fails.
    pub fn make(&mut self, device: &Device, program: &Program, layout: vk::PipelineLayout) -> Result<()> {
        for ((spirv, entry), slot) in program.stages.into_iter().flatten().zip(&mut self.0) {
            *slot = ShaderModule::new(device, spirv)?.compute_pipeline(entry, layout)?;
        }
        Ok(())
    }

    pub fn are_there(&self) -> bool {
        self.0[0] != vk::Pipeline::null()
    }

    /// Groups of one of them for a row of pixels.
    pub fn groups(width: u32) -> u32 {
        width.div_ceil(GROUP)
    }
}
