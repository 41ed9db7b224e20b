//! The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.
//!
//! Data flows one way: [`volume`] → [`topology`] → [`extract`] → [`sweep`] (with [`kernels`] and
//! [`mesh`]) → [`spectrum`] → [`mod@file`] → [`render`].
//!
//! ```
//! use isospectrum::kernels::{Backend, Choice};
//! use isospectrum::spectrum::Query;
//! use isospectrum::sweep::{Parameters, Silent, compute};
//! use isospectrum::volume::phantom;
//!
//! let volume = std::sync::Arc::new(phantom("sphere:8")?);
//! let backend = Backend::choose(Choice::Cpu, None)?;
//! let spectrum = compute(&volume, &Parameters::default(), &backend, &Silent)?;
//! let mut query = Query::new(&spectrum);
//! for isovalue in [0.3, 0.5, 0.7] {
//!     let mesh = query.mesh_at(isovalue)?;
//!     println!("{isovalue}: {} triangles", mesh.triangles.len());
//! }
//! # Ok::<(), isospectrum::Error>(())
//! ```

mod disjoint_sets;
// Tests in `src` and in `tests` share files that name the library.
#[cfg(test)]
extern crate self as isospectrum;

pub mod error;
pub mod export;
pub mod extract;
pub mod file;
pub mod forecast;
pub mod gpu;
pub mod input;
pub mod kernels;
pub mod mesh;
pub mod page;
pub mod prepared;
mod random;
pub mod render;
pub mod spectrum;
pub mod sweep;
pub mod topology;
pub mod verify;
#[cfg(feature = "viewer")]
pub mod view;
pub mod volume;

pub use error::{Error, Result};
pub use prepared::Prepared;
pub use spectrum::{Keep, Query, Spectrum, SurfaceMesh as Mesh};
pub use sweep::{Counts, Parameters, Progress, Silent, compute};
pub use verify::{Report, verify};
pub use volume::{Isovalue, Placement, Preparation, Samples, Volume};
