//! Pictures of a spectrum, drawn offscreen.
//!
//! Nothing is extracted for a picture: the trajectories lie in storage buffers and the vertex
//! shader interpolates each vertex at the isovalue (thesis section 4.3); only the list of active
//! triangles changes with the isovalue. What a window shows is drawn by the same pipeline.
//!
//! # Practice
//!
//! A [`Renderer`] keeps its pipeline and buffers and draws any number of pictures; a [`View`] says
//! how one looks; the [`Image`] that comes back is written by [`Image::write_png`].
//!
//! ```no_run
//! # fn draw(spectrum: &isospectrum::spectrum::Spectrum) -> isospectrum::Result<()> {
//! use isospectrum::render::Gpu;
//! use isospectrum::render::{Color, Renderer, View};
//!
//! let gpu = Gpu::new(None)?;
//! let mut renderer = Renderer::new(&gpu, spectrum)?;
//! let view = View { color: Color::Quality, wireframe: Some(1.0), ..View::default() };
//! renderer.draw(0.5, &view)?.write_png("half.png".as_ref())?;
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "annotations")]
mod annotate;
mod axis;
mod camera;
mod edges;
mod image;
mod layer;
mod layout;
mod light;
mod look;
mod occlusion;
mod painter;
mod passes;
mod pipeline;
mod projection;
mod surface;
mod table;
mod tables;
mod target;

pub use crate::color::{Color, Ends, Map, linear};
pub use crate::gpu::Gpu;
pub use axis::Axis;
pub use camera::{BORDER, Camera, FIELD_OF_VIEW, FILL};
pub use image::Image;
pub use light::Light;
pub use look::plain_color;
pub use painter::Painter;
pub use surface::{RESIDENT_BYTES, Renderer};
pub use tables::Memory;
#[cfg(feature = "viewer")]
pub(crate) use target::SHOWN_FORMAT;

use crate::error::{Error, Result};
use crate::parse_name::from_name;
use crate::setters::setters;
use crate::spectrum::{Keep, Picked, VolumeInfo};

/// How a picture looks.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct View {
    /// Where it is taken from.
    pub camera: Camera,
    /// The point in the middle of the picture, voxel frame; without it the middle of the volume.
    pub look_at: Option<[f64; 3]>,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// What the colour of a triangle shows.
    pub color: Color,
    /// The colour map; without it the usual one of the colour.
    pub map: Option<Map>,
    /// What the ends of the map stand for; what is not told follows from the numbers that are shown. Give them to compare
    /// pictures of several isovalues.
    pub ends: Ends,
    /// Width of the triangles' edges, pixels; without it they are not drawn.
    pub wireframe: Option<f32>,
    /// What lies behind the surface.
    pub background: Background,
    /// Whether caps are left out, so that one looks into the volume at its border.
    pub open: bool,
    /// Which components are drawn, sizes and places in the voxel frame; their colours are those that they have among all.
    pub keep: Keep,
    /// Of these, which are drawn of the first isosurface.
    pub picked: Picked,
    /// A plane beyond which nothing is drawn.
    pub clip: Option<Clip>,
    /// Whether a legend tells what the colours show, where they show something.
    pub legend: bool,
    /// Whether the edges of the volume's box and the directions of the world's axes are drawn.
    pub axes: bool,
    /// Whether a bar tells how long things are.
    pub scale_bar: bool,
    /// Words at the top.
    pub label: Option<String>,
    /// How much of what lies behind the surface hides, 0 to 1. Below 1 the triangles are sorted by
    /// depth for every picture.
    pub opacity: f32,
    /// Whether hollows are darker: of opaque surfaces, by what is seen around each point.
    pub occlusion: bool,
    /// Where the main light is.
    pub light: Light,
}

/// One of the isosurfaces of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Its isovalue.
    pub isovalue: f64,
    /// Linear red, green and blue of its plain side towards lower values; without them those of its place among the
    /// surfaces.
    pub color: Option<[f32; 3]>,
    /// As [`View::opacity`]; without it that of the view.
    pub opacity: Option<f32>,
}

impl Surface {
    fn opacity_in(&self, view: &View) -> f32 {
        self.opacity.unwrap_or(view.opacity)
    }
}

impl From<f64> for Surface {
    fn from(isovalue: f64) -> Self {
        Surface { isovalue, color: None, opacity: None }
    }
}

/// A plane in the voxel frame: points with normal . p <= offset are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clip {
    /// Towards what is left out; not zero.
    pub normal: [f64; 3],
    /// Where the plane lies along the normal.
    pub offset: f64,
}

impl Clip {
    /// Towards what is drawn.
    fn kept(&self) -> glam::DVec3 {
        -glam::DVec3::from_array(self.normal)
    }
}

