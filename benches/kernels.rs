//! Each kernel on both backends: a wavy ball of about 50,000 vertices in a 128^3 volume.
//!
//! `cargo bench -p isospectrum-benches --bench kernels`; the ids are `<kernel>/<backend>/<vertices>`. The group `small` measures load and advance
//! by the number of vertices, from which `kernels::backend::MIN_GPU_VERTICES` is chosen.

#[path = "../tests/common/random.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod random;
#[path = "../tests/common/shapes.rs"]
#[allow(dead_code, reason = "the tests use more of them")]
mod shapes;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use isospectrum::render::Gpu;
use isospectrum::unstable::field::Field;
use isospectrum::unstable::kernels::gpu::{DeviceField, Pipelines};
use isospectrum::unstable::kernels::{Advance, CpuKernels, GpuKernels, Kernels, Relaxation};
use isospectrum::volume::Volume;
use shapes::{Mesh, sampled};
use std::sync::Arc;

const CENTER: DVec3 = DVec3::splat(63.5);

fn ball() -> Arc<Volume> {
    sampled([128; 3], [1.0; 3], |p| {
        let q = DVec3::from_array(p) - CENTER;
        -q.length() - (0.35 * q.x).sin() * (0.3 * q.y).cos() * (0.25 * q.z).cos()
    })
}

/// A mesh of the ball with about `n` vertices.
fn mesh(n: usize) -> Mesh {
    // 4 k^2 + 2 vertices.
    Mesh::sphere(CENTER.as_vec3(), 40.0, (n as f64 / 4.0).sqrt().round() as i32)
}

/// Both backends.
///
/// # Panics
///
/// Without an adapter.
fn backends(volume: &Arc<Volume>) -> Vec<(&'static str, Box<dyn Kernels + Send>)> {
    let field = Arc::new(Field::new(volume.clone()));
    let gpu = Gpu::new(None).unwrap_or_else(|e| panic!("the benches need an adapter: {e}"));
    let pipelines = Arc::new(Pipelines::new(Arc::new(gpu)).expect("the kernels compile"));
    let device_field = DeviceField::new(pipelines.gpu(), field.clone()).expect("the field fits");
    let gpu = GpuKernels::new(pipelines, Arc::new(device_field)).expect("the buffers fit");
    vec![("cpu", Box::new(CpuKernels::new(field))), ("gpu", Box::new(gpu))]
}

fn kernels(c: &mut Criterion) {
    let volume = ball();
    let mesh = mesh(50_000);
    for (backend, mut kernels) in backends(&volume) {
        let n = mesh.positions.len();
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        kernels.advance(&projection(&[-40.0])).expect("projects");
        let mut group = c.benchmark_group("kernels");
        group.sample_size(20).throughput(Throughput::Elements(n as u64));
        let id = |kernel: &str| BenchmarkId::new(format!("{kernel}/{backend}"), n);
        // The normals and the read back are part of all others.
        group.bench_function(id("normals"), |b| {
            b.iter(|| kernels.advance(&projection(&[])).expect("runs"));
        });
        let mut up = false;
        group.bench_function(id("project"), |b| {
            b.iter(|| {
                up = !up;
                let isovalues = if up { &[-40.5] } else { &[-40.0] };
                kernels.advance(&projection(isovalues)).expect("runs")
            });
        });
        kernels.advance(&projection(&[-40.0])).expect("projects");
        let relaxation = Relaxation { max_iterations: 4, ..STEP.relaxation };
        group.bench_function(id("relax"), |b| {
            b.iter(|| kernels.advance(&Advance { relaxation, ..projection(&[]) }).expect("runs"));
        });
        group.bench_function(id("deviation"), |b| {
            b.iter(|| kernels.deviation(-40.0, 1.0).expect("runs"));
        });
        group.finish();
    }
}

/// A step of a sweep.
const STEP: Advance<'static> = Advance {
    isovalues: &[-40.0],
    reach: 3.0,
    ends: &[],
    relaxation: Relaxation { isovalue: -40.0, strength: 0.6, threshold: 0.0, max_iterations: 6 },
};

/// Projections only.
fn projection(isovalues: &[f64]) -> Advance<'_> {
    let relaxation = Relaxation { max_iterations: 0, ..STEP.relaxation };
    Advance { isovalues, relaxation, ..STEP }
}

fn small(c: &mut Criterion) {
    let volume = ball();
    for (backend, mut kernels) in backends(&volume) {
        let mut group = c.benchmark_group("small");
        group.sample_size(20);
        for n in [64, 256, 1024, 4096, 16384, 65536] {
            let mesh = mesh(n);
            group.bench_function(BenchmarkId::new(format!("step/{backend}"), n), |b| {
                b.iter(|| {
                    kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
                    kernels.advance(&STEP).expect("advances")
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, kernels, small);
criterion_main!(benches);
