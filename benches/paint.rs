//! The time from a new isovalue to its picture, by the size of the spectrum: it should depend only on the number of
//! triangles drawn. `cargo bench -p isospectrum-benches --bench paint`; the ids are `paint/<spectrum>/<move>`.
//!
//! A spectrum is a sphere of 8,192 triangles, all of which are replaced at each of its ranks:
//! 1, 100 and 1,200 generations, the last with 10 million triangles.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use isospectrum::render::Gpu;
use isospectrum::render::{Painter, View};
use isospectrum::spectrum::{About, Knot, Patch, Spectrum, Triangle};

#[path = "../tests/common/synthetic.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod synthetic;

use synthetic::{Numbers, volume_info};

/// Points along a meridian and around the equator of the sphere.
const N: u32 = 64;

/// Corners of the sphere's grid: rows from pole to pole, the columns closed.
fn vertex(row: u32, column: u32) -> u32 {
    row * N + column % N
}

/// A sphere in `n_generations`, one after the other; each moves outwards between its two ranks.
fn spectrum(n_generations: u32) -> Spectrum {
    let n_vertices = (N + 1) * N;
    let mut knots = Vec::new();
    let mut triangles = Vec::new();
    for generation in 0..n_generations {
        for row in 0..=N {
            for column in 0..N {
                let (latitude, longitude) = (
                    std::f32::consts::PI * row as f32 / N as f32,
                    std::f32::consts::TAU * column as f32 / N as f32,
                );
                let (sin, cos) = latitude.sin_cos();
                let n = [sin * longitude.cos(), sin * longitude.sin(), cos];
                knots.extend([0, 1].map(|end| Knot {
                    rank: generation + end,
                    position: n.map(|x| 64.0 + (30.0 + 4.0 * end as f32) * x),
                }));
            }
        }
        let first = generation * n_vertices;
        for row in 0..N {
            for column in 0..N {
                let [a, b, c, d] = [(0, 0), (0, 1), (1, 1), (1, 0)]
                    .map(|(down, right)| first + vertex(row + down, column + right));
                triangles.extend([[a, d, b], [b, d, c]].map(|vertices| Triangle {
                    vertices,
                    birth: generation,
                    death: generation + 1,
                    cap: false,
                }));
            }
        }
    }
    let about = About::new(volume_info(), (0.0, f64::from(n_generations) - 1e-6), 0.1);
    let patch = Patch {
        isovalues: (0..=n_generations).map(f64::from).collect(),
        first_knot: (0..=n_generations * n_vertices).map(|v| 2 * v).collect(),
        knots,
        triangles,
        collapses: Vec::new(),
    };
    Spectrum::new(about, patch).expect("valid")
}

fn paint(criterion: &mut Criterion) {
    let gpu = Gpu::new(None).unwrap_or_else(|e| panic!("the benches need an adapter: {e}"));
    println!("device: {}", gpu.name());
    let view = View::default().with_width(960).with_height(540);
    let mut group = criterion.benchmark_group("paint");
    group.sample_size(10).measurement_time(std::time::Duration::from_secs(4));
    for n_generations in [1, 100, 1200] {
        let spectrum = spectrum(n_generations);
        let name = format!("{}_triangles", spectrum.triangles().len());
        let (low, high) = spectrum.range();
        let mut painter = Painter::new(&gpu, &spectrum, u64::MAX).expect("a painter");
        let mut show = |isovalue: f64| {
            painter.paint(&spectrum, &[isovalue.into()], &view).expect("painted");
            gpu.wait().expect("drawn");
        };
        let mut step = 0.0;
        group.bench_function(BenchmarkId::new(&name, "thousandth"), |b| {
            b.iter(|| {
                step = (step + 1.0) % 500.0;
                show(low + (high - low) * (0.25 + step / 1000.0));
            });
        });
        let mut numbers = Numbers(3);
        group.bench_function(BenchmarkId::new(&name, "jump"), |b| {
            b.iter(|| show(low + (high - low) * f64::from(numbers.below(1 << 20)) / 1048576.0));
        });
    }
    group.finish();
}

criterion_group!(benches, paint);
criterion_main!(benches);
