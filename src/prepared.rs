//! A volume that is ready for the sweep, with a record of its preparation.
//!
//! # Invariants
//!
//! Every step of the preparation is recorded in the metadata of the spectrum (`preparation`, `simplification`, `dust`, and the statistics
//! of the samples). Whoever has the original volume can repeat the steps ([`Prepared::again`]) and verify the spectrum against the
//! result.

use std::sync::{Arc, Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::forecast::Forecast;
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::sweep::{Parameters, compute_known};
use crate::topology::Topology;
use crate::topology::dust::{DUST_METHOD, Dust, without_dust};
use crate::topology::exact::ExactField;
use crate::topology::simplify::{METHOD, Simplification, simplified, simplify};
use crate::volume::{Preparation, Statistics, Volume};

/// A volume that is ready for the sweep, with a record of its preparation.
///
/// ```
/// use isospectrum::{Backend, Choice};
/// use isospectrum::{Counts, Isovalue, Noise, Parameters, Preparation, Prepared, Silent, volume::phantom};
///
/// let halved = Preparation { downsample: Some(2), ..Preparation::default() };
/// let prepared = Prepared::new(phantom("sphere:16")?, halved, Noise { persistence: Some(0.01), ..Noise::default() })?;
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = prepared.compute(&Parameters::default(), &backend, &Silent)?;
/// // The spectrum keeps the statistics of the samples, to which percentiles refer.
/// let isovalue = "p90".parse::<Isovalue>()?.resolve(spectrum.range(), spectrum.statistics().as_ref())?;
/// println!("{} triangles", spectrum.mesh_at(isovalue)?.triangles.len());
/// assert!(Counts::of(&spectrum).is_some_and(|counts| counts.steps > 0));
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Prepared {
    volume: Arc<Volume>,
    preparation: Preparation,
    cleaned: Cleaned,
    samples: Statistics,
    /// The topology from a forecast, for the sweep that follows.
    topology: Arc<Mutex<Option<Topology>>>,
}

/// Removal of noise from a prepared volume.
///
/// ```
/// use isospectrum::{Noise, volume::phantom};
///
/// let noise = Noise { persistence: Some(0.2), ..Noise::default() };
/// let (volume, cleaned) = noise.take_out(phantom("noise:8:1")?)?;
/// assert_eq!(volume.dims(), [8; 3]);
/// assert!(cleaned.simplification.is_some() && cleaned.dust.is_none());
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Removes minima and maxima whose persistence is below this difference of samples: see [`simplify`].
    pub persistence: Option<f64>,
    /// Removes components and cavities that never have this many samples before they merge with a larger one: see [`without_dust`].
    pub min_component: Option<u32>,
}

/// Record of the noise that was removed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cleaned {
    /// Removal by persistence, if requested.
    pub simplification: Option<Simplification>,
    /// Removal by size, if requested.
    pub dust: Option<Dust>,
}

impl Noise {
    /// Removes noise from a volume, first by size, then by persistence, which also smooths the plateaus left where small components
    /// were. Components that fall below the size again by that are counted ([`Dust::left`]), not removed.
    ///
    /// # Errors
    ///
    /// Those of [`simplify`] and [`without_dust`].
    pub fn take_out(self, volume: Volume) -> Result<(Volume, Cleaned)> {
        let (mut volume, mut cleaned) = (volume, Cleaned::default());
        if let Some(voxels) = self.min_component {
            let (cleared, done) = without_dust(&volume, voxels)?;
            (volume, cleaned.dust) = (cleared, Some(done));
        }
        if let Some(persistence) = self.persistence {
            let (simplified, done) = simplify(&volume, persistence)?;
            (volume, cleaned.simplification) = (simplified, Some(done));
            if let Some(dust) = &mut cleaned.dust {
                let again = without_dust(&volume, dust.voxels)?.1;
                dust.left = again.parts + again.cavities;
            }
        }
        Ok((volume, cleaned))
    }
}

impl Prepared {
    /// Prepares a volume and removes noise from it.
    ///
    /// # Errors
    ///
    /// Those of [`Preparation::apply`] and [`Noise::take_out`].
    pub fn new(volume: Volume, preparation: Preparation, noise: Noise) -> Result<Prepared> {
        let (volume, cleaned) = noise.take_out(preparation.apply(volume)?)?;
        Ok(Prepared::of(volume, preparation, cleaned))
    }

    /// A volume that has been prepared already, with the record of that.
    pub fn of(volume: Volume, preparation: Preparation, cleaned: Cleaned) -> Prepared {
        let samples = Statistics::of(&volume);
        let topology = Arc::default();
        Prepared { volume: Arc::new(volume), preparation, cleaned, samples, topology }
    }

