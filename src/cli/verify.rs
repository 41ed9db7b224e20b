//! `verify`: measures a spectrum against its volume; exit code 5 if a promise or limit is broken.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use isospectrum::Error;
use isospectrum::Prepared;
use isospectrum::verify::{Limits, Promise, Report, Sampling, Summary, verify, verify_file};

use super::kind::{self, Kind};
use super::number_argument::{fraction, not_negative};
use super::progress::Bar;
use super::report::{number, number_or_dash, percent, table};
use super::spectrum_file::Opened;
use super::volume_arguments::VolumeArguments;
use super::{heading, output, report};

const EXAMPLES: &str = "\
Examples:
  isospectrum verify scan.isp scan.nrrd
  isospectrum verify blobs.isp --phantom blobs:64 --n 100 --min-radius-ratio 0.7";

/// Verify a spectrum against its volume at random isovalues
///
/// Exits with code 5 if a promise or a limit is broken.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::INPUT, after_long_help = EXAMPLES)]
pub(super) struct Verify {
    /// Spectrum (.isp)
    spectrum: PathBuf,
    #[command(flatten)]
    volume: VolumeArguments,
    /// Random isovalues to check
    #[arg(long, value_name = "N", default_value_t = Sampling::default().n_random, help_heading = heading::CHECKS)]
    n: usize,
    /// Events to check
    ///
    /// Just before and just after. As many isovalues at which triangles change are checked, too.
    #[arg(long, value_name = "N", default_value_t = Sampling::default().n_events, help_heading = heading::CHECKS)]
    events: usize,
    /// Random seed
    #[arg(long, value_name = "SEED", default_value_t = Sampling::default().seed, help_heading = heading::CHECKS)]
    seed: u64,
    /// Limit: wrong isovalues
    ///
    /// The number of isovalues with wrong topology.
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = heading::CHECKS)]
    max_wrong: usize,
    /// Limit: distance of barycentres, voxels
    ///
    /// The 99th percentile of the distances of barycentres to the isosurface. The default is the promise.
    #[arg(long, value_name = "H", value_parser = not_negative, help_heading = heading::CHECKS)]
    max_deviation: Option<f64>,
    /// Limit: intersecting triangles
    ///
    /// The fraction of triangles that cross others. The default is the promise.
    #[arg(long, value_name = "SHARE", value_parser = fraction, help_heading = heading::CHECKS)]
    max_intersecting: Option<f64>,
    /// Limit: jumps away from events, voxels
    ///
    /// The 99th percentile. The default is the promise.
    #[arg(long, value_name = "H", value_parser = not_negative, help_heading = heading::CHECKS)]
    max_jump: Option<f64>,
    /// Limit: mean radius ratio
    #[arg(long, value_name = "RATIO", value_parser = fraction, help_heading = heading::CHECKS)]
    min_radius_ratio: Option<f64>,
    /// Print JSON
    #[arg(long, help_heading = heading::OUTPUT)]
    json: bool,
}

impl Verify {
    pub(super) fn run(&self, quiet: bool) -> anyhow::Result<()> {
        self.check_order()?;
        let spectrum = Opened::open(&self.spectrum)?;
        spectrum.check_memory_of_part()?;
        let volume = Prepared::again(self.volume.read()?, spectrum.header())?;
        let sampling = Sampling {
            n_random: self.n,
            n_events: self.events,
            seed: self.seed,
            ..Sampling::default()
        };
        let limits = Limits {
            topology_wrong: self.max_wrong,
            deviation: self.max_deviation,
            self_intersecting: self.max_intersecting,
            radius_ratio: self.min_radius_ratio,
            jump: self.max_jump,
        };
        let bar = Bar::new(quiet);
        let found = match spectrum {
            Opened::Whole(spectrum, _) => verify(&spectrum, &volume, sampling, limits, &bar)?,
            Opened::File(file) => verify_file(&Arc::from(file), &volume, sampling, limits, &bar)?,
        };
        drop(bar);
        if self.json {
            report::print_json("verify", &found)?;
        } else {
            output::print(&table_of(&found))?;
        }
        if found.passed {
            return Ok(());
        }
        Err(Error::Verification(format!(
            "{}: verification failed: {}",
            self.spectrum.display(),
            found.failures.join("; ")
        ))
        .into())
    }

    /// Checks that spectrum and volume are not swapped.
    fn check_order(&self) -> isospectrum::Result<()> {
        let Some(second) = self.volume.path() else { return Ok(()) };
        let first = &self.spectrum;
        if [kind::of(first), kind::of(second)] != [Some(Kind::Volume), Some(Kind::Spectrum)] {
            return Ok(());
        }
        let (first, second) = (first.display(), second.display());
        Err(Error::Usage(format!(
            "{first} is a volume and {second} a spectrum, expected the spectrum first: verify {second} {first}"
        )))
    }
}

fn table_of(found: &Report) -> String {
    let t = &found.totals;
    let distance = |s: &Summary| {
        let parts = [s.mean, s.p99, s.max].map(number_or_dash);
        format!("mean {}, 99 % below {}, max {} voxel", parts[0], parts[1], parts[2])
    };
    let jump = |largest: Option<f64>, p99: Option<f64>| {
        format!("{} voxel, 99 % below {}", number_or_dash(largest), number_or_dash(p99))
    };
    let ratio = &t.radius_ratio;
    let ratios = [ratio.mean, ratio.p01, ratio.min].map(number_or_dash);
    let mut rows = vec![
        ("isovalues", t.isovalues.to_string()),
        ("triangles", format!("{} on average", number(t.n_triangles.round()))),
        ("vertices from isosurface", distance(&t.vertex_deviation)),
        ("barycentres from isosurface", distance(&t.barycentre_deviation)),
        ("isosurface from mesh", distance(&t.surface_deviation)),
        ("radius ratio", format!("mean {}, 1 % below {}, min {}", ratios[0], ratios[1], ratios[2])),
        ("largest jump at an event", jump(t.largest_jump, t.largest_jump_p99)),
        ("largest jump elsewhere", jump(t.largest_jump_elsewhere, t.largest_jump_elsewhere_p99)),
        (
            "triangles that live past an event",
            t.survived_share.map_or_else(|| "-".to_owned(), percent),
        ),
        ("vertices that live on", t.tracked_share.map_or_else(|| "-".to_owned(), percent)),
    ];
    if log::log_enabled!(log::Level::Debug) {
        rows.push(("steps and repairs", report::counts(&serde_json::json!(found.counts))));
    }
    let mut text = table(&rows);
    text += "\npromised\n";
    let promises: Vec<(&str, String)> =
        found.promises.iter().map(|promise| (promise.what, verdict(promise))).collect();
    text += &table(&promises);
    text += if found.passed { "\npassed\n" } else { "\nfailed\n" };
    for row in found.rows.iter().filter(|row| !row.topology_right()) {
        text += &format!(
            "isovalue {}: {} components and Euler characteristic {}, expected {} and {}\n",
            row.isovalue,
            row.topology.components,
            row.topology.euler,
            row.expected_components,
            row.expected_euler
        );
    }
    text
}

/// Describes the measured value, the limit and whether it is kept.
fn verdict(promise: &Promise) -> String {
    let unit = if promise.unit.is_empty() { String::new() } else { format!(" {}", promise.unit) };
    let kept = match promise.kept {
        Some(true) => "kept",
        Some(false) => "NOT KEPT",
        None => "not measured",
    };
    let found = number_or_dash(promise.found);
    format!("{found}{unit}, promised {}{unit}: {kept}", number(promise.limit))
}
