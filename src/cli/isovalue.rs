//! Isovalues on the command line, resolved for a spectrum.

use isospectrum::Result;
use isospectrum::spectrum::Spectrum;

pub(super) use isospectrum::volume::Isovalue;

/// Resolves an isovalue for a spectrum.
///
/// # Errors
///
/// [`Error::Usage`](isospectrum::Error::Usage) if it needs statistics of the samples that the spectrum does not have.
pub(super) fn in_spectrum(isovalue: Isovalue, spectrum: &Spectrum) -> Result<f64> {
    isovalue.resolve(spectrum.range(), spectrum.statistics().as_ref())
}
