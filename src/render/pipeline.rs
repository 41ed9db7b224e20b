//! Compiling the shader for a device, and catching what the device says.

use super::View;
use super::target::{COLOR_FORMAT, DEPTH_FORMAT};
use crate::error::{Error, Result};

/// Samples per pixel.
const N_SAMPLES: u32 = 4;

/// The shader, alone and with what cuts and what one looks through needs.
const SHADER: &str = include_str!("../../shaders/surface.wgsl");
const CUT: &str =
    concat!(include_str!("../../shaders/surface.wgsl"), include_str!("../../shaders/cut.wgsl"));

/// Samples per pixel that every device of this kind can draw and average.
pub(super) fn samples_of(device: &wgpu::Device) -> u32 {
    let can = |format: wgpu::TextureFormat| {
        let features = format.guaranteed_format_features(device.features());
        features.flags.sample_count_supported(N_SAMPLES)
    };
    if can(COLOR_FORMAT) && can(DEPTH_FORMAT) { N_SAMPLES } else { 1 }
}

/// The shader compiled for each kind of picture.
#[derive(Debug)]
pub(super) struct Pipelines {
    whole: wgpu::RenderPipeline,
    clipped: wgpu::RenderPipeline,
    translucent: wgpu::RenderPipeline,
    count: wgpu::RenderPipeline,
    cap: wgpu::RenderPipeline,
}

/// What a pass over a surface does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    /// Counts the sides that lie behind the plane: those turned away from the eye less those turned to it.
    Count,
    /// Covers the plane where there is one side more that is turned away: there it is inside.
    Cap,
    /// Draws the surface.
    Surface,
}

impl Pipelines {
    /// Compiles `shaders/surface.wgsl` for pictures of `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        let module = |label, text: &'static str| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            })
        };
        let whole = module("surface", SHADER);
        let cut = module("cut", CUT);
        let make = |module, recipe| pipeline(device, n_samples, module, recipe);
        let surface = Recipe {
            entries: ["surface_vertex", "surface_fragment"],
            blend: None,
            writes: wgpu::ColorWrites::ALL,
            writes_depth: true,
            depth: wgpu::CompareFunction::Less,
            stencil: wgpu::StencilState::default(),
        };
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let clipped = Recipe { entries: ["surface_vertex", "cut_fragment"], ..surface.clone() };
        let translucent = Recipe { blend: over, writes_depth: false, ..clipped.clone() };
        let count = Recipe {
            entries: ["surface_vertex", "bare_fragment"],
            writes: wgpu::ColorWrites::empty(),
            writes_depth: false,
            depth: wgpu::CompareFunction::Always,
            stencil: counting(),
            ..surface.clone()
        };
        let cap = Recipe {
            entries: ["cap_vertex", "cap_fragment"],
            blend: over,
            stencil: covering(),
            ..surface.clone()
        };
        Pipelines {
            whole: make(&whole, surface),
            clipped: make(&cut, clipped),
            translucent: make(&cut, translucent),
            count: make(&cut, count),
            cap: make(&cut, cap),
        }
    }

    /// The one that draws a surface of a view, with this opacity.
    pub(super) fn of(&self, step: Step, view: &View, opacity: f32) -> &wgpu::RenderPipeline {
        match (step, view.clip.is_some(), opacity < 1.0) {
            (Step::Count, ..) => &self.count,
            (Step::Cap, ..) => &self.cap,
            (Step::Surface, false, false) => &self.whole,
            (Step::Surface, true, false) => &self.clipped,
            (Step::Surface, _, true) => &self.translucent,
        }
    }
}

fn counting() -> wgpu::StencilState {
    let side = |pass_op| wgpu::StencilFaceState {
        compare: wgpu::CompareFunction::Always,
        fail_op: wgpu::StencilOperation::Keep,
        depth_fail_op: wgpu::StencilOperation::Keep,
        pass_op,
    };
    wgpu::StencilState {
        front: side(wgpu::StencilOperation::DecrementWrap),
        back: side(wgpu::StencilOperation::IncrementWrap),
        read_mask: 0xff,
        write_mask: 0xff,
    }
}

/// Where something was counted; there it is zero again afterwards.
fn covering() -> wgpu::StencilState {
    let side = wgpu::StencilFaceState {
        compare: wgpu::CompareFunction::NotEqual,
        fail_op: wgpu::StencilOperation::Keep,
        depth_fail_op: wgpu::StencilOperation::Zero,
        pass_op: wgpu::StencilOperation::Zero,
    };
    wgpu::StencilState { front: side, back: side, read_mask: 0xff, write_mask: 0xff }
}

/// How pipelines differ.
#[derive(Clone)]
struct Recipe {
    /// Of the vertex and the fragment stage.
    entries: [&'static str; 2],
    blend: Option<wgpu::BlendState>,
    writes: wgpu::ColorWrites,
    writes_depth: bool,
    depth: wgpu::CompareFunction,
    stencil: wgpu::StencilState,
}

/// A pipeline of a shader.
fn pipeline(
    device: &wgpu::Device,
    n_samples: u32,
    module: &wgpu::ShaderModule,
    recipe: Recipe,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("surface"),
        // The layout follows from the shader.
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(recipe.entries[0]),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(recipe.writes_depth),
            depth_compare: Some(recipe.depth),
            stencil: recipe.stencil,
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: n_samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(recipe.entries[1]),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOR_FORMAT,
                blend: recipe.blend,
                write_mask: recipe.writes,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Runs `work` and returns the device's complaint as an error: without this wgpu panics.
pub(super) fn caught<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T> {
    let scopes = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ]
    .map(|filter| device.push_error_scope(filter));
    let done = work();
    // Scopes are popped in the opposite order.
    let mut complaint = None;
    for scope in scopes.into_iter().rev() {
        complaint = complaint.or(pollster::block_on(scope.pop()));
    }
    match complaint {
        None => Ok(done),
        Some(error) => Err(Error::Gpu(one_line(&error.to_string()))),
    }
}

/// A message without its line breaks and what surrounds them.
fn one_line(message: &str) -> String {
    let parts: Vec<&str> = message.split_whitespace().collect();
    format!("the device cannot draw: {}", parts.join(" "))
}
