//! The render pipelines of surfaces, and error scopes of the device.

use super::target::{COLOR_FORMAT, DEPTH_FORMAT};
use super::view::View;
use crate::error::{Error, Result};

/// Samples per pixel.
const N_SAMPLES: u32 = 4;

/// The shader of opaque surfaces, and that of clipped and translucent ones.
const SHADER: &str = include_str!("../../shaders/surface.wgsl");
const CUT: &str =
    concat!(include_str!("../../shaders/surface.wgsl"), include_str!("../../shaders/cut.wgsl"));

/// Samples per pixel that the device is guaranteed to render and resolve.
pub(super) fn supported_sample_count(device: &wgpu::Device) -> u32 {
    let is_supported = |format: wgpu::TextureFormat| {
        let features = format.guaranteed_format_features(device.features());
        features.flags.sample_count_supported(N_SAMPLES)
    };
    if is_supported(COLOR_FORMAT) && is_supported(DEPTH_FORMAT) { N_SAMPLES } else { 1 }
}

/// The pipelines of surfaces.
#[derive(Debug)]
pub(super) struct Pipelines {
    opaque: wgpu::RenderPipeline,
    clipped: wgpu::RenderPipeline,
    translucent: wgpu::RenderPipeline,
    count: wgpu::RenderPipeline,
    cap: wgpu::RenderPipeline,
}

/// The purpose of a pass over a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PassKind {
    /// Counts the faces behind the clip plane in the stencil: back faces minus front faces.
    CountFaces,
    /// Draws the clip plane where it is inside of the surface: where the count is not zero.
    Cap,
    /// Draws the surface.
    Surface,
}

impl Pipelines {
    /// Compiles the shaders for `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        let surface = create_module(device, "surface", SHADER);
        let cut = create_module(device, "cut", CUT);
        let depth_stencil = |is_written, depth_compare, stencil| {
            Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(is_written),
                depth_compare: Some(depth_compare),
                stencil,
                bias: Default::default(),
            })
        };
        let (less, always) = (wgpu::CompareFunction::Less, wgpu::CompareFunction::Always);
        let opaque = PipelineOptions {
            label: "surface",
            entries: ["surface_vertex", "surface_fragment"],
            target: picture_target(None),
            depth_stencil: depth_stencil(true, less, wgpu::StencilState::default()),
            n_samples,
        };
        let blended = picture_target(Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING));
        let clipped =
            PipelineOptions { entries: ["surface_vertex", "cut_fragment"], ..opaque.clone() };
        let translucent = PipelineOptions {
            target: blended.clone(),
            depth_stencil: depth_stencil(false, less, wgpu::StencilState::default()),
            ..clipped.clone()
        };
        let count = PipelineOptions {
            entries: ["surface_vertex", "depth_only_fragment"],
            target: wgpu::ColorTargetState {
                write_mask: wgpu::ColorWrites::empty(),
                ..picture_target(None)
            },
            depth_stencil: depth_stencil(false, always, counting_stencil()),
            ..opaque.clone()
        };
        let cap = PipelineOptions {
            entries: ["cap_vertex", "cap_fragment"],
            target: blended,
            depth_stencil: depth_stencil(true, less, cap_stencil()),
            ..opaque.clone()
        };
        Pipelines {
            opaque: create_pipeline(device, &surface, opaque),
            clipped: create_pipeline(device, &cut, clipped),
            translucent: create_pipeline(device, &cut, translucent),
            count: create_pipeline(device, &cut, count),
            cap: create_pipeline(device, &cut, cap),
        }
    }

    /// The pipeline of a pass over a surface with this opacity.
    pub(super) fn of(&self, kind: PassKind, view: &View, opacity: f32) -> &wgpu::RenderPipeline {
        match (kind, view.clip.is_some(), opacity < 1.0) {
            (PassKind::CountFaces, ..) => &self.count,
            (PassKind::Cap, ..) => &self.cap,
            (PassKind::Surface, false, false) => &self.opaque,
            (PassKind::Surface, true, false) => &self.clipped,
            (PassKind::Surface, _, true) => &self.translucent,
        }
    }
}

fn counting_stencil() -> wgpu::StencilState {
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

/// Passes where the count is not zero, and resets it.
fn cap_stencil() -> wgpu::StencilState {
    let side = wgpu::StencilFaceState {
        compare: wgpu::CompareFunction::NotEqual,
        fail_op: wgpu::StencilOperation::Keep,
        depth_fail_op: wgpu::StencilOperation::Zero,
        pass_op: wgpu::StencilOperation::Zero,
    };
    wgpu::StencilState { front: side, back: side, read_mask: 0xff, write_mask: 0xff }
}

/// The differences between the pipelines.
#[derive(Clone)]
pub(super) struct PipelineOptions {
    pub(super) label: &'static str,
    /// Entry points of the vertex and the fragment stage.
    pub(super) entries: [&'static str; 2],
    pub(super) target: wgpu::ColorTargetState,
    pub(super) depth_stencil: Option<wgpu::DepthStencilState>,
    pub(super) n_samples: u32,
}

/// The colour target of passes that draw into the picture.
pub(super) fn picture_target(blend: Option<wgpu::BlendState>) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask: wgpu::ColorWrites::ALL }
}

pub(super) fn create_module(device: &wgpu::Device, label: &str, text: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    })
}

pub(super) fn create_uniform_buffer(
    device: &wgpu::Device,
    label: &str,
    size: usize,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Creates a pipeline without vertex buffers; its bind group layouts follow from the shader.
pub(super) fn create_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    options: PipelineOptions,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(options.label),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(options.entries[0]),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: options.depth_stencil,
        multisample: wgpu::MultisampleState { count: options.n_samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(options.entries[1]),
            compilation_options: Default::default(),
            targets: &[Some(options.target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Runs `work` and returns an error of the device; without error scopes wgpu panics.
pub(super) fn with_error_scope<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T> {
    let scopes = [
        wgpu::ErrorFilter::Internal,
        wgpu::ErrorFilter::OutOfMemory,
        wgpu::ErrorFilter::Validation,
    ]
    .map(|filter| device.push_error_scope(filter));
    let result = work();
    let mut first_error = None;
    for scope in scopes.into_iter().rev() {
        first_error = first_error.or(pollster::block_on(scope.pop()));
    }
    let Some(error) = first_error else { return Ok(result) };
    let message = error.to_string();
    let words: Vec<&str> = message.split_whitespace().collect();
    Err(Error::Gpu(format!("the device cannot draw: {}", words.join(" "))))
}
