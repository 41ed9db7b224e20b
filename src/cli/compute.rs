//! `compute`: the spectrum of a volume, the main job.

mod way;

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use isospectrum::Forecast;
use isospectrum::Parameters;
use isospectrum::settings::{IsovalueRange, SweepSettings};
use isospectrum::verify::{SpotCheck, spot_check};
use isospectrum::{Error, Result};
use serde::Serialize;

use super::backend_arguments::BackendArguments;
use super::budget::BudgetArguments;
use super::info::Facts;
use super::isovalue::Isovalue;
use super::parts::PartArguments;
use super::preparation_arguments::PreparationArguments;
use super::progress::Bar;
use super::simplify_arguments::SimplifyArguments;
use super::target::{Made, Target, is_folder_name};
use super::volume_arguments::VolumeArguments;
use super::{report, spectrum_file};

use way::{Way, Whole};

/// Isovalues at which a spectrum is measured once it has been computed.
const GLANCES: usize = 12;

/// Compute the spectrum of a volume: every isosurface as one tracked mesh
#[derive(Args, Debug)]
#[command(mut_arg("volume", |volume| volume.required_unless_present("plan")))]
pub(super) struct Compute {
    #[command(flatten)]
    volume: VolumeArguments,
    /// Spectrum to write (.isp), or a folder of its parts (.ispt); - is stdout
    #[arg(short, long, value_name = "FILE", required_unless_present = "plan")]
    output: Option<PathBuf>,
    #[command(flatten)]
    preparation: PreparationArguments,
    #[command(flatten)]
    simplify: SimplifyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    #[command(flatten)]
    budget: BudgetArguments,
    /// Compute in bricks of about N cells along a side, as by itself where memory does not suffice
    #[arg(long, value_name = "N", conflicts_with = "plan")]
    brick: Option<usize>,
    #[command(flatten)]
    parts: PartArguments,
    #[command(flatten)]
    backend: BackendArguments,
    /// Print what `info` would tell, and the time, as JSON
    #[arg(long)]
    json: bool,
}

/// The parameters of the sweep; the thesis's, each by its stage. What is not given is what
/// [`Parameters::default`] says.
#[derive(Args, Debug)]
pub(super) struct ParameterArguments {
    /// Isovalues to cover, e.g. 10:200 or 5%:95%, as far as the volume has them [default: all of the volume's]
    #[arg(long, value_name = "LOW:HIGH", allow_hyphen_values = true)]
    range: Option<IsovalueRange>,
    /// Distance between sampling isovalues [default: by how far the surface moves]
    #[arg(long, value_name = "STEP", conflicts_with = "samples", value_parser = positive, allow_negative_numbers = true)]
    step: Option<f64>,
    /// Number of sampling isovalues over the range, in place of --step
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    samples: Option<u32>,
    /// Tolerance: how far triangles should be from the isosurface at most, voxels (the README says what is promised)
    #[arg(long, value_name = "H", value_parser = positive, allow_negative_numbers = true)]
    error: Option<f64>,
    /// Simplify: radius ratio below which a triangle is removed
    #[arg(long, value_name = "RATIO", value_parser = share, allow_negative_numbers = true)]
    min_quality: Option<f64>,
    /// Simplify: area below which a triangle is removed, over the smallest dimension
    #[arg(long, value_name = "AREA", value_parser = not_negative, allow_negative_numbers = true)]
    min_area: Option<f64>,
    /// Refine: area above which a triangle may be refined, over the smallest dimension
    #[arg(long, value_name = "AREA", value_parser = not_negative, allow_negative_numbers = true)]
    refine_area: Option<f64>,
    /// Refine: longest edge, voxels
    #[arg(long, value_name = "LENGTH", value_parser = positive, allow_negative_numbers = true)]
    max_edge: Option<f64>,
    /// Relax: share of the tangential force applied at a time
    #[arg(long, value_name = "SHARE", value_parser = share, allow_negative_numbers = true)]
    relax: Option<f64>,
    /// Relax: largest force at which it ends, voxels; looked at after every eighth iteration
    #[arg(long, value_name = "FORCE", value_parser = not_negative, allow_negative_numbers = true)]
    relax_force: Option<f64>,
    /// Relax: most iterations per sampling step
    #[arg(long, value_name = "N")]
    relax_iterations: Option<u32>,
    /// Isovalue to start from, written as --isovalue is elsewhere
    #[arg(long, value_name = "C", allow_hyphen_values = true)]
    start: Option<Isovalue>,
    /// Closed mesh to start from, at the isovalue of --start
    #[arg(long, value_name = "MESH.ply", requires = "start")]
    initial_mesh: Option<PathBuf>,
}

