//! The renderer of one spectrum: a [`Painter`] and what it paints, picture by picture.

use super::painter::Painter;
use super::{Image, Surface, View};
use crate::color::{Attribute, Sources};
use crate::error::Result;
use crate::gpu::Gpu;
use crate::spectrum::{Keep, Spectrum, VolumeInfo};

/// Largest table that is kept on the device as a whole, bytes: what browsers and software devices
/// bind at once.
pub const RESIDENT_BYTES: u64 = 128 << 20;

/// Draws pictures of one spectrum; keeps its pipeline and buffers between them.
#[derive(Debug)]
pub struct Renderer<'a> {
    spectrum: &'a Spectrum,
    painter: Painter,
}

impl<'a> Renderer<'a> {
    /// Compiles the pipeline and uploads what is kept. The spectrum must pass
    /// [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device refuses or is lost.
    pub fn new(gpu: &Gpu, spectrum: &'a Spectrum) -> Result<Self> {
        Self::with_budget(gpu, spectrum, RESIDENT_BYTES)
    }

    /// As [`Renderer::new`], with no table on the device larger than `bytes` (at least one
    /// triangle's is allowed).
    ///
    /// # Errors
    ///
    /// [`crate::Error::Gpu`] if the device refuses or is lost.
    pub fn with_budget(gpu: &Gpu, spectrum: &'a Spectrum, bytes: u64) -> Result<Self> {
        Ok(Renderer { spectrum, painter: Painter::new(gpu, spectrum, bytes)? })
    }

    /// Draws the isosurface of `isovalue`.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside [`Spectrum::range`], [`crate::Error::Usage`] if the view makes no sense
    /// or is too large for the device, [`crate::Error::Gpu`] if the device refuses or is lost.
    pub fn draw(&mut self, isovalue: f64, view: &View) -> Result<Image> {
        self.draw_all(&[isovalue.into()], view)
    }

    /// Draws several isosurfaces in one picture.
    ///
    /// # Errors
    ///
    /// As [`Renderer::draw`], and [`crate::Error::Usage`] for an opacity that is none.
    pub fn draw_all(&mut self, surfaces: &[Surface], view: &View) -> Result<Image> {
        self.painter.paint(self.spectrum, surfaces, view)?;
        self.painter.picture(self.spectrum, view)
    }

    /// What is known of the volume.
    pub fn volume(&self) -> &VolumeInfo {
        self.spectrum.volume()
    }

    /// Least and largest corner of the box around what is kept of the isosurfaces of `isovalues`, voxel frame: what
    /// [`View::fit`] fits. None where none of them has anything to see.
    ///
    /// # Errors
    ///
    /// [`crate::Error::Range`] outside [`Spectrum::range`].
    pub fn bounds(&mut self, isovalues: &[f64], keep: &Keep) -> Result<Option<[[f64; 3]; 2]>> {
        let mut bounds: Option<[[f64; 3]; 2]> = None;
        for &isovalue in isovalues {
            let bounds_of_one = self.painter.bounds(self.spectrum, isovalue, keep)?;
            let Some([low, high]) = bounds_of_one else { continue };
            let [least, largest] = bounds.unwrap_or([low, high]);
            bounds = Some([
                std::array::from_fn(|i| low[i].min(least[i])),
                std::array::from_fn(|i| high[i].max(largest[i])),
            ]);
        }
        Ok(bounds)
    }

    /// What the colours of the first surface of the last picture show; none where they show nothing.
    pub fn attribute(&self) -> Option<&Attribute> {
        self.painter.attribute()
    }

    /// What colours are to be had from, from the next picture on.
    pub fn set_sources(&mut self, sources: Sources) {
        self.painter.set_sources(sources);
    }

    /// The triangles of the last picture: their vertices and the unit normals, voxel frame, that their corners are
    /// shaded with.
    pub fn shaded(&self) -> impl Iterator<Item = ([u32; 3], [[f32; 3]; 3])> + '_ {
        self.painter.shaded(0)
    }

    /// Number of triangles in the last picture.
    pub fn n_triangles(&self) -> usize {
        self.painter.n_triangles(0)
    }
}
