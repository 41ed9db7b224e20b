// The largest force on a vertex.
// One workgroup per many vertices, strided. Twin: the maximum in src/kernels/cpu.rs.

/// Workgroups that share the vertices: 16 was the fastest of 1 to 256 on a software adapter.
const REDUCE_WORKGROUPS = 16u;

/// What the host reads back.
struct Outcome {
    /// Bits of the largest force; the bits of f32 numbers that are not negative have the same order as the numbers.
    largest_force: atomic<u32>,
}

/// Length of the force on each vertex, voxels.
@group(0) @binding(0) var<storage, read> forces: array<f32>;
/// Zero before.
@group(0) @binding(1) var<storage, read_write> outcome: Outcome;

/// The largest force of the workgroup's vertices.
var<workgroup> largest: atomic<u32>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn reduce(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var force = 0.0;
    for (var v = id.x; v < arrayLength(&forces); v += WORKGROUP_SIZE * REDUCE_WORKGROUPS) {
        force = max(force, forces[v]);
    }
    atomicMax(&largest, bitcast<u32>(force));
    workgroupBarrier();
    if local == 0u {
        atomicMax(&outcome.largest_force, atomicLoad(&largest));
    }
}
