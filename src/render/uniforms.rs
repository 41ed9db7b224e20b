//! The parameters and uniforms of drawing the surfaces of a picture.

use glam::DVec3;

use super::projection::Projection;
use super::shader_types::{Cut, Palette, SurfaceUniforms};
use super::tables;
use super::target::Target;
use super::view::{Surface, View};
use crate::color::{Color, Map, linear};
use crate::spectrum::Spectrum;

/// The inputs that all passes of a picture share.
pub(super) struct Picture<'a> {
    pub(super) spectrum: &'a Spectrum,
    pub(super) target: &'a Target,
    pub(super) view: &'a View,
    pub(super) projection: &'a Projection,
}

/// The parameters of drawing one layer.
pub(super) struct LayerDraw {
    pub(super) layer: usize,
    pub(super) frame: SurfaceUniforms,
    pub(super) opacity: f32,
}

/// Linear colours of the two sides of the first surface of a picture; the second surface has them swapped.
const SIDE_COLORS: [[f32; 4]; 2] = [[0.170, 0.490, 0.470, 1.0], [0.720, 0.290, 0.160, 1.0]];

/// Width of a silhouette, pixels.
const SILHOUETTE_WIDTH: f32 = 1.5;

/// Brightness of the inner side of a surface with a colour of its own, relative to the other side.
const BACK_SIDE_BRIGHTNESS: f32 = 0.45;

/// The sRGB colours of the third and further surfaces of a picture.
const FURTHER_COLORS: [u32; 4] = [0x5fae84, 0xd184b4, 0xe0c95a, 0x8c7ac2];

/// The default linear red, green and blue of the outer side of a plain surface, by its position in the list of
/// surfaces.
pub fn plain_color(position: usize) -> [f32; 3] {
    let n = SIDE_COLORS.len();
    match position % (n + FURTHER_COLORS.len()) {
        i if i < n => [0, 1, 2].map(|k| SIDE_COLORS[i][k]),
        i => linear(FURTHER_COLORS[i - n]),
    }
}

/// The uniforms of a surface.
pub(super) fn frame(
    spectrum: &Spectrum,
    &Surface { isovalue, color, .. }: &Surface,
    layer: usize,
    view: &View,
    projection: &Projection,
    map: Map,
) -> SurfaceUniforms {
    let default = match layer {
        0 => view.front,
        1 => None,
        _ => Some(plain_color(layer)),
    };
    let color = color.or(default);
    let [mut front, mut back] = match color {
        Some([r, g, b]) => {
            let [back_r, back_g, back_b] = [r, g, b].map(|c| BACK_SIDE_BRIGHTNESS * c);
            [[r, g, b, 1.0], [back_r, back_g, back_b, 1.0]]
        }
        None => [SIDE_COLORS[layer % 2], SIDE_COLORS[(layer + 1) % 2]],
    };
    front[3] = if view.silhouette { SILHOUETTE_WIDTH } else { 0.0 };
    // No inner side of a closed surface can be seen.
    back[3] = if view.open || view.clip.is_some() { 0.0 } else { 1.0 };
    let palette = match view.color {
        Color::None => Palette::Plain,
        Color::Component => Palette::Components,
        Color::Normal => Palette::Normals,
        _ => Palette::Map,
    };
    // The lines of a coloured mesh are darker, to be visible on every colour.
    let wire = if palette == Palette::Plain {
        [0.010, 0.022, 0.045, 0.80]
    } else {
        [0.008, 0.008, 0.010, 0.72]
    };
    SurfaceUniforms {
        clip_from_voxel: projection.clip_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_voxel: projection.eye_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_normal: glam::Mat4::from_mat3(projection.eye_from_normal.as_mat3())
            .to_cols_array_2d(),
        front,
        back,
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

/// Whether a surface needs the shader of clipped or translucent surfaces.
pub(super) fn is_cut(view: &View, opacity: f32) -> bool {
    view.clip.is_some() || opacity < 1.0
}

/// Whether the eye is on the side of the clip plane where nothing is shown.
pub(super) fn is_eye_cut_off(view: &View, projection: &Projection) -> bool {
    let [_, _, towards_eye, at_eye] = plane(view, projection).to_array();
    (if projection.parallel { towards_eye } else { at_eye }) < 0.0
}

/// The clip plane in the eye frame; without one, a plane that clips nothing.
fn plane(view: &View, projection: &Projection) -> glam::DVec4 {
    // Planes transform with the inverse transpose.
    view.clip.map_or(glam::DVec4::W, |clip| {
        let kept = -DVec3::from_array(clip.normal);
        projection.eye_from_voxel.inverse().transpose() * kept.extend(clip.offset)
    })
}

/// The clip plane in the eye frame and the opacity of a surface, if it [`is_cut`].
pub(super) fn cut(view: &View, opacity: f32, projection: &Projection) -> Option<Cut> {
    is_cut(view, opacity).then(|| Cut {
        plane: plane(view, projection).as_vec4().to_array(),
        opacity,
        depth: projection.depth.map(|x| x as f32),
        half_extent: projection.half_extent.map(|x| x as f32),
        ..Cut::default()
    })
}
