//! The time for the exact field and one extraction on smooth and dense 128^3 volumes.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use isospectrum::unstable::extract::count::count;
use isospectrum::unstable::extract::extract;
use isospectrum::unstable::topology::exact::ExactField;
use isospectrum::volume::{Placement, Samples, Volume};

const N: usize = 128;

/// An N^3 volume of a function of the position in -1 to 1.
fn sampled(name: &str, f: impl Fn([f64; 3]) -> f64) -> Volume {
    let at = |i: usize| 2.0 * i as f64 / (N - 1) as f64 - 1.0;
    let samples = (0..N * N * N)
        .map(|i| f([at(i % N), at(i / N % N), at(i / (N * N))]).clamp(0.0, 255.0) as u8)
        .collect();
    Volume::new(name, [N; 3], Samples::U8(samples), Placement::default()).expect("a valid volume")
}

/// Two lobes that fall off to a wide plateau of zeros, as in many scans.
fn lobes() -> Volume {
    sampled("lobes", |[x, y, z]| {
        let squared = |c: f64| (x - c) * (x - c) + y * y + z * z;
        300.0 * ((-8.0 * squared(0.4)).exp() + (-8.0 * squared(-0.4)).exp())
    })
}

/// A gyroid with six periods along each axis: surface in every brick.
fn gyroid() -> Volume {
    sampled("gyroid", |p| {
        let [x, y, z] = p.map(|c| 6.0 * std::f64::consts::PI * c);
        128.0 + 80.0 * (x.sin() * y.cos() + y.sin() * z.cos() + z.sin() * x.cos())
    })
}

fn benchmark(c: &mut Criterion) {
    for volume in [lobes(), gyroid()] {
        let mut group = c.benchmark_group(volume.name().to_owned());
        group.sample_size(10);
        group.bench_function("exact field", |b| b.iter(|| ExactField::new(black_box(&volume))));
        let field = ExactField::new(&volume).expect("a small volume");
        group.bench_function("extract", |b| b.iter(|| extract(&field, black_box(128.5))));
        group.bench_function("count", |b| b.iter(|| count(&field, black_box(128.5))));
        group.bench_function("empty", |b| b.iter(|| extract(&field, black_box(1e4))));
        group.finish();
    }
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
