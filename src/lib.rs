//! The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.
//!
//! Data flows one way: [`volume`] → [`topology`] → [`extract`] → [`sweep`] (with [`kernels`] and
//! [`mesh`]) → [`spectrum`] → [`mod@file`] → [`render`].

pub mod error;
pub mod export;
pub mod extract;
pub mod file;
pub mod gpu;
pub mod kernels;
pub mod mesh;
pub mod render;
pub mod spectrum;
pub mod sweep;
pub mod topology;
pub mod verify;
pub mod volume;

pub use error::{Error, Result};
