//! The program `isospectrum`, as the console script of the package runs it.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program with a command line, which begins with its name. Returns the exit code.
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| isospectrum::cli::main(arguments))
}
