//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::color::{Color, ColorSources, SpectrumMesh};
use isospectrum::export::{
    Arrangement, Border, Colors, Format, Morph, NO_COLORS, SceneMesh, SurfaceStyle,
    write_colored_to, write_morph_to, write_scene_to, write_to,
};
use isospectrum::render::{Surface, plain_color};
use isospectrum::spectrum::{Query, Spectrum};
use serde::Serialize;

use super::border_arguments::BorderArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::frames::{Pattern, Sweep};
use super::keep_arguments::KeepArguments;
use super::output::Output;
use super::spectrum_file::Opened;
use super::surface_argument::SurfaceArgument;
use super::{empty, report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp, or a folder .ispt)
    spectrum: PathBuf,
    /// Isovalue: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of them;
    /// again for several meshes. C=COLOR@OPACITY, as render takes it, tells how each looks in a .glb or .usda of several
    #[arg(
        short = 'c',
        long,
        value_name = "C[=COLOR][@OPACITY]",
        allow_hyphen_values = true,
        required_unless_present = "sweep"
    )]
    isovalue: Vec<SurfaceArgument>,
    /// N isovalues from A to B, both included, e.g. 10%:90%:40; a .glb or .usda holds all of them and plays them in
    /// twelve seconds
    #[arg(long, value_name = "A:B:N", allow_hyphen_values = true, conflicts_with = "isovalue")]
    sweep: Option<Sweep>,
    /// With --sweep over a range without events: one mesh that follows the isosurface, its shapes at the N isovalues as morph
    /// targets of a .glb (at most 33)
    #[arg(long, conflicts_with_all = ["color", "color_by", "format", "json"])]
    morph: bool,
    /// Mesh to write: .ply, .stl, .obj, .glb, .vtp, .3mf or .usda; - is stdout; of several isovalues a pattern such as
    /// mesh-%d.ply, numbered from 0, a .glb or .usda of all of them, or a .pvd, which lists .vtp beside it with the isovalue
    /// as their time
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, where the name does not tell: ply, stl, obj, glb, vtp, 3mf or usda
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    #[command(flatten)]
    color: ColorArguments,
    /// The volume of the spectrum, for --color distance
    #[arg(long, value_name = "VOLUME")]
    volume: Option<PathBuf>,
    /// Print what was written as JSON
    #[arg(long)]
    json: bool,
}

/// The `extract` report.
#[derive(Serialize)]
struct Extracted {
    isovalue: f64,
    n_vertices: usize,
    n_triangles: usize,
    /// Of its own file; none where several are in one.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

/// The same of several isovalues.
#[derive(Serialize)]
struct Several {
    meshes: Vec<Extracted>,
    /// Of the file that holds all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

/// How long a sweep in one file takes, seconds; as the page and the window play it.
const SWEEP_SECONDS: f64 = 12.0;

/// What is further from an isosurface than this is warned of, voxels.
const FAR: f64 = 0.5;

/// The list of a series of meshes as ParaView and PyVista read it: files beside it, with isovalues as their time.
fn pvd(files: &[String], isovalues: &[f64]) -> String {
    let escaped = |text: &str| {
        let name = Path::new(text).file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
    };
    let rows = files.iter().zip(isovalues).map(|(file, isovalue)| {
        format!("<DataSet timestep=\"{isovalue}\" part=\"0\" file=\"{}\"/>\n", escaped(file))
    });
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n\
         <Collection>\n{}</Collection>\n</VTKFile>\n",
        rows.collect::<String>()
    )
}

impl Extract {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        if self.morph {
            return self.write_morph();
        }
        let series = self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvd"));
        let format = if series { Format::Vtp } else { self.format()? };
        let n_isovalues = self.sweep.map_or(self.isovalue.len(), |sweep| sweep.n_frames() as usize);
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let list = series.then(|| Output::open(&self.output, &inputs)).transpose()?;
        let pattern = match series {
            true => self.output.with_extension("").display().to_string() + "-%04d.vtp",
            false => self.output.display().to_string(),
        };
        let pattern = PathBuf::from(pattern);
        let is_several = n_isovalues > 1 || self.sweep.is_some();
        // A name without a place for a number is one file.
        let is_scene =
            is_several && format.supports_scenes() && !pattern.display().to_string().contains('%');
        let outputs = match is_several && !is_scene || series {
            false => vec![Output::open(&self.output, &inputs)?],
            true => Pattern::of_any(&pattern)?.open(n_isovalues as u32, &inputs)?,
        };
        if self.json && outputs.iter().any(Output::is_stdout) {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let opened = Opened::open(&self.spectrum)?;
        let surfaces = self.surfaces(opened.told())?;
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        let spectrum = opened.around(&isovalues)?;
        let files = outputs.iter().map(Output::name).collect::<Vec<_>>();
        if !format.supports_colors() && !matches!(self.color.shown(), Color::None | Color::Normal) {
            return Err(Error::Usage(NO_COLORS.to_owned()).into());
        }
        let volume = self.volume.as_ref().map(|path| volume_of(path, &spectrum)).transpose()?;
        let sources = self.color.sources(&spectrum, volume)?;
        let mut query = Query::for_some(&spectrum, surfaces.len());
        let mut written = Vec::new();
        let mut bytes = None;
        if is_scene {
            let output = outputs.into_iter().next().ok_or_else(|| Error::internal("no output"))?;
            (written, bytes) =
                self.write_scene(&mut query, (&spectrum, &sources), &surfaces, format, output)?;
        } else {
            for (surface, output) in surfaces.iter().zip(outputs) {
                let frame = self.frame(&mut query, &spectrum, &sources, surface)?;
                written.push(self.write(&spectrum, &frame, format, output)?);
            }
        }
        if let Some(list) = list {
            let times: Vec<f64> = written.iter().map(|mesh| mesh.isovalue).collect();
            list.write_bytes(pvd(&files, &times).as_bytes())?;
        }
        if self.json {
            match &written[..] {
                [one] => report::print_json("extract", one)?,
                _ => report::print_json("extract", &Several { meshes: written, bytes })?,
            }
        }
        Ok(())
    }

