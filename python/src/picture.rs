//! Pictures.

use std::path::PathBuf;

use isospectrum::render::{Image, Surface, View, linear};
use isospectrum::{Error, Result};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::appearance::Appearance;
use crate::errors::raised;

/// A picture, RGBA with 8 bits per channel.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Picture(pub(crate) Image);

#[pymethods]
impl Picture {
    /// Numbers of rows and columns.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.0.height, self.0.width)
    }

    /// The pixels, row by row from the top.
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<u8>> {
        self.0.pixels.clone().into_pyarray(py)
    }

    /// The picture as PNG.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        py.detach(|| self.0.encode_png(&mut bytes)).map_err(|e| raised(Error::io("-", e)))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes a PNG file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.write_png(&path)).map_err(raised)
    }
}

/// What a picture shows besides surfaces, from a Python dictionary.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Pictured {
    /// Width and height, pixels.
    pub(crate) size: (u32, u32),
    legend: bool,
    scale_bar: bool,
    label: Option<String>,
    pub(crate) fit_volume: bool,
    /// A part of the name of the adapter.
    pub(crate) adapter: Option<String>,
}

impl Pictured {
    /// The view of a spectrum; `is_by_volume` if colours show another volume.
    pub(crate) fn view(
        &self,
        appearance: &Appearance,
        spectrum: &isospectrum::Spectrum,
        is_by_volume: bool,
    ) -> Result<View> {
        Ok(View::default()
            .with_width(self.size.0)
            .with_height(self.size.1)
            .with_camera(appearance.camera()?)
            .with_color(appearance.color(is_by_volume)?)
            .with_map(appearance.map()?)
            .with_ends(appearance.ends()?)
            .with_background(appearance.background()?.unwrap_or_default())
            .with_light(appearance.light()?)
            .with_clip(appearance.clip())
            .with_wireframe(appearance.wireframe.then_some(1.0))
            .with_silhouette(appearance.silhouette)
            .with_opacity(appearance.opacity)
            .with_occlusion(appearance.occlusion()?.unwrap_or(false))
            .with_front(appearance.front()?)
            .with_axes(appearance.axes)
            .with_scale_bar(self.scale_bar || appearance.axes)
            .with_legend(self.legend)
            .with_label(self.label.clone())
            .with_open(appearance.open)
            .with_keep(appearance.keep(spectrum)))
    }
}

/// An isosurface to show: isovalue, sRGB colour, opacity.
pub(crate) type Shown = (f64, Option<u32>, Option<f32>);

pub(crate) fn surfaces_of(shown: Vec<Shown>) -> Vec<Surface> {
    let surface =
        |(isovalue, color, opacity): Shown| Surface { isovalue, color: color.map(linear), opacity };
    shown.into_iter().map(surface).collect()
}
