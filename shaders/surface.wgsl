// Draws the isosurface of one isovalue: trajectories interpolated per vertex, lit per fragment.
// One vertex invocation per corner of an active triangle. Host side: src/render/surface.rs.

/// What is the same for every corner of a picture. Eye frame: origin at the eye, z to the viewer.
struct Frame {
    /// From the voxel frame to clip coordinates.
    clip_from_voxel: mat4x4<f32>,
    /// From the voxel frame to the eye frame.
    eye_from_voxel: mat4x4<f32>,
    /// Turns normals into the eye frame, up to their length; the fourth row and column are not used.
    eye_from_normal: mat4x4<f32>,
    /// Linear colour of the side towards lower values where the surface is plain.
    front: vec4<f32>,
    /// Linear colour of the side towards higher values; tints it where the surface is not plain.
    back: vec4<f32>,
    /// Linear colour of the wireframe and, as alpha, how much it covers.
    wire: vec4<f32>,
    /// The isovalue as the sum of two numbers, on the scale of `isovalues`.
    isovalue: vec2<f32>,
    /// Rank of the last isovalue in `isovalues` that is not above it.
    rank: u32,
    /// One of the constants below.
    palette: u32,
    /// Width of the wireframe, pixels; 0 draws none.
    wire_width: f32,
    /// 1 where the grid axes are left-handed in the world, so that triangles turn the other way.
    mirrored: u32,
    /// 1 where all lines of sight have the direction of the eye frame's z axis.
    parallel: u32,
    /// Where the main light is, one of `LAMPS`.
    lamp: u32,
    /// Linear colours of the map, evenly spaced.
    map: array<vec4<f32>, 33>,
}

/// One knot of a trajectory.
struct Knot {
    /// Rank of its isovalue.
    rank: u32,
    /// Position, voxel frame.
    x: f32,
    y: f32,
    z: f32,
}

/// One active triangle.
struct ActiveTriangle {
    /// Its vertices.
    vertices: array<u32, 3>,
    /// What its colour shows: of each corner the share of the map, 1 to 1023 for 0 to 1, 0 for none, 10 bits each; for
    /// names a number.
    measures: u32,
    /// Unit normals of the mesh at its corners, towards lower values: octahedral, two signed normalised 16-bit
    /// numbers each. Of the mesh that is drawn: no trajectory has any.
    normals: array<u32, 3>,
}

@group(0) @binding(0) var<uniform> frame: Frame;
/// The isovalue of each rank, scaled to [0, 1] over the range, as the sum of two numbers: together
/// 48 bits, so that knots however close are told apart.
@group(0) @binding(1) var<storage, read> isovalues: array<vec2<f32>>;
/// Start of each vertex's knots, and the end.
@group(0) @binding(2) var<storage, read> first_knot: array<u32>;
/// Knots by vertex, rank increasing.
@group(0) @binding(3) var<storage, read> knots: array<Knot>;
/// The active triangles.
@group(0) @binding(4) var<storage, read> triangles: array<ActiveTriangle>;

// Palettes: the same numbers as on the host side.
const PLAIN: u32 = 0u;
const MAP: u32 = 1u;
const NAMES: u32 = 2u;
const NORMALS: u32 = 3u;

/// Where the main light may be, eye frame, in the order of `Light` in src/render/light.rs.
const LAMPS = array(
    vec3(-0.45, 0.65, 0.70),
    vec3(0.0, 0.0, 1.0),
    vec3(-1.0, 0.1, 0.3),
    vec3(1.0, 0.1, 0.3),
    vec3(0.0, 1.0, 0.3),
    vec3(0.0, -1.0, 0.3),
);

/// Linear colour of what has no number; that of src/color.rs.
const NO_VALUE = vec3(0.30, 0.30, 0.30);

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    /// Position, eye frame.
    @location(0) position: vec3<f32>,
    /// Normal towards lower values, eye frame.
    @location(1) normal: vec3<f32>,
    /// Barycentric coordinates in the triangle.
    @location(2) barycentric: vec3<f32>,
    /// Linear colour of the triangle.
    @location(3) @interpolate(flat) color: vec3<f32>,
    /// Share of the map; below 0 where there is none.
    @location(4) share: f32,
}

