//! `--color`, `--color-by`, `--color-map`, `--color-range`, `--color-center`: what colours show, and how.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Result;
use isospectrum::color::{Color, ColorSources, Map, ScaleEnds};
use isospectrum::color_sources;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::{ReadOptions, Volume, files_of, read_volume};

/// What colours show, and how.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct ColorArguments {
    /// What the colours show: none, quality, lifetime, curvature, distance to the isosurface (with --volume), component or
    /// normal
    #[arg(long, value_name = "WHAT", default_value = "none")]
    pub(super) color: Color,
    /// Colour by another volume, e.g. a density by its potential; it lies in the same world, or has as many samples
    #[arg(long, value_name = "VOLUME", conflicts_with = "color")]
    pub(super) color_by: Option<PathBuf>,
    /// Colour map: viridis, cividis, magma, inferno, plasma, or vik with a neutral middle; else one that suits
    #[arg(long, value_name = "MAP")]
    pub(super) color_map: Option<Map>,
    /// Numbers of the first and the last colour, each a number or a percentile of those that are shown: 0:5, p5:p95, 0:
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    color_range: Option<ScaleEnds>,
    /// Number of the middle colour
    #[arg(long, value_name = "C", allow_hyphen_values = true)]
    color_center: Option<f64>,
}

impl ColorArguments {
    /// What is shown.
    pub(super) fn shown(&self) -> Color {
        if self.color_by.is_some() { Color::Field } else { self.color }
    }

    /// What is told of the ends of the scale.
    pub(super) fn ends(&self) -> ScaleEnds {
        let ends = self.color_range.unwrap_or_default();
        ScaleEnds { center: self.color_center.or(ends.center), ..ends }
    }

    /// Every file that a command reads: the spectrum, its volume where it is told, and what colours show.
    pub(super) fn inputs(&self, spectrum: &Path, volume: Option<&PathBuf>) -> Vec<PathBuf> {
        let volumes = volume.into_iter().chain(&self.color_by);
        let files = volumes.flat_map(|path| files_of(path));
        std::iter::once(spectrum.to_owned()).chain(files).collect()
    }

    /// What the colours are had from; the distance from the volume of the spectrum.
    ///
    /// # Errors
    ///
    /// What reading a volume meets, and [`Error::Input`] for one that lies elsewhere.
    pub(super) fn sources(
        &self,
        spectrum: &Spectrum,
        volume: Option<Volume>,
    ) -> Result<ColorSources> {
        let by = self.color_by.as_deref().map(|path| read_volume(path, &ReadOptions::default()));
        let by = by.transpose()?;
        color_sources::sources(
            spectrum,
            self.color,
            by.as_ref(),
            volume.as_ref(),
            "--volume VOLUME",
        )
    }
}

/// The volume of a spectrum, as it was for the sweep.
///
/// # Errors
///
/// What reading it meets, and [`Error::Input`] for one of other dimensions.
pub(super) fn volume_of(path: &Path, spectrum: &Spectrum) -> Result<Volume> {
    color_sources::swept_volume(read_volume(path, &ReadOptions::default())?, spectrum)
}
