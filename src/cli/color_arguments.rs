//! `--color`, `--color-by`, `--color-map`, `--color-range`, `--color-center`: what colours show, and how.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Result;
use isospectrum::color::{Color, ColorSources, Map, ScaleEnds};
use isospectrum::color_sources;
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::{ReadOptions, Volume, files_of, read_volume};

use super::heading;
use super::number_argument::finite;

/// What colours show, and how.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = heading::COLORS)]
pub(super) struct ColorArguments {
    /// Colour by curvature, component, quality, ...
    ///
    /// One of none, quality, lifetime, curvature, distance (to the isosurface, needs --volume), component, normal.
    #[arg(long, value_name = "QUANTITY", default_value = "none", hide_default_value = true)]
    pub(super) color: Color,
    /// Colour by another volume
    ///
    /// For example a density by its potential. The volume covers the same part of the world, or has the same dimensions.
    #[arg(long, value_name = "VOLUME", conflicts_with = "color")]
    pub(super) color_by: Option<PathBuf>,
    /// Colour map, e.g. viridis, magma, vik
    ///
    /// One of viridis, cividis, magma, inferno, plasma, or vik, which has a neutral middle. The default suits the quantity.
    #[arg(long, value_name = "MAP")]
    pub(super) color_map: Option<Map>,
    /// Values of the first and last colour, e.g. 0:5
    ///
    /// Each is a number or a percentile of the visible values: 0:5, p5:p95, 0:
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true, hide_short_help = true)]
    color_range: Option<ScaleEnds>,
    /// Value of the middle colour
    #[arg(long, value_name = "C", value_parser = finite, allow_hyphen_values = true, hide_short_help = true)]
    color_center: Option<f64>,
}

impl ColorArguments {
    /// Returns the quantity that colours show.
    pub(super) fn shown(&self) -> Color {
        if self.color_by.is_some() { Color::Field } else { self.color }
    }

    /// Returns the ends of the scale, as far as they are given.
    pub(super) fn ends(&self) -> ScaleEnds {
        let ends = self.color_range.unwrap_or_default();
        ScaleEnds { center: self.color_center.or(ends.center), ..ends }
    }

    /// Returns every file that the command reads: the spectrum, its volume if given, and the volume of `--color-by`.
    pub(super) fn inputs(&self, spectrum: &Path, volume: Option<&PathBuf>) -> Vec<PathBuf> {
        let volumes = volume.into_iter().chain(&self.color_by);
        let files = volumes.flat_map(|path| files_of(path));
        std::iter::once(spectrum.to_owned()).chain(files).collect()
    }

    /// Returns the sources of the colours. `volume`, that of the spectrum, is needed for the distance.
    ///
    /// # Errors
    ///
    /// Those of reading a volume; [`Error::Input`] for a volume that covers another part of the world.
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

/// Reads the volume of a spectrum and prepares it as for the sweep.
///
/// # Errors
///
/// Those of reading a volume; [`Error::Input`] for a volume of other dimensions.
pub(super) fn volume_of(path: &Path, spectrum: &Spectrum) -> Result<Volume> {
    color_sources::swept_volume(read_volume(path, &ReadOptions::default())?, spectrum)
}
