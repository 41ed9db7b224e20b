//! From a volume to its spectrum.

use isospectrum::bricks::{
    self, Limits as Bounds, Parts as Bricks, Plan, Source, Survey, compute_parts,
};
use isospectrum::file::{self, PartFolder};
use isospectrum::volume::{Mask, Statistics};
use isospectrum::{
    Backend, Choice, Error, Forecast, Isovalue, Noise, Parameters, Preparation, Prepared, Progress,
    Result,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{raised, usage};
use crate::spectrum::Spectrum;
use crate::volume::Volume;
use crate::watch::watched;

/// Computes the spectrum of a volume. `parameters` are those of [`Parameters`] that are numbers, by name; `range` and
/// `start` are written isovalues; `persistence` is a difference of samples, or a share of their range.
#[pyfunction]
#[pyo3(signature = (volume, parameters, range, start, crop, median, smooth, downsample, mask, persistence, min_component, brick, max_memory, backend, adapter, threads, progress))]
#[allow(clippy::too_many_arguments, reason = "Python tells them apart by name")]
pub(crate) fn compute(
    py: Python<'_>,
    volume: &Bound<'_, Volume>,
    parameters: &Bound<'_, PyDict>,
    range: Option<(String, String)>,
    start: Option<String>,
    crop: Option<[[usize; 2]; 3]>,
    median: Option<usize>,
    smooth: Option<[f64; 3]>,
    downsample: Option<usize>,
    mask: Option<&Bound<'_, Volume>>,
    persistence: Option<(f64, bool)>,
    min_component: Option<u32>,
    brick: Option<usize>,
    max_memory: Option<f64>,
    backend: &str,
    adapter: Option<String>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Spectrum> {
    let parameters = parameters_of(parameters)?;
    let choice = choice_of(backend)?;
    let (range, start) = written_ends(range, start)?;
    let (volume, mask) = (volume.get().0.clone(), mask.map(|mask| mask.get().0.clone()));
    let work = move |progress: &dyn Progress| {
        let backend = Backend::choose(choice, adapter.as_deref())?;
        progress.report(0.0, "preparing");
        let mask = mask.map(|mask| Mask::check(&mask, &volume).map(|()| Mask::of(&mask)));
        let mask = mask.transpose()?.map(|mask| mask.record()).transpose()?;
        let preparation = Preparation { crop, median, smooth, downsample, mask };
        let volume = preparation.apply(volume)?;
        let (low, high) = volume.range();
        let value = |(value, is_share)| if is_share { (high - low) * value } else { value };
        let noise = Noise { persistence: persistence.map(value), min_component };
        let (volume, cleaned) = noise.take_out(volume)?;
        let prepared = Prepared::of(volume, preparation, cleaned);
        let known = (prepared.volume().range(), prepared.samples());
        let parameters = with_ends(&parameters, (range, start), known)?;
        let in_bricks = side_of(&prepared, &parameters, (brick, max_memory))?;
        let spectrum = match in_bricks {
            Some(side) => {
                let memory = max_memory.unwrap_or(f64::INFINITY);
                swept_in_bricks(prepared, noise, &parameters, (side, memory), &backend, progress)?
            }
            None => prepared.compute(&parameters, &backend, progress)?,
        };
        // As a file gives it back, so that its meshes are the same before it is saved and after.
        file::arranged(&spectrum.quantised())
    };
    let spectrum = watched(py, progress, move |watched| with_threads(threads, || work(watched)))?;
    Ok(Spectrum::new(spectrum))
}

/// Does work on so many threads, or on all.
pub(crate) fn with_threads<T: Send>(
    threads: Option<usize>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    let Some(n) = threads else { return work() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.map_err(|error| Error::Usage(format!("threads {n}: {error}")))?.install(work)
}

/// Where a sweep is to run.
pub(crate) fn choice_of(backend: &str) -> PyResult<Choice> {
    match backend {
        "auto" => Ok(Choice::Auto),
        "gpu" => Ok(Choice::Gpu),
        "cpu" => Ok(Choice::Cpu),
        _ => Err(usage(format!("backend '{backend}', expected auto, gpu or cpu"))),
    }
}

/// A range and a start as they were written.
type Ends = (Option<(Isovalue, Isovalue)>, Option<Isovalue>);

/// A range and a start, each where there is one.
pub(crate) fn written_ends(
    range: Option<(String, String)>,
    start: Option<String>,
) -> PyResult<Ends> {
    let range = range.map(|(low, high)| Ok::<_, PyErr>((written(&low)?, written(&high)?)));
    Ok((range.transpose()?, start.map(|c| written(&c)).transpose()?))
}

/// Parameters with the range and the start that were written, for a volume of a range of whose samples something is known.
pub(crate) fn with_ends(
    parameters: &Parameters,
    (range, start): Ends,
    (of_volume, samples): ((f64, f64), &Statistics),
) -> Result<Parameters> {
    let resolve = |c: Isovalue, range| c.resolve(range, Some(samples));
    let range = match range {
        Some((low, high)) => {
            let (low, high) = (resolve(low, of_volume)?, resolve(high, of_volume)?);
            if low >= high {
                return Err(Error::Usage(format!(
                    "range {low} to {high}, expected the lower isovalue first"
                )));
            }
            Some((low, high))
        }
        None => None,
    };
    let parameters = Parameters { range, ..parameters.clone() }.within(of_volume)?;
    let range = parameters.range.unwrap_or(of_volume);
    let start = start.map(|c| resolve(c, range)).transpose()?;
    Ok(Parameters { start, ..parameters })
}

/// The side of the bricks that a volume is swept in, cells: as is asked for, or the usual one where more memory is expected of the
/// whole than there may be used.
fn side_of(
    prepared: &Prepared,
    parameters: &Parameters,
    (brick, max_memory): (Option<usize>, Option<f64>),
) -> Result<Option<usize>> {
    let Some(most) = max_memory.filter(|_| brick.is_none()) else { return Ok(brick) };
    let volume = prepared.volume();
    let least = Forecast::least_memory(volume.dims());
    let expected = || -> Result<f64> {
        let range = parameters.range.unwrap_or(volume.range());
        Ok(Forecast::of_volume(volume, range, parameters.error)?.memory)
    };
    Ok((least > most || expected()? > most).then_some(bricks::SIDE))
}

/// The spectrum of a volume in bricks, whose parts lie in a folder among the system's temporary ones while that takes.
fn swept_in_bricks(
    prepared: Prepared,
    noise: Noise,
    parameters: &Parameters,
    (side, memory): (usize, f64),
    backend: &Backend,
    progress: &dyn Progress,
) -> Result<isospectrum::Spectrum> {
    let name = prepared.volume().name().to_owned();
    let samples = prepared.volume().samples().n_bytes() as f64;
    if memory <= samples {
        return Err(Error::Usage(format!(
            "{name}: its samples take {samples} bytes, expected a max_memory above that"
        )));
    }
    let survey = Survey::of(prepared);
    let plan = Plan::new(Source::Given { name }, &survey, noise, parameters, side)?;
    let work = PartFolder::beside(&std::env::temp_dir().join("isospectrum"))?;
    let parts = Bricks::new(&plan, work.path());
    let bounds = Bounds { memory: memory - samples, one_file: true, triangles: None };
    compute_parts(&parts, survey.opened(), backend, bounds, progress)?;
    bricks::merge(&parts, survey.opened(), progress)
}

pub(crate) fn written(text: &str) -> PyResult<Isovalue> {
    text.parse().map_err(raised)
}

/// Parameters with what is given by name in place of the defaults.
pub(crate) fn parameters_of(given: &Bound<'_, PyDict>) -> PyResult<Parameters> {
    let mut parameters = Parameters::default();
    for (name, value) in given {
        let name: String = name.extract()?;
        let number = || value.extract::<f64>();
        match name.as_str() {
            "step" => parameters.step = Some(number()?),
            "samples" => parameters.samples = Some(value.extract()?),
            "error" => parameters.error = number()?,
            "min_quality" => parameters.min_quality = number()?,
            "min_area" => parameters.min_area = number()?,
            "refine_area" => parameters.refine_area = number()?,
            "max_edge" => parameters.max_edge = number()?,
            "relax" => parameters.relax_strength = number()?,
            "relax_force" => parameters.relax_force = number()?,
            "relax_iterations" => parameters.relax_iterations = value.extract()?,
            "initial_mesh" => parameters.initial_mesh = Some(value.extract()?),
            _ => return Err(usage(format!("parameter '{name}' is not known"))),
        }
    }
    Ok(parameters)
}
