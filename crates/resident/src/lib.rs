//! What crosses from a derived scene to a backend, as plain data.
//!
//! * [`rows`]: the fixed layouts of everything that is resident (`repr(C)`, [`bytemuck::Pod`]);
//! * [`batch`]: [`SceneBatch`], the writes that bring a resident model scene up to date;
//! * [`image`]: decoded images with their mip chains;
//! * [`environment`]: what surrounds the scene;
//! * [`camera`], [`frame`], [`film`]: what to render, how, and what comes back;
//! * [`sampling`], [`math`], [`energy`]: the random numbers, warps, polynomials and tables that every backend computes
//!   alike;
//! * [`tonemap`]: from radiance to what a display shows;
//! * [`spans`]: which parts of a buffer are in use; [`slot_tree`]: one value over all rows of a buffer;
//! * [`extent`]: the radius of a scene;
//! * [`world`]: the rows, batches and views of worlds;
//! * [`compare`]: whether what is resident is what was derived;
//! * [`backend`]: the [`Backend`] trait.
//!
//! Nothing here knows of glTF. Coordinates are right-handed with Y up, in metres, relative to the origin of the
//! derived scene (which is `f64`, and known to crate `orthant-render` alone); colours are linear Rec. 709.

pub mod backend;
pub mod batch;
pub mod camera;
pub mod check;
pub mod compare;
pub mod energy;
pub mod environment;
pub mod extent;
pub mod film;
pub mod frame;
pub mod image;
pub mod lights;
pub mod math;
pub mod rows;
pub mod sampling;
pub mod slot_tree;
pub mod spans;
pub mod tonemap;
pub mod world;

pub use backend::{Backend, BackendError, Ticket, TicketStatus};
pub use batch::SceneBatch;
pub use camera::Camera;
pub use environment::Environment;
pub use film::Film;
pub use frame::Frame;
