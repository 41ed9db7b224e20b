//! Isovalues on the command line, resolved in a spectrum.

use isospectrum::spectrum::Spectrum;

pub(super) use isospectrum::volume::Isovalue;

/// The isovalue as a number, in the range of a spectrum.
///
/// # Errors
///
/// Usage, if it needs the statistics of the samples and the spectrum has none.
pub(super) fn in_spectrum(written: Isovalue, spectrum: &Spectrum) -> isospectrum::Result<f64> {
    written.resolve(spectrum.range(), spectrum.statistics().as_ref())
}
