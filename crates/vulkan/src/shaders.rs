//! The compiled shaders. Their sources, and the manifest that says from what and with what they were compiled, lie beside
//! them in `shaders/`.

/// The pass that writes TLAS instances.
pub(crate) const INSTANCES: &[u8] = include_bytes!("../shaders/spirv/instances.spv");

/// The ray tracing pipeline of the path tracer.
pub(crate) const PATH: &[u8] = include_bytes!("../shaders/spirv/path.spv");

/// The stages of the path tracer that trace no ray.
pub(crate) const PATH_STAGES: &[u8] = include_bytes!("../shaders/spirv/path_stages.spv");

/// The path tracer in one ray generation shader, for devices that sort threads by what their rays have hit.
pub(crate) const PATH_REORDER: &[u8] = include_bytes!("../shaders/spirv/path_reorder.spv");

/// The path tracer as compute shaders with ray queries.
pub(crate) const PATH_QUERY: &[u8] = include_bytes!("../shaders/spirv/path_query.spv");

/// The preview's culling.
pub(crate) const RASTER_CULL: &[u8] = include_bytes!("../shaders/spirv/raster/cull.spv");

/// Its graphics pipelines.
pub(crate) const RASTER_DRAW: &[u8] = include_bytes!("../shaders/spirv/raster/draw.spv");

/// Its filtered environment.
pub(crate) const RASTER_ENVIRONMENT: &[u8] = include_bytes!("../shaders/spirv/raster/environment.spv");

/// The pass that writes into the arenas of a world.
pub(crate) const WORLD_SCATTER: &[u8] = include_bytes!("../shaders/spirv/world/scatter.spv");

/// Worlds with light transport, and the stages of it that trace no ray.
pub(crate) const WORLD_PATH: &[u8] = include_bytes!("../shaders/spirv/world/path.spv");

/// Rays in a scene and a world, by ray queries.
pub(crate) const WORLD_PATH_QUERY: &[u8] = include_bytes!("../shaders/spirv/world/path_query.spv");

/// The same, by the ray tracing pipeline.
pub(crate) const WORLD_PATH_SCENE: &[u8] = include_bytes!("../shaders/spirv/world/path_scene.spv");

/// Worlds shaded without light transport.
pub(crate) const WORLD_PREVIEW: &[u8] = include_bytes!("../shaders/spirv/world/preview.spv");

/// What reads its targets.
pub(crate) const RASTER_RESOLVE: &[u8] = include_bytes!("../shaders/spirv/raster/resolve.spv");
