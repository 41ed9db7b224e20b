// Distance of face barycentres from the isosurface along the faces' normals.
// One thread per face. Twin: src/kernels/deviation.rs; one face: src/field/deviation.rs.

/// A slab without a lower side.
const BOTTOMLESS = -3.4e38f;

/// The three vertices of each face.
@group(0) @binding(3) var<storage, read> faces: array<u32>;
/// x, y, z of each vertex, voxel frame.
@group(0) @binding(4) var<storage, read> positions: array<f32>;
/// The distance of each face, voxels.
@group(0) @binding(5) var<storage, read_write> distances: array<f32>;

fn face_deviation(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, isovalue: f32, reach: f32) -> f32 {
    let ab = b - a;
    let ac = c - a;
    let barycentre = a + (ab + ac) / 3.0;
    let point = locate(barycentre);
    let values = relative(corners(point.cell), Slab(isovalue, 1.0, 0.0));
    let difference = interpolate(values, point.local);
    if abs(difference) <= parameters.value_noise {
        return 0.0;
    }
    var direction = unit(cross(ab, ac));
    if all(direction == vec3<f32>(0.0)) {
        direction = unit(slope(values, point.local) * grid.inverse_cell_size);
    }
    if all(direction == vec3<f32>(0.0)) {
        return reach;
    }
    let upwards = select(-1.0, 1.0, difference < 0.0);
    let slab = Slab(isovalue, upwards, BOTTOMLESS);
    var nearest = reach;
    let forwards = walk(barycentre, direction * -upwards, slab, nearest);
    if forwards.end == REACHED {
        nearest = min(nearest, forwards.t);
    }
    let backwards = walk(barycentre, direction * upwards, slab, nearest);
    if backwards.end == REACHED {
        nearest = min(nearest, backwards.t);
    }
    return nearest;
}

@compute @workgroup_size(WORKGROUP_SIZE)
fn deviation(@builtin(global_invocation_id) id: vec3<u32>) {
    let f = element(id);
    if f >= arrayLength(&distances) {
        return;
    }
    let a = position(faces[3u * f]);
    let b = position(faces[3u * f + 1u]);
    let c = position(faces[3u * f + 2u]);
    distances[f] = face_deviation(a, b, c, parameters.isovalue, parameters.reach);
}
