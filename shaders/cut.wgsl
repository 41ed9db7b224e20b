// A surface that a plane cuts off, or that one looks through, and the cap over what the plane cuts open. Joined after
// surface.wgsl. Host side: src/render/painter.rs, page/webgpu.js.

/// What only some pictures need.
struct Cut {
    /// Plane in the eye frame: what has dot(plane.xyz, position) + plane.w < 0 is left out.
    plane: vec4<f32>,
    /// How much of what lies behind the surface hides.
    opacity: f32,
    /// Fills the structure.
    unused: f32,
    /// Depth is (depth.x * z + depth.y) / -z, z of the eye frame; without the division where sight is parallel.
    depth: vec2<f32>,
    /// Half width and half height of the picture at a distance of 1; at any where sight is parallel.
    reach: vec2<f32>,
    /// Fills the structure.
    unused_too: vec2<f32>,
}

@group(0) @binding(5) var<uniform> cut: Cut;

@fragment
fn cut_fragment(
    in: Corner,
    @builtin(front_facing) counter_clockwise: bool,
) -> @location(0) vec4<f32> {
    // Derivatives come before any fragment is left out.
    let color = shade(in, counter_clockwise);
    if (dot(cut.plane, vec4(in.position, 1.0)) < 0.0) {
        discard;
    }
    return vec4(cut.opacity * color, cut.opacity);
}

/// What is left of the surface, without a colour: for depth and for counting.
@fragment
fn bare_fragment(in: Corner) {
    if (dot(cut.plane, vec4(in.position, 1.0)) < 0.0) {
        discard;
    }
}

struct Cap {
    @builtin(position) clip: vec4<f32>,
    /// Right and up in the picture, -1 to 1.
    @location(0) place: vec2<f32>,
}

/// One triangle over all of the picture.
@vertex
fn cap_vertex(@builtin(vertex_index) index: u32) -> Cap {
    let place = vec2(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
    return Cap(vec4(place, 0.0, 1.0), place);
}

struct CapFragment {
    @location(0) color: vec4<f32>,
    @builtin(frag_depth) depth: f32,
}

/// Where the plane is inside of the surface, which the stencil tells: as many sides turned away from the eye lie behind it
/// as sides turned to it, and one more.
@fragment
fn cap_fragment(in: Cap) -> CapFragment {
    let aside = in.place * cut.reach;
    let is_parallel = frame.parallel == 1u;
    let start = select(vec3(0.0), vec3(aside, 0.0), is_parallel);
    let way = vec3(select(aside, vec2(0.0), is_parallel), -1.0);
    let distance = -(dot(cut.plane.xyz, start) + cut.plane.w) / dot(cut.plane.xyz, way);
    let normal = -normalize(cut.plane.xyz);
    // Paler than the surface, so that a section is told from it.
    let color = light(mix(frame.front.rgb, vec3(0.75), 0.35), normal, normalize(-way));
    return CapFragment(
        vec4(cut.opacity * color, cut.opacity),
        saturate((cut.depth.y - cut.depth.x * distance) / select(distance, 1.0, is_parallel)),
    );
}
