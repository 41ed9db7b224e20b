//! `demo`: a spectrum, pictures and a mesh of a built-in volume, within a minute.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use isospectrum::export::{Border, Format, write_to};
use isospectrum::render::View;
use isospectrum::spectrum::{Size, Spectrum};
use isospectrum::volume::phantom;
use isospectrum::{Error, Noise, Parameters, Preparation, Prepared, Result};
use serde::Serialize;

use super::backend_arguments::BackendArguments;
use super::info::Facts;
use super::interrupt::Signals;
use super::isovalue::{Isovalue, in_spectrum};
use super::progress::Bar;
use super::render::Pictures;
use super::{heading, report, spectrum_file};
use isospectrum::file::Output;

/// Isovalues of the pictures, per cent of the range. The blobs are separate, just merged, and almost a ball.
const PERCENTS: [f64; 3] = [60.0, 40.0, 10.0];

/// Isovalue of the mesh, per cent of the range.
const MESH_PERCENT: f64 = 10.0;

/// Compute a built-in volume: spectrum, pictures and a mesh
#[derive(Args, Debug)]
#[command(after_long_help = "Examples:\n  isospectrum demo --phantom hydrogen:64 -o hydrogen")]
pub(super) struct Demo {
    /// Built-in volume to compute
    #[arg(long, value_name = "NAME[:SIZE]", default_value = "blobs:64", help_heading = heading::INPUT)]
    phantom: String,
    /// Folder to write to
    ///
    /// It is made if it does not exist.
    #[arg(short, long, value_name = "DIR", default_value = "isospectrum-demo", help_heading = heading::OUTPUT)]
    output: PathBuf,
    /// Print the report as JSON
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
    #[command(flatten)]
    backend: BackendArguments,
}

/// The `demo` report.
#[derive(Serialize)]
struct DemoReport<'a> {
    files: Vec<PathBuf>,
    seconds: f64,
    #[serde(flatten)]
    facts: Facts<'a>,
}

impl Demo {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        let backend = self.backend.open()?;
        let volume = phantom(&self.phantom)?;
        let prepared = Prepared::new(volume, Preparation::default(), Noise::default())?;
        let volume = prepared.volume();
        let folder = &self.output;
        std::fs::create_dir_all(folder).map_err(|source| Error::io(folder, source))?;
        let name = self.phantom.split(':').next().unwrap_or("demo");
        let path = |ending: &str| folder.join(format!("{name}{ending}"));

        let [nx, ny, nz] = volume.dims();
        log::info!(
            "computing the spectrum of {} ({nx}x{ny}x{nz}) with {}",
            volume.name(),
            backend.name()
        );
        let started = Instant::now();
        let spectrum_path = path(".isp");
        let output = Output::open(&spectrum_path, &[])?;
        let bar = Bar::new(quiet);
        let spectrum = prepared.compute(&Parameters::default(), &backend, &bar)?;
        drop(bar);
        let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, output)?;
        let seconds = started.elapsed().as_secs_f64();

        let mut files = vec![spectrum_path];
        let mesh_path = path(&format!("-{MESH_PERCENT}.ply"));
        write_mesh(
            &spectrum,
            in_spectrum(Isovalue::Percent(MESH_PERCENT), &spectrum)?,
            &mesh_path,
        )?;
        files.push(mesh_path);
        files.extend(self.write_pictures(&spectrum, path)?);

        let facts = Facts::of(&spectrum, &Size::of(&spectrum), n_bytes, 1);
        report::log_lines(&facts.table());
        for file in &files {
            log::info!("wrote {}", file.display());
        }
        log::info!("done: computed every isosurface in {seconds:.1} s");
        if self.json {
            report::print_json("demo", &DemoReport { files, seconds, facts })?;
        }
        Ok(())
    }

    /// Renders the pictures if there is a GPU.
    fn write_pictures(
        &self,
        spectrum: &Spectrum,
        path: impl Fn(&str) -> PathBuf,
    ) -> Result<Vec<PathBuf>> {
        let mut pictures = match Pictures::open(spectrum, self.backend.adapter()) {
            Ok(pictures) => pictures,
            Err(Error::Gpu(why)) => {
                log::info!("no pictures: {why}");
                return Ok(Vec::new());
            }
            Err(error) => return Err(error),
        };
        let isovalues: Vec<f64> = (PERCENTS.iter())
            .map(|&percent| in_spectrum(Isovalue::Percent(percent), spectrum))
            .collect::<Result<_>>()?;
        let view = pictures.fitted(View::default(), &isovalues)?;
        let mut files = Vec::new();
        for (percent, isovalue) in PERCENTS.iter().zip(isovalues) {
            let file = path(&format!("-{percent}.png"));
            pictures.write(&[isovalue.into()], &view, Output::open(&file, &[])?)?;
            files.push(file);
        }
        Ok(files)
    }
}

fn write_mesh(spectrum: &Spectrum, isovalue: f64, path: &Path) -> Result<()> {
    let mesh = spectrum.mesh_at(isovalue)?;
    let placement = &spectrum.volume().placement;
    Output::open(path, &[])?.write(&Signals, |file| {
        write_to(&mesh, placement, Border::Closed, Format::Ply, file).map(drop)
    })?;
    Ok(())
}
