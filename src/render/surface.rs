//! The renderer: the host side of `shaders/surface.wgsl`.
//!
//! # Large spectra
//!
//! A spectrum whose tables fit [`RESIDENT_BYTES`] (and the device's largest binding) is uploaded
//! once, and a new isovalue costs the list of active triangles. Of a larger one each picture
//! uploads only the vertices of the active triangles, each with the knots on either side of the
//! isovalue. Either way the triangles go through the device in pieces of bounded size, so no
//! picture fails for the size of its mesh. The pictures are equal.

use super::attribute::{Attributes, Color, attributes};
use super::device::Gpu;
use super::layout::{ActiveTriangle, Frame, Palette};
use super::tables::{self, KNOT_BYTES_PER_TRIANGLE, Tables};
use super::target::{COLOR_FORMAT, DEPTH_FORMAT, Target, unmultiply};
use super::{Background, Image, View};
use crate::error::{Error, Result};
use crate::spectrum::Spectrum;

/// Largest table that is kept on the device as a whole, bytes: what browsers and software devices
/// bind at once.
pub const RESIDENT_BYTES: u64 = 128 << 20;

/// Samples per pixel.
const N_SAMPLES: u32 = 4;

/// The shader and its entry points.
const SHADER: &str = include_str!("../../shaders/surface.wgsl");

/// Draws pictures of one spectrum; keeps its pipeline and buffers between them.
#[derive(Debug)]
pub struct Renderer<'a> {
    spectrum: &'a Spectrum,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    n_samples: u32,
    frame: wgpu::Buffer,
    isovalues: Table,
    first_knot: Table,
    knots: Table,
    triangles: Table,
    /// Whether the tables hold the whole spectrum.
    resident: bool,
    /// Most triangles drawn at once.
    triangles_per_pass: usize,
    target: Option<Target>,
    listed: Listed,
    color_ends: Option<(f64, f64)>,
}

/// The active triangles of the last picture, and what they depend on.
#[derive(Debug, Default)]
struct Listed {
    key: Option<(u64, Color, Option<u64>, bool)>,
    triangles: Vec<ActiveTriangle>,
    /// Whether the device has them, all in one piece.
    uploaded: bool,
}

impl<'a> Renderer<'a> {
    /// Compiles the pipeline and uploads what is kept. The spectrum must pass
    /// [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device refuses or is lost.
    pub fn new(gpu: &Gpu, spectrum: &'a Spectrum) -> Result<Self> {
        Self::with_budget(gpu, spectrum, RESIDENT_BYTES)
    }

