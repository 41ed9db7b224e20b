//! The arguments that describe the appearance of both pictures and pages.

use std::str::FromStr as _;

use isospectrum::color::{Color, Map, ScaleEnds};
use isospectrum::render::{
    Axis, Background, Camera, Clip, Light, Style, StyleValues, Surface, reveal_inner,
};
use isospectrum::{Error, Keep, Result, Spectrum};
use pyo3::prelude::*;

/// The components to keep: number, least volume, least area, a point; in the world frame.
pub(crate) type Kept = (Option<usize>, f64, f64, Option<[f64; 3]>);

/// The appearance, from a Python dictionary; texts are those of the command line.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Appearance {
    /// Azimuth, elevation, distance.
    camera: Option<(f64, f64, f64)>,
    up: Option<String>,
    orthographic: bool,
    color: String,
    color_map: Option<String>,
    color_range: Option<String>,
    color_center: Option<f64>,
    style: String,
    background: Option<String>,
    light: Option<String>,
    /// Normal and offset, voxel frame.
    clip: Option<([f64; 3], f64)>,
    pub(crate) opacity: f32,
    occlusion: Option<bool>,
    pub(crate) wireframe: bool,
    pub(crate) silhouette: bool,
    pub(crate) axes: bool,
    pub(crate) open: bool,
    keep: Option<Kept>,
}

impl Appearance {
    pub(crate) fn camera(&self) -> Result<Camera> {
        let camera = self.camera.map(|(azimuth, elevation, distance)| Camera {
            azimuth,
            elevation,
            distance,
            ..Camera::default()
        });
        let up = self.up.as_deref().map(Axis::from_str).transpose()?;
        Ok(Camera { up, orthographic: self.orthographic, ..camera.unwrap_or_default() })
    }

    /// The quantity that the colours show; `is_by_volume` if it is another volume.
    pub(crate) fn color(&self, is_by_volume: bool) -> Result<Color> {
        let color = Color::from_str(&self.color)?;
        match color {
            Color::None if is_by_volume => Ok(Color::Field),
            _ if is_by_volume => Err(Error::Usage(format!(
                "color '{}' and color_by, expected one of them",
                self.color
            ))),
            _ => Ok(color),
        }
    }

    pub(crate) fn map(&self) -> Result<Option<Map>> {
        self.color_map.as_deref().map(Map::from_str).transpose()
    }

    pub(crate) fn ends(&self) -> Result<ScaleEnds> {
        let ends = self.color_range.as_deref().map(ScaleEnds::from_str).transpose()?;
        let ends = ends.unwrap_or_default();
        let ends = ScaleEnds { center: self.color_center.or(ends.center), ..ends };
        ends.check()?;
        Ok(ends)
    }

    pub(crate) fn background(&self) -> Result<Option<Background>> {
        let own = self.background.as_deref().map(Background::from_str).transpose()?;
        Ok(own.or(self.style()?.background))
    }

    pub(crate) fn light(&self) -> Result<Light> {
        let own = self.light.as_deref().map(Light::from_str).transpose()?;
        Ok(own.unwrap_or(self.style()?.light))
    }

    pub(crate) fn occlusion(&self) -> Result<Option<bool>> {
        Ok(self.occlusion.or(self.style()?.occlusion))
    }

    /// The colour of the first surface if it has none of its own.
    pub(crate) fn front(&self) -> Result<Option<[f32; 3]>> {
        Ok(self.style()?.front)
    }

    fn style(&self) -> Result<StyleValues> {
        Ok(self.style.parse::<Style>()?.values())
    }

    pub(crate) fn clip(&self) -> Option<Clip> {
        self.clip.map(|(normal, offset)| Clip { normal, offset })
    }

    /// Surfaces of which the inner ones can be seen, unless an opacity is given.
    pub(crate) fn revealed(&self, mut surfaces: Vec<Surface>) -> Vec<Surface> {
        if self.opacity == 1.0 {
            reveal_inner(&mut surfaces);
        }
        surfaces
    }

    pub(crate) fn keep(&self, spectrum: &Spectrum) -> Keep {
        kept(self.keep, spectrum)
    }
}

/// The components to keep, in the voxel frame.
pub(crate) fn kept(keep: Option<Kept>, spectrum: &Spectrum) -> Keep {
    let Some((largest, min_volume, min_area, at)) = keep else { return Keep::default() };
    Keep { largest, min_volume, min_area, at }.in_voxels(&spectrum.volume().placement)
}
