//! The `orthant` command. Everything it does is in the library of the same name.

fn main() -> std::process::ExitCode {
    orthant::run(std::env::args_os())
}
