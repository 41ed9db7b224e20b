//! The description of a picture.

use super::background::Background;
use super::camera::{Camera, FILL};
use super::light::Light;
use super::style::Style;
use crate::color::{Color, Map, ScaleEnds};
use crate::error::{Error, Result};
use crate::setters::setters;
use crate::spectrum::{Keep, Picked, VolumeInfo};

/// The description of a picture. Build one from [`View::default`] and its setters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct View {
    /// Direction and distance of the eye.
    pub camera: Camera,
    /// The point in the center of the picture, voxel frame; `None` for the center of the volume.
    pub look_at: Option<[f64; 3]>,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What the colour of a triangle shows.
    pub color: Color,
    /// The colour map; `None` for the default map of the colour.
    pub map: Option<Map>,
    /// The values at the ends of the colour map; those that are `None` follow from the values shown. Set them to compare
    /// pictures of several isovalues.
    pub ends: ScaleEnds,
    /// Width of the triangles' edges, pixels; `None` draws no edges.
    pub wireframe: Option<f32>,
    /// Whether lines show where a surface turns away from the eye.
    pub silhouette: bool,
    /// The background.
    pub background: Background,
    /// Whether caps are left out, which opens the surface at the border of the volume.
    pub open: bool,
    /// Which components are drawn, sizes and positions in the voxel frame. They keep the colours that they have among all
    /// components.
    pub keep: Keep,
    /// Which of these components are drawn of the first isosurface.
    pub picked: Picked,
    /// A clip plane.
    pub clip: Option<Clip>,
    /// Whether a legend explains the colours, if they show values.
    pub legend: bool,
    /// Whether the edges of the volume's box and the directions of the world's axes are drawn.
    pub axes: bool,
    /// Whether a scale bar is drawn.
    pub scale_bar: bool,
    /// Text at the top.
    pub label: Option<String>,
    /// Opacity of the surface, 0 to 1. Below 1 the triangles are sorted by depth for every picture.
    pub opacity: f32,
    /// Whether ambient occlusion darkens the hollows of opaque surfaces.
    pub occlusion: bool,
    /// Position of the main light.
    pub light: Light,
    /// Linear red, green and blue of the outer side of the first surface if it is plain and has no colour of its own; `None` for the
    /// default.
    pub front: Option<[f32; 3]>,
}

/// One of the isosurfaces of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Its isovalue.
    pub isovalue: f64,
    /// Linear red, green and blue of the outer side if the surface is plain; `None` for the default by its
    /// position in the list of surfaces.
    pub color: Option<[f32; 3]>,
    /// As [`View::opacity`]; `None` for that of the view.
    pub opacity: Option<f32>,
}

impl Surface {
    pub(super) fn opacity_in(&self, view: &View) -> f32 {
        self.opacity.unwrap_or(view.opacity)
    }
}

/// Opacity of surfaces around another one, if none is given.
const OUTER_OPACITY: f32 = 0.35;

/// Makes the inner ones of several surfaces visible: if no surface has an opacity, all but that of the highest isovalue, which is inside
/// the others, become translucent.
pub fn reveal_inner(surfaces: &mut [Surface]) {
    if surfaces.len() < 2 || surfaces.iter().any(|surface| surface.opacity.is_some()) {
        return;
    }
    let innermost = surfaces.iter().map(|surface| surface.isovalue).fold(f64::MIN, f64::max);
    for surface in surfaces.iter_mut().filter(|surface| surface.isovalue < innermost) {
        surface.opacity = Some(OUTER_OPACITY);
    }
}

impl From<f64> for Surface {
    fn from(isovalue: f64) -> Self {
        Surface { isovalue, color: None, opacity: None }
    }
}

/// A clip plane in the voxel frame: points with normal . p <= offset are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// Direction of the removed side; not zero.
    pub normal: [f64; 3],
    /// Offset of the plane along the normal.
    pub offset: f64,
}

