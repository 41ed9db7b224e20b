//! What colours are had from, out of volumes: the only place where what is drawn and samples meet.

use std::sync::Arc;

use crate::color::{Color, DistanceTo, KnotValues, Sources};
use crate::error::{Error, Result};
use crate::prepared::Prepared;
use crate::spectrum::Spectrum;
use crate::verify;
use crate::volume::Volume;

/// The values of a volume at the knots of a spectrum, each at its place in the world ([`Volume::field_in`]).
///
/// # Errors
///
/// [`Error::Input`] where the volume reaches none of the knots.
pub fn field(spectrum: &Spectrum, volume: &Volume) -> Result<KnotValues> {
    let values = values(spectrum, volume);
    if !spectrum.knots().is_empty() && values.values.iter().all(|x| x.is_nan()) {
        return Err(Error::Input(format!(
            "{}: it lies beside the surfaces, expected a volume in the same place of the world as {}",
            volume.name(),
            spectrum.volume().name
        )));
    }
    Ok(values)
}

/// As [`field`], of which the volume need not reach any: of a part of a spectrum.
pub(crate) fn values(spectrum: &Spectrum, volume: &Volume) -> KnotValues {
    let own = spectrum.volume();
    KnotValues::sampled(spectrum, volume.name(), volume.field_in(own.dims, &own.placement))
}

/// The distance to the isosurfaces of the volume of a spectrum ([`verify::distance`]).
pub fn distance(volume: Arc<Volume>) -> DistanceTo {
    DistanceTo::new(move |isovalue, point, normal| {
        verify::distance(&volume, isovalue, point, normal)
    })
}

/// What a colour is had from: the values of a second volume where there is one, and for the distance the volume of the spectrum as
/// it was for the sweep ([`volume_of`]), of which `how` says how it is told.
///
/// # Errors
///
/// [`Error::Usage`] for a distance without the volume; those of [`field`].
pub fn of(
    spectrum: &Spectrum,
    color: Color,
    by: Option<&Volume>,
    (volume, how): (Option<&Volume>, &str),
) -> Result<Sources> {
    let mut found = Sources::default();
    if let Some(by) = by {
        found = found.with_field(field(spectrum, by)?);
    }
    if color == Color::Distance {
        let what =
            || Error::Usage(format!("color distance needs the volume of the spectrum: {how}"));
        found.distance = Some(distance(Arc::new(volume.ok_or_else(what)?.clone())));
    }
    Ok(found)
}

/// The volume of a spectrum, as it was for the sweep.
///
/// # Errors
///
/// Those of [`Prepared::again`], and [`Error::Input`] for one of other dimensions.
pub fn volume_of(volume: Volume, spectrum: &Spectrum) -> Result<Volume> {
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
