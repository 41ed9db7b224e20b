//! `extract`: the mesh at one isovalue, as a file of another program's format.

use std::path::{Path, PathBuf};

use clap::Args;
use isospectrum::Error;
use isospectrum::export::{Border, Format, without_caps, write_to};
use serde::Serialize;

use super::isovalue::Isovalue;
use super::output::Output;
use super::{report, spectrum_file};

/// Write the mesh at one isovalue
#[derive(Args, Debug)]
pub(super) struct Extract {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    /// Isovalue: a number, or a percentage of the range such as 50%
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
        let output = Output::open(&self.output)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let (spectrum, _) = spectrum_file::read(&self.spectrum)?;
        let isovalue = self.isovalue.in_range(spectrum.range);
        let mut mesh = spectrum.mesh_at(isovalue)?;
        if self.open {
            mesh = without_caps(&mesh);
        }
        if mesh.triangles.is_empty() {
            log::warn!("{}", why_empty(isovalue, spectrum.range, self.open));
        }
        let placement = &spectrum.volume.placement;
        let bytes = output
            .write(|file| write_to(&mesh, placement, Border::Closed, format, file))
            .map_err(spectrum_file::named(&self.spectrum))?;
        let (n_vertices, n_triangles) = (mesh.positions.len(), mesh.triangles.len());
        if self.json {
            report::print_json("extract", &Extracted { isovalue, n_vertices, n_triangles, bytes })?;
        }
        log::info!(
            "{}: {n_triangles} triangles, {n_vertices} vertices at isovalue {isovalue}, {}",
            self.output.display(),
            report::bytes(bytes)
        );
        Ok(())
    }

    fn format(&self) -> isospectrum::Result<Format> {
        match &self.format {
            Some(name) => Format::of_path(Path::new(&format!("mesh.{name}"))),
            // Other programs read PLY from a pipe.
            None if self.output == Path::new("-") => Ok(Format::Ply),
            None => Format::of_path(&self.output),
        }
    }
}

/// What to say where there is no surface.
fn why_empty(isovalue: f64, (low, high): (f64, f64), open: bool) -> String {
    let place = if isovalue == low || isovalue == high {
        "it is an end of the range, where the surface has not appeared yet or is gone"
    } else if open {
        "without the caps nothing of the surface is inside the volume"
    } else {
        "no sample is on one side of it"
    };
    format!(
        "the surface at isovalue {isovalue} is empty: {place}; the range is {low} to {high}, try 50%"
    )
}