impl Default for View {
    fn default() -> Self {
        View {
            camera: Camera::default(),
            look_at: None,
            width: 1280,
            height: 960,
            color: Color::None,
            map: None,
            ends: ScaleEnds::default(),
            wireframe: None,
            silhouette: false,
            background: Background::White,
            open: false,
            keep: Keep::default(),
            picked: Picked::default(),
            clip: None,
            legend: true,
            axes: false,
            scale_bar: false,
            label: None,
            opacity: 1.0,
            occlusion: false,
            light: Light::default(),
            front: None,
        }
    }
}

impl View {
    setters! {
        with_camera(camera: Camera),
        with_width(width: u32),
        with_height(height: u32),
        with_color(color: Color),
        with_ends(ends: ScaleEnds),
        with_background(background: Background),
        with_open(open: bool),
        with_keep(keep: Keep),
        with_picked(picked: Picked),
        with_legend(legend: bool),
        with_axes(axes: bool),
        with_scale_bar(scale_bar: bool),
        with_opacity(opacity: f32),
        with_occlusion(occlusion: bool),
        with_silhouette(silhouette: bool),
        with_light(light: Light);
        optional:
        with_look_at(look_at: [f64; 3]),
        with_map(map: Map),
        with_wireframe(wireframe: f32),
        with_clip(clip: Clip),
        with_label(label: String),
        with_front(front: [f32; 3]),
    }

    /// Sets background, light, colour and occlusion to those of a style.
    #[must_use]
    pub fn with_style(self, style: Style) -> Self {
        let values = style.values();
        View {
            background: values.background.unwrap_or_default(),
            light: values.light,
            front: values.front,
            occlusion: values.occlusion.unwrap_or(false),
            ..self
        }
    }
}

/// Smallest side of a box that a picture is fitted to, voxels: smaller boxes are shown with their surroundings.
const MIN_FIT_SIDE: f64 = 1.0;

/// As [`FILL`], with the box of the volume and annotations around it.
const ANNOTATED_FILL: f64 = 0.88;

impl View {
    /// Centers the picture on a box (minimum and maximum corner, voxel frame). The box just fits the picture if the camera's
    /// distance was 1; other distances keep their ratio to that.
    ///
    /// With axes the box of the volume is in the picture, too, and annotations have room around it.
    pub fn fit(&mut self, volume: &VolumeInfo, bounds: [[f64; 3]; 2]) {
        let size = [self.width, self.height];
        let [low, high] = bounds;
        let cell = volume.placement.cell_size();
        let bounds = match self.axes {
            true => [
                low.map(|x| x.min(0.0)),
                std::array::from_fn(|i| high[i].max((volume.dims[i] - 1) as f64 * cell[i])),
            ],
            false => bounds,
        };
        let margin = if self.axes { FILL / ANNOTATED_FILL } else { 1.0 };
        let distance = margin * self.camera.fit_distance(volume, Some(enlarged(bounds)), size);
        self.camera.distance *= distance / self.camera.fit_distance(volume, None, size);
        self.look_at = Some(center(bounds));
    }

    /// Switches between perspective and parallel projection; the size at the distance of the center stays the same.
    pub fn set_orthographic(&mut self, volume: &VolumeInfo, orthographic: bool) {
        let size = [self.width, self.height];
        let before = self.camera.fit_distance(volume, None, size);
        self.camera.orthographic = orthographic;
        self.camera.distance *= before / self.camera.fit_distance(volume, None, size);
    }

    /// `n` views around the up direction, the first from the direction of this one and each further counter-clockwise. All
    /// have the same distance, at which a box fits in all of them, so nothing changes its size: `bounds` as for
    /// [`View::fit`], or the volume's box.
    pub fn turntable(
        &self,
        volume: &VolumeInfo,
        bounds: Option<[[f64; 3]; 2]>,
        n: u32,
    ) -> Vec<View> {
        let size = [self.width, self.height];
        let turned = |k: u32| Camera {
            azimuth: self.camera.azimuth + 360.0 * f64::from(k) / f64::from(n),
            ..self.camera
        };
        let bounds = bounds.map(enlarged);
        let needed = |k| turned(k).fit_distance(volume, bounds, size);
        let farthest = (0..n).map(needed).fold(0.0, f64::max);
        let view = |k| {
            let mut camera = turned(k);
            // The unit of a camera's distance is where the volume fits, which changes with the direction.
            camera.distance *= farthest / camera.fit_distance(volume, None, size);
            View { camera, look_at: bounds.map(center).or(self.look_at), ..self.clone() }
        };
        (0..n).map(view).collect()
    }

