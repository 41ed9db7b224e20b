//! Shared by the test binaries: volumes, spectra and files made for the tests, and runs of the program.
#![allow(dead_code, unused_imports, reason = "each binary uses its share")]

pub(crate) mod any_spectrum;
pub(crate) mod crafted;
pub(crate) mod data;
pub(crate) mod file_sections;
pub(crate) mod program;
pub(crate) mod random;
pub(crate) mod shapes;
pub(crate) mod spectra;
pub(crate) mod synthetic;
