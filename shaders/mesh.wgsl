// Vertices and vectors. Shared by the kernels that declare `positions`.
// Twin: the slices of src/kernels/cpu.rs, and `unit` in src/field/step.rs.

/// A shorter vector has no direction.
const ZERO_LENGTH = 1e-15f;

/// Position of a vertex, voxel frame.
fn position(v: u32) -> vec3<f32> {
    return vec3<f32>(positions[3u * v], positions[3u * v + 1u], positions[3u * v + 2u]);
}

/// The unit vector along `v`, or zero where `v` has no direction.
fn unit(v: vec3<f32>) -> vec3<f32> {
    let size = length(v);
    if size > ZERO_LENGTH {
        return v / size;
    }
    return vec3<f32>(0.0);
}
