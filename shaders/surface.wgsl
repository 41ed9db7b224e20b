// Draws the isosurface of one isovalue: interpolates trajectories per vertex, lights per fragment.
// One vertex invocation per corner of an active triangle. Host side: src/render/shader_types.rs, src/render/painter.rs.

/// Uniforms of a surface. Eye frame: origin at the eye, z to the viewer.
struct SurfaceUniforms {
    /// From the voxel frame to clip coordinates.
    clip_from_voxel: mat4x4<f32>,
    /// From the voxel frame to the eye frame.
    eye_from_voxel: mat4x4<f32>,
    /// Transforms normals to the eye frame, up to their length; the fourth row and column are not used.
    eye_from_normal: mat4x4<f32>,
    /// Linear colour of the outer side of a plain surface. The last component is the width of the silhouette, pixels; 0 draws none.
    front: vec4<f32>,
    /// Linear colour of the inner side of a plain surface; tints that side of other surfaces. The last component is 1 where no
    /// inner side can be seen, because the surface is closed and not clipped: a triangle seen from there is a fold.
    back: vec4<f32>,
    /// Linear colour and opacity of the wireframe.
    wire: vec4<f32>,
    /// The isovalue as the sum of two numbers, on the scale of `isovalues`.
    isovalue: vec2<f32>,
    /// Rank of the last isovalue in `isovalues` that is not above `isovalue`.
    rank: u32,
    /// One of the constants below.
    palette: u32,
    /// Width of the wireframe, pixels; 0 draws none.
    wire_width: f32,
    /// 1 if the grid axes are left-handed in the world, which reverses the winding of triangles.
    mirrored: u32,
    /// 1 for parallel projection, along the z axis of the eye frame.
    parallel: u32,
    /// Index of the main light in `LAMPS`.
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
    /// The values that its colour shows: for the palette MAP the fraction of the map at each corner, 10 bits each, 1 to 1023
    /// for 0 to 1, 0 for no value; for the palette COMPONENTS the index of the component.
    values: u32,
    /// Unit normals of the mesh at its corners, towards the outer side: octahedral, two signed normalized 16-bit numbers each.
    /// Trajectories have no normals.
    normals: array<u32, 3>,
}

@group(0) @binding(0) var<uniform> frame: SurfaceUniforms;
/// The isovalue of each rank, scaled to [0, 1] over the range, as the sum of two numbers: together 48 bits, to distinguish
/// close knots.
@group(0) @binding(1) var<storage, read> isovalues: array<vec2<f32>>;
/// Start of each vertex's knots, and the end.
@group(0) @binding(2) var<storage, read> first_knot: array<u32>;
/// Knots by vertex, rank increasing.
@group(0) @binding(3) var<storage, read> knots: array<Knot>;
/// The active triangles.
@group(0) @binding(4) var<storage, read> triangles: array<ActiveTriangle>;

// Palettes: `Palette` in src/render/shader_types.rs.
const PLAIN: u32 = 0u;
const MAP: u32 = 1u;
const COMPONENTS: u32 = 2u;
const NORMALS: u32 = 3u;

/// Positions of the main light, eye frame, in the order of `Light` in src/render/light.rs.
const LAMPS = array(
    vec3(-0.45, 0.65, 0.70),
    vec3(0.0, 0.0, 1.0),
    vec3(-1.0, 0.1, 0.3),
    vec3(1.0, 0.1, 0.3),
    vec3(0.0, 1.0, 0.3),
    vec3(0.0, -1.0, 0.3),
);

/// Linear colour of missing values; that of src/color/srgb.rs.
const NO_VALUE = vec3(0.30, 0.30, 0.30);

struct Corner {
    @invariant @builtin(position) clip: vec4<f32>,
    /// Position, eye frame.
    @location(0) position: vec3<f32>,
    /// Normal towards the outer side, eye frame.
    @location(1) normal: vec3<f32>,
    /// Barycentric coordinates in the triangle.
    @location(2) barycentric: vec3<f32>,
    /// Linear colour of the triangle.
    @location(3) @interpolate(flat) color: vec3<f32>,
    /// Fraction of the map; below 0 for no value.
    @location(4) fraction: f32,
}

