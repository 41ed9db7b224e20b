//! `compute`: the spectrum of a volume, the main command.

mod way;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use isospectrum::Forecast;
use isospectrum::verify::{Check, Remedy, SpotCheck, check, spot_check};
use isospectrum::{Error, Result, Spectrum, Volume};
use serde::Serialize;

use super::backend_arguments::BackendArguments;
use super::budget::BudgetArguments;
use super::info::Facts;
use super::parameter_arguments::ParameterArguments;
use super::parts::PartArguments;
use super::preparation_arguments::PreparationArguments;
use super::progress::Bar;
use super::simplify_arguments::SimplifyArguments;
use super::target::{Made, Target};
use super::volume_arguments::VolumeArguments;
use super::{heading, report};

use way::{Request, Way, Whole};

/// Number of isovalues at which a computed spectrum is measured for the report.
const N_MEASURED: usize = 12;

const EXAMPLES: &str = "\
Examples:
  Compute the spectrum of a volume:
    isospectrum compute scan.nrrd -o scan.isp
  Read a RAW file, and remove noise first:
    isospectrum compute scan.raw --dims 256x256x113 --type int16 --persistence 2% -o scan.isp
  Cover bone only, with smaller triangles:
    isospectrum compute scan.nrrd --range 1200:2800 --error 0.05 --max-edge 2 -o bone.isp
  Compute a large volume in bricks within 8 GB, to a folder that is read in parts:
    isospectrum compute large.nrrd --max-memory 8GB -o large.isp";

/// Compute the spectrum of a volume: every isosurface as one tracked mesh
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
#[command(mut_arg("volume", |volume| volume.required_unless_present("plan")))]
pub(super) struct Compute {
    #[command(flatten)]
    volume: VolumeArguments,
    #[command(flatten)]
    parts: PartArguments,
    #[command(flatten)]
    preparation: PreparationArguments,
    #[command(flatten)]
    simplify: SimplifyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    /// Spectrum to write (.isp), or - for stdout
    #[arg(short, long, value_name = "FILE", required_unless_present = "plan", help_heading = heading::OUTPUT)]
    output: Option<PathBuf>,
    /// Print the report as JSON
    ///
    /// The report of `info`, with the time and the measured quality.
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
    #[command(flatten)]
    budget: BudgetArguments,
    /// Compute in bricks of N^3 cells
    ///
    /// Bricks are also used without this flag if memory does not suffice for the whole volume.
    #[arg(long, value_name = "N", conflicts_with = "plan", help_heading = heading::MACHINE)]
    brick: Option<usize>,
    #[command(flatten)]
    backend: BackendArguments,
}

/// The `compute` report.
#[derive(Serialize)]
struct Computed<'a> {
    seconds: f64,
    /// Quality of the spectrum at a few isovalues; none after bricks, as the whole volume is not in memory.
    measured: Option<SpotCheck>,
    /// The promises that do not hold, of a verification with default flags up to 20^3 samples, else at fewer isovalues; none after bricks.
    broken_promises: Option<Vec<String>>,
    /// The other promises that may not hold at other isovalues; none after bricks.
    uncertain_promises: Option<Vec<String>>,
    /// What was expected before the sweep; none for bricks.
    forecast: Option<Forecast>,
    #[serde(flatten)]
    facts: Facts<'a>,
}

/// A computation that has ended.
struct Finished<'a> {
    path: &'a Path,
    started: Instant,
    measured: Option<Measured>,
    quiet: bool,
}

/// What is known of a spectrum whose volume is in memory.
struct Measured {
    spot: SpotCheck,
    check: Check,
    forecast: Forecast,
}

impl Measured {
    fn of(
        spectrum: &Spectrum,
        volume: &Volume,
        forecast: Forecast,
        quiet: bool,
    ) -> Result<Measured> {
        let spot = spot_check(spectrum, volume, N_MEASURED)?;
        let check = check(spectrum, volume, &Bar::new(quiet))?;
        Ok(Measured { spot, check, forecast })
    }
}

/// Describes what helps a spectrum that does not pass its verification.
fn advice(remedy: Remedy) -> &'static str {
    match remedy {
        Remedy::None => "please report this volume",
        Remedy::Smoothing => "the samples have two values only: --smooth 0.5 helps",
        Remedy::SmoothingOrTolerance => "--smooth 0.5 or a larger --error may help",
    }
}

