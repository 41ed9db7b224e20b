// Draws the edges of a box as lines with a width in pixels, hidden by surfaces in front. Host side: src/render/box_edges.rs.

/// Uniforms of a picture.
struct EdgeUniforms {
    /// From the voxel frame to clip coordinates.
    clip_from_voxel: mat4x4<f32>,
    /// Minimum and maximum corner of the box, voxel frame.
    low: vec4<f32>,
    high: vec4<f32>,
    /// Linear colour of the lines, premultiplied by alpha.
    color: vec4<f32>,
    /// Half the width and the height of the picture, pixels.
    half_size: vec2<f32>,
    /// Half the width of a line, pixels.
    half_width: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> uniforms: EdgeUniforms;

/// Minimum distance in front of the eye that is drawn, as a fraction of the farther end of the edge.
const MIN_DISTANCE: f32 = 1e-4;

/// Two triangles for each of the twelve edges.
@vertex
fn edge_vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let edge = index / 6u;
    let axis = edge / 4u;
    // The position of the edge along the two other axes, 0 or 1.
    var side = vec3(0.0);
    side[(axis + 1u) % 3u] = f32(edge & 1u);
    side[(axis + 2u) % 3u] = f32((edge >> 1u) & 1u);
    var start = corner(side);
    side[axis] = 1.0;
    var end = corner(side);

    // Clip the part behind the eye.
    let nearest = MIN_DISTANCE * max(abs(start.w), abs(end.w));
    if (max(start.w, end.w) <= nearest) {
        return vec4(0.0);
    }
    let edge_vector = end - start;
    if (start.w < nearest) {
        start = start + edge_vector * ((nearest - start.w) / edge_vector.w);
    } else if (end.w < nearest) {
        end = end - edge_vector * ((nearest - end.w) / -edge_vector.w);
    }

    // The corners of the two triangles: start, start, end; start, end, end, alternating between the sides of the line.
    let number = index % 6u;
    let is_end = number == 2u || number >= 4u;
    let sign = select(-1.0, 1.0, (number & 1u) == 1u);
    let direction = (end.xy / end.w - start.xy / start.w) * uniforms.half_size;
    let normal = vec2(-direction.y, direction.x) * inverseSqrt(max(dot(direction, direction), 1e-12));
    let position = select(start, end, is_end);
    let offset = sign * uniforms.half_width * normal / uniforms.half_size;
    return vec4(position.xy + offset * position.w, position.zw);
}

/// A corner of the box, clip coordinates.
fn corner(side: vec3<f32>) -> vec4<f32> {
    return uniforms.clip_from_voxel * vec4(mix(uniforms.low.xyz, uniforms.high.xyz, side), 1.0);
}

@fragment
fn edge_fragment() -> @location(0) vec4<f32> {
    return uniforms.color;
}
