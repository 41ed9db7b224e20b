//! The kernels against analytic oracles: one suite, run on every backend, and the GPU against its
//! CPU twin.
//!
//! The GPU suite fails where no adapter is found, it is never skipped: install one
//! (`mesa-vulkan-drivers` has a software adapter).

mod agreement;
mod backend;
mod suite;

use isospectrum::render::Gpu;
use isospectrum::unstable::field::Field;
use isospectrum::unstable::kernels::gpu::{DeviceField, Pipelines};
use isospectrum::unstable::kernels::{CpuKernels, GpuKernels, Kernels};
use isospectrum::volume::Volume;
use std::sync::{Arc, LazyLock};

fn cpu(volume: &Arc<Volume>) -> Box<dyn Kernels + Send> {
    Box::new(CpuKernels::new(Arc::new(Field::new(volume.clone()))))
}

/// One device for all tests of the process.
static PIPELINES: LazyLock<Arc<Pipelines>> = LazyLock::new(|| {
    let gpu = Gpu::new(None)
        .unwrap_or_else(|e| panic!("these tests need an adapter and are never skipped: {e}"));
    Arc::new(Pipelines::new(Arc::new(gpu)).expect("the kernels compile"))
});

fn gpu(volume: &Arc<Volume>) -> Box<dyn Kernels + Send> {
    let field = Arc::new(Field::new(volume.clone()));
    let field = DeviceField::new(PIPELINES.gpu(), field).expect("the field fits the device");
    Box::new(GpuKernels::new(PIPELINES.clone(), Arc::new(field)).expect("buffers fit the device"))
}

/// The suite on one backend: a module of the backend's name with a test per requirement.
macro_rules! kernel_tests {
    ($backend:ident: $($requirement:ident),+ $(,)?) => {
        mod $backend {
            $(
                #[test]
                fn $requirement() {
                    crate::kernels::suite::$requirement(crate::kernels::$backend);
                }
            )+
        }
    };
    ($backend:ident) => {
        kernel_tests!($backend:
            a_linear_field_is_reached_exactly_along_normals_then_gradient,
            a_sphere_grows_and_shrinks_to_the_right_radius,
            a_step_along_the_normal_never_leaves_the_slab_before_its_isovalue,
            a_step_stays_on_its_own_of_two_close_sheets,
            constrained_vertices_do_not_move,
            an_advance_is_its_projections_and_its_relaxation,
            constrained_vertices_move_to_their_ends,
            a_plateau_of_bytes_is_crossed_or_the_vertex_stays,
            every_sample_type_gives_the_same_step,
            relaxation_spreads_vertices_and_keeps_them_on_the_isosurface,
            far_from_the_origin_only_positions_are_rounded,
            loading_again_replaces_the_mesh,
            a_mapped_isovalue_is_reached_whatever_the_range,
        );
    };
}

kernel_tests!(cpu);
kernel_tests!(gpu);
