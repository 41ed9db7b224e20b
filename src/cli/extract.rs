//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::export::{Border, Format, without_caps, write_to};
use serde::Serialize;

use super::isovalue::{Isovalue, in_spectrum};
use super::keep_arguments::KeepArguments;
use super::output::Output;
use super::{empty, report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: a number, 50% of the range, p99 of the samples, 2.5sigma above their mean, or top:1% of them
    #[arg(short = 'c', long, value_name = "C", allow_hyphen_values = true)]
    isovalue: Isovalue,
    /// Mesh to write: .ply, .stl, .obj or .glb; - is stdout
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Format, where the name does not tell: ply, stl, obj or glb
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Leave out the triangles that close the mesh at the border of the volume
    #[arg(long)]
    open: bool,
    #[command(flatten)]
    keep: KeepArguments,
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

impl Extract {
    pub(super) fn run(&self) -> anyhow::Result<()> {
        let format = self.format()?;
        let output = Output::open(&self.output, &[&self.spectrum])?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let (spectrum, _) = spectrum_file::read(&self.spectrum)?;
        let isovalue = in_spectrum(self.isovalue, &spectrum)?;
        let keep = self.keep.of(&spectrum);
        let mut mesh = spectrum.mesh_at(isovalue)?.with_components(&keep);
        if self.open {
            mesh = without_caps(&mesh);
        }
        empty::warn(&spectrum, isovalue, self.open);
        empty::warn_of_components(mesh.triangles.len(), &keep);
        let placement = &spectrum.volume.placement;
        let bytes = output
            .write(|file| write_to(&mesh, placement, Border::Closed, format, file))
            .map_err(spectrum_file::named(&self.spectrum))?;
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        if self.json {
            report::print_json("extract", &Extracted { isovalue, n_vertices, n_triangles, bytes })?;
        }
        log::info!(
            "{}: {n_triangles} triangles, {n_vertices} vertices at isovalue {}, {}",
            self.output.display(),
            report::number(isovalue),
            report::bytes(bytes)
        );
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
