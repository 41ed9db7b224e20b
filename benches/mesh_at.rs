//! How long the mesh at one isovalue takes: it should be the active triangles that count, not how
//! many there are in all.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isospectrum::spectrum::{Query, Spectrum, SurfaceMesh};

#[path = "../tests/synthetic/mod.rs"]
mod synthetic;

use synthetic::{Growth, growing_sphere, isovalue};

/// Ranks of the spectra measured.
const N_STEPS: u32 = 200;

/// About 10 thousand active triangles at the isovalue in the middle, with ten times as many
/// inactive ones or hardly any.
fn spectra() -> [(&'static str, Spectrum); 2] {
    let still =
        Growth { subdivisions: 5, n_steps: N_STEPS, splits: 10, flips: 0, knot_distance: 40 };
    [
        ("few_inactive", growing_sphere(&still)),
        ("ten_times_inactive", growing_sphere(&Growth { flips: 310, ..still })),
    ]
}

fn mesh_at(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("mesh_at");
    for (name, spectrum) in spectra() {
        let middle = isovalue(N_STEPS / 2) + 0.1;
        let mut query = Query::new(&spectrum);
        let mut mesh = SurfaceMesh::default();
        query.mesh_at_into(middle, &mut mesh).expect("inside the range");
        group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
        println!(
            "{name}: {} of {} triangles active",
            mesh.triangles.len(),
            spectrum.triangles.len()
        );
        group.bench_function(BenchmarkId::new("same_rank", name), |b| {
            b.iter(|| query.mesh_at_into(black_box(middle), &mut mesh));
        });
        group.bench_function(BenchmarkId::new("small_move", name), |b| {
            let mut up = false;
            b.iter(|| {
                up = !up;
                query.mesh_at_into(middle + if up { 1.0 } else { 0.0 }, &mut mesh)
            });
        });
        group.bench_function(BenchmarkId::new("jump", name), |b| {
            let mut up = false;
            b.iter(|| {
                up = !up;
                query.mesh_at_into(if up { middle } else { middle - 60.0 }, &mut mesh)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, mesh_at);
criterion_main!(benches);
