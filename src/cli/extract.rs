//! `extract`: the mesh at one isovalue or several, in a format of other programs.

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
use super::frames::{Pattern, SweepArgument};
use super::keep_arguments::KeepArguments;
use super::output::Output;
use super::spectrum_file::Opened;
use super::surface_argument::SurfaceArgument;
use super::{empty, heading, pvd, report, spectrum_file};

const EXAMPLES: &str = "\
Examples:
  Write the mesh at half of the range, or that which encloses the highest 1 % of the samples:
    isospectrum extract scan.isp -c 50% -o half.ply
    isospectrum extract scan.isp -c top:1% -o dense.stl
  Write bone and skin to one scene, coloured and half transparent:
    isospectrum extract scan.isp -c 1200=bone -c -200=skin@0.3 -o head.glb
  Write 40 meshes along the range, for ParaView:
    isospectrum extract scan.isp --sweep 10%:90%:40 -o scan.pvd";

/// Write the mesh at one isovalue or several
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = EXAMPLES)]
pub(super) struct Extract {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: 120, 50%, p99, 2.5sigma or top:1%
    ///
    /// A number, a percentage of the range (50%), a percentile of the samples (p99), standard deviations above their mean
    /// (2.5sigma), or the value that the highest 1 % of them exceed (top:1%). Give it again for several meshes. In a scene
    /// (.glb, .usda) of several, C=COLOR@OPACITY sets how each looks: 1200=bone@0.5.
    #[arg(
        short = 'c',
        long,
        value_name = "C",
        allow_hyphen_values = true,
        required_unless_present = "sweep"
    )]
    isovalue: Vec<SurfaceArgument>,
    /// N isovalues from A to B, e.g. 10%:90%:40
    ///
    /// Both ends are included. A .glb or .usda contains all meshes and plays them in twelve seconds.
    #[arg(long, value_name = "A:B:N", allow_hyphen_values = true, conflicts_with = "isovalue")]
    sweep: Option<SweepArgument>,
    /// Volume of the spectrum, for --color distance
    #[arg(long, value_name = "VOLUME", hide_short_help = true)]
    volume: Option<PathBuf>,
    #[command(flatten)]
    border: BorderArguments,
    #[command(flatten)]
    keep: KeepArguments,
    #[command(flatten)]
    color: ColorArguments,
    /// Mesh to write (.ply, .stl, .glb, ...)
    ///
    /// One of .ply, .stl, .obj, .glb, .vtp, .3mf, .usda, or - for stdout. For several isovalues: a pattern such as mesh-%d.ply, numbered from
    /// 0; one .glb or .usda with all of them; or a .pvd, which lists .vtp files next to it with the isovalue as their time.
    #[arg(short, long, value_name = "FILE", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Format, if the name of the output has no extension: ply, stl, ...
    #[arg(long, value_name = "FORMAT", help_heading = heading::OUTPUT, hide_short_help = true)]
    format: Option<String>,
    /// Write one mesh with morph targets (.glb)
    ///
    /// The mesh follows the isosurface. Needs --sweep over a range without events. The shapes at the N isovalues, at most 33, become morph targets.
    #[arg(long, conflicts_with_all = ["color", "color_by", "format", "json"], help_heading = heading::OUTPUT)]
    morph: bool,
    /// Print the report as JSON
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
}

