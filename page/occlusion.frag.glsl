#version 300 es
// The twin of the fragment stages of shaders/occlusion.wgsl: same names, same order. Each pixel has one depth here, and rows go
// upwards.
precision highp float;
precision highp int;
precision highp sampler2D;

/// Depth is (depth.x * z + depth.y) / -z, z of the eye frame; without the division in parallel projection.
uniform vec2 depth;
/// Half the width and half the height of the picture at a distance of 1; at any distance in parallel projection.
uniform vec2 half_extent;
/// Width and height of the picture, pixels.
uniform vec2 size;
/// The radius of occlusion, voxels.
uniform float radius;
uniform bool parallel;
uniform sampler2D depths;
uniform sampler2D visibility;

out vec4 color;

const int N_NEIGHBOURS = 40;
const float N_TURNS = 11.0;
const float MIN_PIXELS = 2.0;
const float BIAS = 0.015;
const float STRENGTH = 14.0;
const float DARKEST = 0.1;
const int SMOOTHING_RADIUS = 3;
const float MAX_DEPTH_DIFFERENCE = 0.35;
const float PI = 3.14159265;

float z_of(float at) {
    return parallel ? (at - depth.y) / depth.x : -depth.y / (at + depth.x);
}

ivec2 clamp_to_picture(ivec2 pixel) {
    return clamp(pixel, ivec2(0), ivec2(size) - 1);
}

float depth_at(ivec2 pixel) {
    return texelFetch(depths, clamp_to_picture(pixel), 0).r;
}

#ifdef VISIBILITY
vec3 point_at(ivec2 pixel) {
    float z = z_of(depth_at(pixel));
    vec2 screen = 2.0 * (vec2(clamp_to_picture(pixel)) + 0.5) / size - 1.0;
    return vec3(screen * half_extent * (parallel ? 1.0 : -z), z);
}

vec3 tangent(vec3 before, vec3 here, vec3 after) {
    vec3 forward = after - here;
    vec3 backward = here - before;
    return abs(forward.z) < abs(backward.z) ? forward : backward;
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 here = point_at(pixel);
    vec3 right = tangent(point_at(pixel - ivec2(1, 0)), here, point_at(pixel + ivec2(1, 0)));
    vec3 up = tangent(point_at(pixel - ivec2(0, 1)), here, point_at(pixel + ivec2(0, 1)));
    vec3 normal = normalize(cross(right, up));
    float per_voxel = 0.5 * size.y / (half_extent.y * (parallel ? 1.0 : -here.z));
    float pixels = radius * per_voxel;
    if (depth_at(pixel) >= 1.0 || pixels < MIN_PIXELS) {
        color = vec4(1.0);
        return;
    }
    // The same noise as on WebGPU, whose rows go downwards.
    vec2 screen = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
    float rotation = 2.0 * PI * fract(52.9829189 * fract(dot(screen, vec2(0.06711056, 0.00583715))));
    float squared_radius = radius * radius;
    float hidden = 0.0;
    for (int i = 0; i < N_NEIGHBOURS; i++) {
        float fraction = (float(i) + 0.5) / float(N_NEIGHBOURS);
        float angle = 2.0 * PI * N_TURNS * fraction + rotation;
        vec2 offset = fraction * pixels * vec2(cos(angle), -sin(angle));
        vec3 v = point_at(pixel + ivec2(roundEven(offset))) - here;
        float squared_distance = dot(v, v);
        float fade = max(squared_radius - squared_distance, 0.0) / squared_radius;
        float height = max(dot(v, normal) - BIAS * radius, 0.0);
        hidden += fade * height / (sqrt(squared_distance) + 0.05 * radius);
    }
    color = vec4(mix(DARKEST, 1.0, exp(-STRENGTH * hidden / float(N_NEIGHBOURS))));
}
#else
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float own = depth_at(pixel);
    // A pixel with the depth of the background can have samples of the surface; only those are drawn over.
    float z = z_of(min(own, 0.9999999));
    float sum = 0.0;
    float weights = 0.0;
    for (int y = -SMOOTHING_RADIUS; y <= SMOOTHING_RADIUS; y++) {
        for (int x = -SMOOTHING_RADIUS; x <= SMOOTHING_RADIUS; x++) {
            ivec2 at = clamp_to_picture(pixel + ivec2(x, y));
            float off = abs(z_of(depth_at(at)) - z) / (MAX_DEPTH_DIFFERENCE * radius);
            float weight = clamp(1.0 - off, 0.0, 1.0) + 1e-4;
            sum += weight * texelFetch(visibility, at, 0).r;
            weights += weight;
        }
    }
    color = vec4(vec3(sum / weights), 1.0);
}
#endif
