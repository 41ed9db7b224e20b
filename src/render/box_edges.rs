//! The edges of the volume's box in a picture: the host side of `shaders/edges.wgsl`.

use glam::DVec3;

use super::background::Background;
use super::pipeline::{
    PipelineOptions, create_module, create_pipeline, create_uniform_buffer, picture_target,
};
use super::projection::{Projection, corners};
use super::shader_types::EdgeUniforms;
use super::target::{DEPTH_FORMAT, Target};
use crate::color::linear;
use crate::spectrum::VolumeInfo;

const SHADER: &str = include_str!("../../shaders/edges.wgsl");

/// sRGB colours of the lines on a light and on a dark background, and their opacity.
const COLORS: [u32; 2] = [0x7d8591, 0x858c98];
const OPACITY: f32 = 0.8;

/// Minimum width of a line, pixels, and the height of a picture, pixels, that has lines of twice this width.
const MIN_WIDTH: f32 = 1.0;
const DOUBLE_WIDTH_HEIGHT: f32 = 1000.0;

/// Two triangles for each of twelve edges.
const N_CORNERS: u32 = 72;

/// The pipeline and its uniforms.
#[derive(Debug)]
pub(super) struct BoxEdges {
    uniforms: wgpu::Buffer,
    pipeline: wgpu::RenderPipeline,
}

impl BoxEdges {
    /// Compiles the shader for `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        let module = create_module(device, "edges", SHADER);
        let options = PipelineOptions {
            label: "edges",
            entries: ["edge_vertex", "edge_fragment"],
            target: picture_target(Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING)),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::LessEqual),
                stencil: wgpu::StencilState::default(),
                bias: Default::default(),
            }),
            n_samples,
        };
        BoxEdges {
            uniforms: create_uniform_buffer(device, "edges", size_of::<EdgeUniforms>()),
            pipeline: create_pipeline(device, &module, options),
        }
    }

    /// Draws the edges of a volume's box, which includes the caps, onto the picture in the target.
    pub(super) fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &Target,
        volume: &VolumeInfo,
        projection: &Projection,
        background: Background,
    ) {
        let size = [target.width, target.height].map(|n| n as f32);
        let [low, .., high] = corners(volume);
        let vec4 = |p: DVec3| p.as_vec3().extend(0.0).to_array();
        let [r, g, b] = linear(COLORS[usize::from(background == Background::Dark)]);
        let uniforms = EdgeUniforms {
            clip_from_voxel: projection.clip_from_voxel.as_mat4().to_cols_array_2d(),
            low: vec4(low),
            high: vec4(high),
            color: [r, g, b, 1.0].map(|c| OPACITY * c),
            half_size: size.map(|n| 0.5 * n),
            half_width: 0.5 * MIN_WIDTH * (1.0 + size[1] / DOUBLE_WIDTH_HEIGHT),
            padding: 0.0,
        };
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("edges"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: self.uniforms.as_entire_binding(),
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
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..N_CORNERS, 0..1);
        drop(pass);
        queue.submit([encoder.finish()]);
    }
}
