// One iteration of tangential relaxation: the force, the move, and back onto the isosurface.
// One thread per vertex. Twin: src/kernels/relax.rs, which has the theory.

/// Longest move of one iteration, as a multiple of the vertex' shortest edge.
const MAX_MOVE = 0.5f;

/// One byte per vertex, four to a word: not 0 where it is constrained.
@group(0) @binding(3) var<storage, read> constrained: array<u32>;
/// Start and end of each vertex' ring.
@group(0) @binding(4) var<storage, read> ring_offsets: array<u32>;
/// Neighbours, counter-clockwise.
@group(0) @binding(5) var<storage, read> ring: array<u32>;
/// x, y, z of each vertex' unit normal.
@group(0) @binding(6) var<storage, read> normals: array<f32>;
/// x, y, z of each vertex before the iteration, voxel frame.
@group(0) @binding(7) var<storage, read> positions: array<f32>;
/// x, y, z of each vertex after the iteration.
@group(0) @binding(8) var<storage, read_write> moved: array<f32>;
/// Length of the force on each vertex before the iteration, voxels.
@group(0) @binding(9) var<storage, read_write> forces: array<f32>;

/// The tangential force on a vertex, and the length of its shortest edge.
struct Force {
    tangential: vec3<f32>,
    shortest: f32,
}

fn force(v: u32, p: vec3<f32>, n: vec3<f32>) -> Force {
    let start = ring_offsets[v];
    let end = ring_offsets[v + 1u];
    if extractBits(constrained[v / 4u], 8u * (v % 4u), 8u) != 0u || start == end {
        return Force(vec3<f32>(0.0), 0.0);
    }
    var sum = vec3<f32>(0.0);
    var shortest = MAX_DISTANCE;
    for (var i = start; i < end; i++) {
        let spoke = position(ring[i]) - p;
        shortest = min(shortest, length(spoke));
        sum += spoke;
    }
    let along = unit(n);
    let umbrella = sum / f32(end - start);
    return Force(umbrella - along * dot(umbrella, along), shortest);
}

/// The position on the isosurface of a vertex that the force has moved off it; `p` if it cannot get back.
fn relaxed(p: vec3<f32>, off: vec3<f32>, n: vec3<f32>, reach: f32) -> vec3<f32> {
    let step = onto_isosurface(off, n, parameters.isovalue, reach);
    let point = locate(step.position);
    let faces_along = dot(gradient_in(point), n) <= 0.0;
    return select(p, step.position, step.status != FAILED && faces_along);
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn relax(@builtin(global_invocation_id) id: vec3<u32>) {
    let v = element(id);
    if v >= arrayLength(&forces) {
        return;
    }
    let n = vec3<f32>(normals[3u * v], normals[3u * v + 1u], normals[3u * v + 2u]);
    let p = position(v);
    let f = force(v, p, n);
    let size = length(f.tangential);
    let move_length = min(parameters.strength * size, MAX_MOVE * f.shortest);
    var q = p;
    if move_length > 0.0 && f.shortest < MAX_DISTANCE {
        q = relaxed(p, p + f.tangential * (move_length / size), n, f.shortest);
    }
    moved[3u * v] = q.x;
    moved[3u * v + 1u] = q.y;
    moved[3u * v + 2u] = q.z;
    forces[v] = size;
}
