//! `--sweep A:B:N`.

use std::str::FromStr;

use isospectrum::series::{MAX_FRAMES, evenly_spaced};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;

/// `A:B:N`: N evenly spaced isovalues from A to B, both included; A can be above B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SweepArgument {
    from: Isovalue,
    to: Isovalue,
    n: u32,
}

impl SweepArgument {
    /// Returns the number of frames.
    pub(super) fn n_frames(&self) -> u32 {
        self.n
    }

    /// Returns the isovalues for a spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] if an end is outside the range, [`Error::Usage`] if an end needs statistics of the samples that are
    /// unknown.
    pub(super) fn in_spectrum(&self, spectrum: &Spectrum) -> Result<Vec<f64>> {
        self.resolve(spectrum.range(), spectrum.statistics().as_ref())
    }

    fn resolve(&self, range: (f64, f64), samples: Option<&Statistics>) -> Result<Vec<f64>> {
        let from = self.from.resolve(range, samples)?;
        let to = self.to.resolve(range, samples)?;
        for isovalue in [from, to] {
            if !(range.0..=range.1).contains(&isovalue) {
                return Err(Error::Range { isovalue, low: range.0, high: range.1 });
            }
        }
        Ok(evenly_spaced(from, to, self.n))
    }
}

impl FromStr for SweepArgument {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let expected = || "expected FROM:TO:N such as 10%:90%:120".to_owned();
        let parts = isospectrum::settings::split_at_colons(text);
        let [from, to, n] = parts[..] else { return Err(expected()) };
        let n = n.trim().parse().map_err(|_| expected())?;
        if !(2..=MAX_FRAMES).contains(&n) {
            return Err(format!("expected from 2 to {MAX_FRAMES} frames"));
        }
        let parse = |end: &str| end.parse().map_err(|error: Error| error.to_string());
        Ok(SweepArgument { from: parse(from)?, to: parse(to)?, n })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_meets_both_ends_in_either_direction() {
        let values =
            |text: &str| text.parse::<SweepArgument>().map(|s| s.resolve((0.0, 10.0), None).ok());
        assert_eq!(values("1:3:3"), Ok(Some(vec![1.0, 2.0, 3.0])));
        assert_eq!(values("100%:0%:2"), Ok(Some(vec![10.0, 0.0])));
        assert_eq!(values("1:11:3"), Ok(None));
        for wrong in ["", "1:2", "1:2:1", "1:2:x", "1:2:3:4", "a:2:3", "1:2:100001"] {
            assert!(wrong.parse::<SweepArgument>().is_err(), "{wrong}");
        }
    }
}