@vertex
fn surface_vertex(@builtin(vertex_index) index: u32) -> Corner {
    let corner = index % 3u;
    let values = triangles[index / 3u].values;
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
    let interval = difference(isovalues[after.rank], start);
    var t = 0.0;
    if (interval > 0.0) {
        t = clamp(difference(frame.isovalue, start) / interval, 0.0, 1.0);
    }
    let position = mix(
        vec3(before.x, before.y, before.z),
        vec3(after.x, after.y, after.z),
        t,
    );
    let normal = decode_normal(triangles[index / 3u].normals[corner]);

    var out: Corner;
    out.clip = frame.clip_from_voxel * vec4(position, 1.0);
    out.position = (frame.eye_from_voxel * vec4(position, 1.0)).xyz;
    out.normal = normalize((frame.eye_from_normal * vec4(normal, 0.0)).xyz);
    out.barycentric = vec3(f32(corner == 0u), f32(corner == 1u), f32(corner == 2u));
    out.color = frame.front.rgb;
    out.fraction = 0.0;
    if (frame.palette == COMPONENTS) {
        out.color = component_color(values);
    } else if (frame.palette == MAP) {
        let code = (values >> (10u * corner)) & 1023u;
        out.fraction = select((f32(code) - 1.0) / 1022.0, -1.0, code == 0u);
    }
    return out;
}

/// a - b, each the sum of two numbers.
fn difference(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return (a.x - b.x) + (a.y - b.y);
}

/// The unit vector of an octahedral code; twin: src/spectrum/normal.rs.
fn decode_normal(code: u32) -> vec3<f32> {
    let e = unpack2x16snorm(code);
    var n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) {
        let sign = select(vec2(-1.0), vec2(1.0), e >= vec2(0.0));
        n = vec3((1.0 - abs(e.yx)) * sign, n.z);
    }
    return normalize(n);
}

/// The linear colour at a fraction of the map.
fn map_color(fraction: f32) -> vec3<f32> {
    let x = clamp(fraction, 0.0, 1.0) * 32.0;
    let before = min(u32(x), 31u);
    let color = mix(frame.map[before].rgb, frame.map[before + 1u].rgb, x - f32(before));
    // Beyond half-way to a corner without a value.
    return select(color, NO_VALUE, fraction < -0.5);
}

/// Eight colours that are distinguishable with any colour vision, repeated in darker rounds.
fn component_color(component: u32) -> vec3<f32> {
    var hues = array(245.0, 60.0, 165.0, 350.0, 95.0, 220.0, 35.0, 310.0);
    var lightness = array(0.58, 0.74, 0.66, 0.64, 0.87, 0.80, 0.58, 0.48);
    let turn = component % 8u;
    let round = f32((component / 8u) % 3u);
    return from_oklch(lightness[turn] * (1.0 - 0.13 * round), 0.125, radians(hues[turn]));
}

/// The linear colour of a direction of the eye frame: its components in the voxel frame, whose axes are the columns of the
/// matrix, from -1 (dark) to 1 (light) as red, green and blue.
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
/// processing"); hue in radians. Colours outside of sRGB are clamped.
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
    let towards_eye = select(normalize(-in.position), vec3(0.0, 0.0, 1.0), frame.parallel == 1u);
    let of_triangle = cross(dpdx(in.position), dpdy(in.position));
    let outline = silhouette_coverage(
        select(-1.0, 1.0, front) * dot(normalize(in.normal), towards_eye),
        abs(dot(of_triangle, towards_eye)) / max(length(of_triangle), 1e-20),
    );

    var color = in.color;
    if (frame.palette == MAP) {
        color = map_color(in.fraction);
    } else if (frame.palette == NORMALS) {
        color = normal_color(in.normal);
    }
    var albedo = color;
    if (!front && frame.back.w < 0.5) {
        albedo = select(mix(0.5 * color, frame.back.rgb, 0.25), frame.back.rgb, frame.palette == PLAIN);
    }
    // No inner side of a closed surface can be seen: its triangles that face away are folds, lit as the surface around them.
    var normal = normalize(select(-in.normal, in.normal, front || frame.back.w > 0.5));
    // Normals of folds and slivers may point away from the eye; mirrored, they are continuous with those around them.
    normal -= 2.0 * min(dot(normal, towards_eye), 0.0) * towards_eye;
    var lit = light(albedo, normal, towards_eye);
    if (frame.wire_width > 0.0) {
        lit = mix(lit, frame.wire.rgb, frame.wire.a * wire_coverage(in.barycentric, altitudes));
    }
    if (frame.front.w > 0.0) {
        lit = mix(lit, frame.wire.rgb, frame.wire.a * outline);
    }
    return lit;
}

