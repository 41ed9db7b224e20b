//! `--open`, `--closed`: whether meshes are closed at the border of the volume.

use clap::Args;
use isospectrum::spectrum::Spectrum;

use super::heading;

/// Whether meshes are closed at the border of the volume or its mask.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = heading::SURFACE)]
pub(super) struct BorderArguments {
    /// Leave out triangles on the border of the volume
    ///
    /// These triangles close the mesh at the border, and beyond a mask.
    #[arg(long, conflicts_with = "closed")]
    open: bool,
    /// Keep the triangles that close the mesh, which are left out by default if the spectrum has a mask
    #[arg(long, hide_short_help = true)]
    closed: bool,
}

impl BorderArguments {
    /// True if meshes of a spectrum are open.
    pub(super) fn is_open(self, spectrum: &Spectrum) -> bool {
        let preparation = spectrum.preparation();
        self.open || !self.closed && preparation.is_ok_and(|p| p.mask.is_some())
    }

    /// True if `--open` is given, for a window without a spectrum.
    #[cfg(feature = "viewer")]
    pub(super) fn open(self) -> bool {
        self.open
    }
}
