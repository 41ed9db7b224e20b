//! Spectra: computed, read, written, and asked.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use isospectrum::bricks::{
    self, Limits as Bounds, Parts as Bricks, Plan, Source, Survey, compute_parts,
};
use isospectrum::color::Sources;
use isospectrum::export::{self, Border, without_caps};
use isospectrum::file::{PartFolder, SpectrumFolder};
use isospectrum::page::{self, Page};
use isospectrum::render::{Background, Gpu, Image, Renderer, Surface, View, linear};
use isospectrum::spectrum::{Components, lineages};
use isospectrum::verify::{Limits, Sampling, verify};
use isospectrum::volume::{Histogram, Mask, Statistics};
use isospectrum::{Backend, Choice};
use isospectrum::{
    Error, Forecast, Isovalue, Mesh, Noise, Parameters, Preparation, Prepared, Progress, Query,
    Result, file,
};
use numpy::{IntoPyArray, PyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{MeshArrays, in_world, mesh_arrays, rows};
use crate::errors::{raised, usage};
use crate::reports::{self, Curves};
use crate::sight::{Kept, Sight, kept, prepared, sources_of};
use crate::volume::Volume;
use crate::watch::watched;

/// A spectrum, with what answers queries on it once that was asked for.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Spectrum {
    spectrum: Arc<isospectrum::Spectrum>,
    query: Arc<OnceLock<Mutex<OwnedQuery>>>,
}

/// Writes a file beside its place, and moves it there when it is complete.
#[pyfunction]
pub(crate) fn write_file(py: Python<'_>, path: PathBuf, bytes: &[u8]) -> PyResult<()> {
    py.detach(|| file::write_beside(&path, |writer| writer.write_all(bytes))).map_err(raised)
}

type OwnedQuery = Query<Arc<isospectrum::Spectrum>>;

/// A picture: red, green, blue, alpha; one byte each.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Picture(Image);

#[pymethods]
impl Picture {
    /// Rows and columns.
    #[getter]
    fn shape(&self) -> (u32, u32) {
        (self.0.height, self.0.width)
    }

    /// The pixels, row by row from the top.
    fn pixels<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<u8>> {
        self.0.pixels.clone().into_pyarray(py)
    }

    /// As PNG.
    fn png<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        py.detach(|| self.0.encode_png(&mut bytes)).map_err(|e| raised(Error::io("-", e)))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes it as PNG.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.write_png(&path)).map_err(raised)
    }
}

