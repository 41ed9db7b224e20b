//! Every kernel's text, without a device: it parses and validates as in a browser, its structs have the host's layout, and
//! constants that are in both languages are equal.

use bytemuck::Zeroable;
use isospectrum::unstable::field::{Status, ray, step};
use isospectrum::unstable::gpu::layout::{Grid, Outcome, Parameters};
use isospectrum::unstable::gpu::{MAX_WORKGROUPS, WORKGROUP_SIZE};
use isospectrum::unstable::kernels::gpu::REDUCE_WORKGROUPS;
use isospectrum::unstable::kernels::relax;
use isospectrum::unstable::kernels::shader::{self, ALL, Shader};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Literal, Module};
use std::mem::offset_of;

/// Storage buffers that every WebGPU device can bind to one stage.
const MAX_STORAGE_BUFFERS: usize = 8;

fn parse(shader: Shader) -> Module {
    naga::front::wgsl::parse_str(&shader.text())
        .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&shader.text())))
}

/// Fields with their offsets, and the size.
type Layout = (Vec<(String, usize)>, usize);

fn layout(module: &Module, name: &str) -> Layout {
    module
        .types
        .iter()
        .find_map(|(_, t)| match &t.inner {
            naga::TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => Some((
                members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                    .collect(),
                *span as usize,
            )),
            _ => None,
        })
        .unwrap_or_else(|| panic!("no struct {name}"))
}

/// Compares a struct of the host with that of a shader; if a field is missing, this does not compile.
macro_rules! assert_layout {
    ($module:expr, $ty:ident { $($field:ident),+ $(,)? }) => {{
        let $ty { $($field: _),+ } = $ty::zeroed();
        let host: Layout = (
            vec![$((stringify!($field).to_string(), offset_of!($ty, $field))),+],
            size_of::<$ty>(),
        );
        assert_eq!(host, layout($module, stringify!($ty)));
    }};
}

/// A constant of a shader as f64, which holds all of f32, i32 and u32.
fn constant(module: &Module, name: &str) -> f64 {
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, c)| c.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("no constant {name}"));
    match module.global_expressions[constant.init] {
        naga::Expression::Literal(Literal::F32(v)) => f64::from(v),
        naga::Expression::Literal(Literal::U32(v)) => f64::from(v),
        naga::Expression::Literal(Literal::I32(v)) => f64::from(v),
        naga::Expression::Literal(Literal::AbstractFloat(v)) => f64::from(v as f32),
        naga::Expression::Literal(Literal::AbstractInt(v)) => v as f64,
        ref other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn every_shader_validates_without_optional_capabilities() {
    for shader in ALL {
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let result = validator.validate(&parse(shader));
        assert!(result.is_ok(), "{}: {:?}", shader.name, result.err());
    }
}

#[test]
fn entry_points_have_the_name_of_the_kernel_and_the_workgroup_size_of_the_host() {
    for shader in ALL {
        let module = parse(shader);
        assert_eq!(module.entry_points.len(), 1, "{}", shader.name);
        assert_eq!(module.entry_points[0].name, shader.name);
        assert_eq!(module.entry_points[0].workgroup_size, [WORKGROUP_SIZE, 1, 1]);
    }
}

#[test]
fn bindings_are_used_consecutive_and_few() {
    for shader in ALL {
        let module = parse(shader);
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .expect("validates");
        let entry = info.get_entry_point(0);
        let mut bindings = Vec::new();
        let mut n_storage = 0;
        for (handle, variable) in module.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            // An unused binding would be missing from the layout that the device derives.
            assert!(!entry[handle].is_empty(), "{}: {:?} is unused", shader.name, variable.name);
            assert_eq!(binding.group, 0);
            bindings.push(binding.binding);
            n_storage += usize::from(matches!(variable.space, AddressSpace::Storage { .. }));
        }
        bindings.sort_unstable();
        let expected: Vec<u32> = (0..bindings.len() as u32).collect();
        assert_eq!(bindings, expected, "{}", shader.name);
        assert!(n_storage <= MAX_STORAGE_BUFFERS, "{}: {n_storage} storage buffers", shader.name);
    }
}

#[test]
fn structs_have_the_same_layout_on_host_and_device() {
    for shader in [shader::PROJECT, shader::RELAX, shader::DEVIATION] {
        let module = parse(shader);
        assert_layout!(&module, Grid { inverse_cell_size, outside, dims, sample_type });
        assert_layout!(
            &module,
            Parameters { isovalue, reach, strength, value_noise, slab_tolerance, share }
        );
    }
    assert_layout!(&parse(shader::REDUCE), Outcome { largest_force });
}

#[test]
fn constants_are_equal_in_both_languages() {
    let relax_module = parse(shader::RELAX);
    let expected = [
        ("WORKGROUP_SIZE", f64::from(WORKGROUP_SIZE)),
        ("MAX_WORKGROUPS", f64::from(MAX_WORKGROUPS)),
        ("MAX_CELLS", f64::from(ray::MAX_CELLS)),
        ("MAX_NEWTON", f64::from(ray::MAX_NEWTON)),
        ("PARALLEL", f64::from(ray::PARALLEL)),
        ("EPSILON", f64::from(f32::EPSILON)),
        ("MAX_GRADIENT_STEPS", f64::from(step::MAX_GRADIENT_STEPS)),
        ("GRADIENT_STEP", f64::from(step::GRADIENT_STEP)),
        ("NUDGE", f64::from(step::NUDGE)),
        ("ZERO_LENGTH", f64::from(step::ZERO_LENGTH)),
        ("MAX_MOVE", f64::from(relax::MAX_MOVE)),
        ("BY_NORMAL", f64::from(Status::Reached as u32)),
        ("BY_GRADIENT", f64::from(Status::ReachedByGradient as u32)),
        ("FAILED", f64::from(Status::Failed as u32)),
    ];
    for (name, value) in expected {
        assert_eq!(constant(&relax_module, name), value, "{name}");
    }
    let reduce_module = parse(shader::REDUCE);
    assert_eq!(constant(&reduce_module, "REDUCE_WORKGROUPS"), f64::from(REDUCE_WORKGROUPS));
}

#[test]
fn no_kernel_can_reach_the_loop_limit_of_software_adapters() {
    // Mesa's software adapter silently ends loops after 65535 iterations of an invocation. The
    // longest kernel walks two rays along the normal and one per gradient step, each with three monotone
    // pieces and one root search.
    let ray = ray::MAX_CELLS * (1 + 3) + ray::MAX_NEWTON;
    let cells_of_gradient_step = 8;
    let step = step::MAX_GRADIENT_STEPS * (cells_of_gradient_step * 4 + ray::MAX_NEWTON);
    assert!(2 * ray + step < 65535 / 4, "{} iterations", 2 * ray + step);
}