/// Two soft lights fixed to the camera (the main light, and a fill light from the other side), ambient light that is brighter
/// from above, a small highlight, and a slight rim light.
fn light(albedo: vec3<f32>, normal: vec3<f32>, towards_eye: vec3<f32>) -> vec3<f32> {
    var lamps = LAMPS;
    let lamp = lamps[frame.lamp];
    let key = normalize(lamp);
    let fill = normalize(vec3(select(0.85, -0.85, lamp.x > 0.0), 0.05, 0.45));
    let above = 0.5 + 0.5 * normal.y;
    let ambient = mix(vec3(0.15, 0.14, 0.15), vec3(0.32, 0.35, 0.41), above);
    // Wrap lighting softens the edge of the shadow, as a large light does.
    let wrap = 0.2;
    let from_key = saturate((dot(normal, key) + wrap) / (1.0 + wrap));
    let from_fill = saturate(dot(normal, fill));
    let diffuse = ambient
        + 0.95 * from_key * from_key * vec3(1.0, 0.965, 0.89)
        + 0.30 * from_fill * vec3(0.66, 0.82, 1.0);

    let middle = normalize(key + towards_eye);
    let highlight = 0.14 * pow(saturate(dot(normal, middle)), 48.0);
    let grazing = 1.0 - saturate(dot(normal, towards_eye));
    let rim = 0.10 * pow(grazing, 4.0) * (0.4 + 0.6 * above);
    return saturate(albedo * diffuse + highlight + rim);
}

/// The triangle's three altitudes, pixels: the inverse length of each barycentric coordinate's gradient.
fn altitudes_in_pixels(barycentric: vec3<f32>) -> vec3<f32> {
    let dx = dpdx(barycentric);
    let dy = dpdy(barycentric);
    return inverseSqrt(max(dx * dx + dy * dy, vec3(1e-12)));
}

/// Coverage of a fragment by the silhouette, from the cosine between normal and view. Near the silhouette of a smooth surface the cosine
/// is as the square root of the distance to it in the picture, which therefore is half the cosine over its slope. Where the cosine
/// is large, or that of the triangle's own normal, the surface is noise or has an edge, and is not turned away.
fn silhouette_coverage(turned: f32, flat_turned: f32) -> f32 {
    let slope = length(vec2(dpdx(turned), dpdy(turned)));
    let inside = 0.5 * max(turned, 0.0) / max(slope, 1e-6);
    return saturate(frame.front.w + 0.5 - inside) * (1.0 - smoothstep(0.35, 0.6, max(turned, flat_turned)));
}

/// Coverage of a fragment by the triangle's edges. Each side of an edge draws half its width. The lines fade if triangles are
/// only a few lines wide, so that a fine mesh turns grey instead of black.
fn wire_coverage(barycentric: vec3<f32>, altitudes: vec3<f32>) -> f32 {
    let distances = barycentric * altitudes;
    let nearest = min(distances.x, min(distances.y, distances.z));
    let half_width = 0.5 * frame.wire_width;
    let coverage = saturate(half_width + 0.5 - nearest);
    let smallest = min(altitudes.x, min(altitudes.y, altitudes.z));
    return coverage * smoothstep(0.5, 6.0, smallest / max(frame.wire_width, 1.0));
}
