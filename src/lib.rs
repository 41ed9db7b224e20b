//! The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.
//!
//! [`compute`] turns a [`Volume`] into a [`Spectrum`]; [`Prepared`] adds the preparation and noise removal of the program. A [`Query`]
//! returns the [`Mesh`] at any isovalue. [`verify()`](verify::verify) checks a spectrum against its volume and returns a [`Report`]. Long
//! computations report to a [`Progress`], which may cancel them. All functions return the same [`Error`].
//!
//! | module | contents |
//! |---|---|
//! | [`volume`] | volumes from files and arrays, and their preparation |
//! | [`spectrum`] | spectra, queries, components of meshes |
//! | [`mod@file`] | files and folders of spectra |
//! | [`export`] | mesh formats of other programs |
//! | [`color`], [`color_sources`], [`render`], [`page`] | colours, pictures, web pages |
//! | [`extraction`], [`series`] | meshes of one isovalue or several as files; numbered pictures and films |
//! | [`verify`](mod@verify) | verification of a spectrum against its volume |
//! | [`bricks`] | computation of volumes larger than memory, or on several machines |
//! | [`settings`] | lengths, percentages and ranges as users write them |
//!
//! # Features
//!
//! `cli` (default) builds the program. Without it (`default-features = false`), `formats` or its parts `dicom`, `tiff`, `xml` and `zip` add the
//! formats that need further crates, `annotations` adds legends, axes and labels to pictures, and `viewer` the window of the program.
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
//! let parameters = Parameters::default().with_error(0.2);
//! let spectrum = compute(&volume.into(), &parameters, &backend, &Silent)?;
//!
//! // The cost of successive isovalues is that of the triangles that change between them.
//! let mut query = Query::new(&spectrum);
//! for isovalue in [-12.0, -9.0, -4.0] {
//!     let mesh: Mesh = query.mesh_at(isovalue)?;
//!     // A closed surface without handles.
//!     assert_eq!(mesh.triangles.len(), 2 * mesh.positions.len() - 4);
//! }
//! # Ok::<(), isospectrum::Error>(())
//! ```

// Without `unstable` most rooms are closed.
#![cfg_attr(
    not(feature = "unstable"),
    allow(unreachable_pub, reason = "public where the feature `unstable` opens the room")
)]
// Without these features some helpers have no user.
#![cfg_attr(
    not(all(feature = "unstable", feature = "formats", feature = "annotations")),
    allow(dead_code, unused_imports, reason = "used by optional features only")
)]

// Tests in `src` and in `tests` share files that name the library, and so does the program.
#[cfg(any(test, feature = "cli"))]
extern crate self as isospectrum;

mod abandoned;
mod atomic_file;
mod atomic_folder;
pub mod bricks;
mod caught_panic;
/// The program, which is no part of the public interface.
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
pub mod color;
pub mod color_sources;
mod disjoint_sets;
mod error;
pub mod export;
mod extract;
pub mod extraction;
mod field;
pub mod file;
mod forecast;
mod gpu;
mod grouped;
mod input;
mod kernels;
mod keys;
mod mesh;
mod numbers;
mod output;
pub mod page;
mod parse_name;
mod ply_reader;
mod prepared;
mod progress;
mod random;
pub mod render;
pub mod series;
mod setters;
pub mod settings;
pub mod spectrum;
mod suggestions;
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
pub use spectrum::{Keep, Mesh, Query, Spectrum};
pub use suggestions::{Candidate, Suggestions, suggestions};
pub use sweep::{Counts, Parameters, compute};
pub use topology::{dust::Dust, simplify::Simplification};
pub use verify::{Report, verify, verify_file};
pub use volume::{Isovalue, Placement, Preparation, Samples, Volume};

/// Internals for the tests, the benches and the program of this package. Not part of the public interface: anything here may change
/// in any version, and signatures contain types of other crates.
#[cfg(feature = "unstable")]
#[doc(hidden)]
pub mod unstable {
    pub mod caught_panic {
        pub use crate::caught_panic::*;
    }
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
    pub mod numbers {
        pub use crate::numbers::*;
    }
    pub mod spectrum {
        pub use crate::spectrum::active_set::*;
        pub mod interval_tree {
            pub use crate::spectrum::interval_tree::*;
        }
    }
    pub mod suggestions {
        pub use crate::suggestions::candidates;
    }
    pub mod sweep {
        pub use crate::sweep::*;
    }
    pub mod topology {
        pub use crate::topology::*;
    }
}
