//! The structures of the shaders `surface.wgsl`, `cut.wgsl`, `occlusion.wgsl` and `edges.wgsl`.
//!
//! # Invariants
//!
//! A test parses the shaders and compares every offset and size with those here.

use bytemuck::{Pod, Zeroable};

use crate::color::N_STOPS;

/// Uniforms of a surface; fields as in the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct SurfaceUniforms {
    pub(super) clip_from_voxel: [[f32; 4]; 4],
    pub(super) eye_from_voxel: [[f32; 4]; 4],
    pub(super) eye_from_normal: [[f32; 4]; 4],
    pub(super) front: [f32; 4],
    pub(super) back: [f32; 4],
    pub(super) wire: [f32; 4],
    pub(super) isovalue: [f32; 2],
    pub(super) rank: u32,
    pub(super) palette: u32,
    pub(super) wire_width: f32,
    pub(super) mirrored: u32,
    pub(super) parallel: u32,
    pub(super) lamp: u32,
    pub(super) map: [[f32; 4]; N_STOPS],
}

/// One knot of a trajectory; fields as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Knot {
    pub(super) rank: u32,
    pub(super) x: f32,
    pub(super) y: f32,
    pub(super) z: f32,
}

impl From<&crate::spectrum::Knot> for Knot {
    fn from(knot: &crate::spectrum::Knot) -> Self {
        let [x, y, z] = knot.position;
        Knot { rank: knot.rank, x, y, z }
    }
}

/// One active triangle; fields as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ActiveTriangle {
    pub(super) vertices: [u32; 3],
    pub(super) values: u32,
    pub(super) normals: [u32; 3],
}

/// Encodes the fractions of a colour map at the three corners of a triangle, 10 bits each: more than a map has colours; 0 means
/// no value.
pub(super) fn encode_fractions(fractions: [Option<f32>; 3]) -> u32 {
    let code = |fraction: Option<f32>| fraction.map_or(0, |t| 1 + (1022.0 * t).round() as u32);
    let [a, b, c] = fractions.map(code);
    a | b << 10 | c << 20
}

/// Encodes a unit normal for the shader: octahedral, 16 bits per coordinate.
pub(super) fn encode_normal(normal: [f32; 3]) -> u32 {
    let [u, v] = crate::spectrum::normal::encode(normal).map(|s| u32::from(s as u16));
    u | v << 16
}

/// Decodes a unit normal; the twin of `decode_normal` in the shader.
pub(super) fn decode_normal(code: u32) -> [f32; 3] {
    crate::spectrum::normal::decode([code as u16 as i16, (code >> 16) as i16])
}

/// Uniforms of clipped and translucent surfaces; fields as in `shaders/cut.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cut {
    pub(super) plane: [f32; 4],
    pub(super) opacity: f32,
    pub(super) padding: f32,
    pub(super) depth: [f32; 2],
    pub(super) half_extent: [f32; 2],
    pub(super) end_padding: [f32; 2],
}

/// Uniforms of the ambient occlusion; fields as in `shaders/occlusion.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct OcclusionUniforms {
    pub(super) depth: [f32; 2],
    pub(super) half_extent: [f32; 2],
    pub(super) size: [f32; 2],
    pub(super) radius: f32,
    pub(super) parallel: u32,
}

/// Uniforms of the edges of the volume's box; fields as in `shaders/edges.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct EdgeUniforms {
    pub(super) clip_from_voxel: [[f32; 4]; 4],
    pub(super) low: [f32; 4],
    pub(super) high: [f32; 4],
    pub(super) color: [f32; 4],
    pub(super) half_size: [f32; 2],
    pub(super) half_width: f32,
    pub(super) padding: f32,
}

/// How the shader colours a surface; the values are those of the shader's constants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Palette {
    /// One colour per side.
    Plain = 0,
    /// A colour map.
    Map = 1,
    /// Categorical colours of component indices.
    Components = 2,
    /// The direction of the normal.
    Normals = 3,
}

