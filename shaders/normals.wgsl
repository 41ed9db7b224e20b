// Area-weighted vertex normals, towards lower values.
// One thread per vertex. Twin: src/kernels/normals.rs.

/// x, y, z of each vertex, voxel frame.
@group(0) @binding(0) var<storage, read> positions: array<f32>;
/// Start and end of each vertex' ring.
@group(0) @binding(1) var<storage, read> ring_offsets: array<u32>;
/// Neighbours, counter-clockwise.
@group(0) @binding(2) var<storage, read> ring: array<u32>;
/// x, y, z of each vertex' unit normal; zero where its faces have no area.
@group(0) @binding(3) var<storage, read_write> vertex_normals: array<f32>;

@compute @workgroup_size(WORKGROUP_SIZE)
fn normals(@builtin(global_invocation_id) id: vec3<u32>) {
    let v = element(id);
    if 3u * v >= arrayLength(&vertex_normals) {
        return;
    }
    let start = ring_offsets[v];
    let end = ring_offsets[v + 1u];
    var sum = vec3<f32>(0.0);
    if start < end {
        let p = position(v);
        var previous = position(ring[end - 1u]) - p;
        for (var i = start; i < end; i++) {
            let spoke = position(ring[i]) - p;
            sum += cross(previous, spoke);
            previous = spoke;
        }
    }
    let n = unit(sum);
    vertex_normals[3u * v] = n.x;
    vertex_normals[3u * v + 1u] = n.y;
    vertex_normals[3u * v + 2u] = n.z;
}
