//! The renderer of one spectrum: a [`Painter`] with its spectrum.

use super::image::Image;
use super::painter::Painter;
use super::view::{Surface, View};
use crate::color::{Attribute, ColorSources};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::spectrum::{Keep, Spectrum, VolumeInfo};

/// Default of the largest table on the device, bytes: the largest binding of browsers and software devices.
pub const RESIDENT_BYTES: u64 = 128 << 20;

/// Draws pictures of one spectrum; keeps its pipeline and buffers between them.
#[derive(Debug)]
pub struct Renderer<'a> {
    spectrum: &'a Spectrum,
    painter: Painter,
}

impl<'a> Renderer<'a> {
    /// Compiles the pipelines and uploads the spectrum, which must pass [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device reports an error or is lost.
    pub fn new(gpu: &Gpu, spectrum: &'a Spectrum) -> Result<Self> {
        Self::with_budget(gpu, spectrum, RESIDENT_BYTES)
    }

    /// As [`Renderer::new`], with no table on the device larger than `max_bytes` (but at least one triangle's).
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device reports an error or is lost.
    pub fn with_budget(gpu: &Gpu, spectrum: &'a Spectrum, max_bytes: u64) -> Result<Self> {
        Ok(Renderer { spectrum, painter: Painter::new(gpu, spectrum, max_bytes)? })
    }

    /// Draws the isosurface of `isovalue`.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside [`Spectrum::range`], [`crate::Error::Usage`] if the view is invalid or too large for
    /// the device, [`crate::Error::Gpu`] if the device reports an error or is lost.
    pub fn draw(&mut self, isovalue: f64, view: &View) -> Result<Image> {
        self.draw_all(&[isovalue.into()], view)
    }

    /// Draws several isosurfaces in one picture.
    ///
    /// # Errors
    ///
    /// As [`Renderer::draw`], and [`crate::Error::Usage`] for an opacity outside of 0 to 1.
    pub fn draw_all(&mut self, surfaces: &[Surface], view: &View) -> Result<Image> {
        self.painter.paint(self.spectrum, surfaces, view)?;
        self.painter.picture(self.spectrum, view)
    }

    /// The description of the volume.
    pub fn volume(&self) -> &VolumeInfo {
        self.spectrum.volume()
    }

    /// Minimum and maximum corner of the box around the kept components of the isosurfaces of `isovalues`, voxel frame, for
    /// [`View::fit`]. `None` if all of them are empty.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside [`Spectrum::range`].
    pub fn bounds(&mut self, isovalues: &[f64], keep: &Keep) -> Result<Option<[[f64; 3]; 2]>> {
        let mut bounds: Option<[[f64; 3]; 2]> = None;
        for &isovalue in isovalues {
            let surface_bounds = self.painter.bounds(self.spectrum, isovalue, keep)?;
            let Some([low, high]) = surface_bounds else { continue };
            let [min, max] = bounds.unwrap_or([low, high]);
            bounds = Some([
                std::array::from_fn(|i| low[i].min(min[i])),
                std::array::from_fn(|i| high[i].max(max[i])),
            ]);
        }
        Ok(bounds)
    }

    /// The values that colour the first surface of the last picture; `None` for colours without values.
    pub fn attribute(&self) -> Option<&Attribute> {
        self.painter.attribute()
    }

    /// Sets the data for colours, from the next picture on.
    pub fn set_sources(&mut self, sources: ColorSources) {
        self.painter.set_sources(sources);
    }

    /// The triangles of the first surface of the last picture: their vertices and the unit normals, voxel frame, that shade
    /// their corners.
    pub fn shaded(&self) -> impl Iterator<Item = ([u32; 3], [[f32; 3]; 3])> + '_ {
        self.painter.shaded(0)
    }

    /// Number of triangles of the first surface of the last picture.
    pub fn n_triangles(&self) -> usize {
        self.painter.n_triangles(0)
    }
}
