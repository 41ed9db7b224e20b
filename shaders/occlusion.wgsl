// Screen-space ambient occlusion: darkens points by how much of the sky above them is hidden by nearby surfaces in the picture.
// Reads the depth of the finished surfaces. Host side: src/render/occlusion.rs, page/occlusion.js.
//
// Theory: after McGuire, Mara and Luebke 2012, "Scalable Ambient Obscurance". For a point P with normal n, each neighbour Q
// within a radius r hides max(v . n - bias, 0) / |v|, v = Q - P, which fades towards r by 1 - v . v / r^2; neighbours are on a
// spiral in the picture. The paper divides by v . v, which gives the nearest neighbours most weight: in scans those are noise.
// Normals are computed from depth, so they are those of the visible surface.

/// Uniforms of a picture. Eye frame: origin at the eye, z to the viewer.
struct OcclusionUniforms {
    /// Depth is (depth.x * z + depth.y) / -z, z of the eye frame; without the division in parallel projection.
    depth: vec2<f32>,
    /// Half width and half height of the picture at a distance of 1; at any distance in parallel projection.
    half_extent: vec2<f32>,
    /// Width and height of the picture, pixels.
    size: vec2<f32>,
    /// Radius of the occlusion, voxels.
    radius: f32,
    /// 1 for parallel projection, along the z axis.
    parallel: u32,
}

@group(0) @binding(0) var<uniform> uniforms: OcclusionUniforms;
/// Depth of every sample. For one sample per pixel the host replaces the type by texture_depth_2d.
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
/// Visibility of the sky, 0 to 1, one number per pixel, before smoothing.
@group(0) @binding(2) var visibility: texture_2d<f32>;

/// Number of neighbours, and turns of their spiral.
const N_NEIGHBOURS: u32 = 40u;
const N_TURNS: f32 = 11.0;

/// Minimum radius of the spiral, pixels: smaller ones find no neighbours.
const MIN_PIXELS: f32 = 2.0;

/// Heights that do not count, as a fraction of the radius: adjacent flat triangles must not occlude each other.
const BIAS: f32 = 0.015;

/// Rate at which hidden sky darkens, and the light that remains if all sky is hidden.
const STRENGTH: f32 = 14.0;
const DARKEST: f32 = 0.1;

/// Radius of the smoothing of the spirals' noise, pixels, and the difference of depth, as a fraction of the occlusion's radius,
/// from which pixels belong to different surfaces.
const SMOOTHING_RADIUS: i32 = 3;
const MAX_DEPTH_DIFFERENCE: f32 = 0.35;

const PI: f32 = 3.14159265;

/// One triangle that covers the picture.
@vertex
fn picture_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    return vec4(vec2(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}

/// The z of the eye frame at a depth.
fn z_of(depth: f32) -> f32 {
    let in_perspective = -uniforms.depth.y / (depth + uniforms.depth.x);
    return select(in_perspective, (depth - uniforms.depth.y) / uniforms.depth.x, uniforms.parallel == 1u);
}

fn clamp_to_picture(pixel: vec2<i32>) -> vec2<i32> {
    return clamp(pixel, vec2(0), vec2<i32>(uniforms.size) - 1);
}

/// The visible point of a pixel, eye frame.
fn point_at(pixel: vec2<i32>) -> vec3<f32> {
    let at = clamp_to_picture(pixel);
    let z = z_of(textureLoad(depths, at, 0));
    let screen = (2.0 * (vec2<f32>(at) + 0.5) / uniforms.size - 1.0) * vec2(1.0, -1.0);
    return vec3(screen * uniforms.half_extent * select(-z, 1.0, uniforms.parallel == 1u), z);
}

/// The one-sided difference with the smaller change of depth, so that it does not cross an edge.
fn tangent(before: vec3<f32>, here: vec3<f32>, after: vec3<f32>) -> vec3<f32> {
    let forward = after - here;
    let backward = here - before;
    return select(backward, forward, abs(forward.z) < abs(backward.z));
}

/// The visibility of the sky from a pixel's point, 0 to 1.
@fragment
fn visibility_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let here = point_at(pixel);
    let right = tangent(point_at(pixel - vec2(1, 0)), here, point_at(pixel + vec2(1, 0)));
    let up = tangent(point_at(pixel + vec2(0, 1)), here, point_at(pixel - vec2(0, 1)));
    let normal = normalize(cross(right, up));
    let per_voxel = 0.5 * uniforms.size.y / (uniforms.half_extent.y * select(-here.z, 1.0, uniforms.parallel == 1u));
    let pixels = uniforms.radius * per_voxel;
    if (textureLoad(depths, pixel, 0) >= 1.0 || pixels < MIN_PIXELS) {
        return vec4(1.0);
    }
    // Interleaved gradient noise (Jimenez 2014): adjacent pixels rotate their spirals such that smoothing averages them.
    let rotation = 2.0 * PI * fract(52.9829189 * fract(dot(position.xy, vec2(0.06711056, 0.00583715))));
    let squared_radius = uniforms.radius * uniforms.radius;
    var hidden = 0.0;
    for (var i = 0u; i < N_NEIGHBOURS; i++) {
        let fraction = (f32(i) + 0.5) / f32(N_NEIGHBOURS);
        let angle = 2.0 * PI * N_TURNS * fraction + rotation;
        let offset = fraction * pixels * vec2(cos(angle), sin(angle));
        let neighbour = pixel + vec2<i32>(round(offset));
        let v = point_at(neighbour) - here;
        let squared_distance = dot(v, v);
        let fade = max(squared_radius - squared_distance, 0.0) / squared_radius;
        let height = max(dot(v, normal) - BIAS * uniforms.radius, 0.0);
        hidden += fade * height / (sqrt(squared_distance) + 0.05 * uniforms.radius);
    }
    return vec4(mix(DARKEST, 1.0, exp(-STRENGTH * hidden / f32(N_NEIGHBOURS))));
}

/// The factor of a sample's colour: the mean visibility over the pixels around it that show the same surface.
@fragment
fn darken_fragment(
    @builtin(position) position: vec4<f32>,
    @builtin(sample_index) index: u32,
) -> @location(0) vec4<f32> {
    let pixel = vec2<i32>(position.xy);
    let depth = textureLoad(depths, pixel, i32(index));
    if (depth >= 1.0) {
        return vec4(1.0);
    }
    let z = z_of(depth);
    var sum = 0.0;
    var weights = 0.0;
    for (var y = -SMOOTHING_RADIUS; y <= SMOOTHING_RADIUS; y++) {
        for (var x = -SMOOTHING_RADIUS; x <= SMOOTHING_RADIUS; x++) {
            let at = clamp_to_picture(pixel + vec2(x, y));
            let difference = abs(z_of(textureLoad(depths, at, 0)) - z);
            let weight = saturate(1.0 - difference / (MAX_DEPTH_DIFFERENCE * uniforms.radius)) + 1e-4;
            sum += weight * textureLoad(visibility, at, 0).r;
            weights += weight;
        }
    }
    return vec4(vec3(sum / weights), 1.0);
}