    /// Repeats the preparation recorded in a spectrum on the original volume; returns the volume for which the spectrum is exact.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the spectrum records a step unknown to this version; those of [`Prepared::new`].
    pub fn again(volume: Volume, spectrum: &Spectrum) -> Result<Volume> {
        let volume = volume.with_outside(spectrum.volume().outside);
        let metadata = spectrum.parameters();
        let volume = spectrum.preparation()?.apply(volume)?;
        let has_method = |of: &str, known: u32| {
            let method = metadata.number(&format!("/{of}/method"));
            let is_known = !metadata.has(&format!("/{of}")) || method == Some(known.into());
            is_known.then_some(()).ok_or_else(|| Error::input(
                "the spectrum's noise was removed by a method unknown to this version, expected a spectrum computed by this version",
            ))
        };
        has_method("simplification", METHOD)?;
        has_method("dust", DUST_METHOD)?;
        let volume = match metadata.number("/dust/voxels") {
            Some(voxels) => without_dust(&volume, voxels as u32)?.0,
            None => volume,
        };
        match metadata.number("/simplification/persistence") {
            Some(persistence) => simplified(&volume, persistence),
            None => Ok(volume),
        }
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// Its preparation.
    pub fn preparation(&self) -> &Preparation {
        &self.preparation
    }

    /// Statistics of its samples, to which percentiles and sigmas refer.
    pub fn samples(&self) -> &Statistics {
        &self.samples
    }

    /// The noise that was removed.
    pub fn cleaned(&self) -> &Cleaned {
        &self.cleaned
    }

    /// Computes the spectrum of the volume, with the preparation in its metadata.
    ///
    /// # Errors
    ///
    /// Those of [`compute`](crate::sweep::compute).
    pub fn compute(
        &self,
        parameters: &Parameters,
        backend: &Backend,
        progress: &dyn Progress,
    ) -> Result<Spectrum> {
        let known = self.topology.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut spectrum = compute_known(&self.volume, parameters, backend, progress, known)?;
        for (key, value) in self.metadata() {
            spectrum.about_mut().parameters.insert(&key, value);
        }
        self.cap(&mut spectrum);
        Ok(spectrum)
    }

    /// The forecast for a range of isovalues and a tolerance. The next computation need not find the topology again.
    ///
    /// # Errors
    ///
    /// Those of [`Forecast::of_volume`].
    pub(crate) fn forecast(&self, range: (f64, f64), error: f64) -> Result<Forecast> {
        let field = ExactField::new(&self.volume)?;
        let topology = Topology::compute(&field)?;
        let forecast = Forecast::of(&field, &topology, range, error);
        *self.topology.lock().unwrap_or_else(PoisonError::into_inner) = Some(topology);
        Ok(forecast)
    }

    /// Entries for the metadata of a spectrum: the preparation, and the statistics of the samples.
    pub(crate) fn metadata(&self) -> serde_json::Map<String, serde_json::Value> {
        let mut metadata = serde_json::Map::new();
        let mut insert = |key: &str, value| metadata.insert(key.to_owned(), value);
        if !self.preparation.is_none() {
            insert("preparation", serde_json::json!(self.preparation));
        }
        if let Some(done) = &self.cleaned.simplification {
            insert("simplification", serde_json::json!(done));
        }
        if let Some(done) = &self.cleaned.dust {
            insert("dust", serde_json::json!(done));
        }
        insert(Statistics::NAME, serde_json::json!(self.samples));
        metadata
    }

    /// Marks the triangles beyond the volume's mask as caps.
    pub(crate) fn cap(&self, spectrum: &mut Spectrum) {
        if self.volume.mask().is_some() {
            spectrum.cap_where(|p| self.volume.is_masked_out(p));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Choice;
    use crate::progress::Silent;
    use crate::verify::{Limits, Sampling, verify};
    use crate::volume::{Mask, Placement, Samples, phantom};

    #[test]
    fn a_spectrum_of_a_prepared_volume_is_verified_against_the_original_volume() {
        let volume = phantom("gyroid:12").expect("a phantom");
        // A ball off the centre.
        let from = |i: usize, middle: i64| (i as i64 - middle).pow(2);
        let is_in = |i: usize| from(i % 12, 4) + from(i / 12 % 12, 6) + from(i / 144, 5) < 20;
        let inside = (0..1728).map(|i| u8::from(is_in(i))).collect();
        let mask = Volume::new("mask", [12; 3], Samples::U8(inside), Placement::default());
        let mask = Mask::of(&mask.expect("a mask")).record().expect("small");
        let crop = Some([[0, 9], [1, 11], [0, 12]]);
        let preparation = Preparation { crop, mask: Some(mask), ..Default::default() };
        let noise = Noise { persistence: Some(0.2), min_component: Some(10) };
        let prepared = Prepared::new(volume.clone(), preparation, noise).expect("prepared");
        assert_eq!(prepared.volume().dims(), [9, 10, 12]);
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let parameters = Parameters { range: Some((-0.2, 0.2)), ..Parameters::default() };
        let spectrum = prepared.compute(&parameters, &backend, &Silent).expect("a spectrum");
        assert_eq!(spectrum.statistics().as_ref(), Some(prepared.samples()));
        let again = Prepared::again(volume, &spectrum).expect("as it was");
        assert_eq!(again.samples(), prepared.volume().samples());
        let sampling = Sampling { n_random: 4, n_events: 1, seed: 0, ..Sampling::default() };
        let found = verify(&spectrum, &again, sampling, Limits::default(), &Silent);
        let found = found.expect("the same volume");
        assert_eq!(found.totals.topology_right, found.totals.isovalues);
    }
}
