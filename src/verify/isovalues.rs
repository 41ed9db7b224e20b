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
    /// Most triangles, and most vertices, whose distances and shapes are measured at one isovalue: of more, a subset that is evenly
    /// distributed. Topology and crossing triangles are always those of all.
    pub max_measured: usize,
}

/// Most random isovalues: a day of work for a small spectrum.
const MAX_RANDOM: usize = 1_000_000;

/// Volumes of at most so many samples are checked after their computation as by [`Sampling::default`]: 20 along each side. More takes
/// as long as the sweep (hydrogen, 32 along each side).
const MAX_DEFAULT_SAMPLES: usize = 8_000;

/// Most triangles measured at one isovalue after a computation. The share beyond a 99th percentile of all varies by .0003.
/// Most triangles measured at one isovalue after a computation. The share beyond a 99th percentile of all varies by .0006.
const MAX_AFFORDABLE: usize = 25_000;

/// Volumes of at most so many samples, 6 along each side, are checked at a second choice of isovalues, as their meshes differ most from one isovalue
/// to another; and those of at most so many, 10 along each side, if the first leaves a doubt. That takes a second.
const MAX_TWICE_SAMPLES: [usize; 2] = [216, 1_000];

/// Number of random isovalues and of events of a second choice. With 4 times as many in all, other isovalues are the main uncertainty that is left.
const SECOND: (usize, usize) = (192, 64);

/// How isovalues are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Draw {
    /// Independently, by [`random_isovalues`].
    Random,
    /// Evenly, by [`spread_isovalues`].
    Spread,
}

impl Sampling {
    /// The sampling that `compute` can afford: the default up to 20^3 samples, then fewer isovalues the more samples there are; and of large
    /// meshes a subset of the triangles.
    pub(super) fn affordable(volume: &Volume) -> Sampling {
        let all = Sampling::default();
        let times = volume.samples().len().div_ceil(MAX_DEFAULT_SAMPLES).max(1);
        Sampling {
            n_random: (all.n_random / times).max(8),
            n_events: (all.n_events / times).max(2),
            seed: all.seed,
            max_measured: MAX_AFFORDABLE,
        }
    }

    /// The second choice of isovalues that `compute` can afford, if the first leaves a doubt or not; none for all but small volumes.
    pub(super) fn second(volume: &Volume, is_doubtful: bool) -> Option<Sampling> {
        let (n_random, n_events) = SECOND;
        let second = Sampling { n_random, n_events, seed: 1, ..Sampling::default() };
        let most = MAX_TWICE_SAMPLES[usize::from(is_doubtful)];
        (volume.samples().len() <= most).then_some(second)
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
        Sampling { n_random: 64, n_events: 16, seed: 0, max_measured: usize::MAX }
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

/// `n` isovalues with the distribution of [`random_isovalues`], sorted: one in each of `n` parts of it that are equally likely, so that a short
/// part of the range with a bad mesh is missed less often.
pub(super) fn spread_isovalues(
    volume: &Volume,
    (low, high): (f64, f64),
    n: usize,
    random: &mut Random,
) -> Vec<f64> {
    let samples = volume.samples();
    let mut inside: Vec<f64> = (0..samples.len()).map(|i| samples.get(i)).collect();
    inside.retain(|v| (low..=high).contains(v));
    inside.sort_by(f64::total_cmp);
    let n_near = if inside.is_empty() { 0 } else { n / 2 };
    let n_uniform = n - n_near;
    let mut share = |i: usize, n: usize| (i as f64 + random.unit()) / n as f64;
    let mut isovalues: Vec<f64> =
        (0..n_uniform).map(|i| low + share(i, n_uniform) * (high - low)).collect();
    for i in 0..n_near {
        let nearest = (share(i, n_near) * inside.len() as f64) as usize;
        // The distances from equal samples are spread, too: multiples of the golden ratio.
        let past = (i as f64 * 0.618_033_988_749_894_9).fract();
        let past = (0.02 + 0.96 * past) * (high - low) / 256.0;
        isovalues.push(inside[nearest.min(inside.len() - 1)] + past);
    }
    let margin = 1e-6 * (high - low);
    isovalues.iter_mut().for_each(|c| *c = c.clamp(low + margin, high - margin));
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
    fn spread_isovalues_are_one_in_each_part() {
        let (n, volume) = (64, ramp());
        let range = volume.range();
        let (low, high) = range;
        let found = spread_isovalues(&volume, range, n, &mut Random::new(1));
        assert_eq!(found.len(), n);
        assert!(found.is_sorted() && found.iter().all(|c| (low..high).contains(c)));
        // Half of them are uniform; those near samples are in a 256th of the range above whole numbers, or at the end of the range.
        let (near, uniform): (Vec<f64>, Vec<f64>) =
            found.iter().partition(|c| c.fract() < (high - low) / 256.0);
        let in_part = |part: usize| {
            let part = part as f64 / 8.0..(part + 1) as f64 / 8.0;
            uniform.iter().filter(|&&c| part.contains(&((c - low) / (high - low)))).count()
        };
        assert!((0..8).all(|part| (2..=5).contains(&in_part(part))), "{uniform:?}");
        // Two samples have more than one part of 32 for themselves, and share at most two others.
        let at = |pair: usize| near.iter().filter(|&&c| (c / 2.0).floor() == pair as f64).count();
        assert!((0..13).all(|pair| (1..=4).contains(&at(pair))), "{near:?}");
    }

    #[test]
    fn events_at_one_isovalue_count_once_and_the_ends_of_the_range_not_at_all() {
        let event = |isovalue| Event {
            isovalue,
            position: [0.0; 3],
            kind: EventKind::Emerge,
            persistence: None,
        };
        let events = [1.0, 3.0, 3.0, 4.0, 9.0].map(event);
        let pairs = event_isovalues(&events, (1.0, 9.0), 10, &mut Random::new(0));
        assert_eq!(pairs.len(), 2);
        assert!(pairs[0].0 < 3.0 && pairs[0].1 > 3.0 && pairs[1].0 < 4.0);
        assert_eq!(event_isovalues(&events, (1.0, 9.0), 1, &mut Random::new(0)).len(), 1);
    }
}
