//! Darkness in hollows, over the opaque surfaces of a picture: the device side of `shaders/occlusion.wgsl`.

use bytemuck::{Pod, Zeroable};

use super::projection::Projection;
use super::target::{COLOR_FORMAT, Target};

const SHADER: &str = include_str!("../../shaders/occlusion.wgsl");

/// How much of the sky a pixel sees: 8 bits, of which smoothing makes more.
const SEEN_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// How far things darken each other, as a share of the half height of the picture where one looks at: a picture looks the
/// same whatever the size of its volume, and however many pixels it has.
const RADIUS: f64 = 0.14;

/// What is the same for every fragment; fields as in the shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
struct Sight {
    depth: [f32; 2],
    reach: [f32; 2],
    size: [f32; 2],
    radius: f32,
    parallel: u32,
}

impl Sight {
    fn of(projection: &Projection, target: &Target) -> Self {
        let Projection { depth, reach, distance, parallel, .. } = *projection;
        let half_height = reach[1] * if parallel { 1.0 } else { distance };
        Sight {
            depth: depth.map(|x| x as f32),
            reach: reach.map(|x| x as f32),
            size: [target.width, target.height].map(|n| n as f32),
            radius: (RADIUS * half_height) as f32,
            parallel: u32::from(parallel),
        }
    }
}

/// The pipelines.
#[derive(Debug)]
pub(super) struct Occlusion {
    sight: wgpu::Buffer,
    /// How much of the sky each pixel sees.
    seen: wgpu::RenderPipeline,
    /// Multiplies the picture by it, smoothed.
    darken: wgpu::RenderPipeline,
}

impl Occlusion {
    /// Compiles the shader for pictures of `n_samples` samples per pixel.
    pub(super) fn new(device: &wgpu::Device, n_samples: u32) -> Self {
        let text = text(n_samples);
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("occlusion"),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        });
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
        Occlusion {
            sight: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("occlusion.sight"),
                size: size_of::<Sight>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            seen: pipeline(device, &module, "seen_fragment", (SEEN_FORMAT, None, 1)),
            darken: pipeline(
                device,
                &module,
                "darken_fragment",
                (COLOR_FORMAT, Some(multiply), n_samples),
            ),
        }
    }

    /// Darkens what the target shows, as its depth tells.
    pub(super) fn draw(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        target: &Target,
        projection: &Projection,
    ) {
        queue.write_buffer(&self.sight, 0, bytemuck::bytes_of(&Sight::of(projection, target)));
        let seen = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("occlusion.seen"),
            size: wgpu::Extent3d {
                width: target.width,
                height: target.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: SEEN_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let seen = seen.create_view(&Default::default());
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("occlusion") });
        let textures = [&target.depth_alone, &seen];
        self.pass(device, &mut encoder, &self.seen, &textures[..1], (&seen, None));
        let onto = (&target.samples, target.resolved.as_ref());
        self.pass(device, &mut encoder, &self.darken, &textures, onto);
        queue.submit([encoder.finish()]);
    }

    /// Runs a pipeline once over the picture; `textures` from binding 1 on.
    fn pass(
        &self,
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        textures: &[&wgpu::TextureView],
        (view, resolve_target): (&wgpu::TextureView, Option<&wgpu::TextureView>),
    ) {
        let mut entries =
            vec![wgpu::BindGroupEntry { binding: 0, resource: self.sight.as_entire_binding() }];
        entries.extend((1..).zip(textures).map(|(binding, texture)| wgpu::BindGroupEntry {
            binding,
            resource: wgpu::BindingResource::TextureView(texture),
        }));
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("occlusion"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("occlusion"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// The shader for pictures of so many samples per pixel.
fn text(n_samples: u32) -> String {
    // Both kinds of textures are read by the same call: the number of the sample is that of the level, 0.
    match n_samples {
        1 => SHADER.replace("texture_depth_multisampled_2d;", "texture_depth_2d;"),
        _ => SHADER.to_owned(),
    }
}

fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    entry: &str,
    (format, blend, count): (wgpu::TextureFormat, Option<wgpu::BlendState>, u32),
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("occlusion"),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("picture_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(entry),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend,
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
    fn the_shader_is_valid_for_any_number_of_samples_and_its_structure_lies_as_here() {
        for n_samples in [1, 4] {
            let text = text(n_samples);
            assert_eq!(text.contains("_multisampled_2d;"), n_samples > 1);
            let module = naga::front::wgsl::parse_str(&text)
                .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::MULTISAMPLED_SHADING,
            )
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
            let (_, sight) = (module.types.iter())
                .find(|(_, t)| t.name.as_deref() == Some("Sight"))
                .expect("a structure");
            let naga::TypeInner::Struct { members, span } = &sight.inner else {
                panic!("no structure")
            };
            let found: Vec<(&str, usize)> = (members.iter())
                .map(|m| (m.name.as_deref().expect("a name"), m.offset as usize))
                .collect();
            let here = [
                ("depth", offset_of!(Sight, depth)),
                ("reach", offset_of!(Sight, reach)),
                ("size", offset_of!(Sight, size)),
                ("radius", offset_of!(Sight, radius)),
                ("parallel", offset_of!(Sight, parallel)),
            ];
            assert_eq!(found, here);
            assert_eq!(*span as usize, size_of::<Sight>());
        }
    }
}