@vertex
fn surface_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = index % 3u;
    let measures = triangles[index / 3u].measures;
    let vertex = triangles[index / 3u].vertices[corner];

    // The last knot not above the isovalue, by bisection of [low, end).
    let end = first_knot[vertex + 1u];
    var low = first_knot[vertex];
    var high = end;
    while (high - low > 1u) {
        let middle = low + (high - low) / 2u;
        if (knots[middle].rank <= frame.rank) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let before = knots[low];
    let after = knots[min(low + 1u, end - 1u)];
    let start = isovalues[before.rank];
    let length_of_step = difference(isovalues[after.rank], start);
    var t = 0.0;
    if (length_of_step > 0.0) {
        t = clamp(difference(frame.isovalue, start) / length_of_step, 0.0, 1.0);
    }
    let position = mix(
        vec3(before.x, before.y, before.z),
        vec3(after.x, after.y, after.z),
        t,
    );
    let normal = decode(triangles[index / 3u].normals[corner]);

    var out: Corner;
    out.clip = frame.clip_from_voxel * vec4(position, 1.0);
    out.position = (frame.eye_from_voxel * vec4(position, 1.0)).xyz;
    out.normal = normalize((frame.eye_from_normal * vec4(normal, 0.0)).xyz);
    out.barycentric = vec3(f32(corner == 0u), f32(corner == 1u), f32(corner == 2u));
    out.color = frame.front.rgb;
    out.share = 0.0;
    if (frame.palette == NAMES) {
        out.color = name_color(measures);
    } else if (frame.palette == MAP) {
        let code = (measures >> (10u * corner)) & 1023u;
        out.share = select((f32(code) - 1.0) / 1022.0, -1.0, code == 0u);
    }
    return out;
}

/// a - b of numbers that are sums of two.
fn difference(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return (a.x - b.x) + (a.y - b.y);
}

/// The unit vector of an octahedral code; twin: src/spectrum/normal.rs.
fn decode(code: u32) -> vec3<f32> {
    let e = unpack2x16snorm(code);
    var n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) {
        let sign = select(vec2(-1.0), vec2(1.0), e >= vec2(0.0));
        n = vec3((1.0 - abs(e.yx)) * sign, n.z);
    }
    return normalize(n);
}

/// The linear colour at a share of the map.
fn map_color(share: f32) -> vec3<f32> {
    let x = clamp(share, 0.0, 1.0) * 32.0;
    let before = min(u32(x), 31u);
    let color = mix(frame.map[before].rgb, frame.map[before + 1u].rgb, x - f32(before));
    // Half-way to a corner without a number.
    return select(color, NO_VALUE, share < -0.5);
}

/// Eight colours that are told apart with any colour vision, in turn; neighbours of one round and
/// the next differ in lightness.
fn name_color(name: u32) -> vec3<f32> {
    var hues = array(245.0, 60.0, 165.0, 350.0, 95.0, 220.0, 35.0, 310.0);
    var lightness = array(0.58, 0.74, 0.66, 0.64, 0.87, 0.80, 0.58, 0.48);
    let turn = name % 8u;
    let round = f32((name / 8u) % 3u);
    return from_oklch(lightness[turn] * (1.0 - 0.13 * round), 0.125, radians(hues[turn]));
}

/// The linear colour of a direction of the eye frame: its components in the voxel frame, whose axes
/// are the columns of the matrix, from -1 (dark) to 1 (light) as red, green and blue.
fn normal_color(eye_normal: vec3<f32>) -> vec3<f32> {
    let axes = mat3x3(
        normalize(frame.eye_from_voxel[0].xyz),
        normalize(frame.eye_from_voxel[1].xyz),
        normalize(frame.eye_from_voxel[2].xyz),
    );
    let components = 0.5 + 0.5 * (normalize(eye_normal) * axes);
    return components * components;
}

/// Linear sRGB of a colour in OKLCh (Ottosson 2020, "A perceptual color space for image
/// processing"); hue in radians. Colours outside sRGB are cut off.
fn from_oklch(lightness: f32, chroma: f32, hue: f32) -> vec3<f32> {
    let a = chroma * cos(hue);
    let b = chroma * sin(hue);
    let l = lightness + 0.3963377774 * a + 0.2158037573 * b;
    let m = lightness - 0.1055613458 * a - 0.0638541728 * b;
    let s = lightness - 0.0894841775 * a - 1.2914855480 * b;
    let cubed = vec3(l * l * l, m * m * m, s * s * s);
    return saturate(vec3(
        dot(cubed, vec3(4.0767416621, -3.3077115913, 0.2309699292)),
        dot(cubed, vec3(-1.2684380046, 2.6097574011, -0.3413193965)),
        dot(cubed, vec3(-0.0041960863, -0.7034186147, 1.7076147010)),
    ));
}

