//! The compiled shaders. Their sources, and the manifest that says from what and with what they were compiled, lie beside
//! them in `shaders/`.

/// The pass that writes TLAS instances.
pub(crate) const INSTANCES: &[u8] = include_bytes!("../shaders/spirv/instances.spv");

/// The path tracer.
pub(crate) const PATH: &[u8] = include_bytes!("../shaders/spirv/path.spv");

/// Its ray generation for devices that sort threads by what their rays have hit.
pub(crate) const PATH_REORDER: &[u8] = include_bytes!("../shaders/spirv/path_reorder.spv");

/// The path tracer as compute shaders with ray queries.
pub(crate) const PATH_QUERY: &[u8] = include_bytes!("../shaders/spirv/path_query.spv");
