//! Computations in bricks whose parts are computed wherever their samples are: in this process or on another machine.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use isospectrum::bricks::{
    self, OpenVolume, Part, Parts, ReadBlocks, SampleBox, Survey, VolumeSource, compute_part,
    merge_to_path,
};
use isospectrum::file;
use isospectrum::spectrum::VolumeInfo;
use isospectrum::volume::Tally;
use isospectrum::{Error, Noise, Result};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arguments::sweep_settings;
use crate::backend::Wanted;
use crate::compute::rounded;
use crate::errors::raised;
use crate::handle::Handle;
use crate::spectrum::Spectrum;
use crate::threads::with_threads;
use crate::volume::{outside_of, placement, samples_of};
use crate::watch::{detached, watched};

/// The frame of a volume: origin, spacing, direction, space and unit, as [`Volume`](crate::volume::Volume) takes them.
type Frame = ([f64; 3], [f64; 3], [[f64; 3]; 3], String, String);

/// A box of samples along x, y, z: the first sample, and the one after the last.
type Block = ([usize; 3], [usize; 3]);

/// The blocks into which a volume is cut; an error for bricks that are too small.
#[pyfunction]
pub(crate) fn cut(dims: [usize; 3], brick: Option<usize>) -> PyResult<Vec<Block>> {
    let side = brick.unwrap_or(bricks::SIDE);
    bricks::check_side(side).map_err(raised)?;
    Ok(bricks::cut(dims, side))
}

/// A tally of samples, from which the statistics of a volume with values in `range` are summed up; as bytes.
#[pyfunction]
pub(crate) fn tally<'py>(
    py: Python<'py>,
    array: &Bound<'py, PyAny>,
    range: (f64, f64),
) -> PyResult<Bound<'py, PyBytes>> {
    let (_, samples) = samples_of(py, array)?;
    let bytes = detached(py, || {
        let mut tally = Tally::new(range);
        tally.add_all(&samples);
        Ok(tally.to_bytes())
    });
    Ok(PyBytes::new(py, &bytes?))
}

/// A folder for parts, next to the file of the result or in that for temporary files. It is removed when it is closed, and by the next
/// run for the same file if its process was killed.
#[pyclass]
pub(crate) struct WorkFolder(Mutex<Option<file::WorkFolder>>);

#[pymethods]
impl WorkFolder {
    /// Creates one for the file `to`.
    #[new]
    fn new(py: Python<'_>, to: Option<PathBuf>) -> PyResult<Self> {
        // As the program: all runs without a file share a name, and remove what killed ones have left.
        let to = to.unwrap_or_else(|| std::env::temp_dir().join("isospectrum"));
        let folder = detached(py, || file::WorkFolder::next_to(&to))?;
        Ok(WorkFolder(Mutex::new(Some(folder))))
    }

    /// Returns its path.
    fn __enter__(&self, py: Python<'_>) -> PyResult<PathBuf> {
        detached(py, || match self.0.lock().unwrap_or_else(PoisonError::into_inner).as_ref() {
            Some(folder) => Ok(folder.path().to_owned()),
            None => Err(Error::Usage("the folder is closed".to_owned())),
        })
    }

    /// Removes it.
    fn __exit__(
        &self,
        py: Python<'_>,
        _kind: Option<Py<PyAny>>,
        _error: Option<Py<PyAny>>,
        _traceback: Option<Py<PyAny>>,
    ) {
        py.detach(|| drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take()));
    }
}

/// Blocks read by a Python callable, which takes a box and returns the array of its samples.
#[derive(Debug)]
struct PythonBlocks(Py<PyAny>);

impl ReadBlocks for PythonBlocks {
    fn read(&self, first: [usize; 3], end: [usize; 3]) -> Result<isospectrum::Samples> {
        let read = Python::attach(|py| {
            let array = self.0.call1(py, (first, end))?;
            samples_of(py, array.bind(py)).map(|found| found.1)
        });
        read.map_err(|error| Error::input(error.to_string()))
    }
}

/// The plan of a computation in bricks.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Plan(Arc<bricks::Plan>);

