//! `orthant world fly`: the frame loop without a window.

use crate::args::{Common, FlyArgs};
use crate::failure::Failure;

/// Flies.
///
/// # Errors
/// A bad world (bad input).
pub fn run(args: &FlyArgs, _common: &Common) -> Result<(), Failure> {
    Err(Failure::missing(format!("{:?}: flying is not built yet", args.scenario)))
}
