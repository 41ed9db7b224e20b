//! The structures that `shaders/surface.wgsl` reads, as the host writes them.
//!
//! A test parses the shader and compares every offset and size, so neither side can drift.

use bytemuck::{Pod, Zeroable};

use crate::color::N_STOPS;

/// What is the same for every corner of a picture; fields as in the shader.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Frame {
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
    pub(super) measures: u32,
    pub(super) normals: [u32; 3],
}

/// Three shares of a colour map as the shader decodes them: 10 bits each, more than there are colours in a map; 0
/// stands for none.
pub(super) fn shares_code(shares: [Option<f32>; 3]) -> u32 {
    let code = |share: Option<f32>| share.map_or(0, |t| 1 + (1022.0 * t).round() as u32);
    let [a, b, c] = shares.map(code);
    a | b << 10 | c << 20
}

/// A unit normal as the shader decodes it.
pub(super) fn normal_code(normal: [f32; 3]) -> u32 {
    let [u, v] = crate::spectrum::normal::encode(normal).map(|s| u32::from(s as u16));
    u | v << 16
}

/// The unit normal of a code, as the shader finds it.
pub(super) fn normal_of_code(code: u32) -> [f32; 3] {
    crate::spectrum::normal::decode([code as u16 as i16, (code >> 16) as i16])
}

/// What only some pictures need; fields as in `shaders/cut.wgsl`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cut {
    pub(super) plane: [f32; 4],
    pub(super) opacity: f32,
    pub(super) unused: f32,
    pub(super) depth: [f32; 2],
    pub(super) reach: [f32; 2],
    pub(super) unused_too: [f32; 2],
}

/// How the shader turns an attribute into a colour; the constants of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Palette {
    /// The frame's own colours.
    Plain = 0,
    /// A colour map.
    Map = 1,
    /// Colours without an order for numbers from 0.
    Names = 2,
    /// The normal's own direction.
    Normals = 3,
}

/// A number as the sum of two of single precision: 48 bits.
pub(super) fn in_two(x: f64) -> [f32; 2] {
    let high = x as f32;
    [high, (x - f64::from(high)) as f32]
}

#[cfg(test)]
mod tests {
    use std::mem::{offset_of, size_of};

    use super::*;

    const SHADER: &str = include_str!("../../shaders/surface.wgsl");
    const CUT: &str =
        concat!(include_str!("../../shaders/surface.wgsl"), include_str!("../../shaders/cut.wgsl"));

    fn parse(text: &str) -> naga::Module {
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)))
    }

    /// Name and offset of each field of a structure of the shader, and the structure's size.
    fn fields(module: &naga::Module, name: &str) -> (Vec<(String, usize)>, usize) {
        let (_, found) = module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some(name))
            .unwrap_or_else(|| panic!("no structure {name}"));
        let naga::TypeInner::Struct { members, span } = &found.inner else {
            panic!("{name} is no structure")
        };
        let of = |m: &naga::StructMember| (m.name.clone().expect("a name"), m.offset as usize);
        (members.iter().map(of).collect(), *span as usize)
    }

    #[test]
    fn the_shaders_are_valid() {
        for text in [SHADER, CUT] {
            naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::empty(),
            )
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
            fields(&module, "Frame"),
            layout!(Frame: clip_from_voxel eye_from_voxel eye_from_normal front back wire isovalue
                rank palette wire_width mirrored parallel lamp map)
        );
        assert_eq!(fields(&module, "Knot"), layout!(Knot: rank x y z));
        assert_eq!(
            fields(&module, "ActiveTriangle"),
            layout!(ActiveTriangle: vertices measures normals)
        );
        assert_eq!(
            fields(&module, "Cut"),
            layout!(Cut: plane opacity unused depth reach unused_too)
        );
    }

    #[test]
    fn palettes_have_the_same_numbers_on_both_sides() {
        for (name, palette) in [
            ("PLAIN", Palette::Plain),
            ("MAP", Palette::Map),
            ("NAMES", Palette::Names),
            ("NORMALS", Palette::Normals),
        ] {
            let line = format!("const {name}: u32 = {}u;", palette as u32);
            assert!(SHADER.contains(&line), "the shader lacks '{line}'");
        }
    }

    #[test]
    fn shares_are_1_to_1023_and_0_is_none() {
        assert_eq!(shares_code([Some(0.0), Some(1.0), None]), 1 | 1023 << 10);
        assert_eq!(shares_code([None, None, Some(0.5)]), 512 << 20);
    }

    #[test]
    fn two_numbers_keep_48_bits() {
        for x in [0.0, 1.0, 1.0 / 3.0, 1.0 - f64::EPSILON, 1e-20, 0.123_456_789_012_345] {
            let [high, low] = in_two(x);
            let back = f64::from(high) + f64::from(low);
            assert!((back - x).abs() <= x * 2f64.powi(-48), "{x} became {back}");
        }
    }
}
