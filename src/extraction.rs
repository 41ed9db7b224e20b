//! Meshes of one isovalue or several as files: one file each, a scene of all, a list of files, or one mesh with morph targets.

use std::path::Path;

use crate::color::{Color, ColorSources, Map, ScaleEnds, SpectrumMesh};
use crate::error::{Error, Result};
use crate::export::{
    Arrangement, Border, Colors, Format, Morph, NO_COLORS, SceneMesh, SurfaceStyle,
    write_colored_to, write_morph_to, write_scene_to, write_to,
};
use crate::output::Output;
use crate::progress::Progress;
use crate::render::{Surface, plain_color};
use crate::series::{Pattern, pvd};
use crate::spectrum::{Keep, Query, Spectrum};

/// Duration of a sweep in one file, seconds; the same as in the page and the window.
const SWEEP_SECONDS: f64 = 12.0;

/// Distance of a morph target from its isosurface above which a warning is logged, voxels: half a voxel is visible.
const MAX_MORPH_DISTANCE: f64 = 0.5;

/// The meshes to write.
#[derive(Clone, Debug)]
pub struct Extraction {
    /// Their isovalues; in a scene of several, their colours and opacities, too.
    pub surfaces: Vec<Surface>,
    /// True for the isovalues of a sweep, which a scene plays one after the other.
    pub is_sweep: bool,
    /// What colours show.
    pub color: Color,
    /// The colour map; `None` for the default map of the colour.
    pub map: Option<Map>,
    /// The values at the ends of the colour map.
    pub ends: ScaleEnds,
    /// The components to write.
    pub keep: Keep,
    /// Whether caps are left out.
    pub open: bool,
}

/// The files of an extraction, which could be written when they were opened.
#[derive(Debug)]
pub struct MeshFiles {
    format: Format,
    /// The list of the other files.
    list: Option<Output>,
    outputs: Vec<Output>,
    is_scene: bool,
}

/// A mesh that was written.
#[derive(Clone, Debug)]
pub struct Extracted {
    /// Its isovalue.
    pub isovalue: f64,
    /// Name of its file.
    pub file: String,
    /// Number of vertices in the file.
    pub n_vertices: usize,
    /// Number of triangles in the file; STL has fewer than the mesh where vertices coincide.
    pub n_triangles: usize,
    /// Size of its own file; none if several share a file.
    pub bytes: Option<u64>,
}

impl MeshFiles {
    /// Opens the files for `n` meshes at `path`: a file; a pattern such as `mesh-%d.ply`; one `.glb` or `.usda` for all of a
    /// sweep or of several; or a `.pvd`, which lists `.vtp` files next to it. None of them may be one of `inputs`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a name that does not suit the number of meshes or is an input; [`Error::Io`].
    pub fn open(
        path: &Path,
        format: Option<Format>,
        n: usize,
        is_sweep: bool,
        inputs: &[&Path],
    ) -> Result<Self> {
        let is_list = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvd"));
        let format = match format {
            _ if is_list => Format::Vtp,
            Some(format) => format,
            None => Format::of_path(path)?,
        };
        let list = is_list.then(|| Output::open(path, inputs)).transpose()?;
        let is_several = n > 1 || is_sweep;
        // A name without a placeholder for a number is one file.
        let has_number = path.display().to_string().contains('%');
        let is_scene = is_several && format.supports_scenes() && !has_number;
        let outputs = if is_list {
            pvd::files(path)?.open(n as u32, inputs)?
        } else if is_several && !is_scene {
            Pattern::of_any(path)?.open(n as u32, inputs)?
        } else {
            vec![Output::open(path, inputs)?]
        };
        Ok(MeshFiles { format, list, outputs, is_scene })
    }

    /// True if one of them is the standard output.
    pub fn has_stdout(&self) -> bool {
        self.outputs.iter().any(Output::is_stdout)
    }

    /// Checks that the format can hold colours that show `color`.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`].
    pub fn check_color(&self, color: Color) -> Result<()> {
        if !self.format.supports_colors() && !matches!(color, Color::None | Color::Normal) {
            return Err(Error::Usage(NO_COLORS.to_owned()));
        }
        Ok(())
    }
}

impl Extraction {
    /// Writes the meshes. `made` is called with the isovalue and the number of triangles of each when it is
    /// made, `written` when its file is complete; in a scene, `written` after all. Returns the size of the file that all share, if they do.
    ///
    /// # Errors
    ///
    /// [`Error::Range`]; those of colours and of [`crate::export::write_to`]; [`Error::Interrupted`].
    pub fn write(
        &self,
        spectrum: &Spectrum,
        sources: &ColorSources,
        files: MeshFiles,
        progress: &dyn Progress,
        made: &mut dyn FnMut(f64, usize),
        written: &mut dyn FnMut(Extracted),
    ) -> Result<Option<u64>> {
        let MeshFiles { format, list, outputs, is_scene } = files;
        let mut query = Query::for_some(spectrum, self.surfaces.len());
        let mut meshes = Meshes { extraction: self, spectrum, sources, query: &mut query, made };
        let n = self.surfaces.len() as f64;
        if is_scene {
            let output = outputs.into_iter().next().ok_or_else(|| Error::internal("no output"))?;
            return meshes.write_scene(format, output, progress, written).map(Some);
        }
        let names: Vec<String> = outputs.iter().map(Output::name).collect();
        for (i, (surface, output)) in self.surfaces.iter().zip(outputs).enumerate() {
            if progress.cancelled() {
                return Err(Error::Interrupted);
            }
            progress.report(i as f64 / n, "writing meshes");
            written(meshes.write_one(surface, format, output, progress)?);
        }
        if let Some(list) = list {
            let times: Vec<f64> = self.surfaces.iter().map(|surface| surface.isovalue).collect();
            list.write_bytes(progress, pvd::list(&names, &times).as_bytes())?;
        }
        Ok(None)
    }
}

