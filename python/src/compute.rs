//! The computation of a spectrum from a volume in memory.

use isospectrum::bricks::{
    self, BrickLimits, Parts, Plan, Strategy, Survey, VolumeSource, compute_parts,
};
use isospectrum::file::{self, TemporaryFolder};
use isospectrum::settings::{ByteSize, NoiseSettings, useful_threads};
use isospectrum::{Backend, Error, Parameters, Prepared, Progress, Result};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arguments::{
    PreparationArguments, choice_of, parsed, preparation_settings, sweep_settings,
};
use crate::spectrum::Spectrum;
use crate::volume::Volume;
use crate::watch::watched;

/// Where the sweep runs and how it is cut.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct ExecutionArguments {
    brick: Option<usize>,
    max_memory: Option<String>,
    backend: String,
    adapter: Option<String>,
    threads: Option<usize>,
}

/// Computes the spectrum of a volume. `parameters` holds the numeric fields of [`Parameters`] by name; `range` and `start` are
/// isovalues as texts.
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
) -> PyResult<Spectrum> {
    let sweep = sweep_settings(parameters, range, start)?;
    let choice = choice_of(&execution.backend)?;
    let noise = NoiseSettings {
        persistence: parsed("persistence", preparation.persistence.as_deref())?,
        min_component: preparation.min_component,
    };
    let max_memory: Option<ByteSize> = parsed("max_memory", execution.max_memory.as_deref())?;
    let preparation = preparation_settings(preparation)?;
    let volume = volume.get().0.clone();
    let ExecutionArguments { brick, adapter, threads, .. } = execution;
    let work = move |progress: &dyn Progress| {
        let backend = Backend::choose(choice, adapter.as_deref())?;
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
            return rounded(prepared.compute(&parameters, &backend, progress)?);
        };
        let name = prepared.volume().name().to_owned();
        let survey = Survey::of(prepared);
        let plan = Plan::new(VolumeSource::Given { name }, &survey, noise, &parameters, side)?;
        let work = TemporaryFolder::next_to(&std::env::temp_dir().join("isospectrum"))?;
        let parts = Parts::new(&plan, work.path());
        let limits = BrickLimits { memory: limit - samples, one_file: true, triangles: None };
        compute_parts(&parts, survey.volume(), &backend, limits, progress)?;
        rounded(bricks::merge(&parts, survey.volume(), progress)?)
    };
    let spectrum = watched(py, progress, move |watched| with_threads(threads, || work(watched)))?;
    Ok(Spectrum::new(spectrum))
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

/// Runs `work` on this many threads, or on all.
pub(crate) fn with_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let Some(n) = threads else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(useful_threads(n)).build();
    pool.map_err(|error| Error::Usage(format!("threads {n}: {error}")))?.install(work)
}
