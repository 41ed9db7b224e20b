//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::color::{Color, Parts, Sources};
use isospectrum::export::{Border, Colors, Format, write_colored_to, write_to};
use isospectrum::spectrum::{Query, Spectrum};
use isospectrum::volume::files_of;
use serde::Serialize;

use super::color_arguments::{ColorArguments, volume_of};
use super::frames::Pattern;
use super::isovalue::{Isovalue, in_spectrum};
use super::keep_arguments::KeepArguments;
use super::output::Output;
use super::{empty, report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of them;
    /// again for several meshes
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true, required = true)]
    isovalue: Vec<Isovalue>,
    /// Mesh to write: .ply, .stl, .obj, .glb or .vtp; - is stdout; of several isovalues a pattern such as mesh-%d.ply, numbered
    /// from 0
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, where the name does not tell: ply, stl, obj, glb or vtp
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Leave out the triangles that close the mesh at the border of the volume
    #[arg(long)]
    open: bool,
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
    bytes: u64,
}

/// The same of several isovalues.
#[derive(Serialize)]
struct Several {
    meshes: Vec<Extracted>,
}

impl Extract {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let format = self.format()?;
        let inputs = self.inputs();
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let outputs = match self.isovalue.len() {
            1 => vec![Output::open(&self.output, &inputs)?],
            n => Pattern::of_any(&self.output)?.open(n as u32, &inputs)?,
        };
        if self.json && outputs.iter().any(Output::is_stdout) {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let (spectrum, _) = spectrum_file::read(&self.spectrum)?;
        let isovalues = (self.isovalue.iter())
            .map(|&written| {
                let isovalue = in_spectrum(written, &spectrum)?;
                spectrum.check_isovalue(isovalue).map(|()| isovalue)
            })
            .collect::<isospectrum::Result<Vec<f64>>>()?;
        if format == Format::Stl && !matches!(self.color.shown(), Color::None | Color::Normal) {
            let why = "STL has no colours; .ply, .obj, .glb and .vtp do";
            return Err(Error::Usage(why.to_owned()).into());
        }
        let volume = self.volume.as_ref().map(|path| volume_of(path, &spectrum)).transpose()?;
        let sources = self.color.sources(&spectrum, volume)?;
        let mut query = Query::new(&spectrum);
        let mut written = Vec::new();
        for (isovalue, output) in isovalues.into_iter().zip(outputs) {
            let from = (&spectrum, &sources);
            written.push(self.write(&mut query, from, isovalue, format, output)?);
        }
        if self.json {
            match &written[..] {
                [one] => report::print_json("extract", one)?,
                _ => report::print_json("extract", &Several { meshes: written })?,
            }
        }
        Ok(())
    }

    /// Writes the mesh of one isovalue.
    fn write(
        &self,
        query: &mut Query<'_>,
        (spectrum, sources): (&Spectrum, &Sources),
        isovalue: f64,
        format: Format,
        output: Output,
    ) -> anyhow::Result<Extracted> {
        let path = match &output {
            Output::File(path) => path.display().to_string(),
            Output::Stdout => "-".to_owned(),
        };
        let keep = self.keep.of(spectrum);
        let whole = query.mesh_at(isovalue)?;
        let (vertices, triangles) = query.parts();
        let parts = Parts { spectrum, isovalue, mesh: &whole, vertices, triangles };
        let attribute = parts.attribute(self.color.shown(), sources, self.color.ends())?;
        let (mesh, kept) = whole.kept(&keep, self.open);
        let attribute = attribute.map(|attribute| attribute.of_part(&kept));
        empty::warn(spectrum, isovalue, self.open);
        empty::warn_of_components(mesh.triangles.len(), &keep);
        let placement = &spectrum.volume.placement;
        let map = self.color.color_map;
        let map = map.unwrap_or_else(|| self.color.shown().usual_map(sources));
        let bytes = output
            .write(|file| match &attribute {
                Some(attribute) => {
                    let colors = Colors { attribute, map };
                    write_colored_to(&mesh, placement, colors, format, file)
                }
                None => write_to(&mesh, placement, Border::Closed, format, file),
            })
            .map_err(spectrum_file::named(&self.spectrum))?;
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        log::info!(
            "{path}: {n_triangles} triangles, {n_vertices} vertices at isovalue {}, {}",
            report::number(isovalue),
            report::bytes(bytes)
        );
        Ok(Extracted { isovalue, n_vertices, n_triangles, bytes })
    }

    /// Every file that is read.
    fn inputs(&self) -> Vec<PathBuf> {
        let volume = self.volume.iter().flat_map(|path| files_of(path));
        let all = [self.spectrum.clone()].into_iter().chain(volume);
        all.chain(self.color.files()).collect()
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
