//! Meshes of several isovalues, morphing meshes and films, written to files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use isospectrum::color::{Color, ColorSources};
use isospectrum::export::Format;
use isospectrum::extraction::{self, Extraction, MeshFiles, morph_file};
use isospectrum::render::Renderer;
use isospectrum::series::{Frames, Series};
use isospectrum::volume::files_of;
use isospectrum::{Result, Volume as Samples, color_sources};
use pyo3::prelude::*;

use crate::appearance::Appearance;
use crate::backend;
use crate::picture::{Pictured, Shown, surfaces_of};
use crate::spectrum::{Spectrum, VOLUME};
use crate::volume::Volume;
use crate::watch::watched;

/// Written meshes: isovalue, name of the file, vertices, triangles.
type Rows = Vec<(f64, String, usize, usize)>;

/// Volumes that colours need: that of the spectrum, and another one that they show.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Volumes<'py> {
    volume: Option<Bound<'py, Volume>>,
    color_by: Option<Bound<'py, Volume>>,
    /// The files of both, which no output may replace.
    inputs: Vec<PathBuf>,
}

impl Volumes<'_> {
    fn taken(&self) -> [Option<Samples>; 2] {
        [&self.volume, &self.color_by].map(|v| v.as_ref().map(|v| v.get().0.clone()))
    }

    /// All files that are read, with that of the spectrum.
    fn inputs(&self, spectrum: Option<&Path>) -> Vec<PathBuf> {
        let files = self.inputs.iter().flat_map(|path| files_of(path));
        spectrum.map(Path::to_owned).into_iter().chain(files).collect()
    }
}

/// The sources of colours that show `color`.
fn sources(
    spectrum: &isospectrum::Spectrum,
    color: Color,
    [volume, color_by]: [Option<Samples>; 2],
) -> Result<ColorSources> {
    let volume = volume.map(|v| color_sources::swept_volume(v, spectrum)).transpose()?;
    color_sources::sources(spectrum, color, color_by.as_ref(), volume.as_ref(), VOLUME)
}

/// Writes the meshes of isosurfaces, each with its sRGB colour and opacity.
#[pyfunction]
#[pyo3(signature = (spectrum, path, format, surfaces, is_sweep, appearance, volumes, progress))]
#[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
pub(crate) fn extract(
    py: Python<'_>,
    spectrum: &Bound<'_, Spectrum>,
    path: PathBuf,
    format: Option<String>,
    surfaces: Vec<Shown>,
    is_sweep: bool,
    appearance: Appearance,
    volumes: Volumes<'_>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Rows> {
    let handle = spectrum.get().0.clone();
    let (inputs, volumes, has_other) =
        (volumes.inputs(handle.path()), volumes.taken(), volumes.color_by.is_some());
    watched(py, progress, move |watched| {
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let format = format.map(|name| Format::of_path(Path::new(&format!("mesh.{name}"))));
        let surfaces = surfaces_of(surfaces);
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        isovalues.iter().try_for_each(|&c| handle.summary().check_isovalue(c))?;
        let color = appearance.color(has_other)?;
        let files = MeshFiles::open(&path, format.transpose()?, surfaces.len(), is_sweep, &inputs)?;
        files.check_color(color)?;
        let spectrum = handle.around(&isovalues)?;
        let sources = sources(&spectrum, color, volumes)?;
        let extraction = Extraction {
            surfaces,
            is_sweep,
            color,
            map: appearance.map()?,
            ends: appearance.ends()?,
            keep: appearance.keep(&spectrum),
            open: appearance.open,
        };
        let mut rows = Rows::new();
        let mut written = |mesh: extraction::Extracted| {
            rows.push((mesh.isovalue, mesh.file, mesh.n_vertices, mesh.n_triangles));
        };
        extraction.write(&spectrum, &sources, files, watched, &mut |_, _| {}, &mut written)?;
        Ok(rows)
    })
}

/// Writes one mesh with morph targets. Returns its numbers of vertices and triangles, and the largest distance from the
/// isosurface, voxels.
#[pyfunction]
#[pyo3(signature = (spectrum, path, isovalues, appearance, progress))]
pub(crate) fn write_morph(
    py: Python<'_>,
    spectrum: &Bound<'_, Spectrum>,
    path: PathBuf,
    isovalues: Vec<f64>,
    appearance: Appearance,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<(usize, usize, f64)> {
    let handle = spectrum.get().0.clone();
    watched(py, progress, move |watched| {
        let inputs: Vec<&Path> = handle.path().into_iter().collect();
        let output = morph_file(&path, &inputs)?;
        isovalues.iter().try_for_each(|&c| handle.summary().check_isovalue(c))?;
        let spectrum = handle.around(&isovalues)?;
        let keep = appearance.keep(&spectrum);
        let (morph, _) = extraction::write_morph(
            &spectrum,
            &isovalues,
            &keep,
            appearance.open,
            output,
            watched,
        )?;
        let mesh = &morph.mesh;
        Ok((mesh.positions.len(), mesh.triangles.len(), morph.max_distance))
    })
}

/// Writes a film or numbered pictures: of one isosurface each, with its text at the top, or of the same surfaces from all around.
#[pyfunction]
#[pyo3(signature = (spectrum, path, fps, sweep, surfaces, turntable, pictured, appearance, volumes, progress))]
#[allow(clippy::too_many_arguments, reason = "passed by name in Python")]
pub(crate) fn film(
    py: Python<'_>,
    spectrum: &Bound<'_, Spectrum>,
    path: PathBuf,
    fps: Option<u32>,
    sweep: Vec<(f64, Option<String>)>,
    surfaces: Vec<Shown>,
    turntable: Option<u32>,
    pictured: Pictured,
    appearance: Appearance,
    volumes: Volumes<'_>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<()> {
    let handle = spectrum.get().0.clone();
    let (inputs, volumes, has_other) =
        (volumes.inputs(handle.path()), volumes.taken(), volumes.color_by.is_some());
    let gpu = backend::gpu(py, pictured.adapter.clone())?;
    watched(py, progress, move |watched| {
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let background = appearance.background()?.unwrap_or_default();
        let series = Series::of(&path, fps, pictured.size.into(), background)?;
        let of_turntable = surfaces.iter().map(|surface| surface.0);
        let isovalues: Vec<f64> = sweep.iter().map(|row| row.0).chain(of_turntable).collect();
        isovalues.iter().try_for_each(|&c| handle.summary().check_isovalue(c))?;
        let spectrum = handle.around(&isovalues)?;
        let view = pictured.view(&appearance, &spectrum, has_other)?;
        let sources = sources(&spectrum, view.color, volumes)?;
        let mut renderer = Renderer::new(&gpu, &spectrum)?;
        renderer.set_sources(sources);
        let is_fitted = !pictured.fit_volume;
        let frames = match turntable {
            None => {
                let labels: BTreeMap<u64, Option<String>> =
                    sweep.into_iter().map(|(c, label)| (c.to_bits(), label)).collect();
                let label = |c: f64| labels.get(&c.to_bits()).cloned().flatten();
                Frames::sweep(&mut renderer, view, &isovalues, is_fitted, &label)?
            }
            Some(n) => {
                let surfaces = appearance.revealed(surfaces_of(surfaces));
                Frames::turntable(&mut renderer, &view, &surfaces, is_fitted, n)?
            }
        };
        frames.write(&mut renderer, &series, &inputs, watched)
    })
}