#[pymethods]
impl Spectrum {
    /// Computes the spectrum of a volume. `parameters` are those of [`Parameters`] that are numbers, by name; `range` and
    /// `start` are written isovalues; `persistence` is a difference of samples, or a share of their range.
    #[staticmethod]
    #[pyo3(signature = (volume, parameters, range, start, crop, median, smooth, downsample, mask, persistence, min_component, brick, max_memory, backend, adapter, threads, progress))]
    #[allow(clippy::too_many_arguments, reason = "Python tells them apart by name")]
    fn compute(
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
    ) -> PyResult<Self> {
        let parameters = parameters_of(parameters)?;
        let choice = match backend {
            "auto" => Choice::Auto,
            "gpu" => Choice::Gpu,
            "cpu" => Choice::Cpu,
            _ => return Err(usage(format!("backend '{backend}', expected auto, gpu or cpu"))),
        };
        let range = range.map(|(low, high)| Ok::<_, PyErr>((written(&low)?, written(&high)?)));
        let (range, start) = (range.transpose()?, start.map(|c| written(&c)).transpose()?);
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
            let volume_range = prepared.volume().range();
            let resolve = |c: Isovalue, range| c.resolve(range, Some(prepared.samples()));
            let range = match range {
                Some((low, high)) => {
                    let range = (resolve(low, volume_range)?, resolve(high, volume_range)?);
                    if range.0 >= range.1 {
                        return Err(Error::Usage(format!(
                            "range {} to {}, expected the lower isovalue first",
                            range.0, range.1
                        )));
                    }
                    Some(range)
                }
                None => None,
            };
            let start = start.map(|c| resolve(c, range.unwrap_or(volume_range))).transpose()?;
            let parameters = Parameters { range, start, ..parameters };
            let in_bricks = side_of(&prepared, &parameters, (brick, max_memory))?;
            let spectrum = match in_bricks {
                Some(side) => {
                    let memory = max_memory.unwrap_or(f64::INFINITY);
                    swept_in_bricks(
                        prepared,
                        noise,
                        &parameters,
                        (side, memory),
                        &backend,
                        progress,
                    )?
                }
                None => prepared.compute(&parameters, &backend, progress)?,
            };
            // As a file gives it back, so that its meshes are the same before it is saved and after.
            file::arranged(&spectrum.quantised())
        };
        let spectrum = watched(py, progress, move |watched| match threads {
            None => work(watched),
            Some(n) => rayon::ThreadPoolBuilder::new()
                .num_threads(n)
                .build()
                .map_err(|error| Error::Usage(format!("threads {n}: {error}")))?
                .install(|| work(watched)),
        })?;
        Ok(Spectrum::new(spectrum))
    }

    /// Reads a spectrum file, or all parts of a folder.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let is_thesis = path.extension().is_some_and(|e| e == "thesis");
        let read = move |_: &_| {
            if file::is_folder(&path) {
                return SpectrumFolder::open(&path)?.read();
            }
            if is_thesis { file::thesis::read(&path) } else { file::read(&path) }
        };
        watched(py, None, read).map(Spectrum::new)
    }

    /// The spectrum in the bytes of a file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        py.detach(|| file::from_bytes(bytes)).map(Spectrum::new).map_err(raised)
    }

    /// The bytes of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = py.detach(|| file::to_bytes(&self.spectrum)).map_err(raised)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes its file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let spectrum = self.spectrum.clone();
        let write = move |_: &_| match path.extension().and_then(|e| e.to_str()) {
            Some("isp") => file::write(&spectrum, &path),
            Some("thesis") => file::thesis::write(&spectrum, &path),
            _ => Err(Error::Usage(format!(
                "{}: expected a name that ends in .isp or .thesis",
                path.display()
            ))),
        };
        watched(py, None, write)
    }

    /// What it holds, as JSON.
    fn about(&self) -> String {
        let s = &*self.spectrum;
        serde_json::json!({
            "volume": s.volume(),
            "range": s.range(),
            "tolerance": s.tolerance(),
            "parameters": s.parameters(),
            "n_vertices": s.n_vertices(),
            "n_triangles": s.triangles().len(),
            "n_knots": s.knots().len(),
            "n_events": s.events().len(),
            "shown_first": s.shown_first(),
        })
        .to_string()
    }

    /// The number that a written isovalue means here.
    fn isovalue(&self, text: &str) -> PyResult<f64> {
        let isovalue = written(text)?;
        isovalue.resolve(self.spectrum.range(), self.spectrum.statistics().as_ref()).map_err(raised)
    }

    /// The mesh at an isovalue, as arrays.
    fn mesh<'py>(
        &self,
        py: Python<'py>,
        isovalue: f64,
        open: bool,
        keep: Option<Kept>,
    ) -> PyResult<MeshArrays<'py>> {
        let mesh = py.detach(|| -> Result<Mesh> {
            let mesh = self.mesh_at(isovalue, open, keep)?;
            Ok(in_world(mesh, &self.spectrum.volume().placement))
        });
        Ok(mesh_arrays(py, mesh.map_err(raised)?))
    }

    /// Its vertices in 64-bit floats.
    fn vertices_f64<'py>(
        &self,
        py: Python<'py>,
        isovalue: f64,
        open: bool,
        keep: Option<Kept>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let placed = py.detach(|| -> Result<Vec<[f64; 3]>> {
            let mesh = self.mesh_at(isovalue, open, keep)?;
            let placement = &self.spectrum.volume().placement;
            Ok(mesh.positions.iter().map(|&p| placement.world_of_voxel(p)).collect())
        });
        Ok(rows(py, placed.map_err(raised)?))
    }

    /// Writes the mesh at an isovalue.
    fn save_mesh(
        &self,
        py: Python<'_>,
        isovalue: f64,
        open: bool,
        keep: Option<Kept>,
        path: PathBuf,
    ) -> PyResult<()> {
        py.detach(|| {
            let mesh = self.mesh_at(isovalue, open, keep)?;
            export::write(&mesh, &self.spectrum.volume().placement, Border::Closed, &path)
        })
        .map_err(raised)
    }

    /// Columns of what isosurfaces measure at `n` isovalues.
    fn curves<'py>(&self, py: Python<'py>, n: usize) -> PyResult<Bound<'py, PyDict>> {
        let (spectrum, query) = (self.spectrum.clone(), self.query.clone());
        let curves =
            watched(py, None, move |_| Curves::of(&spectrum, &mut locked(&query, &spectrum), n))?;
        curves.columns(py)
    }

    /// Columns of all events.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        reports::events(py, &self.spectrum)
    }

    /// Columns of the components at an isovalue.
    fn components<'py>(
        &self,
        py: Python<'py>,
        isovalue: f64,
        keep: Option<Kept>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let placement = self.spectrum.volume().placement;
        let rows = py.detach(|| -> Result<Vec<_>> {
            let mesh = self.mesh_at(isovalue, false, None)?;
            let found = Components::of(&mesh);
            let kept = found.kept(&mesh, &kept(keep, &self.spectrum));
            let lineages = lineages(&self.spectrum, isovalue, &found)?;
            let placed = found.moved(&export::place_in_world(mesh, &placement));
            let rows = placed.list.into_iter().zip(lineages).enumerate().zip(kept);
            Ok(rows.filter(|row| row.1).map(|((i, (c, l)), _)| (i, c, l)).collect())
        });
        reports::components(py, &rows.map_err(raised)?, placement.origin)
    }

    /// Verifies it against a volume; the report is JSON.
    #[pyo3(signature = (volume, n, events, seed, progress))]
    fn verify(
        &self,
        py: Python<'_>,
        volume: &Bound<'_, Volume>,
        n: usize,
        events: usize,
        seed: u64,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<String> {
        let (spectrum, volume) = (self.spectrum.clone(), volume.get().0.clone());
        let sampling = Sampling { n_random: n, n_events: events, seed };
        watched(py, progress, move |watched| {
            let volume = Prepared::again(volume, &spectrum)?;
            let found = verify(&spectrum, &volume, sampling, Limits::default(), watched)?;
            serde_json::to_string(&found).map_err(|e| Error::internal(e.to_string()))
        })
    }

    /// A picture of isosurfaces: each with its isovalue, sRGB colour and opacity.
    #[pyo3(signature = (surfaces, size, sight, legend, scale_bar, label, fit_volume, volume, color_by, adapter))]
    #[allow(clippy::too_many_arguments, reason = "Python tells them apart by name")]
    fn render(
        &self,
        py: Python<'_>,
        surfaces: Vec<Shown>,
        size: (u32, u32),
        sight: Sight,
        legend: bool,
        scale_bar: bool,
        label: Option<String>,
        fit_volume: bool,
        volume: Option<&Bound<'_, Volume>>,
        color_by: Option<&Bound<'_, Volume>>,
        adapter: Option<String>,
    ) -> PyResult<Picture> {
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.0).collect();
        let surfaces = surfaces_of(surfaces);
        let spectrum = self.spectrum.clone();
        let [volume, color_by] = [volume, color_by].map(|v| v.map(|v| v.get().0.clone()));
        watched(py, None, move |_| {
            for &isovalue in &isovalues {
                spectrum.check_isovalue(isovalue)?;
            }
            let mut view = View {
                width: size.0,
                height: size.1,
                camera: sight.camera()?,
                color: sight.color(color_by.is_some())?,
                map: sight.map()?,
                ends: sight.ends()?,
                background: sight.background()?.unwrap_or_default(),
                clip: sight.clip(),
                wireframe: sight.wireframe.then_some(1.0),
                opacity: sight.opacity,
                occlusion: sight.occlusion,
                axes: sight.axes,
                scale_bar: scale_bar || sight.axes,
                legend,
                label,
                open: sight.open,
                keep: sight.keep(&spectrum),
                ..View::default()
            };
            let volume = volume.map(|volume| prepared(volume, &spectrum)).transpose()?;
            let sources = sources_of(&spectrum, view.color, volume.as_ref(), color_by.as_ref())?;
            let gpu = Gpu::new(adapter.as_deref())?;
            let mut renderer = Renderer::new(&gpu, &spectrum)?;
            renderer.set_sources(sources);
            if !fit_volume && let Some(bounds) = renderer.bounds(&isovalues, &view.keep)? {
                view.fit(spectrum.volume(), bounds);
            }
            renderer.draw_all(&surfaces, &view)
        })
        .map(Picture)
    }

    /// The spectrum as one web page; without a still picture where there is no adapter, or none is wanted. `surfaces` are as in
    /// `render`; the first is that of the slider.
    #[pyo3(signature = (surfaces, title, caption, credit, marks, range, tolerance, step, sight, volume, color_by, has_still))]
    #[allow(clippy::too_many_arguments, reason = "Python tells them apart by name")]
    fn html(
        &self,
        py: Python<'_>,
        surfaces: Vec<Shown>,
        title: Option<String>,
        caption: Option<String>,
        credit: Option<String>,
        marks: Vec<(f64, String)>,
        range: Option<(f64, f64)>,
        tolerance: f64,
        step: Option<f64>,
        sight: Sight,
        volume: Option<&Bound<'_, Volume>>,
        color_by: Option<&Bound<'_, Volume>>,
        has_still: bool,
    ) -> PyResult<String> {
        let spectrum = self.spectrum.clone();
        let [volume, color_by] = [volume, color_by].map(|v| v.map(|v| v.get().0.clone()));
        let mut also = surfaces_of(surfaces);
        watched(py, None, move |_| {
            let mut spectrum = (*spectrum).clone();
            let volume = volume.map(|volume| prepared(volume, &spectrum)).transpose()?;
            if let Some(range) = range {
                spectrum = page::part(&spectrum, range)?;
            }
            if tolerance > 0.0 {
                spectrum = page::with_fewer_knots(&spectrum, tolerance);
            }
            let statistics = volume.as_ref().map(Statistics::of).or_else(|| spectrum.statistics());
            if also.is_empty() {
                also.push(spectrum.shown_first().into());
            }
            let marked = marks.iter().map(|mark| mark.0);
            for isovalue in marked.chain(also.iter().map(|surface| surface.isovalue)) {
                spectrum.check_isovalue(isovalue)?;
            }
            let first = also.remove(0);
            let background = sight.background()?;
            if background == Some(Background::Transparent) {
                return Err(Error::Usage(
                    "background 'transparent', expected white, light or dark".to_owned(),
                ));
            }
            let look = page::Look {
                occlusion: sight.occlusion,
                wireframe: sight.wireframe,
                opacity: first.opacity.unwrap_or(sight.opacity),
                clip: sight.clip(),
                background,
                front: first.color,
                also,
                ..page::Look::default()
            };
            let color = sight.color(color_by.is_some())?;
            let sources = sources_of(&spectrum, color, volume.as_ref(), color_by.as_ref())?;
            let samples = volume.as_ref().map(Histogram::of);
            let mut page = Page {
                title: title.as_deref().unwrap_or(&spectrum.volume().name),
                caption: caption.as_deref(),
                credit: credit.as_deref(),
                isovalue: first.isovalue,
                step: step.unwrap_or(page::DEFAULT_STEP),
                open: sight.open,
                camera: sight.camera()?,
                color,
                map: sight.map()?,
                ends: sight.ends()?,
                field: Some(&sources),
                axes: sight.axes,
                look,
                keep: sight.keep(&spectrum),
                samples: samples.as_ref(),
                statistics: statistics.as_ref(),
                marks: &marks,
                still: None,
            };
            let still = if has_still { still(&spectrum, &page, first, &sources)? } else { None };
            page.still = still.as_ref();
            page::html(&spectrum, &page).map(|(text, _)| text)
        })
    }
}