    /// Checks that the numbers are valid, for a device whose pictures are at most `max_size` pixels wide and high.
    pub(super) fn check(&self, max_size: u32) -> Result<()> {
        let View { width, height, .. } = *self;
        if !(1..=max_size).contains(&width) || !(1..=max_size).contains(&height) {
            return Err(Error::Usage(format!(
                "picture of {width}x{height} pixels, expected 1 to {max_size} each way"
            )));
        }
        if let Some(pixels) = self.wireframe
            && !(pixels > 0.0 && pixels.is_finite())
        {
            return Err(Error::Usage(format!(
                "wireframe {pixels} pixels wide, expected a positive number"
            )));
        }
        if !(0.0..=1.0).contains(&self.opacity) {
            return Err(Error::Usage(format!("opacity {}, expected 0 to 1", self.opacity)));
        }
        let clip = self.clip.into_iter().flat_map(|c| c.normal.into_iter().chain([c.offset]));
        let mut numbers = self.look_at.into_iter().flatten().chain(clip);
        if let Some(wrong) = numbers.find(|x| !x.is_finite()) {
            return Err(Error::Usage(format!("view with {wrong}, expected finite numbers")));
        }
        self.ends.check()?;
        self.keep.check()?;
        self.camera.check()
    }
}

fn center([low, high]: [[f64; 3]; 2]) -> [f64; 3] {
    std::array::from_fn(|i| 0.5 * (low[i] + high[i]))
}

/// A box with every side at least [`MIN_FIT_SIDE`] long, with the same center.
fn enlarged(bounds: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    let [low, high] = bounds;
    let center = center(bounds);
    let half: [f64; 3] = std::array::from_fn(|i| 0.5 * (high[i] - low[i]).max(MIN_FIT_SIDE));
    [-1.0, 1.0].map(|side| std::array::from_fn(|i| center[i] + side * half[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::phantom;

    #[test]
    fn with_axes_the_box_of_the_volume_has_room_around_it() {
        let volume = phantom("blobs:16").expect("a phantom").info();
        for (axes, fill) in [(true, ANNOTATED_FILL), (false, FILL)] {
            let mut view = View { axes, ..View::default().with_width(400).with_height(300) };
            let small = [[6.0; 3], [9.0; 3]];
            view.fit(&volume, if axes { small } else { [[0.0; 3], [15.0; 3]] });
            let projection = view.camera.projection(&volume, view.look_at, view.width, view.height);
            let extent = (0..8).map(|i| {
                let corner =
                    glam::DVec3::from_array([0, 1, 2].map(|a| f64::from(i >> a & 1) * 15.0));
                let p = projection.clip_from_voxel.project_point3(corner);
                p.x.abs().max(p.y.abs())
            });
            let extent = extent.fold(0.0, f64::max);
            assert!(extent < fill + 1e-9 && extent > fill - 0.12, "{extent}, expected {fill}");
        }
    }

    #[test]
    fn the_surface_inside_others_is_opaque() {
        let mut surfaces = [Surface::from(10.0), Surface::from(30.0), Surface::from(20.0)];
        reveal_inner(&mut surfaces);
        assert_eq!(surfaces.map(|s| s.opacity), [Some(OUTER_OPACITY), None, Some(OUTER_OPACITY)]);
        let mut chosen = [Surface { opacity: Some(0.5), ..10.0.into() }, 20.0.into()];
        reveal_inner(&mut chosen);
        assert_eq!(chosen[1].opacity, None);
        assert_eq!(chosen[0].opacity, Some(0.5));
    }
}
