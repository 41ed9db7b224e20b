//! What several test binaries share: volumes, spectra and files made for the tests, and the program in a folder of its own.
#![allow(dead_code, unused_imports, reason = "each binary uses its share")]

pub(crate) mod any_spectrum;
pub(crate) mod crafted;
pub(crate) mod data;
pub(crate) mod program;
pub(crate) mod random;
pub(crate) mod shapes;
pub(crate) mod spectra;
pub(crate) mod synthetic;
