// A ray through the field: the cells it visits and the cubic in each. Shared.
// Twin: src/field/ray.rs, which has the theory.

/// Number of cells that a ray visits at most.
const MAX_CELLS = 512u;
/// Number of Newton steps and bisections in one monotone piece at most.
const MAX_NEWTON = 24u;
/// A direction with a smaller component (in cells) counts as parallel to the faces of that axis.
const PARALLEL = 1e-12f;
/// Farther than any distance in a volume: the distance to a face that is never crossed.
const MAX_DISTANCE = 3.4e38f;
/// The spacing of f32 numbers just above 1.
const EPSILON = 1.1920929e-7f;

/// How a ray ended: it reached the isovalue after `Walk.t`.
const REACHED = 0u;
/// It left the slab, or the field, before.
const LEFT = 1u;
/// It went the whole distance inside the slab.
const ENDED = 2u;

/// The value that a ray looks for, and the smallest `sign * (f - isovalue)` allowed before.
struct Slab {
    isovalue: f32,
    sign: f32,
    lowest: f32,
}

/// How a ray ended, and after how many voxels.
struct Walk {
    end: u32,
    t: f32,
}

/// The face through which a ray leaves a cell, and after how many voxels.
struct Exit {
    axis: vec3<bool>,
    t: f32,
}

/// Per axis, 1 or -1 as a direction (in cells) crosses faces upwards or downwards; 0 if it crosses none.
fn steps(d: vec3<f32>) -> vec3<i32> {
    return vec3<i32>(d > vec3<f32>(PARALLEL)) - vec3<i32>(d < vec3<f32>(-PARALLEL));
}

/// The axis of the face through which the ray leaves the cell, and the distance to it from the start, voxels.
fn exit_of(local: vec3<f32>, d: vec3<f32>, step: vec3<i32>, moved: vec3<i32>) -> Exit {
    let crosses = step != vec3<i32>(0);
    let plane = vec3<f32>(moved + vec3<i32>(step > vec3<i32>(0)));
    let t = select(
        vec3<f32>(MAX_DISTANCE), (plane - local) / select(vec3<f32>(1.0), d, crosses), crosses,
    );
    if t.x <= t.y && t.x <= t.z {
        return Exit(vec3<bool>(true, false, false), t.x);
    }
    if t.y <= t.z {
        return Exit(vec3<bool>(false, true, false), t.y);
    }
    return Exit(vec3<bool>(false, false, true), t.z);
}

/// Walks from `origin` along the unit vector `direction` for at most `reach` voxels.
fn walk(origin: vec3<f32>, direction: vec3<f32>, slab: Slab, reach: f32) -> Walk {
    let d = direction * grid.inverse_cell_size;
    let x = origin * grid.inverse_cell_size;
    var start = vec3<i32>(floor(x));
    var local = x - floor(x);
    let step = steps(d);
    // On a face the ray enters the lower cell if it goes down, and a ray within the upper border
    // plane of the volume uses the cell inside.
    let within = (step == vec3<i32>(0)) & (start >= grid.dims - 1);
    let lower = (local == vec3<f32>(0.0)) & ((step < vec3<i32>(0)) | within);
    start -= vec3<i32>(lower);
    local = select(local, vec3<f32>(1.0), lower);
    let entry = select(vec3<f32>(1.0), vec3<f32>(0.0), step > vec3<i32>(0));
    var moved = vec3<i32>(0);
    var a_local = local;
    var t0 = 0.0;
    for (var n = 0u; n < MAX_CELLS; n++) {
        let cell = start + moved;
        if any(cell < vec3<i32>(-1)) || any(cell >= grid.dims) {
            return Walk(LEFT, 0.0);
        }
        let exit = exit_of(local, d, step, moved);
        let t1 = min(max(exit.t, t0), reach);
        let ends = exit.t >= reach;
        var b_local = clamp(local + d * t1 - vec3<f32>(moved), vec3<f32>(0.0), vec3<f32>(1.0));
        if exit.t <= reach {
            b_local = select(b_local, 1.0 - entry, exit.axis);
        }
        let found = crossing(relative(corners(cell), slab), a_local, b_local, slab.lowest);
        if found.end == REACHED {
            return Walk(REACHED, lerp(t0, t1, found.t));
        }
        if found.end == LEFT || ends {
            return Walk(found.end, 0.0);
        }
        moved += select(vec3<i32>(0), step, exit.axis);
        a_local = select(b_local, entry, exit.axis);
        t0 = t1;
    }
    return Walk(LEFT, 0.0);
}

/// `sign * (value - isovalue)` of each value.
fn relative(v: array<f32, 8>, slab: Slab) -> array<f32, 8> {
    let c = slab.isovalue;
    let s = slab.sign;
    return array<f32, 8>(
        s * (v[0] - c), s * (v[1] - c), s * (v[2] - c), s * (v[3] - c),
        s * (v[4] - c), s * (v[5] - c), s * (v[6] - c), s * (v[7] - c),
    );
}

