//! The stages of a sweep that run on every vertex at once: WGSL kernels and their CPU twins behind one trait, [`Kernels`].
//!
//! A kernel is one file in `shaders/`. Its CPU twin has the same name, the same order and the same variable names; it is the
//! reference, and the backend where there is no GPU.
//!
//! | shader | twin | computes |
//! |---|---|---|
//! | `grid.wgsl`, `ray.wgsl`, `step.wgsl` (shared) | [`crate::field`] | the trilinear field, rays, one vertex onto an isosurface |
//! | `normals.wgsl` | [`normals`] | area-weighted normals |
//! | `project.wgsl` | [`project`] | all vertices onto an isosurface |
//! | `relax.wgsl` | [`relax`] | one iteration of tangential relaxation |
//! | `deviation.wgsl` | [`deviation`] | distances of barycentres from an isosurface |
//! | `reduce.wgsl` | the maximum in [`cpu`] | the largest force |
//!
//! [`Backend`] chooses the device.

pub mod backend;
pub mod cpu;
pub mod deviation;
pub mod gpu;
mod interface;
pub mod normals;
pub mod project;
pub mod relax;

pub use crate::gpu::shader;
pub use crate::mesh::Connectivity;
pub use backend::{Backend, Choice};
pub use cpu::CpuKernels;
pub use gpu::GpuKernels;
pub use interface::{Advance, Advanced, DeviceWork, Kernels, RELAX_CHECK_EVERY, Relaxation};
