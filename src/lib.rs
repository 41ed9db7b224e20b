//! The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.
//!
//! Data flows one way: [`volume`] → [`topology`] → [`extract`] → [`sweep`] (with [`kernels`] and
//! [`mesh`]) → [`spectrum`] → [`mod@file`] → [`render`].
//!
//! What most need stands here at the root: a [`Volume`] is computed ([`compute`], or [`Prepared`] with all that the program
//! does) into a [`Spectrum`], of which a [`Query`] gives the [`Mesh`] at any isovalue; [`verify()`](verify::verify) says
//! whether it is right. Modules hold the rest.
//!
//! ```
//! use isospectrum::kernels::{Backend, Choice};
//! use isospectrum::{Mesh, Parameters, Placement, Query, Samples, Silent, Volume, compute};
//!
//! // A ball: samples x fastest, then y, then z.
//! let square = |i: usize| (i as f32 - 4.5).powi(2);
//! let sample = |i: usize| -(square(i % 10) + square(i / 10 % 10) + square(i / 100));
//! let samples: Vec<f32> = (0..1000).map(sample).collect();
//! let volume = Volume::new("ball", [10; 3], Samples::from(samples), Placement::default())?;
//!
//! let backend = Backend::choose(Choice::Cpu, None)?;
//! let parameters = Parameters { error: 0.2, ..Parameters::default() };
//! let spectrum = compute(&volume.into(), &parameters, &backend, &Silent)?;
//!
//! // Successive isovalues cost what changes between them.
//! let mut query = Query::new(&spectrum);
//! for isovalue in [-12.0, -9.0, -4.0] {
//!     let mesh: Mesh = query.mesh_at(isovalue)?;
//!     // A closed surface without handles.
//!     assert_eq!(mesh.triangles.len(), 2 * mesh.positions.len() - 4);
//! }
//! # Ok::<(), isospectrum::Error>(())
//! ```

mod beside;
pub mod bricks;
pub mod color;
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
pub mod sources;
pub mod spectrum;
pub mod sweep;
pub mod topology;
pub mod verify;
#[cfg(feature = "viewer")]
pub mod view;
pub mod volume;

pub use error::{Error, Result};
pub use prepared::{Noise, Prepared};
pub use spectrum::{Keep, Query, Spectrum, SurfaceMesh as Mesh};
pub use sweep::{Counts, Parameters, Progress, Silent, compute};
pub use verify::{Report, verify};
pub use volume::{Isovalue, Placement, Preparation, Samples, Volume};