    /// The isosurfaces that are asked for.
    fn surfaces(&self, spectrum: &Spectrum) -> isospectrum::Result<Vec<Surface>> {
        if let Some(sweep) = self.sweep {
            return Ok(sweep.in_spectrum(spectrum)?.into_iter().map(Surface::from).collect());
        }
        let surface = |written: &SurfaceArgument| {
            let surface = written.in_spectrum(spectrum)?;
            spectrum.check_isovalue(surface.isovalue).map(|()| surface)
        };
        self.isovalue.iter().map(surface).collect()
    }

    /// The mesh of an isovalue as far as it is kept, and what its colours show.
    fn frame(
        &self,
        query: &mut Query<&Spectrum>,
        spectrum: &Spectrum,
        sources: &ColorSources,
        surface: &Surface,
    ) -> anyhow::Result<SceneMesh> {
        let Surface { isovalue, color, opacity } = *surface;
        let keep = self.keep.of(spectrum);
        let whole = query.mesh_at(isovalue)?;
        let (vertices, triangles) = query.parts();
        let parts = SpectrumMesh { spectrum, isovalue, mesh: &whole, vertices, triangles };
        let attribute = parts.attribute(self.color.shown(), sources, self.color.ends())?;
        let (mesh, kept) = whole.kept(&keep, self.border.is_open(spectrum));
        let attribute = attribute.map(|attribute| attribute.of_part(&kept));
        let map = self.color.color_map;
        let map = map.unwrap_or_else(|| self.color.shown().default_map(sources));
        empty::warn(spectrum, isovalue, self.border.is_open(spectrum));
        empty::warn_of_components(mesh.triangles.len(), &keep);
        let style = SurfaceStyle {
            isovalue,
            color: color.unwrap_or_else(|| plain_color(0)),
            opacity: opacity.unwrap_or(1.0),
        };
        Ok(SceneMesh { mesh, style, colors: attribute.map(|attribute| (attribute, map)) })
    }

    /// Writes the mesh of one isovalue.
    fn write(
        &self,
        spectrum: &Spectrum,
        SceneMesh { mesh, style, colors }: &SceneMesh,
        format: Format,
        output: Output,
    ) -> anyhow::Result<Extracted> {
        let path = output.name();
        let placement = &spectrum.volume().placement;
        let bytes = output
            .write(|file| match colors {
                Some((attribute, map)) => {
                    let colors = Colors { attribute, map: *map };
                    write_colored_to(mesh, placement, colors, format, file)
                }
                None => write_to(mesh, placement, Border::Closed, format, file),
            })
            .map_err(|e| e.of_file(&self.spectrum))?;
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        log::info!(
            "{path}: {n_triangles} triangles, {n_vertices} vertices at isovalue {}, {}",
            report::number(style.isovalue),
            report::bytes(bytes)
        );
        Ok(Extracted { isovalue: style.isovalue, n_vertices, n_triangles, bytes: Some(bytes) })
    }

