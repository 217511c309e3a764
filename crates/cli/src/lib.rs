//! The `orthant` command as a library, so that tests and benchmarks call what the program runs.
//!
//! * [`args`]: the command line; [`commands`]: one file per command; [`run()`]: from arguments to an exit code;
//! * [`failure`]: exit codes and the one-line error;
//! * [`output`]: files that are whole or absent;
//! * [`generate`]: scenes that the program makes itself;
//! * [`image_io`]: PNG, OpenEXR and Radiance HDR;
//! * [`metrics`]: how far two pictures are apart;
//! * [`share`]: parts of a rendering, and how they are put together;
//! * [`job`]: what a command does with a scene before and after the backend;
//! * [`live`]: a scene with all that follows its edits, and how that is compared;
//! * [`fly`]: the frame loop of worlds without a window;
//! * [`bench`]: figures, measured beside peers;
//! * [`machine`]: memory and threads.

pub mod args;
pub mod bench;
pub mod commands;
pub mod failure;
pub mod fly;
pub mod generate;
pub mod image_io;
pub mod job;
pub mod live;
pub mod machine;
pub mod metrics;
pub mod output;
mod run;
pub mod share;

pub use run::run;
