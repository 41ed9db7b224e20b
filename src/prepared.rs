//! A volume that is ready for the sweep, and what was done to it: the whole way from samples to a spectrum that tells how it
//! came about, as the program goes it.
//!
//! # Invariants
//!
//! What is done to a volume stands in the parameters of its spectrum (`preparation`, `simplification`, and what is known of
//! the samples), so whoever has the volume can do it again ([`Prepared::again`]) and verify the spectrum against the result.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::kernels::Backend;
use crate::spectrum::Spectrum;
use crate::sweep::{Parameters, Progress, compute};
use crate::topology::simplify::{METHOD, Simplification, simplified, simplify};
use crate::volume::{Preparation, Statistics, Volume};

/// A volume after all that is done to it before the sweep.
///
/// ```
/// use isospectrum::kernels::{Backend, Choice};
/// use isospectrum::{Counts, Isovalue, Parameters, Preparation, Prepared, Silent, volume::phantom};
///
/// let halved = Preparation { downsample: Some(2), ..Preparation::default() };
/// let prepared = Prepared::new(phantom("sphere:16")?, halved, Some(0.01))?;
/// let backend = Backend::choose(Choice::Cpu, None)?;
/// let spectrum = prepared.compute(&Parameters::default(), &backend, &Silent)?;
/// // Isovalues may be written by what the spectrum knows of the samples.
/// let isovalue = "p90".parse::<Isovalue>()?.resolve(spectrum.range, spectrum.statistics().as_ref())?;
/// println!("{} triangles", spectrum.mesh_at(isovalue)?.triangles.len());
/// assert!(Counts::of(&spectrum).is_some_and(|counts| counts.steps > 0));
/// # Ok::<(), isospectrum::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Prepared {
    volume: Arc<Volume>,
    preparation: Preparation,
    simplification: Option<Simplification>,
    samples: Statistics,
}

impl Prepared {
    /// Prepares a volume, and takes noise out of it where `persistence` (a difference of samples) says so.
    ///
    /// # Errors
    ///
    /// Those of [`Preparation::apply`] and [`simplify`].
    pub fn new(
        volume: Volume,
        preparation: Preparation,
        persistence: Option<f64>,
    ) -> Result<Prepared> {
        let volume = preparation.apply(volume)?;
        let (volume, simplification) = match persistence {
            Some(persistence) => {
                let (volume, done) = simplify(&volume, persistence)?;
                (volume, Some(done))
            }
            None => (volume, None),
        };
        Ok(Prepared::of(volume, preparation, simplification))
    }

    /// What is ready already, with what was done to it.
    pub fn of(
        volume: Volume,
        preparation: Preparation,
        simplification: Option<Simplification>,
    ) -> Prepared {
        let samples = Statistics::of(&volume);
        Prepared { volume: Arc::new(volume), preparation, simplification, samples }
    }

    /// The volume that a spectrum is exact for, made anew of the one it was computed from.
    ///
    /// # Errors
    ///
    /// [`Error::Input`] if the spectrum says what this version does not know; those of
    /// [`Prepared::new`].
    pub fn again(volume: Volume, spectrum: &Spectrum) -> Result<Volume> {
        let volume = volume.with_outside(spectrum.volume.outside);
        let parameters = &spectrum.parameters;
        let volume = Preparation::of_parameters(parameters)?.apply(volume)?;
        let said = |name: &str| parameters.pointer(&format!("/simplification/{name}"));
        let method = said("method").and_then(serde_json::Value::as_u64);
        match said("persistence").and_then(serde_json::Value::as_f64) {
            Some(_) if method != Some(METHOD.into()) => Err(Error::input(
                "the spectrum's noise was taken out in a way that this version does not know, expected one computed by this version",
            )),
            Some(persistence) => simplified(&volume, persistence),
            None => Ok(volume),
        }
    }

    /// The volume.
    pub fn volume(&self) -> &Arc<Volume> {
        &self.volume
    }

    /// What is known of its samples: what isovalues are written by.
    pub fn samples(&self) -> &Statistics {
        &self.samples
    }

    /// What was simplified, where that was wanted.
    pub fn simplification(&self) -> Option<&Simplification> {
        self.simplification.as_ref()
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
        if !self.preparation.is_none() {
            spectrum.parameters["preparation"] = serde_json::json!(self.preparation);
        }
        if let Some(done) = &self.simplification {
            spectrum.parameters["simplification"] = serde_json::json!(done);
        }
        // Isovalues are written by them, and the volume is not there any more then.
        spectrum.parameters[Statistics::NAME] = serde_json::json!(self.samples);
        Ok(spectrum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::Choice;
    use crate::sweep::Silent;
    use crate::verify::{Limits, Sampling, verify};
    use crate::volume::phantom;

    #[test]
    fn a_spectrum_of_a_prepared_volume_is_verified_against_the_volume_as_it_was() {
        let volume = phantom("gyroid:12").expect("a phantom");
        let preparation =
            Preparation { crop: Some([[0, 9], [1, 11], [0, 12]]), ..Default::default() };
        let prepared = Prepared::new(volume.clone(), preparation, Some(0.2)).expect("prepared");
        assert_eq!(prepared.volume().dims(), [9, 10, 12]);
        let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
        let spectrum =
            prepared.compute(&Parameters::default(), &backend, &Silent).expect("a spectrum");
        assert_eq!(spectrum.statistics().as_ref(), Some(prepared.samples()));
        let again = Prepared::again(volume, &spectrum).expect("as it was");
        assert_eq!(again.samples(), prepared.volume().samples());
        let sampling = Sampling { n_random: 4, n_events: 1, seed: 0 };
        let found = verify(&spectrum, &again, sampling, Limits::default(), &mut |_| true);
        let found = found.expect("the same volume");
        assert_eq!(found.totals.topology_right, found.totals.isovalues);
    }
}