/// Splits a number into a sum of two of single precision: 48 bits.
pub(super) fn split_f64(x: f64) -> [f32; 2] {
    let high = x as f32;
    [high, (x - f64::from(high)) as f32]
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;
    use crate::render::occlusion::shader_text;

    const SHADER: &str = include_str!("../../shaders/surface.wgsl");
    const CUT: &str =
        concat!(include_str!("../../shaders/surface.wgsl"), include_str!("../../shaders/cut.wgsl"));

    const EDGES: &str = include_str!("../../shaders/edges.wgsl");

    fn parse(text: &str) -> naga::Module {
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)))
    }

    /// Name and offset of each field of a structure of the shader, and the size of the structure.
    fn fields(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
        let (_, found) = module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("no structure {name}"));
        let naga::TypeInner::Struct { members, span } = &found.inner else {
            panic!("{name} is no structure")
        };
        let field = |m: &naga::StructMember| (m.name.clone().expect("a name"), m.offset as usize);
        (members.iter().map(field).collect(), *span as usize)
    }

    #[test]
    fn the_shaders_are_valid() {
        let occlusion = naga::valid::Capabilities::MULTISAMPLED_SHADING;
        let none = naga::valid::Capabilities::empty();
        for (text, capabilities) in [
            (SHADER, none),
            (CUT, none),
            (EDGES, none),
            (shader_text(1).as_str(), occlusion),
            (shader_text(4).as_str(), occlusion),
        ] {
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
                .validate(&parse(text))
                .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
        }
    }

    #[test]
    fn structures_have_the_same_layout_on_both_sides() {
        macro_rules! layout {
            ($type:ident: $($field:ident)*) => {
                (vec![$((stringify!($field).to_string(), offset_of!($type, $field))),*], size_of::<$type>())
            };
        }
        let module = parse(CUT);
        assert_eq!(
            fields(&module, "SurfaceUniforms"),
            layout!(SurfaceUniforms: clip_from_voxel eye_from_voxel eye_from_normal front back wire isovalue
                rank palette wire_width mirrored parallel lamp map)
        );
        assert_eq!(fields(&module, "Knot"), layout!(Knot: rank x y z));
        assert_eq!(
            fields(&module, "ActiveTriangle"),
            layout!(ActiveTriangle: vertices values normals)
        );
        assert_eq!(
            fields(&module, "Cut"),
            layout!(Cut: plane opacity padding depth half_extent end_padding)
        );
        assert_eq!(
            fields(&parse(EDGES), "EdgeUniforms"),
            layout!(EdgeUniforms: clip_from_voxel low high color half_size half_width padding)
        );
        for n_samples in [1, 4] {
            let text = shader_text(n_samples);
            assert_eq!(text.contains("_multisampled_2d;"), n_samples > 1);
            assert_eq!(
                fields(&parse(&text), "OcclusionUniforms"),
                layout!(OcclusionUniforms: depth half_extent size radius parallel)
            );
        }
    }

    #[test]
    fn palettes_have_the_same_numbers_on_both_sides() {
        for (name, palette) in [
            ("PLAIN", Palette::Plain),
            ("MAP", Palette::Map),
            ("COMPONENTS", Palette::Components),
            ("NORMALS", Palette::Normals),
        ] {
            let line = format!("const {name}: u32 = {}u;", palette as u32);
            assert!(SHADER.contains(&line), "the shader lacks '{line}'");
        }
    }

    #[test]
    fn fractions_are_encoded_as_1_to_1023_and_0_means_no_value() {
        assert_eq!(encode_fractions([Some(0.0), Some(1.0), None]), 1 | 1023 << 10);
        assert_eq!(encode_fractions([None, None, Some(0.5)]), 512 << 20);
    }

    #[test]
    fn split_numbers_keep_48_bits() {
        for x in [0.0, 1.0, 1.0 / 3.0, 1.0 - f64::EPSILON, 1e-20, 0.123_456_789_012_345] {
            let [high, low] = split_f64(x);
            let back = f64::from(high) + f64::from(low);
            assert!((back - x).abs() <= x * 2f64.powi(-48), "{x} became {back}");
        }
    }
}
