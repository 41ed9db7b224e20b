//! Ambient occlusion of the opaque surfaces of a picture: the host side of `shaders/occlusion.wgsl`.

use super::pipeline::{
    PipelineOptions, create_module, create_pipeline, create_uniform_buffer, picture_target,
};
use super::projection::Projection;
use super::shader_types::OcclusionUniforms;
use super::target::Target;

const SHADER: &str = include_str!("../../shaders/occlusion.wgsl");

/// Format of the visibility texture: 8 bits, because smoothing averages many pixels.
const VISIBILITY_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Radius of the occlusion as a fraction of the half height of the picture at the distance of its center, so that a picture
/// looks the same for any size of the volume and any number of pixels.
const RADIUS: f64 = 0.14;

/// The uniforms of a picture.
fn uniforms(projection: &Projection, target: &Target) -> OcclusionUniforms {
    let Projection { depth, half_extent, distance, parallel, .. } = *projection;
    let half_height = half_extent[1] * if parallel { 1.0 } else { distance };
    OcclusionUniforms {
        depth: depth.map(|x| x as f32),
        half_extent: half_extent.map(|x| x as f32),
        size: [target.width, target.height].map(|n| n as f32),
        radius: (RADIUS * half_height) as f32,
        parallel: u32::from(parallel),
    }
}

/// The pipelines and uniforms.
#[derive(Debug)]
pub(super) struct Occlusion {
    uniforms: wgpu::Buffer,
    /// Computes the visibility of the sky at each pixel.
    visibility: wgpu::RenderPipeline,
    /// Multiplies the picture by the smoothed visibility.
    darken: wgpu::RenderPipeline,
}

impl Occlusion {
    /// Compiles the shader for `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        let module = create_module(device, "occlusion", &shader_text(n_samples));
        let multiply = wgpu::BlendState {
            color: wgpu::BlendComponent {
                src_factor: wgpu::BlendFactor::Dst,
                dst_factor: wgpu::BlendFactor::Zero,
                operation: wgpu::BlendOperation::Add,
            },
            alpha: wgpu::BlendComponent {
                src_factor: wgpu::BlendFactor::Zero,
                dst_factor: wgpu::BlendFactor::One,
                operation: wgpu::BlendOperation::Add,
            },
        };
        let pipeline = |entry, target, n_samples| {
            let entries = ["picture_vertex", entry];
            let label = "occlusion";
            let options =
                PipelineOptions { label, entries, target, depth_stencil: None, n_samples };
            create_pipeline(device, &module, options)
        };
        let visibility_target =
            wgpu::ColorTargetState { format: VISIBILITY_FORMAT, ..picture_target(None) };
        let size = size_of::<OcclusionUniforms>();
        Occlusion {
            uniforms: create_uniform_buffer(device, "occlusion.uniforms", size),
            visibility: pipeline("visibility_fragment", visibility_target, 1),
            darken: pipeline("darken_fragment", picture_target(Some(multiply)), n_samples),
        }
    }

    /// Darkens the picture in the target by its depth.
    pub(super) fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &Target,
        projection: &Projection,
    ) {
        let uniforms = uniforms(projection, target);
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&uniforms));
        let visibility = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("occlusion.visibility"),
            size: wgpu::Extent3d {
                width: target.width,
                height: target.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: VISIBILITY_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let visibility = visibility.create_view(&Default::default());
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("occlusion") });
        let textures = [&target.depth_only, &visibility];
        let attachment = |view, resolve_target| wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        };
        let output = attachment(&visibility, None);
        self.render_pass(device, &mut encoder, &self.visibility, &textures[..1], output);
        let output = attachment(&target.samples, target.resolved.as_ref());
        self.render_pass(device, &mut encoder, &self.darken, &textures, output);
        queue.submit([encoder.finish()]);
    }

    /// Runs a pipeline once over the picture, with `textures` from binding 1 on.
    fn render_pass(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        textures: &[&wgpu::TextureView],
        output: wgpu::RenderPassColorAttachment<'_>,
    ) {
        let mut entries =
            vec![wgpu::BindGroupEntry { binding: 0, resource: self.uniforms.as_entire_binding() }];
        entries.extend((1..).zip(textures).map(|(binding, texture)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(texture),
        }));
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("occlusion"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("occlusion"),
            color_attachments: &[Some(output)],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The shader for `n_samples` samples per pixel.
pub(super) fn shader_text(n_samples: u32) -> String {
    // The same call reads both kinds of textures: the index of the sample becomes that of the level, 0.
    match n_samples {
        1 => SHADER.replace("texture_depth_multisampled_2d;", "texture_depth_2d;"),
        _ => SHADER.to_owned(),
    }
}
