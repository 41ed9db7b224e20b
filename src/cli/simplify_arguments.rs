//! How noise is taken out of a volume before anything else, as said on the command line.

use clap::Args;
use isospectrum::Cleaned;
use isospectrum::Result;
use isospectrum::settings::{NoiseSettings, Persistence};
use isospectrum::unstable::topology::dust::Dust;
use isospectrum::unstable::topology::simplify::{Census, Simplification};
use isospectrum::volume::Volume;

use super::report::number;

/// The arguments wherever noise can be taken out of a volume.
#[derive(Args, Debug)]
#[group(id = "noise", multiple = true)]
pub(super) struct SimplifyArguments {
    /// Take noise out first: no minimum or maximum is left that is closer than P in value to the saddle that ends
    /// it; samples change by up to about 2 P; a value, or a percentage of the volume's range such as 5%
    #[arg(long, value_name = "P", allow_negative_numbers = true)]
    persistence: Option<Persistence>,
    /// Leave dust out: parts, and cavities, that never have V voxels before they meet a larger one (before --persistence)
    #[arg(long, value_name = "V", value_parser = clap::value_parser!(u32).range(1..))]
    min_component: Option<u32>,
}

impl SimplifyArguments {
    /// The settings that the flags give.
    pub(super) fn settings(&self) -> NoiseSettings {
        NoiseSettings { persistence: self.persistence, min_component: self.min_component }
    }

    /// Removes noise from a volume; returns what was removed.
    pub(super) fn apply(&self, volume: Volume) -> Result<(Volume, Cleaned)> {
        let (volume, cleaned) = self.settings().resolve(&volume).take_out(volume)?;
        if let Some(done) = &cleaned.dust {
            log::info!("dust: {}", dust_sentence(done));
        }
        if let Some(done) = &cleaned.simplification {
            log::info!("{}", sentence(done));
        }
        Ok((volume, cleaned))
    }
}

/// What was left out as dust, for people.
pub(super) fn dust_sentence(done: &Dust) -> String {
    let Dust { voxels, parts, cavities, samples, largest_change, left, .. } = done;
    let change = number(*largest_change);
    let left = if *left > 0 {
        format!("; {left} are as small after --persistence")
    } else {
        String::new()
    };
    format!(
        "{parts} parts and {cavities} cavities below {voxels} voxels left out: {samples} samples changed, by up to {change}{left}"
    )
}

/// What was done, for people.
fn sentence(done: &Simplification) -> String {
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
