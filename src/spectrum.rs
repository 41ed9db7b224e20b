//! The isosurface spectrum: trajectories, lifetimes, collapses, and the mesh at any isovalue.
//!
//! This module does not depend on samples, sweeps or GPUs, and of a volume it knows only its [`VolumeInfo`]: the sweep makes a [`Spectrum`], the file
//! stores it, a [`Query`] and the renderer read it.
//!
//! # Invariants
//!
//! [`Spectrum::check`] lists them; every function here that takes a spectrum relies on them.
//! Lifetimes are half-open, so the mesh is continuous from the right in the isovalue. Triangles
//! that are still alive at the upper end of the range die at an isovalue above it (the next
//! floating point number, for example), so the table of isovalues may end outside the range.

pub(crate) mod active_set;
mod assembly;
mod check;
mod components;
mod data;
mod elements;
mod event_persistence;
mod from_patch;
mod index_set;
mod interpolate;
pub(crate) mod interval_tree;
mod joiner;
mod lineage;
mod masked_caps;
mod measures;
mod mesh;
mod metadata;
pub mod normal;
mod normals;
mod picked;
mod quantise;
mod query;
mod shown_first;
mod size;
mod suggested;

pub(crate) use assembly::Assembly;
pub use check::MAX_COORDINATE;
pub(crate) use check::check_collapses;
pub use components::{Component, Components, Keep};
pub use data::Spectrum;
pub use elements::{Collapse, Knot, Patch, Triangle};
pub use event_persistence::{event_persistence, most_persistent};
pub(crate) use joiner::{Joiner, VertexMismatch};
pub use lineage::{End, Lineage, lineages};
pub(crate) use measures::Measures;
pub use mesh::Mesh;
pub use metadata::{About, Metadata};
pub use normals::Normals;
pub use picked::Picked;
pub(crate) use quantise::{ALONG, facing, rounded_along};
pub use quantise::{FINEST_QUANTUM, quantum};
pub use query::Query;
pub(crate) use shown_first::shown_first;
pub use size::Size;

pub use crate::topology::{Event, EventKind};
pub use crate::volume::VolumeInfo;
