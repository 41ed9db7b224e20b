#version 300 es
// The twin of the vertex stage of shaders/surface.wgsl: same names, same order. Tables are textures with rows of 2048 texels in place
// of storage buffers.
precision highp float;
precision highp int;
precision highp usampler2D;
precision highp sampler2D;

uniform mat4 clip_from_voxel;
uniform mat4 eye_from_voxel;
uniform mat4 eye_from_normal;
/// The isovalue as the sum of two numbers.
uniform vec2 isovalue;
uniform uint rank;
uniform sampler2D isovalues;
uniform usampler2D first_knot;
/// Rank of each knot, and its position as the bits of floats.
uniform usampler2D knots;

/// The vertex of the corner, and the code of its normal.
layout(location = 0) in uint vertex;
layout(location = 1) in uint normal_code;
/// The colour code of the triangle: shares of the map, or the number of the component.
layout(location = 2) in uint values;
/// 0 one colour, 1 a map, 2 a colour per component.
uniform int palette;

invariant gl_Position;
out vec3 position;
out vec3 normal;
out vec3 barycentric;
/// Linear colour of the component.
flat out vec3 triangle_color;
/// Share of the map; negative without a value.
out float fraction;

ivec2 texel(uint index) {
    return ivec2(int(index & 2047u), int(index >> 11));
}

uint first_knot_of(uint v) {
    return texelFetch(first_knot, texel(v), 0).r;
}

uint rank_of(uint knot) {
    return texelFetch(knots, texel(knot), 0).r;
}

vec2 isovalue_of(uint r) {
    return texelFetch(isovalues, texel(r), 0).rg;
}

/// a - b of numbers that are sums of two.
float difference(vec2 a, vec2 b) {
    return (a.x - b.x) + (a.y - b.y);
}

/// The unit vector of an octahedral code.
vec3 decode_normal(uint code) {
    ivec2 s = ivec2(int(code << 16) >> 16, int(code) >> 16);
    vec2 e = clamp(vec2(s) / 32767.0, -1.0, 1.0);
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0) {
        vec2 towards = vec2(e.x >= 0.0 ? 1.0 : -1.0, e.y >= 0.0 ? 1.0 : -1.0);
        n = vec3((1.0 - abs(e.yx)) * towards, n.z);
    }
    return normalize(n);
}

/// Linear sRGB of a colour in OKLCh; hue in radians.
vec3 from_oklch(float lightness, float chroma, float hue) {
    float a = chroma * cos(hue);
    float b = chroma * sin(hue);
    float l = lightness + 0.3963377774 * a + 0.2158037573 * b;
    float m = lightness - 0.1055613458 * a - 0.0638541728 * b;
    float s = lightness - 0.0894841775 * a - 1.2914855480 * b;
    vec3 cubed = vec3(l * l * l, m * m * m, s * s * s);
    return clamp(vec3(
        dot(cubed, vec3(4.0767416621, -3.3077115913, 0.2309699292)),
        dot(cubed, vec3(-1.2684380046, 2.6097574011, -0.3413193965)),
        dot(cubed, vec3(-0.0041960863, -0.7034186147, 1.7076147010))
    ), 0.0, 1.0);
}

vec3 component_color(uint number) {
    float hues[8] = float[8](245.0, 60.0, 165.0, 350.0, 95.0, 220.0, 35.0, 310.0);
    float lightness[8] = float[8](0.58, 0.74, 0.66, 0.64, 0.87, 0.80, 0.58, 0.48);
    uint turn = number % 8u;
    float round_of_eight = float((number / 8u) % 3u);
    return from_oklch(lightness[turn] * (1.0 - 0.13 * round_of_eight), 0.125, radians(hues[turn]));
}

void main() {
    // The last knot not above the isovalue, by bisection of [low, end).
    uint end = first_knot_of(vertex + 1u);
    uint low = first_knot_of(vertex);
    uint high = end;
    while (high - low > 1u) {
        uint middle = low + (high - low) / 2u;
        if (rank_of(middle) <= rank) {
            low = middle;
        } else {
            high = middle;
        }
    }
    uint next = min(low + 1u, end - 1u);
    uvec4 before = texelFetch(knots, texel(low), 0);
    uvec4 after = texelFetch(knots, texel(next), 0);
    vec2 start = isovalue_of(before.r);
    float interval = difference(isovalue_of(after.r), start);
    float t = 0.0;
    if (interval > 0.0) {
        t = clamp(difference(isovalue, start) / interval, 0.0, 1.0);
    }
    vec3 voxel = mix(uintBitsToFloat(before.gba), uintBitsToFloat(after.gba), t);

    gl_Position = clip_from_voxel * vec4(voxel, 1.0);
    // Depth goes from -w to w in WebGL, from 0 to w in WebGPU.
    gl_Position.z = 2.0 * gl_Position.z - gl_Position.w;
    position = (eye_from_voxel * vec4(voxel, 1.0)).xyz;
    normal = normalize((eye_from_normal * vec4(decode_normal(normal_code), 0.0)).xyz);
    triangle_color = palette == 2 ? component_color(values) : vec3(0.0);
    int corner = gl_VertexID % 3;
    uint code = (values >> uint(10 * corner)) & 1023u;
    fraction = palette != 1 ? 0.0 : code == 0u ? -1.0 : (float(code) - 1.0) / 1022.0;
    barycentric = vec3(float(corner == 0), float(corner == 1), float(corner == 2));
}
