//! `orthant world`: one file per command.

pub mod apply;
pub mod fly;
pub mod info;
pub mod new;

use crate::args::{Common, WorldArgs, WorldCommand};
use crate::failure::Failure;

/// Runs one of the commands for worlds.
///
/// # Errors
/// That of the command.
pub fn run(args: &WorldArgs, common: &Common) -> Result<(), Failure> {
    match &args.command {
        WorldCommand::New(args) => new::run(args, common),
        WorldCommand::Apply(args) => apply::run(args, common),
        WorldCommand::Info(args) => info::run(&args.file, args.json, args.salvage, common),
        WorldCommand::Fly(args) => fly::run(args, common),
    }
}
