//! The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.
//!
//! A [`Volume`] is computed ([`compute`], or [`Prepared`] with all that the program does) into a [`Spectrum`], of which a
//! [`Query`] gives the [`Mesh`] at any isovalue; [`verify()`](verify::verify) says in a [`Report`] whether it is right. What
//! takes long tells a [`Progress`], which may stop it. All errors are one [`Error`].
//!
//! | module | what for |
//! |---|---|
//! | [`volume`] | volumes from files and arrays, what may be done to them first |
//! | [`spectrum`] | what a spectrum is made of; components of meshes |
//! | [`mod@file`] | spectra in files and folders |
//! | [`export`] | meshes in the formats of other programs |
//! | [`color`], [`sources`], [`render`], [`page`] | colours, pictures, a web page |
//! | [`verify`](mod@verify) | a spectrum against its volume |
//! | [`bricks`] | volumes that do not fit memory, or many machines |
//!
//! ```
//! use isospectrum::{Backend, Choice, Mesh, Parameters, Placement, Query, Samples, Silent, Volume, compute};
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

// Tests in `src` and in `tests` share files that name the library.
#[cfg(test)]
extern crate self as isospectrum;

mod beside;
pub mod bricks;
pub mod color;
mod disjoint_sets;
mod error;
pub mod export;
mod extract;
mod field;
pub mod file;
mod forecast;
mod gpu;
mod input;
mod kernels;
mod mesh;
mod named;
pub mod page;
mod ply_reader;
mod prepared;
mod progress;
mod random;
pub mod render;
pub mod sources;
pub mod spectrum;
mod sweep;
mod topology;
pub mod verify;
#[cfg(feature = "viewer")]
pub mod view;
pub mod volume;

pub use error::{Error, Result};
pub use forecast::Forecast;
pub use kernels::{Backend, Choice};
pub use prepared::{Cleaned, Noise, Prepared};
pub use progress::{Progress, Silent};
pub use spectrum::{Keep, Query, Spectrum, SurfaceMesh as Mesh};
pub use sweep::{Counts, Parameters, compute};
pub use topology::{dust::Dust, simplify::Simplification};
pub use verify::{Report, verify};
pub use volume::{Isovalue, Placement, Preparation, Samples, Volume};

/// What the program, the tests and the benches of this very package look into. It is no part of the interface: it may change
/// with any version, and has types of other crates in it.
#[doc(hidden)]
pub mod inside {
    pub mod extract {
        pub use crate::extract::*;
    }
    pub mod field {
        pub use crate::field::*;
    }
    pub mod gpu {
        pub use crate::gpu::*;
    }
    pub mod input {
        pub use crate::input::*;
    }
    pub mod kernels {
        pub use crate::kernels::*;
    }
    pub mod mesh {
        pub use crate::mesh::*;
    }
    pub mod spectrum {
        pub use crate::spectrum::active_set::*;
        pub mod interval_tree {
            pub use crate::spectrum::interval_tree::*;
        }
    }
    pub mod sweep {
        pub use crate::sweep::*;
    }
    pub mod topology {
        pub use crate::topology::*;
    }
}
