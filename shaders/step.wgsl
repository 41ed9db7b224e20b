// How one vertex reaches an isosurface. Shared.
// Twin: src/field/step.rs, which has the theory.

/// Number of steps along the gradient at most.
const MAX_GRADIENT_STEPS = 16u;
/// Longest step along the gradient, voxels.
const GRADIENT_STEP = 0.25f;
/// Length by which a gradient step overshoots a face, voxels.
const NUDGE = 1e-3f;

/// Status of a vertex that reached its isosurface along its normal.
const BY_NORMAL = 0u;
/// Along the gradient.
const BY_GRADIENT = 1u;
/// Not at all.
const FAILED = 2u;

/// Position of a vertex after its step, and its status.
struct Step {
    position: vec3<f32>,
    status: u32,
}

/// Moves `p` onto the isosurface of `isovalue`, at most `reach` voxels, first along the normal `n`,
/// then along the gradient.
fn onto_isosurface(p: vec3<f32>, n: vec3<f32>, isovalue: f32, reach: f32) -> Step {
    let point = locate(p);
    let values = relative(corners(point.cell), Slab(isovalue, 1.0, 0.0));
    let difference = interpolate(values, point.local);
    if abs(difference) <= parameters.value_noise {
        return Step(p, BY_NORMAL);
    }
    let upwards = select(-1.0, 1.0, difference < 0.0);
    let slab = Slab(isovalue, upwards, -abs(difference) - parameters.slab_tolerance);
    // Normals point to lower values, so uphill is against them.
    let along = unit(n) * -upwards;
    if any(along != vec3<f32>(0.0)) {
        let onwards = walk(p, along, slab, reach);
        if onwards.end == REACHED {
            return Step(p + along * onwards.t, BY_NORMAL);
        }
        let backwards = walk(p, -along, slab, reach);
        if backwards.end == REACHED {
            return Step(p - along * backwards.t, BY_NORMAL);
        }
    }
    return along_gradient(p, slab, reach);
}

/// Follows the gradient from `p` in short steps until the isovalue, for at most `reach` voxels.
fn along_gradient(p: vec3<f32>, slab: Slab, reach: f32) -> Step {
    var q = p;
    var left = reach;
    // Per axis, the direction in which the last steps crossed a face; zero where they did not.
    var crossed = vec3<f32>(0.0);
    for (var n = 0u; n < MAX_GRADIENT_STEPS; n++) {
        let point = locate(q);
        let uphill = gradient_in(point) * slab.sign;
        let slides = uphill * crossed < vec3<f32>(0.0);
        let direction = unit(select(uphill, vec3<f32>(0.0), slides));
        if all(direction == vec3<f32>(0.0)) {
            break;
        }
        let d = direction * grid.inverse_cell_size;
        let exit = exit_of(point.local, d, steps(d), vec3<i32>(0));
        let past = max(exit.t, 0.0) + NUDGE;
        let size = min(min(past, GRADIENT_STEP), left);
        let found = walk(q, direction, slab, size);
        if found.end == REACHED {
            return Step(q + direction * found.t, BY_GRADIENT);
        }
        if found.end == LEFT {
            break;
        }
        q += direction * size;
        left -= size;
        if left <= 0.0 {
            break;
        }
        crossed = select(vec3<f32>(0.0), crossed, slides);
        if past <= size {
            crossed = select(crossed, direction, exit.axis);
        }
    }
    return Step(p, FAILED);
}
