//! `isospectrum._native`: what of the library Python calls. The package around it (`python/isospectrum`) has the names,
//! defaults and docstrings; here numbers and arrays go over.
//!
//! # Invariants
//!
//! Nothing of the library runs while the interpreter's lock is held, and no lock of ours is waited for with it.

mod arrays;
mod bricks;
mod compute;
mod errors;
mod held;
mod picture;
mod reports;
mod sight;
mod spectrum;
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
