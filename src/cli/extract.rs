//! `extract`: the mesh at one isovalue or several, in a format of other programs.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::export::Format;
use isospectrum::extraction::{self, Extraction, MeshFiles, morph_file, write_morph};
use isospectrum::render::Surface;
use isospectrum::spectrum::Spectrum;
use serde::Serialize;

use super::border_arguments::BorderArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::interrupt::Signals;
use super::keep_arguments::KeepArguments;
use super::spectrum_file::Opened;
use super::surface_argument::SurfaceArgument;
use super::sweep_argument::SweepArgument;
use super::{empty, heading, report, spectrum_file};

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

impl From<extraction::Extracted> for Extracted {
    fn from(mesh: extraction::Extracted) -> Self {
        let extraction::Extracted { isovalue, n_vertices, n_triangles, bytes, .. } = mesh;
        Extracted { isovalue, n_vertices, n_triangles, bytes }
    }
}

/// The `extract` report of several isovalues.
#[derive(Serialize)]
struct Several {
    meshes: Vec<Extracted>,
    /// Size of the file that contains all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    bytes: Option<u64>,
}

impl Extract {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        if self.morph {
            return self.write_morph();
        }
        let n_isovalues = self.sweep.map_or(self.isovalue.len(), |sweep| sweep.n_frames() as usize);
        let inputs = self.color.inputs(&self.spectrum, self.volume.as_ref());
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let is_sweep = self.sweep.is_some();
        let format = if self.is_list() { None } else { Some(self.format()?) };
        let files = MeshFiles::open(&self.output, format, n_isovalues, is_sweep, &inputs)?;
        if self.json && files.has_stdout() {
            return Err(Error::Usage(
                "--json and -o - both write to stdout, expected one of them".to_owned(),
            )
            .into());
        }
        let opened = Opened::open(&self.spectrum)?;
        let surfaces = self.surfaces(opened.header())?;
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        let spectrum = opened.around(&isovalues)?;
        files.check_color(self.color.shown())?;
        let volume = self.volume.as_ref().map(|path| volume_of(path, &spectrum)).transpose()?;
        let sources = self.color.sources(&spectrum, volume)?;
        let extraction = Extraction {
            surfaces,
            is_sweep,
            color: self.color.shown(),
            map: self.color.color_map,
            ends: self.color.ends(),
            keep: self.keep.of(&spectrum),
            open: self.border.is_open(&spectrum),
        };
        let mut meshes = Vec::new();
        let mut made = |isovalue, n_triangles| {
            empty::warn(&spectrum, isovalue, extraction.open);
            empty::warn_of_components(n_triangles, &extraction.keep);
        };
        let mut written = |mesh: extraction::Extracted| {
            if let Some(bytes) = mesh.bytes {
                log::info!(
                    "{}: {} triangles, {} vertices at isovalue {}, {}",
                    mesh.file,
                    mesh.n_triangles,
                    mesh.n_vertices,
                    report::number(mesh.isovalue),
                    report::bytes(bytes)
                );
            }
            meshes.push(Extracted::from(mesh));
        };
        let bytes = extraction
            .write(&spectrum, &sources, files, &Signals, &mut made, &mut written)
            .map_err(|e| e.of_file(&self.spectrum))?;
        if let Some(bytes) = bytes {
            let n_triangles: usize = meshes.iter().map(|mesh| mesh.n_triangles).sum();
            let (path, n, size) = (self.output.display(), meshes.len(), report::bytes(bytes));
            log::info!("{path}: {n} meshes, {n_triangles} triangles in total, {size}");
        }
        if self.json {
            match &meshes[..] {
                [one] => report::print_json("extract", one)?,
                _ => report::print_json("extract", &Several { meshes, bytes })?,
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

    /// Writes one mesh with morph targets that follows the isosurface.
    fn write_morph(&self) -> anyhow::Result<()> {
        if self.sweep.is_none() {
            return Err(Error::Usage("--morph needs --sweep".to_owned()).into());
        }
        let output = morph_file(&self.output, &[&self.spectrum])?;
        let opened = Opened::open(&self.spectrum)?;
        let isovalues: Vec<f64> =
            self.surfaces(opened.header())?.iter().map(|surface| surface.isovalue).collect();
        let spectrum = opened.around(&isovalues)?;
        let (keep, open) = (self.keep.of(&spectrum), self.border.is_open(&spectrum));
        let (morph, bytes) = write_morph(&spectrum, &isovalues, &keep, open, output, &Signals)
            .map_err(|e| e.of_file(&self.spectrum))?;
        log::info!(
            "{}: {} triangles, {} morph targets, {}; largest distance from the isosurface {} voxels",
            self.output.display(),
            morph.mesh.triangles.len(),
            morph.targets.len(),
            report::bytes(bytes),
            report::number(morph.max_distance)
        );
        Ok(())
    }

    /// True if the output is a list of files.
    fn is_list(&self) -> bool {
        self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("pvd"))
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
