//! `isospectrum._native`: the functions of the library that the Python package calls. Public names, defaults and docstrings are in
//! `python/package/isospectrum`; this crate converts arguments, numbers and arrays.
//!
//! # Invariants
//!
//! The library never runs while the interpreter's lock is held, and no other lock is waited for with it.

mod analysis;
mod appearance;
mod arguments;
mod arrays;
mod backend;
mod bricks;
mod compute;
mod errors;
mod handle;
mod identities;
mod picture;
mod program;
mod reports;
mod series;
mod spectrum;
mod surface;
mod threads;
mod volume;
mod warnings;
mod watch;

use pyo3::prelude::*;

/// The compiled part of `isospectrum`.
#[pymodule(name = "_native", gil_used = false)]
mod native {
    #[pymodule_export]
    use crate::analysis::{analyze, forecast};
    #[pymodule_export]
    use crate::arguments::default_parameters;
    #[pymodule_export]
    use crate::bricks::{Plan, WorkFolder, cut, tally};
    #[pymodule_export]
    use crate::compute::compute;
    #[pymodule_export]
    use crate::picture::Picture;
    #[pymodule_export]
    use crate::program::run_program;
    #[pymodule_export]
    use crate::series::{extract, film, write_morph};
    #[pymodule_export]
    use crate::spectrum::{Spectrum, write_file};
    #[pymodule_export]
    use crate::surface::Surface;
    #[pymodule_export]
    use crate::threads::after_fork;
    #[pymodule_export]
    use crate::volume::{Volume, short_number, unit_in_mm};
}
