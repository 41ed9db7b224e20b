//! Spectra in bricks whose parts are made by whoever has their samples: here, or on another machine.

use std::path::PathBuf;
use std::sync::Arc;

use isospectrum::bricks::{
    self, Held as Samples, Opened, Part, Parts, ReadBlocks, Source, Survey, merge_to_folder,
    part_of,
};
use isospectrum::file::{self, PartFolder, is_folder};
use isospectrum::spectrum::VolumeInfo;
use isospectrum::volume::{Outside, Tally};
use isospectrum::{Backend, Error, Noise, Result};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::compute::{choice_of, parameters_of, with_ends, with_threads, written_ends};
use crate::errors::raised;
use crate::held::Held;
use crate::spectrum::Spectrum;
use crate::volume::{placed, samples_of};
use crate::watch::watched;

/// The folder of parts in the folder that it is made in.
const MADE: &str = "made";

/// Where a volume's samples lie: origin, spacing, direction, space and unit, as [`Volume`](crate::volume::Volume) takes them.
type Frame = ([f64; 3], [f64; 3], [[f64; 3]; 3], String, String);

/// A box of samples along x, y, z: the first one, and the one behind the last.
type Block = ([usize; 3], [usize; 3]);

/// The blocks that a volume is cut into.
#[pyfunction]
pub(crate) fn cut(dims: [usize; 3], brick: Option<usize>) -> Vec<Block> {
    bricks::cut(dims, brick.unwrap_or(bricks::SIDE))
}

/// What samples tell of the statistics of a volume of a range, as bytes.
#[pyfunction]
pub(crate) fn tally<'py>(
    py: Python<'py>,
    array: &Bound<'py, PyAny>,
    range: (f64, f64),
) -> PyResult<Bound<'py, PyBytes>> {
    let (_, samples) = samples_of(py, array)?;
    let bytes = py.detach(|| {
        let mut tally = Tally::new(range);
        tally.add_all(&samples);
        tally.to_bytes()
    });
    Ok(PyBytes::new(py, &bytes))
}

/// Samples that Python is asked for: a callable of a box that gives the array there.
#[derive(Debug)]
struct Asked(Py<PyAny>);

impl ReadBlocks for Asked {
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<isospectrum::Samples> {
        let asked = Python::attach(|py| {
            let array = self.0.call1(py, (first, end))?;
            samples_of(py, array.bind(py)).map(|found| found.1)
        });
        asked.map_err(|error| Error::input(error.to_string()))
    }
}

/// A computation in bricks.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Plan(Arc<bricks::Plan>);

#[pymethods]
impl Plan {
    /// Of a volume that others have looked at, block by block: its range, what its samples tell of statistics, each once, and
    /// CRC-32 of the samples of each block of [`cut`]. `blocks` gives samples.
    #[new]
    #[pyo3(signature = (name, dims, sample_type, limits, frame, tallies, checksums, brick, parameters, range, start, blocks))]
    #[allow(clippy::too_many_arguments, reason = "Python tells them apart by name")]
    fn new(
        py: Python<'_>,
        name: String,
        dims: [usize; 3],
        sample_type: String,
        limits: (f64, f64),
        frame: Frame,
        tallies: Vec<Vec<u8>>,
        checksums: Vec<u32>,
        brick: Option<usize>,
        parameters: &Bound<'_, PyDict>,
        range: Option<(String, String)>,
        start: Option<String>,
        blocks: Py<PyAny>,
    ) -> PyResult<Self> {
        let (origin, spacing, direction, space, unit) = frame;
        let placement = placed(origin, spacing, direction, &space, &unit)?;
        let parameters = parameters_of(parameters)?;
        let (range, start) = written_ends(range, start)?;
        let plan = py.detach(|| {
            let mut tally = Tally::new(limits);
            tallies.iter().try_for_each(|bytes| tally.add_bytes(bytes))?;
            let samples = tally.statistics();
            let parameters = with_ends(&parameters, (range, start), (limits, &samples))?;
            let outside = Outside::default();
            let source = Source::Given { name: name.clone() };
            let info = VolumeInfo { name, dims, sample_type, range: limits, placement, outside };
            let survey = Survey::of_blocks(info, samples, checksums, Arc::new(Asked(blocks)))?;
            let side = brick.unwrap_or(bricks::SIDE);
            bricks::Plan::new(source, &survey, Noise::default(), &parameters, side)
        });
        plan.map(|plan| Plan(Arc::new(plan))).map_err(raised)
    }

