//! The time for the mesh at one isovalue: it should depend on the number of active triangles, not on
//! the total number, nor on the number of files.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use isospectrum::bricks::{
    BrickLimits, Parts, Plan, Survey, VolumeSource, compute_parts, merge, merge_to_path,
};
use isospectrum::file::{FileQuery, SpectrumFile, from_bytes, to_bytes};
use isospectrum::spectrum::{Mesh, Query, Spectrum};
use isospectrum::volume::{Preparation, phantom};
use isospectrum::{Backend, Choice};
use isospectrum::{Cleaned, Noise, Prepared};
use isospectrum::{Parameters, Silent};

#[path = "../tests/common/synthetic.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod synthetic;

use synthetic::{Growth, growing_sphere, isovalue};

/// Number of ranks of the spectra.
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
        let mut mesh = Mesh::default();
        query.mesh_at_into(middle, &mut mesh).expect("inside the range");
        group.throughput(Throughput::Elements(mesh.triangles.len() as u64));
        println!(
            "{name}: {} of {} triangles active",
            mesh.triangles.len(),
            spectrum.triangles().len()
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

/// A phantom of 128^3 cells in 8^3 bricks: its spectrum as one tree, and the file of its bricks.
fn in_parts(folder: &std::path::Path) -> isospectrum::Result<(Spectrum, Arc<SpectrumFile>)> {
    let (made, path) = (folder.join("parts"), folder.join("bricks.isp"));
    std::fs::create_dir(&made).expect("a folder");
    let volume = phantom("hydrogen:129")?;
    let source =
        VolumeSource::Phantom { name: "hydrogen:129".to_owned(), outside: volume.outside() };
    let (low, high) = volume.range();
    let range = Some((low + 0.1 * (high - low), low + 0.5 * (high - low)));
    let prepared = Prepared::of(volume, Preparation::default(), Cleaned::default());
    let survey = Survey::of(prepared);
    let parameters = Parameters::default().with_range(range);
    let plan = Plan::new(source, &survey, Noise::default(), &parameters, 16)?;
    let (parts, volume) = (Parts::new(&plan, &made), survey.volume());
    let limits = BrickLimits { memory: f64::INFINITY, in_memory: true, triangles: None };
    compute_parts(&parts, volume, &Backend::choose(Choice::Cpu, None)?, limits, &Silent)?;
    let file = from_bytes(&to_bytes(&merge(&parts, volume, &Silent)?)?)?;
    merge_to_path(&parts, volume, &path, None, &Silent)?;
    Ok((file, Arc::new(SpectrumFile::open(&path)?)))
}

/// Moves of a thousandth of the range, back and forth around its middle.
fn bricks(criterion: &mut Criterion) {
    let work = tempfile::tempdir().expect("a folder");
    let (file, bricks) = in_parts(work.path()).expect("a spectrum");
    let (low, high) = file.range();
    let (middle, step) = (0.5 * (low + high), 0.001 * (high - low));
    let mut mesh = Mesh::default();
    let mut group = criterion.benchmark_group("bricks");
    let mut query = Query::new(&file);
    query.mesh_at_into(middle, &mut mesh).expect("inside the range");
    let n_parts = bricks.n_trees();
    println!("{} triangles of {}, {n_parts} parts", mesh.triangles.len(), file.triangles().len());
    let mut up = false;
    group.bench_function("small_move/one_file", |b| {
        b.iter(|| {
            up = !up;
            query.mesh_at_into(middle + if up { step } else { 0.0 }, &mut mesh)
        });
    });
    let mut query = FileQuery::new(bricks.clone());
    query.mesh_at_into(middle, &mut mesh).expect("inside the range");
    let n_read = bricks.needed_around(&[middle]).0;
    println!("{} triangles of {n_read} that are read", mesh.triangles.len());
    group.bench_function("small_move/parts", |b| {
        b.iter(|| {
            up = !up;
            query.mesh_at_into(middle + if up { step } else { 0.0 }, &mut mesh)
        });
    });
    // Cold: reads the chunks with triangles there, makes the mesh.
    group.sample_size(10);
    group.bench_function("first/parts", |b| {
        b.iter(|| bricks.read_around(&[middle]).and_then(|s| s.mesh_at(middle)));
    });
    // Through the whole range, including all reading.
    group.bench_function("walk_of_1000/parts", |b| {
        b.iter(|| {
            let mut query = FileQuery::new(bricks.clone());
            let at = |i: u32| low + f64::from(i) / 1000.0 * (high - low);
            (0..=1000).try_for_each(|i| query.mesh_at_into(at(i), &mut mesh))
        });
    });
    group.bench_function("walk_of_1000/one_file", |b| {
        let path = work.path().join("s.isp");
        isospectrum::file::write(&file, &path).expect("written");
        b.iter(|| {
            let file = isospectrum::file::read(&path).expect("as it was written");
            let mut query = Query::new(&file);
            let at = |i: u32| low + f64::from(i) / 1000.0 * (high - low);
            (0..=1000).try_for_each(|i| query.mesh_at_into(at(i), &mut mesh))
        });
    });
    group.finish();
}

criterion_group!(benches, mesh_at, bricks);
criterion_main!(benches);
