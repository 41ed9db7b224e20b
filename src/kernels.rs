//! The vertex- and triangle-parallel stages: WGSL kernels and their CPU twins behind one trait.
//!
//! Each kernel is one file in `shaders/` and one module here of the same name, which holds its host
//! side and its CPU twin in the same order with the same variable names. The CPU twin is the
//! reference, and the backend where no adapter exists.
//!
//! | shader | twin | what it does |
//! |---|---|---|
//! | `grid.wgsl` (shared) | [`field`] | the trilinear field |
//! | `ray.wgsl` (shared) | [`ray`] | a ray through it |
//! | `step.wgsl` (shared) | [`step`] | the rule by which a vertex reaches an isosurface |
//! | `normals.wgsl` | [`normals`] | area-weighted normals |
//! | `project.wgsl` | [`project`] | all vertices onto an isosurface |
//! | `relax.wgsl` | [`relax`] | one iteration of tangential relaxation |
//! | `deviation.wgsl` | [`deviation`] | distances of barycentres |
//! | `reduce.wgsl` | sums in [`cpu`] | largest force, number of failures |
//! | `compact.wgsl` | [`compact`] | the triangles alive at a rank |
//!
//! [`Backend`] chooses where they run.

pub mod backend;
pub mod compact;
pub mod cpu;
pub mod deviation;
pub mod field;
pub mod gpu;
pub mod normals;
pub mod project;
pub mod ray;
pub mod relax;
pub mod step;

pub use crate::gpu::shader;
pub use crate::mesh::Connectivity;
pub use backend::{Backend, Choice};
pub use cpu::CpuKernels;
pub use field::Field;
pub use gpu::GpuKernels;

use crate::error::Result;

/// What became of a vertex in the last projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Status {
    /// Reached its isosurface along its normal, or is held.
    Reached = 0,
    /// Reached it along the gradient.
    ReachedByGradient = 1,
    /// Did not reach it within the rules; it stayed where it was.
    Failed = 2,
}

/// How a relaxation ran.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Relaxation {
    /// Iterations done.
    pub iterations: u32,
    /// Largest tangential force left, voxels.
    pub largest_force: f32,
}

/// Where a mesh goes: onto some isosurfaces one after the other, and to better places on the last of them.
#[derive(Clone, Copy, Debug)]
pub struct Advance<'a> {
    /// The isovalues of the projections, one after the other.
    pub isovalues: &'a [f64],
    /// The longest way of one projection, voxels.
    pub reach: f32,
    /// By vertex, where it is in the end if it is held, voxel frame: with every projection it goes as far as is left
    /// in equal parts. Empty if held vertices stay where they are.
    pub ends: &'a [[f32; 3]],
    /// The isovalue of the relaxation, and its strength, threshold and most iterations (see [`Kernels::relax`]).
    pub relaxed_at: f64,
    /// Share of the force that moves a vertex.
    pub strength: f32,
    /// Relaxation ends at smaller forces, voxels.
    pub threshold: f32,
    /// Iterations of relaxation.
    pub max_iterations: u32,
}

/// What has become of a mesh, by vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Advanced {
    /// Positions, voxel frame.
    pub positions: Vec<[f32; 3]>,
    /// Area-weighted unit normals there, towards lower values.
    pub normals: Vec<[f32; 3]>,
    /// What became of each vertex in the last projection.
    pub status: Vec<Status>,
}

/// What a device was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceWork {
    /// Lists of commands that were submitted.
    pub submissions: u64,
    /// How often results were waited for.
    pub read_backs: u64,
}

/// The stages that run on every vertex or face of a mesh, on the CPU or on a GPU.
///
/// The buffers live behind this trait and stay where they are between calls: load once per
/// connectivity, run any number of sub-steps, read back once.
pub trait Kernels {
    /// The backend in words: `cpu`, or the adapter's name and backend.
    fn name(&self) -> String;

    /// Takes a mesh: connectivity and positions (voxel frame).
    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()>;

    /// Moves every vertex that is not held onto the isosurface of `isovalue` by one step along its area-weighted
    /// normal, uphill or downhill by the sign of what is missing, at most `reach` voxels, so that
    /// the field along the step leaves [value, isovalue] first through the isovalue. Where that
    /// fails: short steps along the gradient under the same rule. Returns how many vertices failed.
    fn project(&mut self, isovalue: f64, reach: f32) -> Result<u32>;

    /// Tangential relaxation: `strength` (thesis: 0.6) times the tangential part of the umbrella
    /// operator, then back onto the isosurface; until the largest force is below `threshold` or
    /// `max_iterations` are done. A vertex that cannot get back keeps its place.
    fn relax(
        &mut self,
        isovalue: f64,
        strength: f32,
        threshold: f32,
        max_iterations: u32,
    ) -> Result<Relaxation>;

    /// Projects, relaxes, and tells what has become of all vertices: on a device in one submission for each projection, the last
    /// of them with all of the relaxation, if that has no more than [`RELAX_CHECK_EVERY`] iterations, and the one read back.
    fn advance(&mut self, advance: &Advance) -> Result<Advanced>;

    /// Distance of every face's barycentre from the isosurface along the face's normal, to the
    /// nearer side, voxels; `reach` where there is none within `reach`. Length: faces.
    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>>;

    /// Positions, voxel frame.
    fn positions(&mut self) -> Result<Vec<[f32; 3]>>;

    /// Area-weighted unit normals at the present positions, towards lower values.
    fn normals(&mut self) -> Result<Vec<[f32; 3]>>;

    /// What became of each vertex in the last projection.
    fn status(&mut self) -> Result<Vec<Status>>;

    /// What a device was asked for by these kernels so far; nothing where they run on the CPU.
    fn device_work(&self) -> DeviceWork {
        DeviceWork::default()
    }
}

/// Relaxation looks at the largest force after every so many iterations only: on a GPU the look costs a read back, as
/// much as four iterations of a small mesh. A step of a sweep has fewer, so that it is one submission.
pub const RELAX_CHECK_EVERY: u32 = 8;

/// Whether relaxation looks at the largest force after this many iterations.
fn is_check(iterations: u32) -> bool {
    iterations.is_multiple_of(RELAX_CHECK_EVERY)
}

impl Advance<'_> {
    /// The share of what is left of its way that a held vertex goes with the i-th projection.
    fn held_share(&self, i: usize) -> f32 {
        if self.ends.is_empty() { 0.0 } else { 1.0 / (self.isovalues.len() - i) as f32 }
    }
}

/// Checks that the parts of a connectivity belong together.
///
/// # Panics
///
/// Where they do not, which is a bug in the caller.
fn check_shape(connectivity: &Connectivity, n_vertices: usize) {
    let Connectivity { ring_offsets, ring, held, .. } = connectivity;
    assert_eq!(ring_offsets.len(), n_vertices + 1, "one ring per vertex");
    assert_eq!(held.len(), n_vertices, "one byte per vertex");
    assert_eq!(ring_offsets.last().map(|&end| end as usize), Some(ring.len()), "rings fill `ring`");
}