impl View {
    setters! {
        with_camera(camera: Camera),
        with_width(width: u32),
        with_height(height: u32),
        with_color(color: Color),
        with_ends(ends: Ends),
        with_background(background: Background),
        with_open(open: bool),
        with_keep(keep: Keep),
        with_picked(picked: Picked),
        with_legend(legend: bool),
        with_axes(axes: bool),
        with_scale_bar(scale_bar: bool),
        with_opacity(opacity: f32),
        with_occlusion(occlusion: bool),
        with_light(light: Light);
        optional:
        with_look_at(look_at: [f64; 3]),
        with_map(map: Map),
        with_wireframe(wireframe: f32),
        with_clip(clip: Clip),
        with_label(label: String),
    }
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
            ends: Ends::default(),
            wireframe: None,
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
        }
    }
}

/// Least side of a box that a picture fits, voxels: what is smaller is shown with its surroundings.
const LEAST_FIT: f64 = 1.0;

impl View {
    /// Looks at a box (least and largest corner, voxel frame) such that it just fits where the camera's distance was
    /// 1, and is as much larger or smaller where it was not.
    pub fn fit(&mut self, volume: &VolumeInfo, bounds: [[f64; 3]; 2]) {
        let size = [self.width, self.height];
        let part = self.camera.fit_distance(volume, Some(at_least(bounds)), size);
        self.camera.distance *= part / self.camera.fit_distance(volume, None, size);
        self.look_at = Some(middle_of(bounds));
    }

    /// Changes between perspective and parallel projection; what lies as far as the point looked at keeps its size.
    pub fn set_orthographic(&mut self, volume: &VolumeInfo, orthographic: bool) {
        let size = [self.width, self.height];
        let before = self.camera.fit_distance(volume, None, size);
        self.camera.orthographic = orthographic;
        self.camera.distance *= before / self.camera.fit_distance(volume, None, size);
    }

    /// `n` views all around the direction upwards, the first from the direction of this one and each further
    /// counter-clockwise. All are from one distance, at which a box fits in all of them, so nothing changes its size: the
    /// box that is given as to [`View::fit`], without it the volume's.
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
        let bounds = bounds.map(at_least);
        let needed = |k| turned(k).fit_distance(volume, bounds, size);
        let farthest = (0..n).map(needed).fold(0.0, f64::max);
        let view = |k| {
            let mut camera = turned(k);
            // Distances of cameras count from where the volume fits, which changes with the direction.
            camera.distance *= farthest / camera.fit_distance(volume, None, size);
            View { camera, look_at: bounds.map(middle_of).or(self.look_at), ..self.clone() }
        };
        (0..n).map(view).collect()
    }

    /// Whether the numbers make sense for a device whose pictures are at most `largest` pixels wide
    /// and high.
    fn check(&self, largest: u32) -> Result<()> {
        let View { width, height, .. } = *self;
        if !(1..=largest).contains(&width) || !(1..=largest).contains(&height) {
            return Err(Error::Usage(format!(
                "picture of {width}x{height} pixels, expected 1 to {largest} each way"
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
        let numbers = self
            .look_at
            .into_iter()
            .flatten()
            .chain(self.clip.into_iter().flat_map(|c| c.normal.into_iter().chain([c.offset])))
            .chain(self.ends.numbers());
        if let Some(wrong) = numbers.into_iter().find(|x| !x.is_finite()) {
            return Err(Error::Usage(format!("view with {wrong}, expected finite numbers")));
        }
        self.keep.check()?;
        self.camera.check()
    }
}

fn middle_of([low, high]: [[f64; 3]; 2]) -> [f64; 3] {
    std::array::from_fn(|i| 0.5 * (low[i] + high[i]))
}

/// A box, or a larger one around its middle where a side is shorter than [`LEAST_FIT`].
fn at_least(bounds: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    let [low, high] = bounds;
    let middle = middle_of(bounds);
    let half: [f64; 3] = std::array::from_fn(|i| 0.5 * (high[i] - low[i]).max(LEAST_FIT));
    [-1.0, 1.0].map(|side| std::array::from_fn(|i| middle[i] + side * half[i]))
}

/// What lies behind the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Background {
    /// White, for print.
    #[default]
    White,
    /// A light grey.
    Light,
    /// Nearly black, for slides.
    Dark,
    /// Nothing: alpha is 0.
    Transparent,
}

impl Background {
    /// Every background, in the order of the documentation.
    pub const ALL: [Background; 4] =
        [Background::White, Background::Light, Background::Dark, Background::Transparent];

    /// The name as flags spell it.
    pub fn name(self) -> &'static str {
        match self {
            Background::White => "white",
            Background::Light => "light",
            Background::Dark => "dark",
            Background::Transparent => "transparent",
        }
    }

    /// Linear red, green, blue and alpha.
    fn linear(self) -> [f64; 4] {
        match self {
            Background::White => [1.0, 1.0, 1.0, 1.0],
            Background::Light => [0.82, 0.83, 0.85, 1.0],
            Background::Dark => [0.012, 0.013, 0.016, 1.0],
            Background::Transparent => [0.0; 4],
        }
    }
}

from_name!(Background, "background");
