// The list of the triangles alive at a rank, and the arguments of the draw that uses it.
// One thread per triangle. Twin: src/kernels/compact.rs.

/// What is asked.
struct Moment {
    /// Rank of the isovalue.
    rank: u32,
}

/// The arguments of an indirect draw.
struct Draw {
    /// Zero before; three for each triangle listed.
    n_corners: atomic<u32>,
    /// One.
    n_instances: u32,
    first_corner: u32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> moment: Moment;
/// Birth and death of each triangle.
@group(0) @binding(1) var<storage, read> lifetimes: array<vec2<u32>>;
@group(0) @binding(2) var<storage, read_write> draw: Draw;
/// Triangles alive, in no order of workgroups; room for all of them.
@group(0) @binding(3) var<storage, read_write> alive: array<u32>;

/// How many of the workgroup's triangles are alive, and where its part of the list begins.
var<workgroup> n_alive: atomic<u32>;
var<workgroup> first: u32;

@compute @workgroup_size(WORKGROUP_SIZE)
fn compact(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let triangle = element(id);
    var lives = false;
    if triangle < arrayLength(&lifetimes) {
        let lifetime = lifetimes[triangle];
        lives = lifetime.x <= moment.rank && moment.rank < lifetime.y;
    }
    var place = 0u;
    if lives {
        place = atomicAdd(&n_alive, 1u);
    }
    workgroupBarrier();
    // One addition for a workgroup: all threads adding at one place would wait for each other.
    if local == 0u {
        let n = atomicLoad(&n_alive);
        if n > 0u {
            first = atomicAdd(&draw.n_corners, 3u * n) / 3u;
        }
    }
    workgroupBarrier();
    if lives && first + place < arrayLength(&alive) {
        alive[first + place] = triangle;
    }
}
