// The trilinear field: samples, the layer around them, values and gradients. Shared.
// Twin: src/field/grid.rs.

/// The volume: constant during a sweep.
struct Grid {
    /// Cells per voxel along each axis.
    inverse_cell_size: vec3<f32>,
    /// Value of the layer around the volume.
    outside: f32,
    /// Samples along each axis.
    dims: vec3<i32>,
    /// How samples are packed: 0 u8, 1 i8, 2 u16, 3 i16, 4 f32.
    sample_type: u32,
}

/// The parameters of one kernel call.
struct Parameters {
    /// The isovalue to reach.
    isovalue: f32,
    /// How far a vertex moves at most, voxels.
    reach: f32,
    /// Share of the force that moves a vertex.
    strength: f32,
    /// Smaller differences from the isovalue count as none.
    value_noise: f32,
    /// How far values along a step may leave the slab between start and isovalue.
    slab_tolerance: f32,
    /// Share of its remaining way by which a constrained vertex moves.
    share: f32,
}

/// A point of the field: its cell, and its coordinates inside the cell, 0 to 1 along each axis.
struct CellPoint {
    cell: vec3<i32>,
    local: vec3<f32>,
}

/// The grid of the volume.
@group(0) @binding(0) var<uniform> grid: Grid;
/// The samples, x fastest, packed into words, the lowest bits first.
@group(0) @binding(1) var<storage, read> samples: array<u32>;
/// The parameters of this call.
@group(0) @binding(2) var<uniform> parameters: Parameters;

/// Sample `i`.
fn sample(i: u32) -> f32 {
    switch grid.sample_type {
        case 0u: {
            return f32(extractBits(samples[i / 4u], 8u * (i % 4u), 8u));
        }
        case 1u: {
            return f32(extractBits(bitcast<i32>(samples[i / 4u]), 8u * (i % 4u), 8u));
        }
        case 2u: {
            return f32(extractBits(samples[i / 2u], 16u * (i % 2u), 16u));
        }
        case 3u: {
            return f32(extractBits(bitcast<i32>(samples[i / 2u]), 16u * (i % 2u), 16u));
        }
        default: {
            return bitcast<f32>(samples[i]);
        }
    }
}

/// The sample at a lattice point, or the value of the layer around the volume.
fn padded(at: vec3<i32>) -> f32 {
    if any(at < vec3<i32>(0)) || any(at >= grid.dims) {
        return grid.outside;
    }
    let p = vec3<u32>(at);
    let n = vec3<u32>(grid.dims);
    return sample(p.x + n.x * (p.y + n.y * p.z));
}

/// The values at the 8 corners of a cell; corner c is at (c & 1, c >> 1 & 1, c >> 2 & 1).
fn corners(cell: vec3<i32>) -> array<f32, 8> {
    if all(cell >= vec3<i32>(0)) && all(cell < grid.dims - 1) {
        let nx = u32(grid.dims.x);
        let slice = nx * u32(grid.dims.y);
        let i = u32(cell.x) + nx * u32(cell.y) + slice * u32(cell.z);
        return array<f32, 8>(
            sample(i), sample(i + 1u), sample(i + nx), sample(i + nx + 1u),
            sample(i + slice), sample(i + slice + 1u),
            sample(i + nx + slice), sample(i + nx + slice + 1u),
        );
    }
    return array<f32, 8>(
        padded(cell), padded(cell + vec3<i32>(1, 0, 0)),
        padded(cell + vec3<i32>(0, 1, 0)), padded(cell + vec3<i32>(1, 1, 0)),
        padded(cell + vec3<i32>(0, 0, 1)), padded(cell + vec3<i32>(1, 0, 1)),
        padded(cell + vec3<i32>(0, 1, 1)), padded(cell + vec3<i32>(1, 1, 1)),
    );
}

/// The cell of a position (voxel frame), and its coordinates there.
fn locate(p: vec3<f32>) -> CellPoint {
    let last = grid.dims - 1;
    let x = clamp(p * grid.inverse_cell_size, vec3<f32>(-1.0), vec3<f32>(grid.dims));
    let cell = min(vec3<i32>(floor(x)), last);
    return CellPoint(cell, x - vec3<f32>(cell));
}

/// Linear interpolation, exact at both ends.
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    return a * (1.0 - t) + b * t;
}

/// The trilinear value inside a cell.
fn interpolate(v: array<f32, 8>, local: vec3<f32>) -> f32 {
    let low = lerp(lerp(v[0], v[1], local.x), lerp(v[2], v[3], local.x), local.y);
    let high = lerp(lerp(v[4], v[5], local.x), lerp(v[6], v[7], local.x), local.y);
    return lerp(low, high, local.z);
}

/// The trilinear gradient inside a cell, per cell.
fn slope(v: array<f32, 8>, local: vec3<f32>) -> vec3<f32> {
    let x = lerp(
        lerp(v[1] - v[0], v[3] - v[2], local.y), lerp(v[5] - v[4], v[7] - v[6], local.y), local.z,
    );
    let y = lerp(
        lerp(v[2] - v[0], v[3] - v[1], local.x), lerp(v[6] - v[4], v[7] - v[5], local.x), local.z,
    );
    let z = lerp(
        lerp(v[4] - v[0], v[5] - v[1], local.x), lerp(v[6] - v[2], v[7] - v[3], local.x), local.y,
    );
    return vec3<f32>(x, y, z);
}

/// The gradient at a point, per voxel.
fn gradient_in(point: CellPoint) -> vec3<f32> {
    return slope(corners(point.cell), point.local) * grid.inverse_cell_size;
}
