// A surface that a plane cuts off, or that one looks through. Joined after surface.wgsl.
// Host side: src/render/painter.rs.

/// What only some pictures need.
struct Cut {
    /// Plane in the eye frame: what has dot(plane.xyz, position) + plane.w < 0 is left out.
    plane: vec4<f32>,
    /// How much of what lies behind the surface hides.
    opacity: f32,
    /// Fill the structure.
    unused: f32,
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
