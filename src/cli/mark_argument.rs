//! `120=bone`: an isovalue with a name, which a page or window offers.

use std::str::FromStr;

use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;

/// An isovalue and its name.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mark {
    isovalue: Isovalue,
    name: String,
}

impl FromStr for Mark {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (written, name) = text.split_once('=').unwrap_or((text, text));
        Ok(Mark { isovalue: written.parse()?, name: name.trim().to_owned() })
    }
}

/// Returns the isovalue and the name of each mark in a spectrum.
///
/// # Errors
///
/// [`Error::Usage`] if an isovalue needs statistics of the samples that are unknown, [`Error::Range`] outside the range.
pub(super) fn resolved(
    marks: &[Mark],
    spectrum: &Spectrum,
    samples: Option<&Statistics>,
) -> Result<Vec<(f64, String)>> {
    (marks.iter())
        .map(|mark| {
            let isovalue = mark.isovalue.resolve(spectrum.range(), samples)?;
            spectrum.check_isovalue(isovalue)?;
            Ok((isovalue, mark.name.clone()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_without_name_is_named_by_its_isovalue() {
        let read = |text: &str| text.parse::<Mark>().map(|mark| (mark.isovalue, mark.name)).ok();
        assert_eq!(read("120=bone"), Some((Isovalue::Absolute(120.0), "bone".into())));
        assert_eq!(read("-4= water "), Some((Isovalue::Absolute(-4.0), "water".into())));
        assert_eq!(read("50%"), Some((Isovalue::Percent(50.0), "50%".into())));
        assert_eq!(read("bone=120"), None);
    }
}