impl Compute {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        if let Some(plan) = &self.parts.plan {
            let backend = self.backend.open()?;
            return self.parts.run(plan, self.output.as_deref(), &backend, quiet, self.json);
        }
        let path = self.output.as_deref().unwrap_or(Path::new("-"));
        let output = self.open_output(path)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage(
                "--json and -o - both write to stdout, expected one of them".to_owned(),
            )
            .into());
        }
        let backend = self.backend.open()?;
        let started = Instant::now();
        let whole = match self.request(quiet).way()? {
            Way::Whole(whole) => *whole,
            Way::Bricks(bricks) => {
                let made = bricks.compute(output, &backend, quiet)?;
                return self.report(&made, Finished { path, started, measured: None, quiet });
            }
        };
        let Whole { prepared, parameters, forecast } = whole;
        let spectrum = prepared.compute(&parameters, &backend, &Bar::new(quiet))?;
        let mut made = output.write(spectrum)?;
        // With the positions that the file has.
        made.spectrum = made.spectrum.quantised();
        let measured = (!quiet || self.json)
            .then(|| Measured::of(&made.spectrum, prepared.volume(), forecast, quiet));
        let measured = measured.transpose()?;
        self.report(&made, Finished { path, started, measured, quiet })
    }

    /// Reports the written spectrum.
    fn report(&self, made: &Made, finished: Finished<'_>) -> anyhow::Result<()> {
        let Finished { path, started, measured, quiet } = finished;
        let facts = made.facts();
        let seconds = started.elapsed().as_secs_f64();
        if quiet && !self.json {
            return Ok(());
        }
        log::info!("{}: done in {seconds:.1} s", path.display());
        report::log_lines(&summary(&facts, measured.as_ref().map(|m| &m.spot)));
        if let Some(Measured { check, .. }) = &measured
            && let Some(summary) = check.summary()
        {
            log::warn!("{}: {summary}; {}", path.display(), advice(check.remedy));
        }
        let forecast = measured.as_ref().map(|m| m.forecast);
        let (measured, check) = measured.map(|m| (m.spot, m.check)).unzip();
        let (broken_promises, uncertain_promises) =
            check.map(|check| (check.broken, check.uncertain)).unzip();
        if log::log_enabled!(log::Level::Debug) {
            report::log_lines(&facts.table());
        }
        if self.json {
            report::print_json(
                "compute",
                &Computed {
                    seconds,
                    measured,
                    broken_promises,
                    uncertain_promises,
                    forecast,
                    facts,
                },
            )?;
        }
        Ok(())
    }

    /// Returns what the choice between the whole volume and bricks depends on.
    fn request(&self, quiet: bool) -> Request<'_> {
        Request {
            volume: &self.volume,
            preparation: &self.preparation,
            simplify: &self.simplify,
            parameters: &self.parameters,
            budget: &self.budget,
            brick: self.brick,
            quiet,
        }
    }

    /// Opens the output. Another extension, such as `volume.raw`, is taken for a mistake.
    fn open_output(&self, path: &Path) -> Result<Target> {
        // A pipe or a device can have any name.
        let is_file = std::fs::metadata(path).map_or(true, |found| found.is_file());
        let is_isp = path.extension().is_some_and(|extension| extension == "isp");
        if is_file && !is_isp && path != Path::new("-") {
            let shown = path.display();
            return Err(Error::Usage(format!("{shown}: expected a name that ends in .isp")));
        }
        let volume = self.volume.files();
        let mask = self.preparation.files();
        let inputs = volume.iter().chain(&mask).chain(self.parameters.initial_mesh());
        let inputs = inputs.map(PathBuf::as_path);
        Target::open(path, &inputs.collect::<Vec<_>>())
    }
}

/// Describes quality and size of a spectrum for people.
fn summary(facts: &Facts, measured: Option<&SpotCheck>) -> String {
    let tolerance = report::number(facts.tolerance());
    let mut rows = facts.summary();
    if let Some(measured) = measured {
        let within = measured.within_tolerance_share.map_or_else(
            || "-".to_owned(),
            |share| format!("{} of the triangles within {tolerance} voxel", report::percent(share)),
        );
        rows.insert(1, ("tolerance", within));
        rows.insert(2, ("radius ratio", report::number_or_dash(measured.radius_ratio)));
    } else {
        rows.insert(
            1,
            ("tolerance", "not measured in bricks; `isospectrum verify` does".to_owned()),
        );
    }
    report::table(&rows)
}