    /// As [`Renderer::new`], with no table on the device larger than `bytes` (at least one
    /// triangle's is allowed).
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`] if the device refuses or is lost.
    pub fn with_budget(gpu: &Gpu, spectrum: &'a Spectrum, bytes: u64) -> Result<Self> {
        let device = gpu.device.clone();
        let queue = gpu.queue.clone();
        let bytes = bytes.min(device.limits().max_storage_buffer_binding_size);
        let resident = tables::largest_table(spectrum) <= bytes;
        let n_samples = samples_of(gpu);
        let mut renderer = caught(&device.clone(), || {
            let table = |label| Table::new(&device, label);
            Renderer {
                spectrum,
                pipeline: pipeline(&device, n_samples),
                n_samples,
                frame: device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("surface.frame"),
                    size: size_of::<Frame>() as u64,
                    usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                }),
                isovalues: table("surface.isovalues"),
                first_knot: table("surface.first_knot"),
                knots: table("surface.knots"),
                triangles: table("surface.triangles"),
                resident,
                triangles_per_pass: (bytes / KNOT_BYTES_PER_TRIANGLE).clamp(1, 1 << 20) as usize,
                target: None,
                listed: Listed::default(),
                color_ends: None,
                device,
                queue,
            }
        })?;
        if resident {
            let device = renderer.device.clone();
            caught(&device, || renderer.upload_tables(&tables::all(spectrum)))?;
        }
        Ok(renderer)
    }

    /// Draws the isosurface of `isovalue`.
    ///
    /// # Errors
    ///
    /// [`Error::Range`] outside [`Spectrum::range`], [`Error::Usage`] if the view makes no sense
    /// or is too large for the device, [`Error::Gpu`] if the device refuses or is lost.
    pub fn draw(&mut self, isovalue: f64, view: &View) -> Result<Image> {
        let (low, high) = self.spectrum.range;
        if !(low <= isovalue && isovalue <= high) {
            return Err(Error::Range { isovalue, low, high });
        }
        view.check(self.device.limits().max_texture_dimension_2d)?;
        let rank = self.spectrum.rank_at(isovalue);
        self.list(isovalue, rank, view);

        let device = self.device.clone();
        let n_samples = self.n_samples;
        if self.target.as_ref().is_none_or(|t| (t.width, t.height) != (view.width, view.height)) {
            self.target = None;
            self.target =
                Some(caught(&device, || Target::new(&device, view.width, view.height, n_samples))?);
        }
        let frame = frame(self.spectrum, isovalue, rank.unwrap_or(0), view);
        caught(&device, || self.passes(frame, view.background))?;
        let Some(target) = &self.target else { unreachable!("made above") };
        let mut image = caught(&device, || target.read(&device))??;
        if view.background == Background::Transparent {
            unmultiply(&mut image);
        }
        Ok(image)
    }

    /// What the two ends of the colours of the last picture stand for, in the unit of its
    /// [`Color`]; none where the colours have no scale.
    pub fn color_ends(&self) -> Option<(f64, f64)> {
        self.color_ends
    }

    /// Number of triangles in the last picture.
    pub fn n_triangles(&self) -> usize {
        self.listed.triangles.len()
    }

    /// Lists the active triangles with their attributes, unless the last picture had the same.
    fn list(&mut self, isovalue: f64, rank: Option<u32>, view: &View) {
        let key =
            (isovalue.to_bits(), view.color, view.largest_curvature.map(f64::to_bits), view.open);
        if self.listed.key == Some(key) {
            return;
        }
        let spectrum = self.spectrum;
        let active = rank.map(|rank| active_triangles(spectrum, rank)).unwrap_or_default();
        // Caps are left out last, so that they do not change what the others show.
        let Attributes { values, ends } = attributes(
            spectrum,
            &active,
            (isovalue, rank.unwrap_or(0)),
            view.color,
            view.largest_curvature,
        );
        let triangles = active
            .iter()
            .zip(values)
            .map(|(&i, measure)| (spectrum.triangles[i as usize], measure))
            .filter(|(triangle, _)| !(view.open && triangle.cap))
            .map(|(triangle, measure)| ActiveTriangle { vertices: triangle.vertices, measure })
            .collect();
        self.listed = Listed { key: Some(key), triangles, uploaded: false };
        self.color_ends = ends;
    }

    /// Draws the listed triangles, piece by piece, and records the copy of the picture.
    fn passes(&mut self, mut frame: Frame, background: Background) {
        let triangles = std::mem::take(&mut self.listed.triangles);
        let n_passes = triangles.len().div_ceil(self.triangles_per_pass).max(1);
        for pass in 0..n_passes {
            let first = pass * self.triangles_per_pass;
            let piece = &triangles[first..triangles.len().min(first + self.triangles_per_pass)];
            let rank = frame.rank;
            if !self.listed.uploaded {
                frame.rank = self.upload_piece(piece, rank);
                // A list in one piece need not be uploaded again; the tables of a part of the
                // spectrum give the ranks other numbers, which the next picture would not know.
                self.listed.uploaded = self.resident && n_passes == 1;
            }
            self.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
            frame.rank = rank;
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("surface") });
            self.pass(&mut encoder, piece.len(), (pass == 0).then_some(background));
            if pass + 1 == n_passes
                && let Some(target) = &self.target
            {
                target.copy(&mut encoder);
            }
            self.queue.submit([encoder.finish()]);
        }
        self.listed.triangles = triangles;
    }

    /// Records one pass over the uploaded triangles; `clear` where it is the picture's first.
    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        n_triangles: usize,
        clear: Option<Background>,
    ) {
        let Some(target) = &self.target else { return };
        let (color, depth) = match clear {
            Some(background) => {
                let [r, g, b, a] = background.linear();
                (wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }), wgpu::LoadOp::Clear(1.0))
            }
            None => (wgpu::LoadOp::Load, wgpu::LoadOp::Load),
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("surface"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.samples,
                depth_slice: None,
                resolve_target: target.resolved.as_ref(),
                ops: wgpu::Operations { load: color, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target.depth,
                depth_ops: Some(wgpu::Operations { load: depth, store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        if n_triangles > 0 {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bind_group(), &[]);
            pass.draw(0..3 * n_triangles as u32, 0..1);
        }
    }

    /// The bindings, in the shader's order.
    fn bind_group(&self) -> wgpu::BindGroup {
        let buffers = [
            self.frame.as_entire_binding(),
            self.isovalues.binding(),
            self.first_knot.binding(),
            self.knots.binding(),
            self.triangles.binding(),
        ];
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surface"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    /// Uploads the triangles of one pass and, if the device does not keep them, their vertices.
    /// Returns what the uploaded tables call the rank `rank`.
    fn upload_piece(&mut self, triangles: &[ActiveTriangle], rank: u32) -> u32 {
        if self.resident {
            self.triangles.write(&self.device, &self.queue, triangles);
            return rank;
        }
        let mut triangles = triangles.to_vec();
        let (tables, rank) = tables::selected(self.spectrum, &mut triangles, rank);
        self.triangles.write(&self.device, &self.queue, &triangles);
        self.upload_tables(&tables);
        rank
    }

    fn upload_tables(&mut self, tables: &Tables) {
        self.isovalues.write(&self.device, &self.queue, &tables.isovalues);
        self.first_knot.write(&self.device, &self.queue, &tables.first_knot);
        self.knots.write(&self.device, &self.queue, &tables.knots);
    }
}

/// The triangles alive at `rank`, by index.
fn active_triangles(spectrum: &Spectrum, rank: u32) -> Vec<u32> {
    (0..)
        .zip(&spectrum.triangles)
        .filter(|(_, triangle)| triangle.birth <= rank && rank < triangle.death)
        .map(|(i, _)| i)
        .collect()
}

/// What is the same for every corner of a picture.
fn frame(spectrum: &Spectrum, isovalue: f64, rank: u32, view: &View) -> Frame {
    let projection = view.camera.projection(&spectrum.volume, view.width, view.height);
    let palette = view.color.palette();
    // The lines of a coloured mesh are darker, to be seen on every colour.
    let wire = if palette == Palette::Plain {
        [0.010, 0.022, 0.045, 0.80]
    } else {
        [0.008, 0.008, 0.010, 0.72]
    };
    Frame {
        clip_from_voxel: projection.clip_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_voxel: projection.eye_from_voxel.as_mat4().to_cols_array_2d(),
        eye_from_normal: glam::Mat4::from_mat3(projection.eye_from_normal.as_mat3())
            .to_cols_array_2d(),
        front: [0.235, 0.410, 0.620, 1.0],
        back: [0.700, 0.370, 0.150, 1.0],
        wire,
        isovalue: tables::scaled(spectrum, isovalue),
        rank,
        palette: palette as u32,
        wire_width: view.wireframe.unwrap_or(0.0),
        mirrored: u32::from(projection.mirrored),
        unused: [0.0; 2],
    }
}

/// A storage buffer that grows with what is written to it.
#[derive(Debug)]
struct Table {
    label: &'static str,
    buffer: wgpu::Buffer,
    /// Bytes in use; at least [`Table::LEAST`], since nothing cannot be bound.
    size: u64,
}

impl Table {
    /// Bytes of the largest element of any table.
    const LEAST: u64 = 32;

    fn new(device: &wgpu::Device, label: &'static str) -> Self {
        Table { label, buffer: Self::buffer(device, label, Self::LEAST), size: Self::LEAST }
    }

    fn buffer(device: &wgpu::Device, label: &str, size: u64) -> wgpu::Buffer {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    /// Replaces what the table holds.
    fn write<T: bytemuck::Pod>(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, data: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        self.size = (bytes.len() as u64).max(Self::LEAST);
        if self.size > self.buffer.size() {
            // A quarter more, so that a mesh that grows with the isovalue does not allocate for
            // every picture.
            let roomy = (self.size + self.size / 4).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
            self.buffer = Self::buffer(device, self.label, roomy);
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }

    fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.buffer,
            offset: 0,
            size: wgpu::BufferSize::new(self.size),
        })
    }
}

/// Samples per pixel the adapter can draw and average.
fn samples_of(gpu: &Gpu) -> u32 {
    let can = |format| {
        gpu.adapter.get_texture_format_features(format).flags.sample_count_supported(N_SAMPLES)
    };
    if can(COLOR_FORMAT) && can(DEPTH_FORMAT) { N_SAMPLES } else { 1 }
}

fn pipeline(device: &wgpu::Device, n_samples: u32) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("surface"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("surface"),
        // The layout follows from the shader.
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("surface_vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Less),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: n_samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("surface_fragment"),
            compilation_options: Default::default(),
            targets: &[Some(COLOR_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// Runs `work` and returns the device's complaint as an error: without this wgpu panics.
fn caught<T>(device: &wgpu::Device, work: impl FnOnce() -> T) -> Result<T> {
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
