//! `120=bone`: an isovalue with a name, which is offered to who looks.

use std::str::FromStr;

use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;

/// An isovalue and what it shows.
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

/// The isovalues of marks in a spectrum, by what is known of the samples, and their names.
///
/// # Errors
///
/// [`Error::Usage`] where the samples are needed and not known, [`Error::Range`] outside the spectrum's range.
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
    fn a_mark_is_named_or_its_own_name() {
        let read = |text: &str| text.parse::<Mark>().map(|mark| (mark.isovalue, mark.name)).ok();
        assert_eq!(read("120=bone"), Some((Isovalue::Absolute(120.0), "bone".into())));
        assert_eq!(read("-4= water "), Some((Isovalue::Absolute(-4.0), "water".into())));
        assert_eq!(read("50%"), Some((Isovalue::Percent(50.0), "50%".into())));
        assert_eq!(read("bone=120"), None);
    }
}
