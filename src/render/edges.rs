//! The edges of the volume's box in a picture: the device side of `shaders/edges.wgsl`.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::Background;
use super::projection::{Projection, corners};
use super::target::{COLOR_FORMAT, DEPTH_FORMAT, Target};
use crate::color::linear;
use crate::spectrum::VolumeInfo;

const SHADER: &str = include_str!("../../shaders/edges.wgsl");

/// Colours of the lines on light and on dark, and how much of what lies behind they hide.
const COLORS: [u32; 2] = [0x7d8591, 0x858c98];
const OPACITY: f32 = 0.8;

/// Least width of a line, pixels, and the height of a picture in which it is wider by as much again.
const LEAST_WIDTH: f32 = 1.0;
const HEIGHT: f32 = 1000.0;

/// Two triangles for each of twelve edges.
const N_CORNERS: u32 = 72;

/// What is the same for every edge; fields as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Uniform {
    clip_from_voxel: [[f32; 4]; 4],
    low: [f32; 4],
    high: [f32; 4],
    color: [f32; 4],
    half_size: [f32; 2],
    half_width: f32,
    unused: f32,
}

/// The pipeline.
#[derive(Debug)]
pub(super) struct Edges {
    uniform: wgpu::Buffer,
    pipeline: wgpu::RenderPipeline,
}

impl Edges {
    /// Compiles the shader for pictures of `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        Edges {
            uniform: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("edges"),
                size: size_of::<Uniform>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            pipeline: pipeline(device, n_samples),
        }
    }

    /// Draws the edges of a volume's box, which reaches as far as caps do, over what the target shows.
    pub(super) fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &Target,
        (volume, projection, background): (&VolumeInfo, &Projection, Background),
    ) {
        let size = [target.width, target.height].map(|n| n as f32);
        let [low, .., high] = corners(volume);
        let place = |p: DVec3| p.as_vec3().extend(0.0).to_array();
        let [r, g, b] = linear(COLORS[usize::from(background == Background::Dark)]);
        let uniform = Uniform {
            clip_from_voxel: projection.clip_from_voxel.as_mat4().to_cols_array_2d(),
            low: place(low),
            high: place(high),
            color: [r, g, b, 1.0].map(|c| OPACITY * c),
            half_size: size.map(|n| 0.5 * n),
            half_width: 0.5 * LEAST_WIDTH * (1.0 + size[1] / HEIGHT),
            unused: 0.0,
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("edges"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: self.uniform.as_entire_binding(),
            }],
        });
        let mut encoder =
            device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("edges") });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("edges"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.samples,
                depth_slice: None,
                resolve_target: target.resolved.as_ref(),
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                }),
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.draw(0..N_CORNERS, 0..1);
        drop(pass);
        queue.submit([encoder.finish()]);
    }
}

fn pipeline(device: &wgpu::Device, n_samples: u32) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("edges"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("edges"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("edge_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: wgpu::StencilState::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: n_samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("edge_fragment"),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOR_FORMAT,
                blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use super::*;

    #[test]
    fn the_shader_is_valid_and_its_structure_lies_as_here() {
        let module = naga::front::wgsl::parse_str(SHADER)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(SHADER)));
        naga::valid::Validator::new(
            naga::valid::ValidationFlags::all(),
            naga::valid::Capabilities::empty(),
        )
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(SHADER)));
        let found = module.types.iter().find_map(|(_, t)| match &t.inner {
            naga::TypeInner::Struct { members, span } => Some((members, *span as usize)),
            _ => None,
        });
        let (members, span) = found.expect("a structure");
        let found: Vec<(&str, usize)> = (members.iter())
            .map(|m| (m.name.as_deref().expect("a name"), m.offset as usize))
            .collect();
        let here = [
            ("clip_from_voxel", offset_of!(Uniform, clip_from_voxel)),
            ("low", offset_of!(Uniform, low)),
            ("high", offset_of!(Uniform, high)),
            ("color", offset_of!(Uniform, color)),
            ("half_size", offset_of!(Uniform, half_size)),
            ("half_width", offset_of!(Uniform, half_width)),
            ("unused", offset_of!(Uniform, unused)),
        ];
        assert_eq!(found, here);
        assert_eq!(span, size_of::<Uniform>());
    }
}
