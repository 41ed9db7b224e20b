//! Spectra: files, meshes, tables, pictures and pages.

use std::path::PathBuf;
use std::sync::Arc;

use isospectrum::export;
use isospectrum::page::{self, Page};
use isospectrum::render::{Background, Renderer};
use isospectrum::spectrum::{Components, lineages};
use isospectrum::verify::{Limits, Sampling, verify, verify_file};
use isospectrum::volume::{Histogram, Statistics};
use isospectrum::{Error, Mesh, Prepared, Query, Result, color_sources, file};
use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::appearance::{Appearance, Kept, kept};
use crate::arguments;
use crate::arrays::{Rows, Target, rows_of};
use crate::backend;
use crate::errors::raised;
use crate::handle::Handle;
use crate::identities::{self, Lifetimes, Trajectory};
use crate::picture::{Picture, Pictured, Shown, surfaces_of};
use crate::reports::{self, Curves};
use crate::surface::{Surface, shown, shown_with_ids};
use crate::volume::Volume;
use crate::watch::{detached, watched};

/// How error messages name the argument for the volume.
pub(crate) const VOLUME: &str = "volume=";

/// A spectrum, or a folder of its parts.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Spectrum(pub(crate) Arc<Handle>);

/// Writes a file atomically.
#[pyfunction]
pub(crate) fn write_file(py: Python<'_>, path: PathBuf, bytes: &[u8]) -> PyResult<()> {
    py.detach(|| file::write_atomically(&path, |writer| writer.write_all(bytes))).map_err(raised)
}

