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
        Pipelines {
            whole: pipeline(device, n_samples, &whole, "surface_fragment", false),
            clipped: pipeline(device, n_samples, &cut, "cut_fragment", false),
            translucent: pipeline(device, n_samples, &cut, "cut_fragment", true),
        }
    }

    /// The one that draws a surface of a view, with this opacity.
    pub(super) fn of(&self, view: &View, opacity: f32) -> &wgpu::RenderPipeline {
        match (view.clip.is_some(), opacity < 1.0) {
            (false, false) => &self.whole,
            (true, false) => &self.clipped,
            (_, true) => &self.translucent,
        }
    }
}

/// A pipeline of a shader; one that is `translucent` blends and leaves the depth as it is.
fn pipeline(
    device: &wgpu::Device,
    n_samples: u32,
    module: &wgpu::ShaderModule,
    fragment: &str,
    translucent: bool,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("surface"),
        // The layout follows from the shader.
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("surface_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(!translucent),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: n_samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                blend: translucent.then_some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                ..COLOR_FORMAT.into()
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