@fragment
fn surface_fragment(
    in: Corner,
    @builtin(front_facing) counter_clockwise: bool,
) -> @location(0) vec4<f32> {
    return vec4(shade(in, counter_clockwise), 1.0);
}

/// The linear colour of a fragment.
fn shade(in: Corner, counter_clockwise: bool) -> vec3<f32> {
    // Derivatives come first: they need the neighbouring fragments to run the same way.
    let altitudes = altitudes_in_pixels(in.barycentric);
    let front = counter_clockwise != (frame.mirrored == 1u);

    var color = in.color;
    if (frame.palette == MAP) {
        color = map_color(in.share);
    } else if (frame.palette == NORMALS) {
        color = normal_color(in.normal);
    }
    var albedo = color;
    if (!front) {
        albedo = select(mix(0.5 * color, frame.back.rgb, 0.25), frame.back.rgb, frame.palette == PLAIN);
    }
    let towards_eye = select(normalize(-in.position), vec3(0.0, 0.0, 1.0), frame.parallel == 1u);
    var normal = normalize(select(-in.normal, in.normal, front));
    var lit = light(albedo, normal, towards_eye);
    if (frame.wire_width > 0.0) {
        lit = mix(lit, frame.wire.rgb, frame.wire.a * wire_coverage(in.barycentric, altitudes));
    }
    return lit;
}

/// Two soft lights fixed to the camera, of which the reader places one and the other one fills in from the other side, light
/// from all around that is brighter from above, a small highlight, and a slight rim.
fn light(albedo: vec3<f32>, normal: vec3<f32>, towards_eye: vec3<f32>) -> vec3<f32> {
    var lamps = LAMPS;
    let lamp = lamps[frame.lamp];
    let key = normalize(lamp);
    let fill = normalize(vec3(select(0.85, -0.85, lamp.x > 0.0), 0.05, 0.45));
    let above = 0.5 + 0.5 * normal.y;
    let ambient = mix(vec3(0.17, 0.16, 0.155), vec3(0.36, 0.38, 0.42), above);
    // Wrapped a little around the edge of the shadow: a large light, not a point.
    let wrap = 0.2;
    let from_key = saturate((dot(normal, key) + wrap) / (1.0 + wrap));
    let from_fill = saturate(dot(normal, fill));
    let diffuse = ambient
        + 0.88 * from_key * from_key * vec3(1.0, 0.985, 0.955)
        + 0.20 * from_fill * vec3(0.86, 0.93, 1.0);

    let middle = normalize(key + towards_eye);
    let highlight = 0.14 * pow(saturate(dot(normal, middle)), 48.0);
    let grazing = 1.0 - saturate(dot(normal, towards_eye));
    let rim = 0.10 * pow(grazing, 4.0) * (0.4 + 0.6 * above);
    return saturate(albedo * diffuse + highlight + rim);
}

/// The triangle's three altitudes, pixels: one over the length of each coordinate's gradient.
fn altitudes_in_pixels(barycentric: vec3<f32>) -> vec3<f32> {
    let dx = dpdx(barycentric);
    let dy = dpdy(barycentric);
    return inverseSqrt(max(dx * dx + dy * dy, vec3(1e-12)));
}

/// How much of a fragment the triangle's edges cover. Each side of an edge draws half its width.
/// Where triangles are only a few lines wide the lines fade, so that a fine mesh turns grey
/// instead of black.
fn wire_coverage(barycentric: vec3<f32>, altitudes: vec3<f32>) -> f32 {
    let distances = barycentric * altitudes;
    let nearest = min(distances.x, min(distances.y, distances.z));
    let half_width = 0.5 * frame.wire_width;
    let coverage = saturate(half_width + 0.5 - nearest);
    let smallest = min(altitudes.x, min(altitudes.y, altitudes.z));
    return coverage * smoothstep(0.5, 6.0, smallest / max(frame.wire_width, 1.0));
}