    /// The plan in the bytes of a file.
    #[staticmethod]
    fn from_bytes(bytes: &[u8]) -> PyResult<Self> {
        bricks::Plan::from_bytes(bytes).map(|plan| Plan(Arc::new(plan))).map_err(raised)
    }

    /// The bytes of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.0.to_bytes().map_err(raised)?))
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        Ok((py.get_type::<Plan>().getattr("from_bytes")?, (self.to_bytes(py)?,)))
    }

    /// How many parts there are.
    #[getter]
    fn n(&self) -> usize {
        self.0.recipe.bricks.len()
    }

    /// The box of samples that a part is made of.
    fn needed(&self, number: usize) -> Block {
        self.0.needed(number)
    }

    /// Makes a part of the samples that it needs; the bytes of its file.
    fn part<'py>(
        &self,
        py: Python<'py>,
        number: usize,
        array: &Bound<'py, PyAny>,
        backend: &str,
        adapter: Option<String>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let choice = choice_of(backend)?;
        let (_, samples) = samples_of(py, array)?;
        let plan = self.0.clone();
        let bytes = watched(py, None, move |watched| {
            let backend = Backend::choose(choice, adapter.as_deref())?;
            let (first, end) = plan.needed(number);
            let held = Arc::new(Samples::new(first, end, samples)?);
            let volume = Opened::Blocks(held, plan.recipe.volume.clone());
            with_threads(threads, || part_of(&plan, &volume, number, &backend, watched))
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Whether the file of a part is in a folder, and whole.
    fn is_there(&self, py: Python<'_>, folder: PathBuf, number: usize) -> bool {
        py.detach(|| Parts::new(&self.0, folder).is_there(number).unwrap_or(false))
    }

    /// Writes the file of a part into a folder, if its bytes are those of one.
    fn keep(&self, py: Python<'_>, folder: PathBuf, number: usize, bytes: &[u8]) -> PyResult<()> {
        let keep = || {
            Part::head(bytes, &self.0, number)?;
            let file = Parts::new(&self.0, folder).file(number);
            file::write_beside(&file, |writer| writer.write_all(bytes))
        };
        py.detach(keep).map_err(raised)
    }

    /// Joins the parts of a folder: to a file (`.isp`), a folder of parts (`.ispt`), or in memory. `blocks` gives samples, few of
    /// which are read again.
    #[pyo3(signature = (folder, blocks, to, progress))]
    fn merge(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        blocks: Py<PyAny>,
        to: Option<PathBuf>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Spectrum> {
        let plan = self.0.clone();
        let held = watched(py, progress, move |watched| {
            let volume = Opened::Blocks(Arc::new(Asked(blocks)), plan.recipe.volume.clone());
            let parts = Parts::new(&plan, folder);
            let Some(to) = to else {
                let spectrum = bricks::merge(&parts, &volume, watched)?;
                return Ok(Held::whole(file::arranged(&spectrum.quantised())?));
            };
            if to.extension().is_some_and(|e| e == "ispt") {
                let work = PartFolder::beside_folder(&to, is_folder)?;
                let made = work.path().join(MADE);
                let named = |error| match error {
                    // Nobody knows the folder to work in.
                    Error::Io { path, source } if path.starts_with(work.path()) => {
                        Error::io(&to, source)
                    }
                    other => other,
                };
                std::fs::create_dir(&made).map_err(|e| named(Error::io(&made, e)))?;
                merge_to_folder(&parts, &volume, &made, None, watched).map_err(named)?;
                work.put_folder(MADE, &to)?;
                return Held::folder(&to);
            }
            let written = file::into_bytes(bricks::merge(&parts, &volume, watched)?)?;
            file::write_beside(&to, |writer| writer.write_all(&written.bytes))?;
            Ok(Held::whole(written.spectrum.quantised()))
        });
        held.map(Spectrum::of)
    }
}
