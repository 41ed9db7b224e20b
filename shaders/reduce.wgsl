// The largest force and the number of vertices that failed.
// One workgroup per many vertices, strided. Twin: the sums of src/kernels/cpu.rs.

/// Workgroups that share the vertices: 16 was the quickest of 1 to 256 on a software adapter.
const REDUCE_WORKGROUPS = 16u;
/// Status of a vertex that failed.
const FAILED = 2u;

/// What the host reads back.
struct Outcome {
    /// Bits of the largest force; those of f32 numbers that are not negative are in their order.
    largest_force: atomic<u32>,
    /// Vertices that failed.
    n_failed: atomic<u32>,
}

/// Length of the force on each vertex, voxels.
@group(0) @binding(0) var<storage, read> forces: array<f32>;
/// What became of each vertex.
@group(0) @binding(1) var<storage, read> status: array<u32>;
/// Zero before.
@group(0) @binding(2) var<storage, read_write> outcome: Outcome;

/// The workgroup's share of the outcome.
var<workgroup> largest: atomic<u32>;
var<workgroup> failed: atomic<u32>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn reduce(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var force = 0.0;
    var count = 0u;
    for (var v = id.x; v < arrayLength(&status); v += WORKGROUP_SIZE * REDUCE_WORKGROUPS) {
        force = max(force, forces[v]);
        count += u32(status[v] == FAILED);
    }
    atomicMax(&largest, bitcast<u32>(force));
    atomicAdd(&failed, count);
    workgroupBarrier();
    if local == 0u {
        atomicMax(&outcome.largest_force, atomicLoad(&largest));
        atomicAdd(&outcome.n_failed, atomicLoad(&failed));
    }
}