impl ParameterArguments {
    /// The settings that the flags give.
    pub(super) fn settings(&self) -> SweepSettings {
        let default = Parameters::default();
        let parameters = default
            .clone()
            .with_step(self.step)
            .with_samples(self.samples.map(|n| n as usize))
            .with_error(self.error.unwrap_or(default.error))
            .with_min_quality(self.min_quality.unwrap_or(default.min_quality))
            .with_min_area(self.min_area.unwrap_or(default.min_area))
            .with_refine_area(self.refine_area.unwrap_or(default.refine_area))
            .with_max_edge(self.max_edge.unwrap_or(default.max_edge))
            .with_relax_strength(self.relax.unwrap_or(default.relax_strength))
            .with_relax_force(self.relax_force.unwrap_or(default.relax_force))
            .with_relax_iterations(self.relax_iterations.unwrap_or(default.relax_iterations))
            .with_initial_mesh(self.initial_mesh.clone());
        SweepSettings { range: self.range, start: self.start, parameters }
    }
}

/// The `compute` report.
#[derive(Serialize)]
struct Computed<'a> {
    seconds: f64,
    /// The spectrum measured against its volume at a few isovalues; not of one in bricks, whose volume is nowhere as a whole.
    measured: Option<SpotCheck>,
    /// What was expected before the sweep of a whole.
    forecast: Option<Forecast>,
    #[serde(flatten)]
    facts: Facts<'a>,
}

impl Compute {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        if let Some(plan) = &self.parts.plan {
            let backend = self.backend.open()?;
            return self.parts.run(plan, self.output.as_deref(), &backend, (quiet, self.json));
        }
        let path = self.output.as_deref().unwrap_or(Path::new("-"));
        let output = self.open_output(path)?;
        if self.json && output.is_stdout() {
            return Err(Error::Usage("--json and -o - both want stdout".to_owned()).into());
        }
        let backend = self.backend.open()?;
        let started = Instant::now();
        let whole = match self.way()? {
            Way::Whole(whole) => *whole,
            Way::Bricks(bricks) => {
                let made = bricks.compute(output, &backend, quiet)?;
                return self.tell(&made, (path, started), None, quiet);
            }
        };
        let Whole { prepared, parameters, forecast } = whole;
        let spectrum = prepared.compute(&parameters, &backend, &Bar::new(quiet))?;
        let Target::File(output) = output else {
            return Err(Error::internal("a folder of parts that is computed as a whole").into());
        };
        let (spectrum, n_bytes) = spectrum_file::write_whole(spectrum, output)?;
        let measured =
            (!quiet || self.json).then(|| spot_check(&spectrum, prepared.volume(), GLANCES));
        let measured = measured.transpose()?.map(|measured| (measured, forecast));
        let made = Made::File(Box::new(spectrum), n_bytes);
        self.tell(&made, (path, started), measured, quiet)
    }

    /// Says what came out.
    fn tell(
        &self,
        made: &Made,
        (path, started): (&Path, Instant),
        measured: Option<(SpotCheck, Forecast)>,
        quiet: bool,
    ) -> anyhow::Result<()> {
        let facts = made.facts();
        let seconds = started.elapsed().as_secs_f64();
        if quiet && !self.json {
            return Ok(());
        }
        let (measured, forecast) = measured.unzip();
        log::info!("{}: done in {seconds:.1} s", path.display());
        report::tell(&summary(&facts, measured.as_ref()));
        if log::log_enabled!(log::Level::Debug) {
            report::tell(&facts.table());
        }
        if self.json {
            report::print_json("compute", &Computed { seconds, measured, forecast, facts })?;
        }
        Ok(())
    }
}

impl Compute {
    /// Whatever else the name says, such as `volume.raw`, is a slip of the hand.
    fn open_output(&self, path: &Path) -> Result<Target> {
        // A pipe or a device may have any name.
        let is_file = std::fs::metadata(path).map_or(true, |found| found.is_file());
        let is_isp = path.extension().is_some_and(|extension| extension == "isp");
        if is_file && !is_isp && !is_folder_name(path) && path != Path::new("-") {
            let shown = path.display();
            return Err(Error::Usage(format!(
                "{shown}: expected a name that ends in .isp, or in .ispt for a folder"
            )));
        }
        let volume = self.volume.files();
        let mask = self.preparation.files();
        let inputs = volume.iter().chain(&mask).chain(&self.parameters.initial_mesh);
        let inputs = inputs.map(PathBuf::as_path);
        Target::open(path, &inputs.collect::<Vec<_>>())
    }
}

/// What came out, for people: how good it is, and how large.
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
    }
    report::table(&rows)
}

/// A finite number above 0.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    number_where(text, |x| x > 0.0, "a number above 0")
}

/// A finite number, 0 or above.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    number_where(text, |x| x >= 0.0, "0 or a number above")
}

/// A number from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    number_where(text, |x| (0.0..=1.0).contains(&x), "a number from 0 to 1")
}

fn number_where(text: &str, holds: fn(f64) -> bool, expected: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|&x| x.is_finite() && holds(x));
    number.ok_or_else(|| format!("expected {expected}"))
}
