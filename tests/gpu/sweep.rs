//! A sweep on the GPU.

use isospectrum::unstable::kernels::backend::MIN_GPU_VERTICES;
use isospectrum::{Backend, Choice, Parameters, Silent, compute};

use crate::common::spectra::{assert_isosurfaces, phantom_volume, random_isovalues};

#[test]
fn a_sphere_computed_on_the_gpu_has_the_counted_topology() {
    let volume = phantom_volume("sphere:48");
    let gpu = Backend::choose(Choice::Gpu, None).expect("an adapter");
    // Where the sphere fills the volume.
    let range = (0.1, 0.2);
    let parameters = Parameters::default().with_range(Some(range));
    let spectrum = compute(&volume, &parameters, &gpu, &Silent).expect("a spectrum");
    let isovalues = random_isovalues(range, 24, 7);
    let largest = assert_isosurfaces(&volume, &spectrum, &isovalues, "sphere");
    assert!(largest >= MIN_GPU_VERTICES, "{largest} vertices: all of it ran on the CPU");
}