/// The `extract` report.
#[derive(Serialize)]
struct Extracted {
    isovalue: f64,
    n_vertices: usize,
    n_triangles: usize,
    /// Size of its own file; none if several share a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

/// The `extract` report of several isovalues.
#[derive(Serialize)]
struct Several {
    meshes: Vec<Extracted>,
    /// Size of the file that contains all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

/// Duration of a sweep in one file, seconds; the same as in the page and the window.
const SWEEP_SECONDS: f64 = 12.0;

/// Distance of a morph target from its isosurface above which a warning is printed, voxels: half a voxel is visible.
const MAX_MORPH_DISTANCE: f64 = 0.5;

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
        let is_several = n_isovalues > 1 || self.sweep.is_some();
        // A name without a placeholder for a number is one file.
        let has_number = self.output.display().to_string().contains('%');
        let is_scene = is_several && format.supports_scenes() && !has_number;
        let outputs = if series {
            pvd::files(&self.output)?.open(n_isovalues as u32, &inputs)?
        } else if is_several && !is_scene {
            Pattern::of_any(&self.output)?.open(n_isovalues as u32, &inputs)?
        } else {
            vec![Output::open(&self.output, &inputs)?]
        };
        if self.json && outputs.iter().any(Output::is_stdout) {
            return Err(Error::Usage(
                "--json and -o - both write to stdout, expected one of them".to_owned(),
            )
            .into());
        }
        let opened = Opened::open(&self.spectrum)?;
        let surfaces = self.surfaces(opened.header())?;
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
                self.write_scene(&mut query, &spectrum, &sources, &surfaces, format, output)?;
        } else {
            for (surface, output) in surfaces.iter().zip(outputs) {
                let frame = self.frame(&mut query, &spectrum, &sources, surface)?;
                written.push(self.write(&spectrum, &frame, format, output)?);
            }
        }
        if let Some(list) = list {
            let times: Vec<f64> = written.iter().map(|mesh| mesh.isovalue).collect();
            list.write_bytes(pvd::list(&files, &times).as_bytes())?;
        }
        if self.json {
            match &written[..] {
                [one] => report::print_json("extract", one)?,
                _ => report::print_json("extract", &Several { meshes: written, bytes })?,
            }
        }
        Ok(())
    }

    /// Returns the requested isosurfaces.
    fn surfaces(&self, spectrum: &Spectrum) -> isospectrum::Result<Vec<Surface>> {
        if let Some(sweep) = self.sweep {
            return Ok(sweep.in_spectrum(spectrum)?.into_iter().map(Surface::from).collect());
        }
        let surface = |argument: &SurfaceArgument| {
            let surface = argument.in_spectrum(spectrum)?;
            spectrum.check_isovalue(surface.isovalue).map(|()| surface)
        };
        self.isovalue.iter().map(surface).collect()
    }

    /// Returns the kept components of the mesh at an isovalue, with their colours.
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
        let mut written = None;
        let bytes = output
            .write(|file| {
                written = Some(match colors {
                    Some((attribute, map)) => {
                        let colors = Colors { attribute, map: *map };
                        write_colored_to(mesh, placement, colors, format, file)
                    }
                    None => write_to(mesh, placement, Border::Closed, format, file),
                }?);
                Ok(())
            })
            .map_err(|e| e.of_file(&self.spectrum))?;
        // STL has fewer than the mesh where vertices coincide.
        let (n_vertices, n_triangles) =
            written.map_or((0, 0), |written| (written.n_vertices, written.n_triangles));
        log::info!(
            "{path}: {n_triangles} triangles, {n_vertices} vertices at isovalue {}, {}",
            report::number(style.isovalue),
            report::bytes(bytes)
        );
        Ok(Extracted { isovalue: style.isovalue, n_vertices, n_triangles, bytes: Some(bytes) })
    }

    /// Writes the meshes of several isovalues to one file. Returns the reports and the size of the file.
    fn write_scene(
        &self,
        query: &mut Query<&Spectrum>,
        spectrum: &Spectrum,
        sources: &ColorSources,
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
        let (n, size) = (written.len(), report::bytes(bytes));
        log::info!("{path}: {n} meshes, {n_triangles} triangles in total, {size}");
        Ok((written, Some(bytes)))
    }

    /// Writes one mesh with morph targets that follows the isosurface.
    fn write_morph(&self) -> anyhow::Result<()> {
        if Format::of_path(&self.output).ok() != Some(Format::Glb) {
            let shown = self.output.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .glb")).into());
        }
        if self.sweep.is_none() {
            return Err(Error::Usage("--morph needs --sweep".to_owned()).into());
        }
        let output = Output::open(&self.output, &[&self.spectrum])?;
        let opened = Opened::open(&self.spectrum)?;
        let isovalues: Vec<f64> =
            self.surfaces(opened.header())?.iter().map(|surface| surface.isovalue).collect();
        let spectrum = opened.around(&isovalues)?;
        let keep = self.keep.of(&spectrum);
        let morph = Morph::of(&spectrum, &isovalues, &keep, self.border.is_open(&spectrum))?;
        let path = output.name();
        let placement = &spectrum.volume().placement;
        let bytes = output
            .write(|file| write_morph_to(&morph, SWEEP_SECONDS, placement, file))
            .map_err(|e| e.of_file(&self.spectrum))?;
        log::info!(
            "{path}: {} triangles, {} morph targets, {}; largest distance from the isosurface {} voxels",
            morph.mesh.triangles.len(),
            morph.targets.len(),
            report::bytes(bytes),
            report::number(morph.max_distance)
        );
        if morph.max_distance > MAX_MORPH_DISTANCE {
            log::warn!(
                "{path}: the morph targets miss parts of the isosurface that grow between vertices; use a shorter range"
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
            // PLY is the format that most programs read from a pipe.
            None if self.output == Path::new("-") => Ok(Format::Ply),
            None => Format::of_path(&self.output),
        }
    }

    /// Checks that the extension does not contradict `--format`.
    fn check_name(&self, format: Format, name: &str) -> isospectrum::Result<()> {
        let by_name = Format::of_path(&self.output).ok();
        if by_name.is_none_or(|by_name| by_name == format)
            && spectrum_file::Format::of_name(&self.output).is_err()
        {
            return Ok(());
        }
        let shown = self.output.display();
        Err(Error::Usage(format!("{shown}: the extension contradicts --format {name}")))
    }
}
