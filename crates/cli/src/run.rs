//! From arguments to an exit code.

use crate::args::{Cli, Command};
use crate::commands;
use crate::failure::{Exit, Failure};
use clap::Parser;
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs the program with the given arguments (the first is its name), and prints what went wrong on stderr, in one line.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are asked for and go to stdout; everything else is wrong usage. A closed stream is no
            // reason to fail differently.
            let _closed = error.print();
            return ExitCode::from(if error.use_stderr() { Exit::Usage as u8 } else { 0 });
        }
    };
    install_panic_hook();
    match std::panic::catch_unwind(|| dispatch(&cli)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(failure)) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.exit as u8)
        }
        // The hook has said what happened.
        Err(_) => ExitCode::from(Exit::Internal as u8),
    }
}

fn dispatch(cli: &Cli) -> Result<(), Failure> {
    match &cli.command {
        Command::Bench(args) => commands::bench::run(args, &cli.common),
        Command::Compare(args) => commands::compare::run(args, &cli.common),
        Command::Edit(args) => commands::edit::run(args, &cli.common),
        Command::Convert(args) => commands::convert::run(args, &cli.common),
        Command::Generate(args) => commands::generate::run(args),
        Command::Devices(args) => commands::devices::run(args),
        Command::Merge(args) => commands::merge::run(args, &cli.common),
        Command::Info(args) => commands::info::run(args, &cli.common),
        Command::World(args) => commands::world::run(args, &cli.common),
        Command::Render(args) => commands::render::run(args, &cli.common),
    }
}

/// A panic is a fault of the program: one line says where, and the exit code is 1. `RUST_BACKTRACE=1` adds the stack.
fn install_panic_hook() {
    std::panic::set_hook(Box::new(|info| {
        let message = info
            .payload()
            .downcast_ref::<&str>()
            .map(|s| (*s).to_owned())
            .or_else(|| info.payload().downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".into());
        let message = message.split_whitespace().collect::<Vec<_>>().join(" ");
        let place = info.location().map_or_else(|| "unknown place".into(), ToString::to_string);
        eprintln!("internal fault: {place}: {message}: please report it with the command and its input");
        if std::env::var_os("RUST_BACKTRACE").is_some_and(|v| v != "0") {
            eprintln!("{}", std::backtrace::Backtrace::force_capture());
        }
    }));
}
