//! The computation of a spectrum from a volume in memory.

use isospectrum::bricks::{
    self, BrickLimits, Parts, Plan, Strategy, Survey, VolumeSource, compute_parts,
};
use isospectrum::file::{self, TemporaryFolder};
use isospectrum::settings::{ByteSize, NoiseSettings};
use isospectrum::verify::{self, Remedy};
use isospectrum::{Error, Forecast, Parameters, Prepared, Progress, Result};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{PreparationArguments, parsed, preparation_settings, sweep_settings};
use crate::backend::Wanted;
use crate::spectrum::Spectrum;
use crate::threads::with_threads;
use crate::volume::Volume;
use crate::watch::watched;

/// Where the sweep runs and how it is cut.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ExecutionArguments {
    brick: Option<usize>,
    max_memory: Option<String>,
    max_triangles: Option<f64>,
    backend: String,
    adapter: Option<String>,
    threads: Option<usize>,
    /// True if the spectrum is verified, unless it is computed in bricks.
    check: bool,
}

/// Computes the spectrum of a volume. `parameters` holds the numeric fields of [`Parameters`] by name; `range` and `start` are
/// isovalues as texts. Returns the promises that do not hold, and what helps, too.
#[pyfunction]
#[pyo3(signature = (volume, parameters, range, start, preparation, execution, progress))]
#[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
pub(crate) fn compute(
    py: Python<'_>,
    volume: &Bound<'_, Volume>,
    parameters: &Bound<'_, PyDict>,
    range: Option<(String, String)>,
    start: Option<String>,
    preparation: PreparationArguments<'_>,
    execution: ExecutionArguments,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Spectrum, Option<String>)> {
    let sweep = sweep_settings(parameters, range, start)?;
    let noise = NoiseSettings {
        persistence: parsed("persistence", preparation.persistence.as_deref())?,
        min_component: preparation.min_component,
    };
    let max_memory: Option<ByteSize> = parsed("max_memory", execution.max_memory.as_deref())?;
    let preparation = preparation_settings(preparation)?;
    let volume = volume.get().0.clone();
    let ExecutionArguments { brick, backend, adapter, threads, check, max_triangles, .. } =
        execution;
    let backend = Wanted::new(&backend, adapter, volume.samples().len())?.open(py)?;
    let work = move |progress: &dyn Progress| {
        progress.report(0.0, "preparing");
        let preparation = preparation.resolve(&volume)?;
        let volume = preparation.apply(volume)?;
        let noise = noise.resolve(&volume);
        let (volume, cleaned) = noise.take_out(volume)?;
        let prepared = Prepared::of(volume, preparation, cleaned);
        let parameters = sweep.resolve(prepared.volume().range(), prepared.samples())?;
        let memory = max_memory.map(ByteSize::bytes);
        let limit = memory.unwrap_or(f64::INFINITY);
        let samples = prepared.volume().samples().n_bytes() as f64;
        if limit <= samples {
            return Err(Error::Usage(format!(
                "{}: its samples take {samples} bytes, expected a max_memory above that",
                prepared.volume().name()
            )));
        }
        let side = match (brick, memory) {
            (Some(side), _) => Some(side),
            (None, Some(memory)) => brick_side(&prepared, &parameters, memory)?,
            (None, None) => None,
        };
        let Some(side) = side else {
            check_triangles(&prepared, &parameters, max_triangles)?;
            let spectrum = rounded(prepared.compute(&parameters, &backend, progress)?)?;
            let broken = if check { broken(&spectrum, prepared.volume(), progress)? } else { None };
            return Ok((spectrum, broken));
        };
        let name = prepared.volume().name().to_owned();
        let survey = Survey::of(prepared);
        let plan = Plan::new(VolumeSource::Given { name }, &survey, noise, &parameters, side)?;
        let work = TemporaryFolder::next_to(&std::env::temp_dir().join("isospectrum"))?;
        let parts = Parts::new(&plan, work.path());
        let limits =
            BrickLimits { memory: limit - samples, in_memory: true, triangles: max_triangles };
        compute_parts(&parts, survey.volume(), &backend, limits, progress)?;
        Ok((rounded(bricks::merge(&parts, survey.volume(), progress)?)?, None))
    };
    let made = watched(py, progress, move |watched| with_threads(threads, || work(watched)))?;
    Ok((Spectrum::new(made.0), made.1))
}

/// Refuses a volume whose spectrum is expected to have more triangles than allowed.
fn check_triangles(prepared: &Prepared, parameters: &Parameters, most: Option<f64>) -> Result<()> {
    let Some(most) = most else { return Ok(()) };
    let Strategy::Whole(Forecast { triangles, .. }) = Strategy::choose(prepared, parameters, None)?
    else {
        return Ok(());
    };
    if triangles <= most {
        return Ok(());
    }
    Err(Error::Usage(format!(
        "{}: about {triangles:.1e} triangles expected, more than max_triangles {most:.1e}; error=0.2 makes larger triangles, \
         persistence=\"5%\" takes noise out, range takes a part",
        prepared.volume().name()
    )))
}

/// The promises that a spectrum does not keep, or may not keep at other isovalues, as the program's `compute` prints them; none if it keeps all.
fn broken(
    spectrum: &isospectrum::Spectrum,
    volume: &isospectrum::Volume,
    progress: &dyn Progress,
) -> Result<Option<String>> {
    let found = verify::check(spectrum, volume, &Unreported(progress))?;
    let Some(summary) = found.summary() else { return Ok(None) };
    let advice = match found.remedy {
        Remedy::None => "please report this volume",
        Remedy::Smoothing => "the samples have two values only: smooth=0.5 helps",
        Remedy::SmoothingOrTolerance => "smooth=0.5 or a larger error may help",
    };
    Ok(Some(format!("{}: {summary}; {advice}", volume.name())))
}

/// Work that can be cancelled and reports no progress, after work that has reported all of it.
struct Unreported<'a>(&'a dyn Progress);

impl Progress for Unreported<'_> {
    fn report(&self, _done: f64, _message: &str) {}

    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}

/// The spectrum as its file would hold it, so that its meshes are the same before it is saved and after.
pub(crate) fn rounded(spectrum: isospectrum::Spectrum) -> Result<isospectrum::Spectrum> {
    file::in_file_order(&spectrum.quantised())
}

/// The side of the bricks, if the volume has to be cut to stay within the memory.
fn brick_side(prepared: &Prepared, parameters: &Parameters, memory: f64) -> Result<Option<usize>> {
    match Strategy::choose(prepared, parameters, Some(memory))? {
        Strategy::Bricks { side, .. } => Ok(Some(side)),
        Strategy::Whole(forecast) if forecast.memory > memory => Err(Error::Usage(format!(
            "{}: about {:.0} bytes of memory expected, and it cannot be cut into bricks, expected a max_memory above that",
            prepared.volume().name(),
            forecast.memory
        ))),
        Strategy::Whole(_) => Ok(None),
    }
}
