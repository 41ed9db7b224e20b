// Darkens what lies in hollows: how much of the sky over each point is hidden by what is near it, as far as the picture
// shows that. Reads the depth of the finished surfaces. Host side: src/render/occlusion.rs.
//
// Theory: after McGuire, Mara and Luebke 2012, "Scalable Ambient Obscurance". Over a point P with normal n each neighbour Q
// within a radius r hides max(v . n - bias, 0) / |v|, v = Q - P, which fades towards r by 1 - v . v / r^2; neighbours lie
// on a spiral in the picture. Theirs divides by v . v, so that the nearest count most: in scans those are noise. Normals come
// from depth, so they are those of the surface that is seen.

/// What is the same for every fragment. Eye frame: origin at the eye, z to the viewer.
struct Sight {
    /// Depth is (depth.x * z + depth.y) / -z, z of the eye frame; without the division where sight is parallel.
    depth: vec2<f32>,
    /// Half width and half height of the picture at a distance of 1; at any where sight is parallel.
    reach: vec2<f32>,
    /// Width and height of the picture, pixels.
    size: vec2<f32>,
    /// How far things darken each other, voxels.
    radius: f32,
    /// 1 where all lines of sight have the direction of the z axis.
    parallel: u32,
}

@group(0) @binding(0) var<uniform> sight: Sight;
/// Depth of every sample. Where pixels have one sample the host puts texture_depth_2d here.
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
/// How much of the sky is seen, one number per pixel, before it is smoothed.
@group(0) @binding(2) var seen: texture_2d<f32>;

/// Neighbours that are looked at, and turns of the spiral on which they lie.
const N_NEIGHBOURS: u32 = 40u;
const N_TURNS: f32 = 11.0;

/// Least radius of the spiral, pixels: below nothing is to be found.
const LEAST_PIXELS: f32 = 2.0;

/// What is not counted, as a share of the radius: triangles are flat, and next to each other not hollow.
const BIAS: f32 = 0.015;

/// How fast hidden sky darkens, and what is left of the light where all is hidden.
const STRENGTH: f32 = 14.0;
const DARKEST: f32 = 0.1;

/// Pixels to either side over which the noise of the spirals is smoothed, and the difference of depth, as a share of the
/// radius, from which on neighbours belong to another surface.
const SMOOTHED: i32 = 3;
const APART: f32 = 0.35;

const PI: f32 = 3.14159265;

/// One triangle over all of the picture.
@vertex
fn picture_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(vec2(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

/// The z of the eye frame behind a depth.
fn z_of(depth: f32) -> f32 {
    let in_perspective = -sight.depth.y / (depth + sight.depth.x);
    return select(in_perspective, (depth - sight.depth.y) / sight.depth.x, sight.parallel == 1u);
}

fn inside(pixel: vec2<i32>) -> vec2<i32> {
    return clamp(pixel, vec2(0), vec2<i32>(sight.size) - 1);
}

/// What a pixel shows, eye frame.
fn point_at(pixel: vec2<i32>) -> vec3<f32> {
    let at = inside(pixel);
    let z = z_of(textureLoad(depths, at, 0));
    let place = (2.0 * (vec2<f32>(at) + 0.5) / sight.size - 1.0) * vec2(1.0, -1.0);
    return vec3(place * sight.reach * select(-z, 1.0, sight.parallel == 1u), z);
}

/// The difference to one of two neighbours that lies nearer in depth, so that no edge is crossed.
fn along(before: vec3<f32>, here: vec3<f32>, after: vec3<f32>) -> vec3<f32> {
    let onwards = after - here;
    let backwards = here - before;
    return select(backwards, onwards, abs(onwards.z) < abs(backwards.z));
}

/// How much of the sky over a pixel's point is seen, 0 to 1.
@fragment
fn seen_fragment(@builtin(position) place: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(place.xy);
    let here = point_at(pixel);
    let right = along(point_at(pixel - vec2(1, 0)), here, point_at(pixel + vec2(1, 0)));
    let up = along(point_at(pixel + vec2(0, 1)), here, point_at(pixel - vec2(0, 1)));
    let normal = normalize(cross(right, up));
    let per_voxel = 0.5 * sight.size.y / (sight.reach.y * select(-here.z, 1.0, sight.parallel == 1u));
    let pixels = sight.radius * per_voxel;
    if (textureLoad(depths, pixel, 0) >= 1.0 || pixels < LEAST_PIXELS) {
        return vec4(1.0);
    }
    // Interleaved gradient noise (Jimenez 2014): neighbours turn their spirals by what smoothing evens out.
    let turned = 2.0 * PI * fract(52.9829189 * fract(dot(place.xy, vec2(0.06711056, 0.00583715))));
    let squared = sight.radius * sight.radius;
    var hidden = 0.0;
    for (var i = 0u; i < N_NEIGHBOURS; i++) {
        let share = (f32(i) + 0.5) / f32(N_NEIGHBOURS);
        let angle = 2.0 * PI * N_TURNS * share + turned;
        let offset = share * pixels * vec2(cos(angle), sin(angle));
        let other = pixel + vec2<i32>(round(offset));
        let way = point_at(other) - here;
        let far = dot(way, way);
        let fade = max(squared - far, 0.0) / squared;
        let above = max(dot(way, normal) - BIAS * sight.radius, 0.0);
        hidden += fade * above / (sqrt(far) + 0.05 * sight.radius);
    }
    return vec4(mix(DARKEST, 1.0, exp(-STRENGTH * hidden / f32(N_NEIGHBOURS))));
}

/// What the colour of a sample is multiplied by: what its pixel and those around it see, as far as they show one surface.
@fragment
fn darken_fragment(
    @builtin(position) place: vec4<f32>,
    @builtin(sample_index) number: u32,
) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(place.xy);
    let depth = textureLoad(depths, pixel, i32(number));
    if (depth >= 1.0) {
        return vec4(1.0);
    }
    let z = z_of(depth);
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -SMOOTHED; y <= SMOOTHED; y++) {
        for (var x = -SMOOTHED; x <= SMOOTHED; x++) {
            let at = inside(pixel + vec2(x, y));
            let off = abs(z_of(textureLoad(depths, at, 0)) - z) / (APART * sight.radius);
            let weight = saturate(1.0 - off) + 1e-4;
            sum += weight * textureLoad(seen, at, 0).r;
            weights += weight;
        }
    }
    return vec4(vec3(sum / weights), 1.0);
}