/// Makes and writes the meshes of an extraction.
struct Meshes<'a, 'q> {
    extraction: &'a Extraction,
    spectrum: &'a Spectrum,
    sources: &'a ColorSources,
    query: &'q mut Query<&'a Spectrum>,
    made: &'q mut dyn FnMut(f64, usize),
}

impl Meshes<'_, '_> {
    /// The kept components of the mesh at an isovalue, with their colours.
    fn frame(&mut self, surface: &Surface) -> Result<SceneMesh> {
        let Surface { isovalue, color, opacity } = *surface;
        let Extraction { keep, open, ends, .. } = self.extraction;
        let (spectrum, shown) = (self.spectrum, self.extraction.color);
        let whole = self.query.mesh_at(isovalue)?;
        let (vertices, triangles) = self.query.parts();
        let parts = SpectrumMesh { spectrum, isovalue, mesh: &whole, vertices, triangles };
        let attribute = parts.attribute(shown, self.sources, *ends)?;
        let (mesh, kept) = whole.kept(keep, *open);
        let attribute = attribute.map(|attribute| attribute.of_part(&kept));
        let map = self.extraction.map.unwrap_or_else(|| shown.default_map(self.sources));
        (self.made)(isovalue, mesh.triangles.len());
        let style = SurfaceStyle {
            isovalue,
            color: color.unwrap_or_else(|| plain_color(0)),
            opacity: opacity.unwrap_or(1.0),
        };
        Ok(SceneMesh { mesh, style, colors: attribute.map(|attribute| (attribute, map)) })
    }

    /// Writes the mesh of one isovalue.
    fn write_one(
        &mut self,
        surface: &Surface,
        format: Format,
        output: Output,
        progress: &dyn Progress,
    ) -> Result<Extracted> {
        let SceneMesh { mesh, style, colors } = self.frame(surface)?;
        let file = output.name();
        let placement = &self.spectrum.volume().placement;
        let mut written = None;
        let bytes = output.write(progress, |writer| {
            written = Some(match &colors {
                Some((attribute, map)) => {
                    let colors = Colors { attribute, map: *map };
                    write_colored_to(&mesh, placement, colors, format, writer)
                }
                None => write_to(&mesh, placement, Border::Closed, format, writer),
            }?);
            Ok(())
        })?;
        let (n_vertices, n_triangles) =
            written.map_or((0, 0), |written| (written.n_vertices, written.n_triangles));
        let isovalue = style.isovalue;
        Ok(Extracted { isovalue, file, n_vertices, n_triangles, bytes: Some(bytes) })
    }

    /// Writes the meshes of all isovalues to one file. Returns its size.
    fn write_scene(
        &mut self,
        format: Format,
        output: Output,
        progress: &dyn Progress,
        written: &mut dyn FnMut(Extracted),
    ) -> Result<u64> {
        let Extraction { surfaces, is_sweep, .. } = self.extraction;
        let file = output.name();
        let mut frames = Vec::new();
        for (i, surface) in surfaces.iter().enumerate() {
            if progress.cancelled() {
                return Err(Error::Interrupted);
            }
            progress.report(i as f64 / surfaces.len() as f64, "writing meshes");
            let mut frame = self.frame(surface)?;
            if surface.color.is_none() && !is_sweep {
                frame.style.color = plain_color(i);
            }
            frames.push(frame);
        }
        let extracted: Vec<Extracted> = (frames.iter())
            .map(|SceneMesh { mesh, style, .. }| Extracted {
                isovalue: style.isovalue,
                file: file.clone(),
                n_vertices: mesh.positions.len(),
                n_triangles: mesh.triangles.len(),
                bytes: None,
            })
            .collect();
        let arrangement = match is_sweep {
            true => Arrangement::Sweep { seconds: SWEEP_SECONDS },
            false => Arrangement::Together,
        };
        let placement = &self.spectrum.volume().placement;
        let bytes = output.write(progress, |writer| {
            write_scene_to(frames, arrangement, placement, format, writer)
        })?;
        extracted.into_iter().for_each(written);
        Ok(bytes)
    }
}

/// Writes one mesh with morph targets that follows the isosurface over `isovalues`, as GLB, and warns if it misses parts of
/// it. Returns the mesh, and the size of the file.
///
/// # Errors
///
/// Those of [`Morph::of`] and of [`write_morph_to`]; [`Error::Interrupted`].
pub fn write_morph(
    spectrum: &Spectrum,
    isovalues: &[f64],
    keep: &Keep,
    open: bool,
    output: Output,
    progress: &dyn Progress,
) -> Result<(Morph, u64)> {
    let morph = Morph::of(spectrum, isovalues, keep, open)?;
    let (file, placement) = (output.name(), &spectrum.volume().placement);
    let bytes = output
        .write(progress, |writer| write_morph_to(&morph, SWEEP_SECONDS, placement, writer))?;
    if morph.max_distance > MAX_MORPH_DISTANCE {
        log::warn!(
            "{file}: the morph targets miss parts of the isosurface that grow between vertices; use a shorter range"
        );
    }
    Ok((morph, bytes))
}

/// The file for [`write_morph`] at `path`, which must not be one of `inputs`.
///
/// # Errors
///
/// [`Error::Usage`] unless the name ends in `.glb`, and if it is an input; [`Error::Io`].
pub fn morph_file(path: &Path, inputs: &[&Path]) -> Result<Output> {
    if Format::of_path(path).ok() != Some(Format::Glb) {
        let shown = path.display();
        return Err(Error::Usage(format!("{shown}: expected a name that ends in .glb")));
    }
    Output::open(path, inputs)
}
