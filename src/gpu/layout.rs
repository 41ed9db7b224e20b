//! Structs that kernels and host share, laid out as WGSL lays them out. A `vec3` is followed by a
//! scalar, so no row needs padding; `tests/shaders.rs` compares every offset.

use bytemuck::{Pod, Zeroable};

/// What does not change while a volume is worked on.
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

/// What one call of a kernel works with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Parameters {
    /// The value to reach.
    pub isovalue: f32,
    /// Longest way to it, voxels.
    pub reach: f32,
    /// Share of the force that moves a vertex.
    pub strength: f32,
    /// Differences to the isovalue up to this are none.
    pub value_noise: f32,
    /// How far values along a step may leave the slab between start and isovalue.
    pub slab_tolerance: f32,
    /// Share of what is left of its way that a held vertex goes.
    pub share: f32,
}

/// What the reduction hands back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Outcome {
    /// Bits of the largest force.
    pub largest_force: u32,
    /// Vertices that failed.
    pub n_failed: u32,
}
