//! Flags that remove noise from a volume.

use clap::Args;
use isospectrum::Cleaned;
use isospectrum::Result;
use isospectrum::settings::{NoiseSettings, Persistence};
use isospectrum::unstable::topology::dust::Dust;
use isospectrum::unstable::topology::simplify::{Census, Simplification};
use isospectrum::volume::Volume;

use super::heading;
use super::report::number;

/// The flags of every command that can remove noise from a volume.
#[derive(Args, Debug)]
#[command(next_help_heading = heading::REGION)]
#[group(id = "noise", multiple = true)]
pub(super) struct SimplifyArguments {
    /// Remove minima and maxima of a persistence below P
    ///
    /// The persistence of a minimum or maximum is the difference in value to the saddle at which its component ends. P is
    /// a value, or a percentage of the range of the volume such as 5%. Samples change by at most 1.5 P where smoothing suffices, else by more: up to 4.3 P
    /// were found. The largest change is printed.
    #[arg(long, value_name = "P")]
    persistence: Option<Persistence>,
    /// Remove components and cavities below V voxels
    ///
    /// Removes those that stay below V voxels until they meet a larger one. Runs before --persistence.
    #[arg(long, value_name = "V", value_parser = clap::value_parser!(u32).range(1..))]
    min_component: Option<u32>,
}

impl SimplifyArguments {
    /// Returns the settings.
    pub(super) fn settings(&self) -> NoiseSettings {
        NoiseSettings { persistence: self.persistence, min_component: self.min_component }
    }

    /// Returns the volume without noise and the record of the changes.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Cleaned)> {
        let (volume, cleaned) = self.settings().resolve(&volume).take_out(volume)?;
        if let Some(done) = &cleaned.dust {
            log::info!("dust: {}", describe_dust(done));
        }
        if let Some(done) = &cleaned.simplification {
            log::info!("{}", describe(done));
        }
        Ok((volume, cleaned))
    }
}

/// Describes the removed dust for people.
pub(super) fn describe_dust(done: &Dust) -> String {
    let Dust { voxels, parts, cavities, samples, largest_change, left, .. } = done;
    let change = number(*largest_change);
    let left =
        if *left > 0 { format!("; --persistence left {left} of that size") } else { String::new() };
    format!(
        "removed {parts} components and {cavities} cavities below {voxels} voxels: changed {samples} samples by up to {change}{left}"
    )
}

/// Describes a simplification for people.
fn describe(done: &Simplification) -> String {
    let Simplification { before, after, .. } = done;
    let pair = |of: fn(&Census) -> usize| format!("{} -> {}", of(before), of(after));
    format!(
        "simplified: extrema of a persistence below {}: minima {}, maxima {}; in all critical points {}, minima {}, maxima {}, handles {}; samples changed by up to {} (mean {})",
        number(done.persistence),
        pair(|c| c.minima_below),
        pair(|c| c.maxima_below),
        pair(|c| c.critical_points),
        pair(|c| c.minima),
        pair(|c| c.maxima),
        pair(|c| c.handles),
        number(done.largest_change),
        number(done.mean_change),
    )
}
