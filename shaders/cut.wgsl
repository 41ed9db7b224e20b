// Clipped and translucent surfaces, and the caps of clipped ones. Appended to surface.wgsl. Host side:
// src/render/shader_types.rs, src/render/passes.rs, page/webgpu.js.

/// Uniforms of clipped and translucent surfaces.
struct Cut {
    /// Plane in the eye frame: fragments with dot(plane.xyz, position) + plane.w < 0 are discarded.
    plane: vec4<f32>,
    opacity: f32,
    padding: f32,
    /// Depth is (depth.x * z + depth.y) / -z, z of the eye frame; without the division in parallel projection.
    depth: vec2<f32>,
    /// Half width and half height of the picture at a distance of 1; at any distance in parallel projection.
    half_extent: vec2<f32>,
    end_padding: vec2<f32>,
}

@group(0) @binding(5) var<uniform> cut: Cut;

@fragment
fn cut_fragment(
    in: Corner,
    @builtin(front_facing) counter_clockwise: bool,
) -> @location(0) vec4<f32> {
    // Derivatives must be computed before any fragment is discarded.
    let color = shade(in, counter_clockwise);
    if (dot(cut.plane, vec4(in.position, 1.0)) < 0.0) {
        discard;
    }
    return vec4(cut.opacity * color, cut.opacity);
}

/// The clipped surface without a colour: for the stencil, or for the depth only.
@fragment
fn depth_only_fragment(in: Corner) {
    if (dot(cut.plane, vec4(in.position, 1.0)) < 0.0) {
        discard;
    }
}

struct Cap {
    @builtin(position) clip: vec4<f32>,
    /// Right and up in the picture, -1 to 1.
    @location(0) screen: vec2<f32>,
}

/// One triangle that covers the picture.
@vertex
fn cap_vertex(@builtin(vertex_index) index: u32) -> Cap {
    let screen = vec2(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return Cap(vec4(screen, 0.0, 1.0), screen);
}

struct CapFragment {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

/// The plane where it is inside of the surface. The stencil test selects these fragments: one more back face than front faces
/// is behind the plane.
@fragment
fn cap_fragment(in: Cap) -> CapFragment {
    let offset = in.screen * cut.half_extent;
    let is_parallel = frame.parallel == 1u;
    let start = select(vec3(0.0), vec3(offset, 0.0), is_parallel);
    let direction = vec3(select(offset, vec2(0.0), is_parallel), -1.0);
    let distance = -(dot(cut.plane.xyz, start) + cut.plane.w) / dot(cut.plane.xyz, direction);
    let normal = -normalize(cut.plane.xyz);
    // Paler than the surface, to distinguish the section from it.
    let color = light(mix(frame.front.rgb, vec3(0.75), 0.35), normal, normalize(-direction));
    return CapFragment(
        vec4(cut.opacity * color, cut.opacity),
        saturate((cut.depth.y - cut.depth.x * distance) / select(distance, 1.0, is_parallel)),
    );
}
