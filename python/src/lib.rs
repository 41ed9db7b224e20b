//! `isospectrum._native`: the functions of the library that the Python package calls. Public names, defaults and docstrings are in
//! `python/package/isospectrum`; this crate converts arguments, numbers and arrays.
//!
//! # Invariants
//!
//! The library never runs while the interpreter's lock is held, and no other lock is waited for with it.

mod appearance;
mod arguments;
mod arrays;
mod bricks;
mod compute;
mod errors;
mod handle;
mod picture;
mod reports;
mod spectrum;
mod threads;
mod volume;
mod watch;

use pyo3::prelude::*;

/// The compiled part of `isospectrum`.
#[pymodule(name = "_native", gil_used = false)]
mod native {
    #[pymodule_export]
    use crate::bricks::{Plan, cut, tally};
    #[pymodule_export]
    use crate::compute::compute;
    #[pymodule_export]
    use crate::picture::Picture;
    #[pymodule_export]
    use crate::spectrum::{Spectrum, write_file};
    #[pymodule_export]
    use crate::volume::Volume;
    #[pymodule_export]
    use crate::volume::unit_in_mm;
}
