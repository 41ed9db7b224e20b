//! The isovalues of a verification: random ones, and pairs around
//! events.

use crate::error::{Error, Result};
use crate::random::Random;
use crate::spectrum::{Event, Spectrum};
use crate::volume::Volume;

/// The number of isovalues of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Number of random isovalues.
    pub n_random: usize,
    /// Most events, with an isovalue on either side of each, and most isovalues away from events at which
    /// triangles are born or die, with one on either side of each. Most values of samples and events that are checked with the numbers
    /// next to them.
    pub n_events: usize,
    /// Seed of the random choice.
    pub seed: u64,
}

/// Most random isovalues: a day of work for a small spectrum.
const MAX_RANDOM: usize = 1_000_000;

/// Volumes of at most so many samples are checked after their computation as by [`Sampling::default`]: 20 along each side. More takes
/// as long as the sweep (hydrogen, 32 along each side).
const MAX_DEFAULT_SAMPLES: usize = 8_000;

impl Sampling {
    /// The sampling that `compute` can afford: the default up to 20^3 samples, then fewer isovalues the more samples there are.
    pub fn affordable(volume: &Volume) -> Sampling {
        let all = Sampling::default();
        let times = volume.samples().len().div_ceil(MAX_DEFAULT_SAMPLES).max(1);
        Sampling {
            n_random: (all.n_random / times).max(8),
            n_events: (all.n_events / times).max(2),
            seed: all.seed,
        }
    }

    /// # Errors
    ///
    /// [`Error::Usage`] for more random isovalues than a verification can reach.
    pub(super) fn check(&self) -> Result<()> {
        if self.n_random > MAX_RANDOM {
            return Err(Error::Usage(format!(
                "{} random isovalues, expected at most {MAX_RANDOM}",
                self.n_random
            )));
        }
        Ok(())
    }
}

impl Default for Sampling {
    fn default() -> Self {
        Sampling { n_random: 64, n_events: 16, seed: 0 }
    }
}

/// `n` isovalues inside `range`, sorted: half of them uniform over the range, the others near
/// values of samples, where most surfaces of the volume are.
pub(super) fn random_isovalues(
    volume: &Volume,
    range: (f64, f64),
    n: usize,
    random: &mut Random,
) -> Vec<f64> {
    let (low, high) = range;
    let margin = 1e-6 * (high - low);
    let mut isovalues: Vec<f64> = (0..n)
        .map(|i| {
            let uniform = (low + random.unit() * (high - low)).min(high);
            if i % 2 == 0 {
                return uniform;
            }
            // Up to 64 draws, to find a sample inside the range.
            let inside = (0..64)
                .map(|_| volume.samples().get(random.below(volume.samples().len())))
                .find(|v| (low..=high).contains(v));
            // Past the sample by less than a step of 8-bit data, to avoid isovalues equal to samples.
            let past = (0.02 + 0.96 * random.unit()) * (high - low) / 256.0;
            inside.map_or(uniform, |v| v + past)
        })
        .map(|c| c.clamp(low + margin, high - margin))
        .collect();
    isovalues.sort_by(f64::total_cmp);
    isovalues
}

/// Isovalues just before and just after at most `n` events, sorted by event: pairs a millionth of
/// the range to either side. Events at one isovalue count once.
pub(super) fn event_isovalues(
    events: &[Event],
    range: (f64, f64),
    n: usize,
    random: &mut Random,
) -> Vec<(f64, f64)> {
    let delta = 1e-6 * (range.1 - range.0);
    let mut at: Vec<f64> = events.iter().map(|e| e.isovalue).collect();
    at.retain(|&c| c - delta > range.0 && c + delta < range.1);
    at.sort_by(f64::total_cmp);
    at.dedup();
    while at.len() > n {
        at.remove(random.below(at.len()));
    }
    at.into_iter().map(|c| (c - delta, c + delta)).collect()
}

/// The values of up to `n` samples and events, each with the number before and the number after, sorted: at them triangles change.
pub(super) fn neighbours(
    volume: &Volume,
    spectrum: &Spectrum,
    n: usize,
    random: &mut Random,
) -> Vec<f64> {
    let (samples, events) = (volume.samples(), spectrum.events());
    let values = (0..n).map(|i| match events {
        [_, ..] if i % 2 == 0 => events[random.below(events.len())].isovalue,
        _ => samples.get(random.below(samples.len())),
    });
    let (low, high) = spectrum.range();
    let mut isovalues: Vec<f64> = values.flat_map(|c| [c.next_down(), c, c.next_up()]).collect();
    isovalues.retain(|c| (low..=high).contains(c));
    isovalues.sort_by(f64::total_cmp);
    isovalues.dedup();
    isovalues
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::EventKind;
    use crate::volume::{Placement, Samples};

    fn ramp() -> Volume {
        let samples = Samples::U8((0..27).collect());
        Volume::new("ramp", [3; 3], samples, Placement::default()).expect("a valid volume")
    }

    #[test]
    fn one_seed_gives_one_sequence_inside_the_range() {
        let draw = |seed| random_isovalues(&ramp(), (5.0, 20.0), 31, &mut Random::new(seed));
        assert_eq!(draw(7), draw(7));
        assert_ne!(draw(7), draw(8));
        assert_eq!(draw(7).len(), 31);
        assert!(draw(7).iter().all(|c| (5.0..20.0).contains(c)));
        assert!(draw(7).is_sorted());
    }

    #[test]
    fn events_at_one_isovalue_count_once_and_the_ends_of_the_range_not_at_all() {
        let event = |isovalue| Event { isovalue, position: [0.0; 3], kind: EventKind::Emerge };
        let events = [1.0, 3.0, 3.0, 4.0, 9.0].map(event);
        let pairs = event_isovalues(&events, (1.0, 9.0), 10, &mut Random::new(0));
        assert_eq!(pairs.len(), 2);
        assert!(pairs[0].0 < 3.0 && pairs[0].1 > 3.0 && pairs[1].0 < 4.0);
        assert_eq!(event_isovalues(&events, (1.0, 9.0), 1, &mut Random::new(0)).len(), 1);
    }
}
