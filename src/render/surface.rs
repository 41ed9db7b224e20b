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
use super::layout::{ActiveTriangle, Frame, Palette};
use super::pipeline::{caught, pipeline, samples_of};
use super::table::Table;
use super::tables::{self, KNOT_BYTES_PER_TRIANGLE, Tables};
use super::target::{Target, unmultiply};
use super::{Background, Image, View};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::spectrum::Spectrum;
use crate::spectrum::interval_tree::IntervalTree;

/// Largest table that is kept on the device as a whole, bytes: what browsers and software devices
/// bind at once.
pub const RESIDENT_BYTES: u64 = 128 << 20;

/// Draws pictures of one spectrum; keeps its pipeline and buffers between them.
#[derive(Debug)]
pub struct Renderer<'a> {
    spectrum: &'a Spectrum,
    lifetimes: IntervalTree,
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
        let device = gpu.device().clone();
        let queue = gpu.queue().clone();
        let bytes = bytes.min(device.limits().max_storage_buffer_binding_size);
        let resident = tables::largest_table(spectrum) <= bytes;
        let n_samples = samples_of(&device);
        let mut renderer = caught(&device.clone(), || {
            let table = |label| Table::new(&device, label);
            Renderer {
                spectrum,
                lifetimes: lifetimes(spectrum),
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
        let kept = self.target.take().filter(|t| (t.width, t.height) == (view.width, view.height));
        let target = match kept {
            Some(target) => target,
            None => caught(&device, || Target::new(&device, view.width, view.height, n_samples))?,
        };
        let frame = frame(self.spectrum, isovalue, rank.unwrap_or(0), view);
        let drawn = caught(&device, || {
            self.passes(&target, frame, view.background);
            target.read(&device)
        });
        let mut image = drawn.flatten().inspect_err(|_| {
            // What was refused must not be taken for uploaded by the next picture.
            self.listed = Listed::default();
        })?;
        self.target = Some(target);
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
        let active = rank.map(|rank| active_triangles(&self.lifetimes, rank)).unwrap_or_default();
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
    fn passes(&mut self, target: &Target, mut frame: Frame, background: Background) {
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
            self.pass(&mut encoder, target, piece.len(), (pass == 0).then_some(background));
            if pass + 1 == n_passes {
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
        target: &Target,
        n_triangles: usize,
        clear: Option<Background>,
    ) {
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

/// The lifetimes of a spectrum's triangles, to be asked for those alive at a rank.
fn lifetimes(spectrum: &Spectrum) -> IntervalTree {
    let ranks: Vec<(u32, u32)> = spectrum.triangles.iter().map(|t| (t.birth, t.death)).collect();
    IntervalTree::new(&ranks)
}

/// The triangles alive at `rank`, by increasing index: equal pictures draw in equal order, and
/// vertices that follow each other lie close in memory.
fn active_triangles(lifetimes: &IntervalTree, rank: u32) -> Vec<u32> {
    let mut active = Vec::new();
    lifetimes.stab(rank, |i| active.push(i));
    active.sort_unstable();
    active
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
