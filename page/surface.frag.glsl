#version 300 es
// The twin of the fragment stage of shaders/surface.wgsl, for a surface of one colour, a colour map or a colour per component: same
// names, same order.
precision highp float;
precision highp int;

/// Linear colours of the two sides.
uniform vec3 front;
/// The last component of the inner side is 1 where it cannot be seen.
uniform vec4 back;
/// Linear colour and opacity of the wireframe.
uniform vec4 wire;
uniform float wire_width;
/// Width of the silhouette.
uniform float silhouette;
uniform bool mirrored;
/// Whether the projection is parallel.
uniform bool parallel;
uniform int palette;
/// Index of the main light.
uniform int lamp;
/// Linear colours of the map, evenly spaced.
uniform vec4 map[33];

/// For clipped or transparent surfaces: the twin of shaders/cut.wgsl.
uniform vec4 plane;
uniform float opacity;
#ifdef CAP
uniform vec2 depth;
uniform vec2 half_extent;
in vec2 screen;
#endif

#ifndef CAP
in vec3 position;
in vec3 normal;
in vec3 barycentric;
flat in vec3 triangle_color;
in float fraction;
#endif

out vec4 color;

float saturate(float x) {
    return clamp(x, 0.0, 1.0);
}

vec3 light(vec3 albedo, vec3 n, vec3 towards_eye) {
    vec3 lamps[6] = vec3[6](vec3(-0.45, 0.65, 0.70), vec3(0.0, 0.0, 1.0), vec3(-1.0, 0.1, 0.3), vec3(1.0, 0.1, 0.3),
        vec3(0.0, 1.0, 0.3), vec3(0.0, -1.0, 0.3));
    vec3 key = normalize(lamps[lamp]);
    vec3 fill = normalize(vec3(lamps[lamp].x > 0.0 ? -0.85 : 0.85, 0.05, 0.45));
    float above = 0.5 + 0.5 * n.y;
    vec3 ambient = mix(vec3(0.15, 0.14, 0.15), vec3(0.32, 0.35, 0.41), above);
    float wrap = 0.2;
    float from_key = saturate((dot(n, key) + wrap) / (1.0 + wrap));
    float from_fill = saturate(dot(n, fill));
    vec3 diffuse = ambient
        + 0.95 * from_key * from_key * vec3(1.0, 0.965, 0.89)
        + 0.30 * from_fill * vec3(0.66, 0.82, 1.0);
    vec3 middle = normalize(key + towards_eye);
    float highlight = 0.14 * pow(saturate(dot(n, middle)), 48.0);
    float grazing = 1.0 - saturate(dot(n, towards_eye));
    float rim = 0.10 * pow(grazing, 4.0) * (0.4 + 0.6 * above);
    return clamp(albedo * diffuse + highlight + rim, 0.0, 1.0);
}

#ifdef CAP
void main() {
    vec3 offset = vec3(screen * half_extent, 0.0);
    vec3 start = parallel ? offset : vec3(0.0);
    vec3 direction = vec3(parallel ? vec2(0.0) : offset.xy, -1.0);
    float away = -(dot(plane.xyz, start) + plane.w) / dot(plane.xyz, direction);
    vec3 lit = light(mix(front, vec3(0.75), 0.35), -normalize(plane.xyz), normalize(-direction));
    color = vec4(opacity * lit, opacity);
    gl_FragDepth = saturate((depth.y - depth.x * away) / (parallel ? 1.0 : away));
}
#else
vec3 altitudes_in_pixels() {
    vec3 dx = dFdx(barycentric);
    vec3 dy = dFdy(barycentric);
    return inversesqrt(max(dx * dx + dy * dy, vec3(1e-12)));
}

float wire_coverage(vec3 altitudes) {
    vec3 distances = barycentric * altitudes;
    float nearest = min(distances.x, min(distances.y, distances.z));
    float half_width = 0.5 * wire_width;
    float coverage = saturate(half_width + 0.5 - nearest);
    float smallest = min(altitudes.x, min(altitudes.y, altitudes.z));
    return coverage * smoothstep(0.5, 6.0, smallest / max(wire_width, 1.0));
}

float silhouette_coverage(float turned, float flat_turned) {
    float slope = length(vec2(dFdx(turned), dFdy(turned)));
    float inside = 0.5 * max(turned, 0.0) / max(slope, 1e-6);
    return saturate(silhouette + 0.5 - inside) * (1.0 - smoothstep(0.35, 0.6, max(turned, flat_turned)));
}

vec3 map_color() {
    float x = clamp(fraction, 0.0, 1.0) * 32.0;
    int before = min(int(x), 31);
    vec3 between = mix(map[before].rgb, map[before + 1].rgb, x - float(before));
    return fraction < -0.5 ? vec3(0.30) : between;
}

void main() {
    // Derivatives need uniform control flow, so they come first.
    vec3 altitudes = altitudes_in_pixels();
    // Counter-clockwise with y upwards, as on WebGPU.
    bool is_front = gl_FrontFacing != mirrored;
    vec3 towards_eye = parallel ? vec3(0.0, 0.0, 1.0) : normalize(-position);
    vec3 of_triangle = cross(dFdx(position), dFdy(position));
    float outline = silhouette_coverage(
        (is_front ? 1.0 : -1.0) * dot(normalize(normal), towards_eye),
        abs(dot(of_triangle, towards_eye)) / max(length(of_triangle), 1e-20)
    );
    vec3 shown = palette == 0 ? front : palette == 1 ? map_color() : triangle_color;
    vec3 albedo = shown;
    if (!is_front && back.a < 0.5) {
        albedo = palette == 0 ? back.rgb : mix(0.5 * shown, back.rgb, 0.25);
    }
    // No inner side of a closed surface can be seen: its triangles that face away are folds, lit as the surface around them.
    vec3 n = normalize(is_front || back.a > 0.5 ? normal : -normal);
    // Normals of folds and slivers may point away from the eye; mirrored, they are continuous with those around them.
    n -= 2.0 * min(dot(n, towards_eye), 0.0) * towards_eye;
    vec3 lit = light(albedo, n, towards_eye);
    if (wire_width > 0.0) {
        lit = mix(lit, wire.rgb, wire.a * wire_coverage(altitudes));
    }
    if (silhouette > 0.0) {
        lit = mix(lit, wire.rgb, wire.a * outline);
    }
#ifdef CUT
    if (dot(plane, vec4(position, 1.0)) < 0.0) {
        discard;
    }
    color = vec4(opacity * lit, opacity);
#else
    color = vec4(lit, 1.0);
#endif
}
#endif
