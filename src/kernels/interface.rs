//! The trait that both backends implement, with its arguments and results.

use crate::error::Result;
use crate::field::Status;
use crate::mesh::Connectivity;

/// Projections onto isosurfaces one after the other, then a relaxation.
#[derive(Clone, Copy, Debug)]
pub struct Advance<'a> {
    /// The isovalues of the projections, in order.
    pub isovalues: &'a [f64],
    /// How far one projection moves a vertex at most, voxels.
    pub reach: f32,
    /// By vertex, its position after the last projection if it is constrained, voxel frame: every projection moves it by an equal
    /// part of the way. Empty if constrained vertices do not move.
    pub ends: &'a [[f32; 3]],
    /// The relaxation after the projections.
    pub relaxation: Relaxation,
}

/// Tangential relaxation: iterations that move each vertex by a share of the tangential part of the umbrella operator, then
/// back onto the isosurface. A vertex that cannot get back keeps its position.
#[derive(Clone, Copy, Debug)]
pub struct Relaxation {
    /// The isosurface that vertices stay on.
    pub isovalue: f64,
    /// Share of the force that moves a vertex (thesis: 0.6).
    pub strength: f32,
    /// Relaxation ends when the largest force is smaller, voxels; tested every [`RELAX_CHECK_EVERY`] iterations.
    pub threshold: f32,
    /// Number of iterations at most.
    pub max_iterations: u32,
}

/// The state of a mesh after an [`Advance`], by vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Advanced {
    /// Positions, voxel frame.
    pub positions: Vec<[f32; 3]>,
    /// Area-weighted unit normals there, towards lower values.
    pub normals: Vec<[f32; 3]>,
    /// Result of the last projection.
    pub status: Vec<Status>,
}

/// How much work a GPU was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceWork {
    /// Command buffers submitted.
    pub submissions: u64,
    /// How often the CPU waited for results.
    pub read_backs: u64,
}

/// The stages that run on every vertex of a mesh, on the CPU or on a GPU.
///
/// Buffers stay on the device between calls: load once per connectivity, advance any number of times.
pub trait Kernels {
    /// Takes a mesh: connectivity and positions (voxel frame).
    fn load(&mut self, connectivity: &Connectivity, positions: &[[f32; 3]]) -> Result<()>;

    /// Projects onto each isovalue, relaxes, and returns the state of all vertices.
    ///
    /// A projection moves every vertex that is not constrained onto the isosurface by one step along its area-weighted normal,
    /// uphill or downhill by the sign of the difference, so that the field along the step leaves [value, isovalue] first
    /// through the isovalue. Where that fails it takes short steps along the gradient under the same rule.
    ///
    /// On a GPU every projection is one submission; the last one includes the relaxation, if that has no more than
    /// [`RELAX_CHECK_EVERY`] iterations, and the single read back.
    fn advance(&mut self, advance: &Advance) -> Result<Advanced>;

    /// The distance of every face's barycentre from the isosurface along the face's normal, to the nearer side, voxels;
    /// `reach` where there is none within `reach`. Length: faces. Source: thesis section 3.7.
    fn deviation(&mut self, isovalue: f64, reach: f32) -> Result<Vec<f32>>;

    /// The work that a GPU was given so far; zero on the CPU.
    fn device_work(&self) -> DeviceWork {
        DeviceWork::default()
    }
}

/// The largest force is tested after this many iterations of relaxation only: on a GPU the test needs a read back, which costs
/// as much as four iterations of a small mesh. A step of a sweep has fewer iterations by default, so it is one submission.
pub const RELAX_CHECK_EVERY: u32 = 8;

impl Advance<'_> {
    /// The share of its remaining way by which projection `i` moves a constrained vertex.
    pub(super) fn constrained_share(&self, i: usize) -> f32 {
        if self.ends.is_empty() { 0.0 } else { 1.0 / (self.isovalues.len() - i) as f32 }
    }
}

/// Checks that the arrays of a connectivity have matching lengths.
///
/// # Panics
///
/// If they do not, which is a bug in the caller.
pub(super) fn check_shape(connectivity: &Connectivity, n_vertices: usize) {
    let Connectivity { ring_offsets, ring, constrained, .. } = connectivity;
    assert_eq!(ring_offsets.len(), n_vertices + 1, "one ring per vertex");
    assert_eq!(constrained.len(), n_vertices, "one byte per vertex");
    assert_eq!(ring_offsets.last().map(|&end| end as usize), Some(ring.len()), "rings fill `ring`");
}
