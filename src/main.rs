//! The program `isospectrum`. All of it is in `cli`, which the Python package runs, too.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(isospectrum::cli::main(std::env::args_os().collect()))
}
