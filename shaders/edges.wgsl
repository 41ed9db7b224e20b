// Draws the edges of a box as lines with a width in pixels, with the depth test on. Host side: src/render/edges.rs.

/// Constants of a draw call.
struct Edges {
    /// From the voxel frame to clip coordinates.
    clip_from_voxel: mat4x4<f32>,
    /// Least and largest corner of the box, voxel frame.
    low: vec4<f32>,
    high: vec4<f32>,
    /// Linear colour of the lines, multiplied by their alpha.
    color: vec4<f32>,
    /// Half the width and the height of the picture, pixels.
    half_size: vec2<f32>,
    /// Half the width of a line, pixels.
    half_width: f32,
    /// Padding.
    unused: f32,
}

@group(0) @binding(0) var<uniform> edges: Edges;

/// Near clip distance, as a share of the larger distance of the edge's ends.
const MIN_DEPTH_SHARE: f32 = 1e-4;

/// Two triangles for each of the twelve edges.
@vertex
fn edge_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let edge = index / 6u;
    let axis = edge / 4u;
    // The side of the box along the two other axes.
    var side = vec3(0.0);
    side[(axis + 1u) % 3u] = f32(edge & 1u);
    side[(axis + 2u) % 3u] = f32((edge >> 1u) & 1u);
    var start = corner(side);
    side[axis] = 1.0;
    var end = corner(side);

    // Clips the part behind the eye.
    let nearest = MIN_DEPTH_SHARE * max(abs(start.w), abs(end.w));
    if (max(start.w, end.w) <= nearest) {
        return vec4(0.0);
    }
    let all = end - start;
    if (start.w < nearest) {
        start = start + all * ((nearest - start.w) / all.w);
    } else if (end.w < nearest) {
        end = end - all * ((nearest - end.w) / -all.w);
    }

    // Corners of the rectangle: start, start, end; start, end, end, alternating between its two sides.
    let number = index % 6u;
    let is_end = number == 2u || number >= 4u;
    let turn = select(-1.0, 1.0, (number & 1u) == 1u);
    let along = (end.xy / end.w - start.xy / start.w) * edges.half_size;
    let across = vec2(-along.y, along.x) * inverseSqrt(max(dot(along, along), 1e-12));
    let position = select(start, end, is_end);
    let moved = turn * edges.half_width * across / edges.half_size;
    return vec4(position.xy + moved * position.w, position.zw);
}

/// A corner of the box, clip coordinates.
fn corner(side: vec3<f32>) -> vec4<f32> {
    return edges.clip_from_voxel * vec4(mix(edges.low.xyz, edges.high.xyz, side), 1.0);
}

@fragment
fn edge_fragment() -> @location(0) vec4<f32> {
    return edges.color;
}
