//! The thesis's table 1: time and space of the spectrum of the hydrogen atom for its four pairs of
//! sampling step and tolerance, its numbers next to ours.
//!
//! `cargo bench -p isospectrum-benches --bench table1` takes many minutes; `-- --row 3` runs one row, 1 to 4. Each row is
//! run once: runs of minutes need no statistics. The volume is
//! `hydrogen_atom_128x128x128_uint8.raw` in the folder `ISOSPECTRUM_DATA`, or in `../shared/data`.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use isospectrum::volume::{ReadOptions, Volume, read_volume};
use isospectrum::{Backend, Choice};
use isospectrum::{Parameters, Silent, compute};
use isospectrum::{Result, file};

const VOLUME: &str = "hydrogen_atom_128x128x128_uint8.raw";

/// Isovalue of the mesh whose triangles are counted: the thesis shows 10, and samples are integers.
const ISOVALUE: f64 = 10.5;

/// A row of the thesis's table.
struct Row {
    step: f64,
    error: f64,
    seconds: f64,
    megabytes: f64,
    triangles: f64,
    vertices: f64,
}

/// Table 1 of the thesis; counts are given there in thousands.
const ROWS: [Row; 4] = [
    Row { step: 2.0, error: 0.2, seconds: 157.0, megabytes: 11.0, triangles: 42.2, vertices: 19.4 },
    Row { step: 1.0, error: 0.1, seconds: 464.0, megabytes: 32.0, triangles: 77.1, vertices: 36.0 },
    Row { step: 2.0, error: 0.1, seconds: 395.0, megabytes: 18.0, triangles: 74.8, vertices: 35.0 },
    Row { step: 3.0, error: 0.1, seconds: 398.0, megabytes: 14.0, triangles: 73.8, vertices: 34.6 },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|a| a == flag);
    // `cargo bench` passes `--bench`; `cargo test --benches` does not.
    if has("--test") || !has("--bench") {
        println!(
            "table1: nothing to test, run it by `cargo bench -p isospectrum-benches --bench table1`"
        );
        return ExitCode::SUCCESS;
    }
    let rows: Vec<&Row> = match arguments.iter().position(|a| a == "--row") {
        None => ROWS.iter().collect(),
        Some(i) => {
            let number = arguments.get(i + 1).and_then(|n| n.parse::<usize>().ok());
            match number.and_then(|n| ROWS.get(n.checked_sub(1)?)) {
                Some(row) => vec![row],
                None => {
                    eprintln!("table1: --row, expected a number from 1 to {}", ROWS.len());
                    return ExitCode::from(2);
                }
            }
        }
    };
    match volume_path() {
        Ok(path) => match run(&path, &rows) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("table1: {error}");
                ExitCode::FAILURE
            }
        },
        Err(path) => {
            println!(
                "table1: NOT RUN: {} is missing; set ISOSPECTRUM_DATA to its folder",
                path.display()
            );
            ExitCode::SUCCESS
        }
    }
}

/// The path of the volume; as an error if it is missing.
fn volume_path() -> std::result::Result<PathBuf, PathBuf> {
    let default = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path =
        std::env::var_os("ISOSPECTRUM_DATA").map_or_else(default, PathBuf::from).join(VOLUME);
    if path.is_file() { Ok(path) } else { Err(path) }
}

fn run(path: &Path, rows: &[&Row]) -> Result<()> {
    let volume = Arc::new(read_volume(path, &ReadOptions::default())?);
    let backend = Backend::choose(Choice::Auto, None)?;
    println!("{VOLUME}, kernels on {}, {} threads", backend.name(), threads());
    println!("                  thesis                            here");
    println!(
        "step    h  |     s   MB  triangles  vertices  |       s      MB  triangles  vertices  at {ISOVALUE}"
    );
    for row in rows {
        print_row(row, &volume, &backend)?;
    }
    Ok(())
}

/// Computes the spectrum of one row and prints it.
fn print_row(row: &Row, volume: &Arc<Volume>, backend: &Backend) -> Result<()> {
    let parameters = Parameters::default().with_step(Some(row.step)).with_error(row.error);
    let started = Instant::now();
    let spectrum = compute(volume, &parameters, backend, &Silent)?;
    let seconds = started.elapsed().as_secs_f64();
    let megabytes = file::to_bytes(&spectrum)?.len() as f64 / 1e6;
    let thousands = |n: usize| n as f64 / 1e3;
    println!(
        "{:4.1} {:4.1}  | {:5.0} {:4.0} {:9.1}k {:8.1}k  | {seconds:7.1} {megabytes:7.1} {:9.1}k {:8.1}k {:7.1}k",
        row.step,
        row.error,
        row.seconds,
        row.megabytes,
        row.triangles,
        row.vertices,
        thousands(spectrum.triangles().len()),
        thousands(spectrum.n_vertices()),
        thousands(spectrum.mesh_at(ISOVALUE)?.triangles.len()),
    );
    Ok(())
}

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
