//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::color::{Color, Parts, Sources};
use isospectrum::export::{Border, Colors, Format, NO_COLORS, write_colored_to, write_to};
use isospectrum::spectrum::{Query, Spectrum};
use serde::Serialize;

use super::border_arguments::BorderArguments;
use super::color_arguments::{ColorArguments, volume_of};
use super::frames::{Pattern, Sweep};
use super::isovalue::{Isovalue, in_spectrum};
use super::keep_arguments::KeepArguments;
use super::output::Output;
use super::spectrum_file::Opened;
use super::{empty, report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp, or a folder .ispt)
    spectrum: PathBuf,
    /// Isovalue: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of them;
    /// again for several meshes
    #[arg(
        short = 'c',
        long,
        value_name = "C",
        allow_hyphen_values = true,
        required_unless_present = "sweep"
    )]
    isovalue: Vec<Isovalue>,
    /// N isovalues from A to B, both included, e.g. 10%:90%:40
    #[arg(long, value_name = "A:B:N", allow_hyphen_values = true, conflicts_with = "isovalue")]
    sweep: Option<Sweep>,
    /// Mesh to write: .ply, .stl, .obj, .glb, .vtp or .3mf; - is stdout; of several isovalues a pattern such as mesh-%d.ply, numbered
    /// from 0, or a .pvd, which lists .vtp beside it with the isovalue as their time
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, where the name does not tell: ply, stl, obj, glb, vtp or 3mf
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
    bytes: u64,
}

/// The same of several isovalues.
#[derive(Serialize)]
struct Several {
    meshes: Vec<Extracted>,
}

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
        let outputs = match n_isovalues {
            1 if !series && self.sweep.is_none() => vec![Output::open(&self.output, &inputs)?],
            n => Pattern::of_any(&pattern)?.open(n as u32, &inputs)?,
        };
        if self.json && outputs.iter().any(Output::is_stdout) {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let opened = Opened::open(&self.spectrum)?;
        let told = opened.told();
        let isovalues = match self.sweep {
            Some(sweep) => sweep.in_spectrum(told)?,
            None => (self.isovalue.iter())
                .map(|&written| {
                    let isovalue = in_spectrum(written, told)?;
                    told.check_isovalue(isovalue).map(|()| isovalue)
                })
                .collect::<isospectrum::Result<Vec<f64>>>()?,
        };
        let spectrum = opened.around(&isovalues)?;
        let files = outputs.iter().map(Output::name).collect::<Vec<_>>();
        if !format.has_colors() && !matches!(self.color.shown(), Color::None | Color::Normal) {
            return Err(Error::Usage(NO_COLORS.to_owned()).into());
        }
        let volume = self.volume.as_ref().map(|path| volume_of(path, &spectrum)).transpose()?;
        let sources = self.color.sources(&spectrum, volume)?;
        let mut query = Query::new(&spectrum);
        let mut written = Vec::new();
        for (isovalue, output) in isovalues.into_iter().zip(outputs) {
            let from = (&spectrum, &sources);
            written.push(self.write(&mut query, from, isovalue, format, output)?);
        }
        if let Some(list) = list {
            let times: Vec<f64> = written.iter().map(|mesh| mesh.isovalue).collect();
            list.write_bytes(pvd(&files, &times).as_bytes())?;
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
        query: &mut Query<&Spectrum>,
        (spectrum, sources): (&Spectrum, &Sources),
        isovalue: f64,
        format: Format,
        output: Output,
    ) -> anyhow::Result<Extracted> {
        let path = output.name();
        let keep = self.keep.of(spectrum);
        let whole = query.mesh_at(isovalue)?;
        let (vertices, triangles) = query.parts();
        let parts = Parts { spectrum, isovalue, mesh: &whole, vertices, triangles };
        let attribute = parts.attribute(self.color.shown(), sources, self.color.ends())?;
        let (mesh, kept) = whole.kept(&keep, self.border.is_open(spectrum));
        let attribute = attribute.map(|attribute| attribute.of_part(&kept));
        empty::warn(spectrum, isovalue, self.border.is_open(spectrum));
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
