//! The compiled shaders. Their sources, and the manifest that says from what and with what they were compiled, lie beside
//! them in `shaders/`.

/// The pass that writes TLAS instances.
pub(crate) const INSTANCES: &[u8] = include_bytes!("../shaders/spirv/instances.spv");

/// The path tracer.
pub(crate) const PATH: &[u8] = include_bytes!("../shaders/spirv/path.spv");
