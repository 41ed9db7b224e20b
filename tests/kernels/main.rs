//! The kernels against analytic oracles: one suite, run on every backend, and the GPU against its
//! CPU twin.
//!
//! The GPU suite fails, it is never skipped, where no adapter is found: install one
//! (`mesa-vulkan-drivers` has a software adapter).

mod shapes;
mod suite;

use isospectrum::kernels::{CpuKernels, Field, Kernels};
use isospectrum::volume::Volume;
use std::sync::Arc;

fn cpu(volume: &Arc<Volume>) -> Box<dyn Kernels + Send> {
    Box::new(CpuKernels::new(Arc::new(Field::new(volume.clone()))))
}

/// The suite on one backend: a module of the backend's name with a test per promise.
macro_rules! kernel_tests {
    ($backend:ident: $($promise:ident),+ $(,)?) => {
        mod $backend {
            $(
                #[test]
                fn $promise() {
                    crate::suite::$promise(crate::$backend);
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
            border_components_never_change,
            a_plateau_of_bytes_is_crossed_or_the_vertex_stays,
            every_sample_type_gives_the_same_step,
            deviation_is_the_distance_along_the_face_normal,
            relaxation_spreads_vertices_and_keeps_them_on_the_isosurface,
            far_from_the_origin_only_positions_are_rounded,
            loading_again_replaces_the_mesh,
            a_mapped_isovalue_is_reached_whatever_the_range,
        );
    };
}

kernel_tests!(cpu);
