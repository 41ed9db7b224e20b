// The rule by which one vertex gets onto an isosurface. Shared.
// Twin: src/kernels/step.rs, which has the theory.

/// Steps along the gradient before giving up.
const MAX_GRADIENT_STEPS = 16u;
/// Longest step along the gradient, voxels.
const GRADIENT_STEP = 0.25f;
/// How far a gradient step goes past a face, voxels.
const NUDGE = 1e-3f;

/// Status of a vertex that reached its isosurface along its normal.
const BY_NORMAL = 0u;
/// Along the gradient.
const BY_GRADIENT = 1u;
/// Not at all.
const FAILED = 2u;

/// Where a vertex went, and its status.
struct Step {
    position: vec3<f32>,
    status: u32,
}

/// 1 along the axes a vertex may move, 0 along those of its border planes.
fn free_axes(border: u32) -> vec3<f32> {
    return select(vec3<f32>(1.0), vec3<f32>(0.0), held_axes(border));
}

/// `moved`, with the components along border axes copied from `p` bit for bit.
fn keep_borders(moved: vec3<f32>, p: vec3<f32>, border: u32) -> vec3<f32> {
    return select(moved, p, held_axes(border));
}

/// Moves `p` onto the isosurface of `isovalue`, at most `reach` voxels, first along the normal `n`,
/// then along the gradient; bit a of `border` holds component a fixed.
fn onto_isosurface(p: vec3<f32>, n: vec3<f32>, border: u32, isovalue: f32, reach: f32) -> Step {
    let place = locate(p, border);
    let values = relative(corners(place.cell), Slab(isovalue, 1.0, 0.0));
    let difference = interpolate(values, place.local);
    if abs(difference) <= parameters.value_noise {
        return Step(p, BY_NORMAL);
    }
    let upwards = select(-1.0, 1.0, difference < 0.0);
    let slab = Slab(isovalue, upwards, -abs(difference) - parameters.slab_tolerance);
    // Normals point to lower values, so uphill is against them.
    let along = unit(n * free_axes(border)) * -upwards;
    if any(along != vec3<f32>(0.0)) {
        let onwards = walk(p, along, border, slab, reach);
        if onwards.end == REACHED {
            return Step(keep_borders(p + along * onwards.t, p, border), BY_NORMAL);
        }
        let backwards = walk(p, -along, border, slab, reach);
        if backwards.end == REACHED {
            return Step(keep_borders(p - along * backwards.t, p, border), BY_NORMAL);
        }
    }
    return along_gradient(p, border, slab, reach);
}

/// Follows the gradient from `p` in short steps until the isovalue, for at most `reach` voxels.
fn along_gradient(p: vec3<f32>, border: u32, slab: Slab, reach: f32) -> Step {
    let free = free_axes(border);
    var q = p;
    var left = reach;
    // The way in which the last steps crossed a face, zero where they did not.
    var crossed = vec3<f32>(0.0);
    for (var n = 0u; n < MAX_GRADIENT_STEPS; n++) {
        let place = locate(q, border);
        let uphill = gradient_in(place) * free * slab.sign;
        let slides = uphill * crossed < vec3<f32>(0.0);
        let direction = unit(select(uphill, vec3<f32>(0.0), slides));
        if all(direction == vec3<f32>(0.0)) {
            break;
        }
        let d = direction * grid.inverse_cell_size;
        let exit = exit_of(place.local, d, steps(d), vec3<i32>(0));
        let past = max(exit.t, 0.0) + NUDGE;
        let size = min(min(past, GRADIENT_STEP), left);
        let found = walk(q, direction, border, slab, size);
        if found.end == REACHED {
            return Step(keep_borders(q + direction * found.t, p, border), BY_GRADIENT);
        }
        if found.end == LEFT {
            break;
        }
        q = keep_borders(q + direction * size, p, border);
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
