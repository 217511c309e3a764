//! `orthant world apply`: a script of patches, applied to a world and to what is derived from it.

use crate::args::{ApplyArgs, Common};
use crate::failure::Failure;

/// Applies.
///
/// # Errors
/// Those of the script.
pub fn run(_args: &ApplyArgs, _common: &Common) -> Result<(), Failure> {
    Err(Failure::missing("applying patches is not built yet"))
}
