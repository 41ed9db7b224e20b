// The element of a thread. Shared by all kernels.
// Twin: `Kernel::dispatch` in src/gpu/kernel.rs.

/// Threads of a workgroup.
const WORKGROUP_SIZE = 64u;
/// Workgroups along x at most; the rest are along y.
const MAX_WORKGROUPS = 65535u;

/// The element of a thread.
fn element(id: vec3<u32>) -> u32 {
    return id.x + id.y * (WORKGROUP_SIZE * MAX_WORKGROUPS);
}