impl Spectrum {
    fn new(spectrum: isospectrum::Spectrum) -> Self {
        Spectrum { spectrum: Arc::new(spectrum), query: Arc::default() }
    }

    /// The mesh in the voxel frame.
    fn mesh_at(&self, isovalue: f64, open: bool, keep: Option<Kept>) -> Result<Mesh> {
        let mut mesh = locked(&self.query, &self.spectrum).mesh_at(isovalue)?;
        if keep.is_some() {
            mesh = mesh.with_components(&kept(keep, &self.spectrum));
        }
        Ok(if open { without_caps(&mesh) } else { mesh })
    }
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

/// The query of a spectrum, built when it is wanted first.
fn locked<'a>(
    query: &'a OnceLock<Mutex<OwnedQuery>>,
    spectrum: &Arc<isospectrum::Spectrum>,
) -> MutexGuard<'a, OwnedQuery> {
    let query = query.get_or_init(|| Mutex::new(Query::new(spectrum.clone())));
    query.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The picture of a page for those who can see no other, if there is an adapter to draw it.
fn still(
    spectrum: &isospectrum::Spectrum,
    page: &Page<'_>,
    first: Surface,
    sources: &Sources,
) -> Result<Option<Image>> {
    let gpu = match Gpu::new(None) {
        Ok(gpu) => gpu,
        Err(Error::Gpu(_)) => return Ok(None),
        Err(error) => return Err(error),
    };
    let look = &page.look;
    let mut view = View {
        width: 640,
        height: 480,
        open: page.open,
        keep: page.keep,
        camera: page.camera,
        background: Background::Transparent,
        color: page.color,
        map: page.map,
        ends: page.ends,
        clip: look.clip,
        occlusion: look.occlusion,
        wireframe: look.wireframe.then_some(1.0),
        opacity: look.opacity,
        ..View::default()
    };
    let mut renderer = Renderer::new(&gpu, spectrum)?;
    renderer.set_sources(sources.clone());
    let surfaces: Vec<Surface> = std::iter::once(first).chain(look.also.iter().copied()).collect();
    let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
    if let Some(bounds) = renderer.bounds(&isovalues, &view.keep)? {
        view.fit(spectrum.volume(), bounds);
    }
    renderer.draw_all(&surfaces, &view).map(Some)
}

/// An isosurface that is shown: isovalue, sRGB colour, opacity.
type Shown = (f64, Option<u32>, Option<f32>);

fn surfaces_of(shown: Vec<Shown>) -> Vec<Surface> {
    let surface =
        |(isovalue, color, opacity): Shown| Surface { isovalue, color: color.map(linear), opacity };
    shown.into_iter().map(surface).collect()
}

fn written(text: &str) -> PyResult<Isovalue> {
    text.parse().map_err(raised)
}

/// Parameters with what is given by name in place of the defaults.
fn parameters_of(given: &Bound<'_, PyDict>) -> PyResult<Parameters> {
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