/// The first event of the field on a segment from `a` to `b` inside a cell: it reaches zero (at 0
/// to 1 along the segment), falls below `lowest` before, or neither.
fn crossing(v: array<f32, 8>, a: vec3<f32>, b: vec3<f32>, lowest: f32) -> Walk {
    let low = min(min(min(v[0], v[1]), min(v[2], v[3])), min(min(v[4], v[5]), min(v[6], v[7])));
    let high = max(max(max(v[0], v[1]), max(v[2], v[3])), max(max(v[4], v[5]), max(v[6], v[7])));
    if high < 0.0 && low >= lowest {
        return Walk(ENDED, 0.0);
    }
    return first_crossing(bernstein(v, a, b), lowest);
}

/// Bernstein coefficients of the field along the segment from `a` to `b` inside a cell.
fn bernstein(v: array<f32, 8>, a: vec3<f32>, b: vec3<f32>) -> vec4<f32> {
    // Names spell the ends that x, y and z are taken from.
    let even = vec4<f32>(v[0], v[2], v[4], v[6]);
    let odd = vec4<f32>(v[1], v[3], v[5], v[7]);
    let xa = even * (1.0 - a.x) + odd * a.x;
    let xb = even * (1.0 - b.x) + odd * b.x;
    let aa = xa.xz * (1.0 - a.y) + xa.yw * a.y;
    let ab = xa.xz * (1.0 - b.y) + xa.yw * b.y;
    let ba = xb.xz * (1.0 - a.y) + xb.yw * a.y;
    let bb = xb.xz * (1.0 - b.y) + xb.yw * b.y;
    let aaa = lerp(aa.x, aa.y, a.z);
    let aab = lerp(aa.x, aa.y, b.z);
    let aba = lerp(ab.x, ab.y, a.z);
    let abb = lerp(ab.x, ab.y, b.z);
    let baa = lerp(ba.x, ba.y, a.z);
    let bab = lerp(ba.x, ba.y, b.z);
    let bba = lerp(bb.x, bb.y, a.z);
    let bbb = lerp(bb.x, bb.y, b.z);
    return vec4<f32>(aaa, (aab + aba + baa) / 3.0, (abb + bab + bba) / 3.0, bbb);
}

/// The first place in 0..1 where the cubic with these Bernstein coefficients reaches zero from
/// below, unless it falls below `lowest` before.
fn first_crossing(b: vec4<f32>, lowest: f32) -> Walk {
    if b.x >= 0.0 {
        return Walk(REACHED, 0.0);
    }
    if max(max(b.y, b.z), b.w) < 0.0 && min(min(b.y, b.z), b.w) >= lowest {
        return Walk(ENDED, 0.0);
    }
    let turns = turning_points(b);
    let ends = array<f32, 3>(turns.x, turns.y, 1.0);
    var low = 0.0;
    for (var i = 0u; i < 3u; i++) {
        let high = ends[i];
        if high > low {
            let value = cubic(b, high);
            if value >= 0.0 {
                return Walk(REACHED, root_between(b, low, high));
            }
            if value < lowest {
                return Walk(LEFT, 0.0);
            }
            low = high;
        }
    }
    return Walk(ENDED, 0.0);
}

/// The parameters in 0..1 at which the cubic turns, ascending; 0 in place of those that do not exist.
fn turning_points(b: vec4<f32>) -> vec2<f32> {
    let e = b.yzw - b.xyz;
    let discriminant = e.y * e.y - e.x * e.z;
    if discriminant <= 0.0 {
        return vec2<f32>(0.0);
    }
    // Both roots without cancellation: one from the sum of equal signs, one from their product.
    let half = e.y - e.x;
    let root = sqrt(discriminant);
    let q = select(-root - half, root - half, half < 0.0);
    let s = fraction(q, e.x - 2.0 * e.y + e.z);
    let t = fraction(e.x, q);
    return vec2<f32>(min(s, t), max(s, t));
}

/// n / d if it is between 0 and 1, else 0.
fn fraction(n: f32, d: f32) -> f32 {
    if n != 0.0 && abs(n) < abs(d) && (n > 0.0) == (d > 0.0) {
        return n / d;
    }
    return 0.0;
}

/// The cubic with Bernstein coefficients `b` at `s`, by de Casteljau's steps.
fn cubic(b: vec4<f32>, s: f32) -> f32 {
    let p = b.xyz * (1.0 - s) + b.yzw * s;
    let q = p.xy * (1.0 - s) + p.yz * s;
    return lerp(q.x, q.y, s);
}

/// The root of a piece that rises monotonically from below zero at `from` to above it at `to`.
fn root_between(b: vec4<f32>, first: f32, last: f32) -> f32 {
    var low = first;
    var high = last;
    var s = 0.5 * (low + high);
    for (var n = 0u; n < MAX_NEWTON; n++) {
        let p = b.xyz * (1.0 - s) + b.yzw * s;
        let q = p.xy * (1.0 - s) + p.yz * s;
        let value = lerp(q.x, q.y, s);
        if value >= 0.0 {
            high = s;
        } else {
            low = s;
        }
        let rise = 3.0 * (q.y - q.x);
        var next = 0.5 * (low + high);
        if rise > 0.0 {
            let newton = s - value / rise;
            if newton > low && newton < high {
                next = newton;
            } else if newton == s {
                return s;
            }
        }
        if abs(next - s) <= EPSILON * 0.5 * s {
            return next;
        }
        s = next;
    }
    return s;
}