#[pymethods]
impl Plan {
    /// Plans the computation for a volume that the caller has surveyed: `limits` are its smallest and largest sample, `tallies` count
    /// each sample once, and `checksums` holds the CRC-32 of the samples of each block of [`cut`]. `blocks` reads samples.
    #[new]
    #[pyo3(signature = (name, dims, sample_type, limits, frame, outside, tallies, checksums, brick, parameters, range, start, blocks))]
    #[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
    fn new(
        py: Python<'_>,
        name: String,
        dims: [usize; 3],
        sample_type: String,
        limits: (f64, f64),
        frame: Frame,
        outside: &str,
        tallies: Vec<Vec<u8>>,
        checksums: Vec<u32>,
        brick: Option<usize>,
        parameters: &Bound<'_, PyDict>,
        range: Option<(String, String)>,
        start: Option<String>,
        blocks: Py<PyAny>,
    ) -> PyResult<Self> {
        let (origin, spacing, direction, space, unit) = frame;
        let placement = placement(origin, spacing, direction, &space, &unit)?;
        let outside = outside_of(outside)?;
        let sweep = sweep_settings(parameters, range, start)?;
        let plan = detached(py, || {
            let mut tally = Tally::new(limits);
            tallies.iter().try_for_each(|bytes| tally.add_bytes(bytes))?;
            let samples = tally.statistics();
            let parameters = sweep.resolve(limits, &samples)?;
            let source = VolumeSource::Given { name: name.clone() };
            let info = VolumeInfo { name, dims, sample_type, range: limits, placement, outside };
            let survey =
                Survey::of_blocks(info, samples, checksums, Arc::new(PythonBlocks(blocks)))?;
            let side = brick.unwrap_or(bricks::SIDE);
            bricks::Plan::new(source, &survey, Noise::default(), &parameters, side)
        });
        plan.map(|plan| Plan(Arc::new(plan)))
    }

    /// Parses the bytes of a plan file.
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

    /// Number of parts.
    #[getter]
    fn n(&self) -> usize {
        self.0.recipe.bricks.len()
    }

    /// The box of samples that a part is computed from.
    fn required_samples(&self, number: usize) -> Block {
        self.0.required_samples(number)
    }

    /// Computes a part from the samples that it requires; returns the bytes of its file.
    fn part<'py>(
        &self,
        py: Python<'py>,
        number: usize,
        array: &Bound<'py, PyAny>,
        backend: &str,
        adapter: Option<String>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (_, samples) = samples_of(py, array)?;
        let backend = Wanted::new(backend, adapter, samples.len())?.open(py)?;
        let plan = self.0.clone();
        let bytes = watched(py, None, move |watched| {
            let (first, end) = plan.required_samples(number);
            let samples = Arc::new(SampleBox::new(first, end, samples)?);
            let volume = OpenVolume::Blocks(samples, plan.recipe.volume.clone());
            with_threads(threads, || compute_part(&plan, &volume, number, &backend, watched))
        })?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// True if a folder contains the file of a part, undamaged.
    fn is_complete(&self, py: Python<'_>, folder: PathBuf, number: usize) -> bool {
        py.detach(|| Parts::new(&self.0, folder).is_complete(number).unwrap_or(false))
    }

    /// Writes the file of a part into a folder, after checking its bytes.
    fn store(&self, py: Python<'_>, folder: PathBuf, number: usize, bytes: &[u8]) -> PyResult<()> {
        let store = || {
            Part::head(bytes, &self.0, number)?;
            let file = Parts::new(&self.0, folder).file(number);
            file::write_atomically(&file, |writer| writer.write_all(bytes))
        };
        detached(py, store)
    }

    /// Merges the parts in a folder to a file, or in memory. `blocks` reads samples, a few of
    /// which are needed.
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
        let handle = watched(py, progress, move |watched| {
            let blocks = Arc::new(PythonBlocks(blocks));
            let volume = OpenVolume::Blocks(blocks, plan.recipe.volume.clone());
            let parts = Parts::new(&plan, folder);
            let Some(to) = to else {
                return rounded(bricks::merge(&parts, &volume, watched)?).map(Handle::whole);
            };
            merge_to_path(&parts, &volume, &to, None, watched)?;
            Handle::open(&to)
        });
        handle.map(Spectrum::of)
    }
}
