//! The path tracer.
//!
//! * [`camera`]: from pixels to rays;
//! * [`surface`]: from a hit to a point with normals, errors and texture coordinates; [`material`]: from there to what
//!   it emits and reflects; [`bsdf`]: how it reflects;
//! * [`texture`], [`cone`]: filtering written out, and the level of detail;
//! * [`alpha`]: what is there at all;
//! * [`offset`]: where rays start and shadow rays end, by bounds of the rounding errors;
//! * [`lights`]: next event estimation;
//! * [`integrator`]: the loop over the vertices of a path; [`aov`]: the other outputs; [`tile`]: blocks of samples.
//!
//! Every function here has, or is to have, a twin of the same name in the shaders: no allocation, no trait objects, no
//! mathematics but [`orthant_resident::math`], and the same order of operations.

pub mod alpha;
pub mod aov;
pub mod bsdf;
pub mod camera;
pub mod cone;
pub mod integrator;
pub mod lights;
pub mod material;
pub mod offset;
pub mod surface;
pub mod texture;
pub mod tile;

use crate::scene::ResidentScene;
use crate::world::WorldTracer;
use orthant_resident::Frame;

/// All that a path needs to know.
#[derive(Clone, Copy)]
pub struct PathTracer<'a> {
    /// What is hit.
    pub scene: &'a ResidentScene,
    /// What shines.
    pub lights: &'a lights::LightTables,
    /// What is asked for.
    pub frame: &'a Frame,
    /// The frame's camera, prepared.
    pub view: camera::View,
    /// What is seen of the world, if anything is.
    pub world: Option<&'a WorldTracer<'a>>,
}