    /// Writes the meshes of several isovalues into one file; what they are, and its bytes.
    fn write_scene(
        &self,
        query: &mut Query<&Spectrum>,
        (spectrum, sources): (&Spectrum, &ColorSources),
        surfaces: &[Surface],
        format: Format,
        output: Output,
    ) -> anyhow::Result<(Vec<Extracted>, Option<u64>)> {
        let path = output.name();
        let mut frames = Vec::new();
        for (i, surface) in surfaces.iter().enumerate() {
            let mut frame = self.frame(query, spectrum, sources, surface)?;
            if surface.color.is_none() && self.sweep.is_none() {
                frame.style.color = plain_color(i);
            }
            frames.push(frame);
        }
        let written: Vec<Extracted> = (frames.iter())
            .map(|SceneMesh { mesh, style, .. }| Extracted {
                isovalue: style.isovalue,
                n_vertices: mesh.positions.len(),
                n_triangles: mesh.triangles.len(),
                bytes: None,
            })
            .collect();
        let arrangement = match self.sweep {
            Some(_) => Arrangement::Sweep { seconds: SWEEP_SECONDS },
            None => Arrangement::Together,
        };
        let placement = &spectrum.volume().placement;
        let bytes = output
            .write(|file| write_scene_to(frames, arrangement, placement, format, file))
            .map_err(|e| e.of_file(&self.spectrum))?;
        let n_triangles: usize = written.iter().map(|mesh| mesh.n_triangles).sum();
        let (n, bytes_told) = (written.len(), report::bytes(bytes));
        log::info!("{path}: {n} meshes of {n_triangles} triangles together, {bytes_told}");
        Ok((written, Some(bytes)))
    }

    /// Writes one mesh that follows the isosurface.
    fn write_morph(&self) -> anyhow::Result<()> {
        if Format::of_path(&self.output).ok() != Some(Format::Glb) {
            let shown = self.output.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .glb")).into());
        }
        if self.sweep.is_none() {
            return Err(Error::Usage("--morph, expected --sweep with it".to_owned()).into());
        }
        let output = Output::open(&self.output, &[&self.spectrum])?;
        let opened = Opened::open(&self.spectrum)?;
        let isovalues: Vec<f64> =
            self.surfaces(opened.told())?.iter().map(|surface| surface.isovalue).collect();
        let spectrum = opened.around(&isovalues)?;
        let keep = self.keep.of(&spectrum);
        let morph = Morph::of(&spectrum, &isovalues, &keep, self.border.is_open(&spectrum))?;
        let path = output.name();
        let placement = &spectrum.volume().placement;
        let bytes = output
            .write(|file| write_morph_to(&morph, SWEEP_SECONDS, placement, file))
            .map_err(|e| e.of_file(&self.spectrum))?;
        log::info!(
            "{path}: {} triangles and {} morph targets, {}; isosurfaces lie at most {} voxels beside it",
            morph.mesh.triangles.len(),
            morph.targets.len(),
            report::bytes(bytes),
            report::number(morph.max_distance)
        );
        if morph.max_distance > FAR {
            log::warn!(
                "{path}: what grows out between its vertices is not in it; a shorter range is followed better"
            );
        }
        Ok(())
    }

    fn format(&self) -> isospectrum::Result<Format> {
        match &self.format {
            Some(name) => {
                let format = Format::of_path(Path::new(&format!("mesh.{name}")))?;
                self.check_name(format, name)?;
                Ok(format)
            }
            // Other programs read PLY from a pipe.
            None if self.output == Path::new("-") => Ok(Format::Ply),
            None => Format::of_path(&self.output),
        }
    }
}

impl Extract {
    /// A name that tells another format would lie about what is in the file.
    fn check_name(&self, format: Format, name: &str) -> isospectrum::Result<()> {
        let told = Format::of_path(&self.output).ok();
        if told.is_none_or(|told| told == format)
            && spectrum_file::Format::of_name(&self.output).is_err()
        {
            return Ok(());
        }
        let shown = self.output.display();
        Err(Error::Usage(format!("{shown}: its name tells another format than --format {name}")))
    }
}
