//! A volume that is ready for the sweep, and what was done to it: the whole way from samples to a spectrum that tells how it
//! came about, as the program goes it.
//!
//! # Invariants
//!
//! What is done to a volume stands in the parameters of its spectrum (`preparation`, `simplification`, `dust`, and what is
//! known of the samples), so whoever has the volume can do it again ([`Prepared::again`]) and verify the spectrum against the result.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::kernels::Backend;
use crate::progress::Progress;
use crate::spectrum::Spectrum;
use crate::sweep::{Parameters, compute};
use crate::topology::dust::{DUST_METHOD, Dust, without_dust};
use crate::topology::simplify::{METHOD, Simplification, simplified, simplify};
use crate::volume::{Preparation, Statistics, Volume};

/// A volume after all that is done to it before the sweep.
///
/// ```
/// use isospectrum::{Backend, Choice};
/// use isospectrum::{Counts, Isovalue, Noise, Parameters, Preparation, Prepared, Silent, volume::phantom};
///
/// let halved = Preparation { downsample: Some(2), ..Preparation::default() };
/// let prepared = Prepared::new(phantom("sphere:16")?, halved, Noise { persistence: Some(0.01), ..Noise::default() })?;
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = prepared.compute(&Parameters::default(), &backend, &Silent)?;
/// // Isovalues may be written by what the spectrum knows of the samples.
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
}

/// Which noise is taken out of a volume once it is prepared.
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
    /// No extremum is left that is closer than this to the saddle that ends it, a difference of samples: see [`simplify`].
    pub persistence: Option<f64>,
    /// Parts and cavities go that never have so many samples before they meet a larger one: see [`without_dust`].
    pub min_component: Option<u32>,
}

/// What was taken out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cleaned {
    /// By persistence, where that was wanted.
    pub simplification: Option<Simplification>,
    /// By size, where that was wanted.
    pub dust: Option<Dust>,
}

impl Noise {
    /// The volume without the noise, and what went: first by size, then by persistence, which smooths what dust was
    /// flattened to, and of which nothing is left then. What that made too small again is counted.
    ///
    /// # Errors
    ///
    /// Those of [`simplify`] and [`without_dust`].
    pub fn take_out(self, volume: Volume) -> Result<(Volume, Cleaned)> {
        let (mut volume, mut cleaned) = (volume, Cleaned::default());
        if let Some(voxels) = self.min_component {
            let (left, done) = without_dust(&volume, voxels)?;
            (volume, cleaned.dust) = (left, Some(done));
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
    /// Prepares a volume, and takes noise out of it.
    ///
    /// # Errors
    ///
    /// Those of [`Preparation::apply`] and [`Noise::take_out`].
    pub fn new(volume: Volume, preparation: Preparation, noise: Noise) -> Result<Prepared> {
        let (volume, cleaned) = noise.take_out(preparation.apply(volume)?)?;
        Ok(Prepared::of(volume, preparation, cleaned))
    }

    /// What is ready already, with what was done to it.
    pub fn of(volume: Volume, preparation: Preparation, cleaned: Cleaned) -> Prepared {
        let samples = Statistics::of(&volume);
        Prepared { volume: Arc::new(volume), preparation, cleaned, samples }
    }

    /// The volume that a spectrum is exact for, made anew of the one it was computed from.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the spectrum says what this version does not know; those of
    /// [`Prepared::new`].
    pub fn again(volume: Volume, spectrum: &Spectrum) -> Result<Volume> {
        let volume = volume.with_outside(spectrum.volume().outside);
        let told = spectrum.parameters();
        let volume = spectrum.preparation()?.apply(volume)?;
        let has_method = |of: &str, known: u32| {
            let method = told.number(&format!("/{of}/method"));
            let is_known = !told.has(&format!("/{of}")) || method == Some(known.into());
            is_known.then_some(()).ok_or_else(|| Error::input(
                "the spectrum's noise was taken out in a way that this version does not know, expected one computed by this version",
            ))
        };
        has_method("simplification", METHOD)?;
        has_method("dust", DUST_METHOD)?;
        let volume = match told.number("/dust/voxels") {
            Some(voxels) => without_dust(&volume, voxels as u32)?.0,
            None => volume,
        };
        match told.number("/simplification/persistence") {
            Some(persistence) => simplified(&volume, persistence),
            None => Ok(volume),
        }
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// What was done to it.
    pub fn preparation(&self) -> &Preparation {
        &self.preparation
    }

    /// What is known of its samples: what isovalues are written by.
    pub fn samples(&self) -> &Statistics {
        &self.samples
    }

    /// Which noise was taken out.
    pub fn cleaned(&self) -> &Cleaned {
        &self.cleaned
    }

    /// The spectrum of the volume, which tells what was done to it.
    ///
    /// # Errors
    ///
    /// Those of [`compute`].
    pub fn compute(
        &self,
        parameters: &Parameters,
        backend: &Backend,
        progress: &dyn Progress,
    ) -> Result<Spectrum> {
        let mut spectrum = compute(&self.volume, parameters, backend, progress)?;
        self.tell(&mut spectrum);
        Ok(spectrum)
    }

    /// Tells a spectrum of the volume what was done to it.
    fn tell(&self, spectrum: &mut Spectrum) {
        for (name, what) in self.told() {
            spectrum.about_mut().parameters.tell(&name, what);
        }
        self.cap(spectrum);
    }

    /// What a spectrum's parameters tell of what was done to the volume, and of its samples.
    pub(crate) fn told(&self) -> serde_json::Map<String, serde_json::Value> {
        let mut told = serde_json::Map::new();
        let mut tell = |name: &str, what| told.insert(name.to_owned(), what);
        if !self.preparation.is_none() {
            tell("preparation", serde_json::json!(self.preparation));
        }
        if let Some(done) = &self.cleaned.simplification {
            tell("simplification", serde_json::json!(done));
        }
        if let Some(done) = &self.cleaned.dust {
            tell("dust", serde_json::json!(done));
        }
        // Isovalues are written by them, and the volume is not there any more then.
        tell(Statistics::NAME, serde_json::json!(self.samples));
        told
    }

    /// Makes caps of what lies beyond the volume's mask.
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
    fn a_spectrum_of_a_prepared_volume_is_verified_against_the_volume_as_it_was() {
        let volume = phantom("gyroid:12").expect("a phantom");
        // A ball that is not in the middle.
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
        let sampling = Sampling { n_random: 4, n_events: 1, seed: 0 };
        let found = verify(&spectrum, &again, sampling, Limits::default(), &Silent);
        let found = found.expect("the same volume");
        assert_eq!(found.totals.topology_right, found.totals.isovalues);
    }
}
