//! Two methods to list the triangles alive at an isovalue: `cargo bench -p isospectrum-benches --bench active_set`; the ids are
//! `<spectrum>/<method>/<move>`.
//!
//! - `tree`: a query of the interval tree, its result sorted as pictures need it;
//! - `lists`: an update of the active set by the triangles born and dead since the last isovalue ([`ActiveSet`]).
//!
//! Moves are by a thousandth of the range, by a hundredth, and to a random isovalue. The spectra have lifetimes only:
//! about 10,000 triangles alive of 10 thousand, 1 and 10 million, and a million alive of 10 million.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use isospectrum::spectrum::Triangle;
use isospectrum::unstable::spectrum::ActiveSet;
use isospectrum::unstable::spectrum::interval_tree::IntervalTree;

/// Ranks of each spectrum.
const N_RANKS: u32 = 1 << 20;

/// A linear congruential generator: the same numbers on every machine.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, n: u32) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (((self.0 >> 33) * u64::from(n)) >> 31) as u32
    }
}

/// `n` triangles of which about `alive` live at any rank, with lifetimes of 0.5 to 1.5 times the mean.
fn spectrum(n: usize, alive: usize) -> Vec<Triangle> {
    let mut numbers = Numbers(7);
    let mean = (u64::from(N_RANKS) * alive as u64 / n as u64).max(2) as u32;
    (0..n)
        .map(|_| {
            let length = mean / 2 + numbers.below(mean) + 1;
            let birth = numbers.below(N_RANKS + length);
            // Lifetimes are clipped to the range of ranks.
            let death = birth.max(1);
            Triangle {
                vertices: [0, 1, 2],
                birth: birth.saturating_sub(length),
                death: death.min(N_RANKS),
                cap: false,
            }
        })
        .filter(|t| t.birth < t.death)
        .collect()
}

/// The ranks of a walk: steps of `step` up and down around the middle, or random ranks.
fn walk(step: Option<u32>) -> impl FnMut() -> u32 {
    let mut numbers = Numbers(3);
    let mut rank = N_RANKS / 2;
    let mut up = true;
    move || {
        match step {
            None => rank = numbers.below(N_RANKS),
            Some(step) => {
                up = if rank > N_RANKS / 4 * 3 { false } else { up || rank < N_RANKS / 4 };
                rank = if up { rank + step } else { rank - step };
            }
        }
        rank
    }
}

const MOVES: [(&str, Option<u32>); 3] =
    [("thousandth", Some(N_RANKS / 1000)), ("hundredth", Some(N_RANKS / 100)), ("jump", None)];

fn active_set(criterion: &mut Criterion) {
    for (name, n, alive) in [
        ("10k", 10_000, 10_000),
        ("1M_10k_alive", 1_000_000, 10_000),
        ("10M_10k_alive", 10_000_000, 10_000),
        ("10M_1M_alive", 10_000_000, 1_000_000),
    ] {
        let triangles = spectrum(n, alive);
        let lifetimes: Vec<(u32, u32)> = triangles.iter().map(|t| (t.birth, t.death)).collect();
        let tree = IntervalTree::new(&lifetimes);
        let mut lists = ActiveSet::new(&triangles);
        println!("{name}: {} alive in the middle", lists.move_to(N_RANKS / 2).len());

        let mut group = criterion.benchmark_group(name);
        group.sample_size(10).measurement_time(std::time::Duration::from_secs(2));
        group.warm_up_time(std::time::Duration::from_millis(500));
        for (distance, step) in MOVES {
            let mut rank = walk(step);
            let mut list = Vec::new();
            group.bench_function(BenchmarkId::new("tree", distance), |b| {
                b.iter(|| {
                    list.clear();
                    tree.stab(rank(), |i| list.push(i));
                    list.sort_unstable();
                    list.len()
                });
            });
            let mut rank = walk(step);
            group.bench_function(BenchmarkId::new("lists", distance), |b| {
                b.iter(|| lists.move_to(rank()).len());
            });
        }
        group.finish();
    }
}

criterion_group!(benches, active_set);
criterion_main!(benches);
