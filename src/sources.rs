//! What colours are had from, out of volumes: the only place where what is drawn and samples meet.

use std::sync::Arc;

use crate::color::{DistanceTo, KnotValues};
use crate::error::{Error, Result};
use crate::spectrum::Spectrum;
use crate::verify;
use crate::volume::Volume;

/// The values of a volume at the knots of a spectrum, each at its place in the world ([`Volume::field_in`]).
///
/// # Errors
///
/// [`Error::Input`] where the volume reaches none of the knots.
pub fn field(spectrum: &Spectrum, volume: &Volume) -> Result<KnotValues> {
    let own = spectrum.volume();
    let value_at = volume.field_in(own.dims, &own.placement);
    let values = KnotValues::sampled(spectrum, volume.name(), value_at);
    if !spectrum.knots().is_empty() && values.values.iter().all(|x| x.is_nan()) {
        return Err(Error::Input(format!(
            "{}: it lies beside the surfaces, expected a volume in the same place of the world as {}",
            volume.name(),
            own.name
        )));
    }
    Ok(values)
}

/// The distance to the isosurfaces of the volume of a spectrum ([`verify::distance`]).
pub fn distance(volume: Arc<Volume>) -> DistanceTo {
    DistanceTo::new(move |isovalue, point, normal| {
        verify::distance(&volume, isovalue, point, normal)
    })
}
