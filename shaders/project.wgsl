// Moves every vertex onto the isosurface of the next isovalue.
// One thread per vertex. Twin: src/kernels/project.rs; one vertex: step.wgsl.

/// One byte per vertex, four to a word: not 0 where it is constrained.
@group(0) @binding(3) var<storage, read> constrained: array<u32>;
/// x, y, z of each vertex' unit normal.
@group(0) @binding(4) var<storage, read> normals: array<f32>;
/// x, y, z of each vertex, voxel frame.
@group(0) @binding(5) var<storage, read_write> positions: array<f32>;
/// The status of each vertex.
@group(0) @binding(6) var<storage, read_write> status: array<u32>;
/// x, y, z of the final position of each vertex if it is constrained, voxel frame.
@group(0) @binding(7) var<storage, read> ends: array<f32>;

/// Where a constrained vertex at p is after a share of its way.
fn constrained_at(p: vec3<f32>, end: vec3<f32>, share: f32) -> vec3<f32> {
    // Not p + share * (end - p): a share of one must give the end itself.
    return p * (1.0 - share) + end * share;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn project(@builtin(global_invocation_id) id: vec3<u32>) {
    let v = element(id);
    if v >= arrayLength(&status) {
        return;
    }
    let p = position(v);
    if extractBits(constrained[v / 4u], 8u * (v % 4u), 8u) != 0u {
        let end = vec3<f32>(ends[3u * v], ends[3u * v + 1u], ends[3u * v + 2u]);
        let q = constrained_at(p, end, parameters.share);
        positions[3u * v] = q.x;
        positions[3u * v + 1u] = q.y;
        positions[3u * v + 2u] = q.z;
        status[v] = BY_NORMAL;
        return;
    }
    let n = vec3<f32>(normals[3u * v], normals[3u * v + 1u], normals[3u * v + 2u]);
    let step = onto_isosurface(p, n, parameters.isovalue, parameters.reach);
    positions[3u * v] = step.position.x;
    positions[3u * v + 1u] = step.position.y;
    positions[3u * v + 2u] = step.position.z;
    status[v] = step.status;
}
