//! Structs that kernels and host share, in WGSL's memory layout. A `vec3` is followed by a
//! scalar, so no row needs padding; a test compares every offset with the shaders.

use bytemuck::{Pod, Zeroable};

/// The volume: constant during a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Grid {
    /// Cells per voxel along each axis.
    pub inverse_cell_size: [f32; 3],
    /// Value of the layer around the volume.
    pub outside: f32,
    /// Samples along each axis.
    pub dims: [i32; 3],
    /// How samples are packed: 0 u8, 1 i8, 2 u16, 3 i16, 4 f32.
    pub sample_type: u32,
}

/// The parameters of one kernel call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Parameters {
    /// The isovalue to reach.
    pub isovalue: f32,
    /// How far a vertex moves at most, voxels.
    pub reach: f32,
    /// Share of the force that moves a vertex.
    pub strength: f32,
    /// Smaller differences from the isovalue count as none.
    pub value_noise: f32,
    /// How far values along a step may leave the slab between start and isovalue.
    pub slab_tolerance: f32,
    /// Share of its remaining way by which a constrained vertex moves.
    pub share: f32,
}

/// The result of the reduction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// Bits of the largest force.
    pub largest_force: u32,
}
