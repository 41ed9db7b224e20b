//! The choice of a backend, and its behaviour towards callers.

use crate::common::random::Random;
use crate::common::shapes::{Mesh, noise};
use crate::kernels::cpu;
use crate::kernels::suite::project;
use glam::Vec3;
use isospectrum::Error;
use isospectrum::unstable::field::Field;
use isospectrum::unstable::kernels::backend::MIN_GPU_VERTICES;
use isospectrum::unstable::kernels::{Advance, Advanced, DeviceWork, Kernels, Relaxation};
use isospectrum::{Backend, Choice};
use std::sync::Arc;

/// A step as a sweep takes it.
const STEP: Advance<'static> = Advance {
    isovalues: &[],
    reach: 1.5,
    ends: &[],
    relaxation: Relaxation { isovalue: 120.0, strength: 0.6, threshold: 1e-6, max_iterations: 6 },
};

#[test]
fn a_gpu_by_an_unknown_name_is_an_error_that_lists_the_known_ones() {
    for choice in [Choice::Gpu, Choice::Auto] {
        let error = Backend::choose(choice, Some("no such adapter")).expect_err("no such adapter");
        assert!(matches!(error, Error::Gpu(_)));
        let text = error.to_string();
        assert!(text.contains("no such adapter") && text.contains("expected one of"), "{text}");
        assert!(!text.contains('\n'), "{text}");
    }
}

#[test]
fn the_cpu_backend_is_always_available() {
    let backend = Backend::choose(Choice::Cpu, None).expect("the CPU");
    assert_eq!(backend.name(), "cpu");
}

#[test]
fn auto_chooses_an_adapter_unless_it_is_a_software_one() {
    let gpu = crate::kernels::PIPELINES.gpu();
    let expected = if gpu.is_software() { "cpu".to_string() } else { gpu.name() };
    let backend = Backend::choose(Choice::Auto, None).expect("auto always finds one");
    assert_eq!(backend.name(), expected);
    let by_choice = Backend::choose(Choice::Gpu, None).expect("an adapter");
    assert_eq!(by_choice.name(), gpu.name());
}

#[test]
fn threads_share_a_backend_and_get_the_same_answers() {
    let mut random = Random(2);
    let volume = noise([20, 20, 20], &mut random);
    let (low, high) = (Vec3::splat(2.0), Vec3::splat(17.0));
    let large = MIN_GPU_VERTICES / 4 + 1;
    let meshes: Vec<Mesh> = [large, 50, large + 300, 7]
        .map(|n| Mesh::tetrahedra(n, low, high, 0.4, &mut random))
        .into();
    let backend = Backend::choose(Choice::Gpu, None).expect("an adapter");
    let field = Arc::new(Field::new(volume));
    let run = || {
        let mut kernels = backend.kernels(&field).expect("the field fits");
        let step = |mesh: &Mesh| {
            kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
            project(&mut *kernels, &[120.0], 1.5).positions
        };
        meshes.iter().map(step).collect::<Vec<_>>()
    };
    let results = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..3).map(|_| scope.spawn(run)).collect();
        threads.into_iter().map(|t| t.join().expect("no panic")).collect::<Vec<_>>()
    });
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

#[test]
fn the_cpu_gives_the_same_bytes_on_any_number_of_threads() {
    let mut random = Random(4);
    let volume = noise([24, 24, 24], &mut random);
    let (low, high) = (Vec3::splat(2.0), Vec3::splat(21.0));
    let mesh = Mesh::tetrahedra(4000, low, high, 0.4, &mut random);
    let run = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("threads");
        pool.install(|| {
            let mut kernels: Box<dyn Kernels + Send> = cpu(&volume);
            kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
            kernels.advance(&Advance { isovalues: &[120.0], ..STEP }).expect("advances")
        })
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn a_step_is_one_submission_and_one_read_back() {
    let mut random = Random(5);
    let volume = noise([24, 24, 24], &mut random);
    let (low, high) = (Vec3::splat(2.0), Vec3::splat(21.0));
    let mesh = Mesh::tetrahedra(4000, low, high, 0.4, &mut random);
    for (backend, isovalues, submissions) in [
        (crate::kernels::gpu as fn(&_) -> _, &[120.0][..], 1),
        (crate::kernels::gpu, &[119.0, 120.0], 2),
        (cpu, &[120.0], 0),
    ] {
        let mut kernels: Box<dyn Kernels + Send> = backend(&volume);
        kernels.load(&mesh.connectivity, &mesh.positions).expect("loads");
        let step = Advance { isovalues, ends: &mesh.positions, ..STEP };
        kernels.advance(&step).expect("advances");
        let read_backs = u64::from(submissions > 0);
        assert_eq!(kernels.device_work(), DeviceWork { submissions, read_backs });
    }
}

#[test]
fn kernels_accept_an_empty_mesh() {
    let volume = noise([8, 8, 8], &mut Random(1));
    let empty = isospectrum::unstable::kernels::Connectivity {
        ring_offsets: vec![0],
        ..Default::default()
    };
    for backend in [cpu, crate::kernels::gpu] {
        let mut kernels = backend(&volume);
        kernels.load(&empty, &[]).expect("loads");
        for max_iterations in [4, 20] {
            let relaxation = Relaxation { max_iterations, ..STEP.relaxation };
            let step = Advance { isovalues: &[120.0], relaxation, ..STEP };
            assert_eq!(kernels.advance(&step).expect("advances"), Advanced::default());
        }
    }
}
