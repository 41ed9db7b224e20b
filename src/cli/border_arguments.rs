//! `--open`, `--closed`: whether meshes are closed where the volume ends.

use clap::Args;
use isospectrum::spectrum::Spectrum;

/// Whether meshes are closed where the volume, or its mask, ends.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(super) struct BorderArguments {
    /// Leave out the triangles that close the mesh at the border of the volume, and beyond its mask
    #[arg(long, conflicts_with = "closed")]
    open: bool,
    /// Keep the triangles that close the mesh, which are left out by themselves where the spectrum has a mask
    #[arg(long)]
    closed: bool,
}

impl BorderArguments {
    /// Whether meshes of a spectrum are open.
    pub(super) fn is_open(self, spectrum: &Spectrum) -> bool {
        let done = spectrum.preparation();
        self.open || !self.closed && done.is_ok_and(|done| done.mask.is_some())
    }

    /// Whether that was asked for, where there is no spectrum yet.
    #[cfg(feature = "viewer")]
    pub(super) fn open(self) -> bool {
        self.open
    }
}
