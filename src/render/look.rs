//! How the surfaces of a picture look, as the shader reads it.

use super::layout::{Cut, Frame, Palette};
use super::projection::Projection;
use super::{Surface, View, tables};
use crate::color::{Color, Map};
use crate::spectrum::Spectrum;

/// How a layer is drawn.
pub(super) struct Look {
    pub(super) layer: usize,
    pub(super) frame: Frame,
    pub(super) opacity: f32,
}

/// Linear colours of the two sides of the first surface of a picture; of the second they change
/// places.
const SIDES: [[f32; 4]; 2] = [[0.235, 0.410, 0.620, 1.0], [0.700, 0.370, 0.150, 1.0]];

/// How light the side towards higher values is of a surface that has a colour of its own, over the other side.
const DARK_SIDE: f32 = 0.45;

/// Linear red, green and blue of the plain side towards lower values of a surface by its place among those of a picture.
pub fn plain_color(place: usize) -> [f32; 3] {
    let [r, g, b, _] = SIDES[place % 2];
    [r, g, b]
}

/// What is the same for every corner of a surface.
pub(super) fn frame(
    spectrum: &Spectrum,
    &Surface { isovalue, color, .. }: &Surface,
    layer: usize,
    view: &View,
    projection: &Projection,
    map: Map,
) -> Frame {
    let sides = match color {
        Some([r, g, b]) => [[r, g, b, 1.0], [DARK_SIDE * r, DARK_SIDE * g, DARK_SIDE * b, 1.0]],
        None => [SIDES[layer % 2], SIDES[(layer + 1) % 2]],
    };
    let palette = match view.color {
        Color::None => Palette::Plain,
        Color::Component => Palette::Names,
        Color::Normal => Palette::Normals,
        _ => Palette::Map,
    };
    // The lines of a coloured mesh are darker, to be seen on every colour.
    let wire = if palette == Palette::Plain {
        [0.010, 0.022, 0.045, 0.80]
    } else {
        [0.008, 0.008, 0.010, 0.72]
    };
    Frame {
        clip_from_voxel: projection.clip_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_voxel: projection.eye_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_normal: glam::Mat4::from_mat3(projection.eye_from_normal.as_mat3())
            .to_cols_array_2d(),
        front: sides[0],
        back: sides[1],
        wire,
        isovalue: tables::scaled(spectrum, isovalue),
        rank: spectrum.rank_at(isovalue).unwrap_or(0),
        palette: palette as u32,
        wire_width: view.wireframe.unwrap_or(0.0),
        mirrored: u32::from(projection.mirrored),
        parallel: u32::from(projection.parallel),
        lamp: view.light as u32,
        map: map.linear_stops().map(|[r, g, b]| [r, g, b, 1.0]),
    }
}

/// Whether a surface takes more than the plain pipeline.
pub(super) fn is_cut(view: &View, opacity: f32) -> bool {
    view.clip.is_some() || opacity < 1.0
}

/// The clip plane in the eye frame and the opacity of a surface, where it has any.
pub(super) fn cut(view: &View, opacity: f32, projection: &Projection) -> Option<Cut> {
    let plane = match view.clip {
        // Planes turn with the inverse transpose.
        Some(clip) => {
            projection.eye_from_voxel.inverse().transpose() * clip.kept().extend(clip.offset)
        }
        None => glam::DVec4::W,
    };
    is_cut(view, opacity).then(|| Cut {
        plane: plane.as_vec4().to_array(),
        opacity,
        depth: projection.depth.map(|x| x as f32),
        reach: projection.reach.map(|x| x as f32),
        ..Cut::default()
    })
}
