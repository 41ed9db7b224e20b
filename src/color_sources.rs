//! Data for colours that need volumes: the only module that combines drawing with samples.

use std::sync::Arc;

use crate::color::{Color, ColorSources, DistanceTo, KnotValues};
use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::Spectrum;
use crate::verify;
use crate::volume::{Placement, Volume};

/// The values of a volume at the knots of a spectrum, each at its position in the world ([`Volume::field_in`]).
///
/// # Errors
///
/// [`Error::Input`] if no knot is inside the volume.
pub fn field(spectrum: &Spectrum, volume: &Volume) -> Result<KnotValues> {
    let field = partial_field(spectrum, volume);
    if !spectrum.knots().is_empty() && field.values.iter().all(|x| x.is_nan()) {
        return Err(Error::Input(format!(
            "{}: contains none of the surfaces, expected a volume that overlaps {} in the world",
            volume.name(),
            spectrum.volume().name
        )));
    }
    let (own, other) = (spectrum.volume(), volume.placement());
    let is_placed = [own.placement, *other].iter().any(|&p| p != Placement::IDENTITY);
    if !is_placed && own.dims != volume.dims() {
        log::warn!(
            "{}: {:?} samples, {} has {:?}, and neither says where it is: sample (0, 0, 0) is taken to be the same place in both",
            volume.name(),
            volume.dims(),
            own.name,
            own.dims
        );
    }
    Ok(field)
}

/// As [`field`], for a part of a spectrum, which may be entirely outside of the volume.
pub(crate) fn partial_field(spectrum: &Spectrum, volume: &Volume) -> KnotValues {
    let own = spectrum.volume();
    KnotValues::sampled(spectrum, volume.name(), volume.field_in(own.dims, &own.placement))
}

/// The distance to the isosurfaces of the volume of a spectrum ([`verify::distance`]).
pub fn distance(volume: Arc<Volume>) -> DistanceTo {
    DistanceTo::new(move |isovalue, point, normal| {
        verify::distance(&volume, isovalue, point, normal)
    })
}

/// The data that `color` needs: the values of a second volume, if there is one, and for the distance the volume of the
/// spectrum as it was swept ([`swept_volume`]). `volume_hint` says in the error how a user provides the latter.
///
/// # Errors
///
/// [`Error::Usage`] for [`Color::Distance`] without the volume; those of [`field`].
pub fn sources(
    spectrum: &Spectrum,
    color: Color,
    field_volume: Option<&Volume>,
    volume: Option<&Volume>,
    volume_hint: &str,
) -> Result<ColorSources> {
    let mut sources = ColorSources::default();
    if let Some(volume) = field_volume {
        sources = sources.with_field(field(spectrum, volume)?);
    }
    if color == Color::Distance {
        let volume = volume.ok_or_else(|| {
            Error::Usage(format!("color distance needs the volume of the spectrum: {volume_hint}"))
        })?;
        sources.distance = Some(distance(Arc::new(volume.clone())));
    }
    Ok(sources)
}

/// The volume of a spectrum as it was swept: prepared by the spectrum's parameters.
///
/// # Errors
///
/// Those of [`Prepared::again`], and [`Error::Input`] for a volume of other dimensions.
pub fn swept_volume(volume: Volume, spectrum: &Spectrum) -> Result<Volume> {
    let volume = Prepared::again(volume, spectrum)?;
    let (found, expected) = (volume.dims(), spectrum.volume().dims);
    if found == expected {
        return Ok(volume);
    }
    Err(Error::Input(format!(
        "{}: {found:?} samples, expected {expected:?} as the spectrum's volume has",
        volume.name()
    )))
}