#[pymethods]
impl Spectrum {
    /// Opens a spectrum file.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        watched(py, None, move |_| Handle::open(&path)).map(Spectrum::of)
    }

    /// Parses the bytes of a spectrum file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: &[u8]) -> PyResult<Self> {
        detached(py, || file::from_bytes(bytes)).map(Spectrum::new)
    }

    /// The bytes of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = detached(py, || file::to_bytes(&*self.0.all()?))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes a spectrum file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let handle = self.0.clone();
        let write = move |_: &_| match path.extension().and_then(|e| e.to_str()) {
            Some("isp") => file::write(&*handle.all()?, &path),
            Some("thesis") => file::thesis::write(&*handle.all()?, &path),
            _ => Err(Error::Usage(format!(
                "{}: expected a name that ends in .isp or .thesis",
                path.display()
            ))),
        };
        watched(py, None, write)
    }

    /// Its description, as JSON.
    fn about(&self) -> String {
        let (s, [n_vertices, n_knots, n_triangles]) = (self.0.summary(), self.0.size());
        serde_json::json!({
            "volume": s.volume(),
            "range": s.range(),
            "tolerance": s.tolerance(),
            "parameters": s.parameters(),
            "n_vertices": n_vertices,
            "n_triangles": n_triangles,
            "n_knots": n_knots,
            "n_events": s.events().len(),
            "shown_first": s.shown_first(),
        })
        .to_string()
    }

    /// An isovalue as a number, in the range of the spectrum.
    fn isovalue(&self, text: &str) -> PyResult<f64> {
        let isovalue = arguments::isovalue(text)?;
        let spectrum = self.0.summary();
        isovalue.resolve(spectrum.range(), spectrum.statistics().as_ref()).map_err(raised)
    }

    /// The mesh at an isovalue, turned inside out if `is_turned`. With `has_ids` the whole spectrum is read.
    fn surface(
        &self,
        py: Python<'_>,
        isovalue: f64,
        open: bool,
        keep: Option<Kept>,
        is_turned: bool,
        has_ids: bool,
    ) -> PyResult<Surface> {
        detached(py, || {
            let volume = self.0.summary().volume().clone();
            if !has_ids {
                let mesh = self.mesh_at(isovalue, open, keep)?;
                return Ok(Surface::new(mesh, None, volume, is_turned));
            }
            let keep = keep.map(|keep| kept(Some(keep), self.0.summary()));
            let mut query = Query::for_some(self.0.all()?, 1);
            let mesh = query.mesh_at(isovalue)?;
            let (vertices, triangles) = query.parts();
            let (mesh, ids) = shown_with_ids(&mesh, [vertices, triangles], keep.as_ref(), open);
            Ok(Surface::new(mesh, Some(ids), volume, is_turned))
        })
    }

    /// Writes the mesh at an isovalue to arrays, as [`Surface::arrays`] returns it. Returns its numbers of vertices and triangles; if the
    /// arrays have fewer rows, nothing is written.
    #[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
    fn fill(
        &self,
        py: Python<'_>,
        isovalue: f64,
        open: bool,
        keep: Option<Kept>,
        is_turned: bool,
        vertices: Rows<'_, f32>,
        triangles: Rows<'_, i32>,
        normals: Rows<'_, f32>,
    ) -> PyResult<(usize, usize)> {
        let [mut vertices, mut normals] = [vertices, normals];
        let mut triangles = triangles;
        let target = Target {
            vertices: rows_of(&mut vertices, "vertices")?,
            triangles: rows_of(&mut triangles, "triangles")?,
            normals: rows_of(&mut normals, "normals")?,
        };
        detached(py, || {
            let placement = self.0.summary().volume().placement;
            if keep.is_none() && !open {
                return self
                    .0
                    .with_mesh_at(isovalue, |mesh| target.fill(mesh, &placement, is_turned));
            }
            Ok(target.fill(&self.mesh_at(isovalue, open, keep)?, &placement, is_turned))
        })
    }

    /// The trajectory of a vertex: isovalues, and positions in the world frame.
    fn trajectory<'py>(&self, py: Python<'py>, vertex: usize) -> PyResult<Trajectory<'py>> {
        let spectrum = detached(py, || self.0.all())?;
        identities::trajectory(py, &spectrum, vertex)
    }

    /// The isovalues from which each vertex or triangle is part of a mesh, and from which it no longer is.
    fn lifetimes<'py>(&self, py: Python<'py>, of_triangles: bool) -> PyResult<Lifetimes<'py>> {
        let spectrum = detached(py, || self.0.all())?;
        Ok(identities::lifetimes(py, &spectrum, of_triangles))
    }

    /// Columns of measures of the isosurfaces at `n` isovalues from the lowest to the highest of `range`.
    fn curves<'py>(
        &self,
        py: Python<'py>,
        n: usize,
        range: (f64, f64),
    ) -> PyResult<Bound<'py, PyDict>> {
        let handle = self.0.clone();
        let curves = watched(py, None, move |_| {
            Curves::of(handle.summary(), |c| handle.mesh_at(c), n, range)
        })?;
        curves.columns(py)
    }

    /// Columns of all events, with the components and the Euler characteristic of the isosurface from each on.
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let spectrum = self.0.summary();
        let low = spectrum.range().0;
        let (components, euler) = detached(py, || {
            let first = Components::of(&self.0.around(&[low])?.mesh_at(low)?);
            let euler = first.list.iter().map(|component| component.euler).sum();
            Ok(reports::after_events(spectrum.events(), low, first.list.len() as i64, euler))
        })?;
        let columns = reports::events(py, spectrum.events(), &spectrum.volume().placement)?;
        columns.set_item("components", components.into_pyarray(py))?;
        columns.set_item("euler", euler.into_pyarray(py))?;
        Ok(columns)
    }

    /// Columns of the components at an isovalue.
    fn components<'py>(
        &self,
        py: Python<'py>,
        isovalue: f64,
        keep: Option<Kept>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let placement = self.0.summary().volume().placement;
        let rows = detached(py, || -> Result<Vec<_>> {
            let mesh = self.mesh_at(isovalue, false, None)?;
            let found = Components::of(&mesh);
            let kept = found.kept(&mesh, &kept(keep, self.0.summary()));
            let lineages = lineages(&*self.0.all()?, isovalue, &found)?;
            let placed = found.moved(&export::place_in_world(mesh, &placement));
            let rows = placed.list.into_iter().zip(lineages).enumerate().zip(kept);
            Ok(rows.filter(|row| row.1).map(|((i, (c, l)), _)| (i, c, l)).collect())
        });
        reports::components(py, &rows?, placement.origin)
    }

    /// Verifies the spectrum against a volume; returns the report as JSON.
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
        let (handle, volume) = (self.0.clone(), volume.get().0.clone());
        let sampling = Sampling { n_random: n, n_events: events, seed, ..Sampling::default() };
        watched(py, progress, move |watched| {
            let volume = Prepared::again(volume, handle.summary())?;
            let limits = Limits::default();
            let found = match &*handle {
                Handle::Whole { spectrum, .. } => {
                    verify(spectrum, &volume, sampling, limits, watched)?
                }
                Handle::File { file, .. } => verify_file(file, &volume, sampling, limits, watched)?,
            };
            serde_json::to_string(&found).map_err(|e| Error::internal(e.to_string()))
        })
    }

    /// Draws isosurfaces, each with its isovalue, sRGB colour and opacity.
    #[pyo3(signature = (surfaces, pictured, appearance, volume, color_by))]
    fn render(
        &self,
        py: Python<'_>,
        surfaces: Vec<Shown>,
        pictured: Pictured,
        appearance: Appearance,
        volume: Option<&Bound<'_, Volume>>,
        color_by: Option<&Bound<'_, Volume>>,
    ) -> PyResult<Picture> {
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.0).collect();
        let surfaces = appearance.revealed(surfaces_of(surfaces));
        let handle = self.0.clone();
        let [volume, color_by] = [volume, color_by].map(|v| v.map(|v| v.get().0.clone()));
        let gpu = backend::gpu(py, pictured.adapter.clone())?;
        watched(py, None, move |_| {
            for &isovalue in &isovalues {
                handle.summary().check_isovalue(isovalue)?;
            }
            let spectrum = handle.around(&isovalues)?;
            let mut view = pictured.view(&appearance, &spectrum, color_by.is_some())?;
            let volume = volume.map(|v| color_sources::swept_volume(v, &spectrum)).transpose()?;
            let sources = color_sources::sources(
                &spectrum,
                view.color,
                color_by.as_ref(),
                volume.as_ref(),
                VOLUME,
            )?;
            let mut renderer = Renderer::new(&gpu, &spectrum)?;
            renderer.set_sources(sources);
            if !pictured.fit_volume
                && let Some(bounds) = renderer.bounds(&isovalues, &view.keep)?
            {
                view.fit(spectrum.volume(), bounds);
            }
            renderer.draw_all(&surfaces, &view)
        })
        .map(Picture)
    }

    /// The spectrum as a web page, with a still picture if wanted and there is a GPU adapter. `surfaces` are as in `render`; the first is
    /// that of the slider.
    #[pyo3(signature = (surfaces, title, caption, credit, marks, range, tolerance, step, appearance, volume, color_by, has_slice, has_still))]
    #[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
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
        appearance: Appearance,
        volume: Option<&Bound<'_, Volume>>,
        color_by: Option<&Bound<'_, Volume>>,
        has_slice: bool,
        has_still: bool,
    ) -> PyResult<String> {
        let handle = self.0.clone();
        let [volume, color_by] = [volume, color_by].map(|v| v.map(|v| v.get().0.clone()));
        let mut also = appearance.revealed(surfaces_of(surfaces));
        let gpu = if has_still { backend::gpu_if_any(py)? } else { None };
        watched(py, None, move |_| {
            let volume =
                volume.map(|v| color_sources::swept_volume(v, handle.summary())).transpose()?;
            let mut spectrum = match range {
                Some(range) => {
                    let ends = [range.0, range.1];
                    ends.into_iter().try_for_each(|c| handle.summary().check_isovalue(c))?;
                    page::with_range(&*handle.around(&ends)?, range)?
                }
                None => Arc::unwrap_or_clone(handle.all()?),
            };
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
            let background = appearance.background()?;
            if background == Some(Background::Transparent) {
                return Err(Error::Usage(
                    "background 'transparent', expected white, light or dark".to_owned(),
                ));
            }
            let mut look = page::Look::default();
            look.occlusion = appearance.occlusion()?;
            look.wireframe = appearance.wireframe;
            look.silhouette = appearance.silhouette;
            look.opacity = first.opacity.unwrap_or(appearance.opacity);
            look.clip = appearance.clip();
            look.background = background;
            look.light = appearance.light()?;
            look.front = first.color.or(appearance.front()?);
            look.also = also;
            let color = appearance.color(color_by.is_some())?;
            let sources = color_sources::sources(
                &spectrum,
                color,
                color_by.as_ref(),
                volume.as_ref(),
                VOLUME,
            )?;
            let samples = volume.as_ref().map(Histogram::of);
            let mut page =
                Page::new(title.as_deref().unwrap_or(&spectrum.volume().name), first.isovalue)
                    .with_caption(caption.as_deref())
                    .with_credit(credit.as_deref())
                    .with_step(step.unwrap_or(page::DEFAULT_STEP))
                    .with_open(appearance.open)
                    .with_camera(appearance.camera()?)
                    .with_color(color)
                    .with_map(appearance.map()?)
                    .with_ends(appearance.ends()?)
                    .with_field(&sources)
                    .with_axes(appearance.axes)
                    .with_look(look)
                    .with_keep(appearance.keep(&spectrum))
                    .with_samples(samples.as_ref())
                    .with_statistics(statistics.as_ref())
                    .with_slice(volume.as_ref().filter(|_| has_slice))
                    .with_marks(&marks);
            let still = gpu.map(|gpu| page::still(&gpu, &spectrum, &page, first));
            let still = still.transpose()?;
            page.still = still.as_ref();
            page::html(&spectrum, &page).map(|(text, _)| text)
        })
    }
}

impl Spectrum {
    pub(crate) fn new(spectrum: isospectrum::Spectrum) -> Self {
        Spectrum::of(Handle::whole(spectrum))
    }

    pub(crate) fn of(handle: Handle) -> Self {
        Spectrum(Arc::new(handle))
    }

    /// The mesh in the voxel frame.
    fn mesh_at(&self, isovalue: f64, open: bool, keep: Option<Kept>) -> Result<Mesh> {
        let mesh = self.0.mesh_at(isovalue)?;
        let keep = keep.map(|keep| kept(Some(keep), self.0.summary()));
        Ok(shown(mesh, keep.as_ref(), open))
    }
}
