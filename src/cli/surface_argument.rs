//! `40=skin@0.3`: an isovalue with the colour and opacity of its surface.

use std::str::FromStr;

use isospectrum::render::{Surface, linear};
use isospectrum::spectrum::Spectrum;
use isospectrum::volume::Statistics;
use isospectrum::{Error, Result};

use super::isovalue::Isovalue;

/// Colours by name (sRGB).
const NAMED: [(&str, u32); 12] = [
    ("blue", 0x85a9cd),
    ("orange", 0xd9a46c),
    ("green", 0x5fae84),
    ("pink", 0xd184b4),
    ("yellow", 0xe0c95a),
    ("red", 0xc8503c),
    ("violet", 0x8c7ac2),
    ("white", 0xf2f2f2),
    ("grey", 0xa0a4aa),
    ("bone", 0xe8dcc0),
    ("skin", 0xe0b090),
    ("muscle", 0xb0564a),
];

/// `C[=COLOR][@OPACITY]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceArgument {
    isovalue: Isovalue,
    color: Option<u32>,
    opacity: Option<f32>,
}

impl SurfaceArgument {
    /// Resolves the surface for a spectrum.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] if the isovalue needs statistics of the samples that the spectrum does not have.
    pub(super) fn in_spectrum(self, spectrum: &Spectrum) -> Result<Surface> {
        self.resolve(spectrum.range(), spectrum.statistics().as_ref())
    }

    /// Resolves the surface for a range, with statistics of the samples if known.
    ///
    /// # Errors
    ///
    /// As [`SurfaceArgument::in_spectrum`].
    pub(super) fn resolve(
        self,
        range: (f64, f64),
        samples: Option<&Statistics>,
    ) -> Result<Surface> {
        Ok(Surface {
            isovalue: self.isovalue.resolve(range, samples)?,
            color: self.color.map(linear),
            opacity: self.opacity,
        })
    }
}

impl FromStr for SurfaceArgument {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (rest, opacity) = match text.split_once('@') {
            Some((rest, opacity)) => (rest, Some(opacity_of(opacity)?)),
            None => (text, None),
        };
        let (written, color) = match rest.split_once('=') {
            Some((written, color)) => (written, Some(color_of(color)?)),
            None => (rest, None),
        };
        Ok(SurfaceArgument { isovalue: written.parse()?, color, opacity })
    }
}

fn opacity_of(text: &str) -> Result<f32> {
    let opacity = text.trim().parse().ok().filter(|x| (0.0..=1.0).contains(x));
    opacity.ok_or_else(|| Error::Usage(format!("opacity '{text}', expected 0 to 1")))
}

fn color_of(text: &str) -> Result<u32> {
    let text = text.trim();
    if let Some((_, code)) = NAMED.iter().find(|(name, _)| *name == text) {
        return Ok(*code);
    }
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6);
    digits.and_then(|d| u32::from_str_radix(d, 16).ok()).ok_or_else(|| {
        let names = NAMED.map(|(name, _)| name).join(", ");
        Error::Usage(format!("colour '{text}', expected #rrggbb or one of {names}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_isovalue_may_have_a_color_and_an_opacity() {
        let of = |text: &str| {
            let read = text.parse::<SurfaceArgument>().ok()?;
            Some((read.isovalue, read.color, read.opacity))
        };
        assert_eq!(of("37.5"), Some((Isovalue::Absolute(37.5), None, None)));
        assert_eq!(of("50%@0.25"), Some((Isovalue::Percent(50.0), None, Some(0.25))));
        assert_eq!(of("-4=bone"), Some((Isovalue::Absolute(-4.0), Some(0x00e8_dcc0), None)));
        let all = Some((Isovalue::Percentile(99.0), Some(0x0001_02ff), Some(1.0)));
        assert_eq!(of("top:1%=#0102ff@1"), all);
        for wrong in ["", "=bone", "5=ruby", "5=#12", "5@2", "5@", "@0.5", "5=#12345g"] {
            assert_eq!(of(wrong), None, "{wrong}");
        }
    }
}
