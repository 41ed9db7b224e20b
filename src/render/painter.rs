//! The device side of `shaders/surface.wgsl`: tables, pipelines, passes.
//!
//! # Large spectra
//!
//! A spectrum whose tables fit the budget (and the device's largest binding) is uploaded once, and
//! a new isovalue costs the list of active triangles. Of a larger one each picture uploads only
//! the vertices of the active triangles, each with the knots on either side of the isovalue.
//! Either way the triangles go through the device in pieces of bounded size, so no picture fails
//! for the size of its mesh. The pictures are equal.

use super::edges::Edges;
use super::layer::{Layer, Listed};
use super::layout::{ActiveTriangle, Cut, Frame, normal_of_code};
use super::look::{Look, cut, frame, is_cut};
use super::occlusion::Occlusion;
use super::pipeline::{Pipelines, Step, caught, samples_of};
use super::table::Table;
use super::tables::{self, KNOT_BYTES_PER_TRIANGLE, Tables};
use super::target::Target;
use super::{Background, Image, Surface, View};
use crate::color::{Attribute, Map, Sources};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::render::camera::Projection;
use crate::spectrum::{Keep, Spectrum, SurfaceMesh};

/// Draws pictures of one spectrum, of one or more isovalues each; keeps its pipelines and buffers
/// between them. Every call takes the spectrum that it was made for.
#[derive(Debug)]
pub struct Painter {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipelines: Pipelines,
    n_samples: u32,
    /// From the first picture on that wants them.
    occlusion: Option<Occlusion>,
    edges: Option<Edges>,
    isovalues: Table,
    first_knot: Table,
    knots: Table,
    /// Whether the tables hold the whole spectrum.
    resident: bool,
    /// Most triangles drawn at once.
    triangles_per_pass: usize,
    layers: Vec<Layer>,
    sources: Sources,
    target: Option<Target>,
}

impl Painter {
    /// Compiles the pipeline and uploads what is kept, with no table on the device larger than
    /// `bytes` (at least one triangle's is allowed). The spectrum must pass [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device refuses or is lost.
    pub fn new(gpu: &Gpu, spectrum: &Spectrum, bytes: u64) -> Result<Self> {
        let device = gpu.device().clone();
        let queue = gpu.queue().clone();
        let bytes = bytes.min(device.limits().max_storage_buffer_binding_size);
        let n_samples = samples_of(&device);
        let mut painter = caught(&device.clone(), || {
            let table = |label| Table::new(&device, label);
            Painter {
                pipelines: Pipelines::new(&device, n_samples),
                n_samples,
                occlusion: None,
                edges: None,
                isovalues: table("surface.isovalues"),
                first_knot: table("surface.first_knot"),
                knots: table("surface.knots"),
                resident: tables::largest_table(spectrum) <= bytes,
                triangles_per_pass: (bytes / KNOT_BYTES_PER_TRIANGLE).clamp(1, 1 << 20) as usize,
                layers: vec![Layer::new(&device, spectrum)],
                sources: Sources::default(),
                target: None,
                device,
                queue,
            }
        })?;
        if painter.resident {
            let device = painter.device.clone();
            let tables = tables::all(spectrum);
            caught(&device, || painter.upload_tables(&tables))?;
        }
        Ok(painter)
    }

    /// Draws isosurfaces into the painter's own texture, each in the order of its triangles' indices: the bytes of a
    /// picture depend on what is seen alone, never on the pictures before. Opaque ones come first, then those that one
    /// looks through from the highest isovalue to the lowest: what lies above a higher isovalue is inside of what lies
    /// above a lower one.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`], [`Error::Usage`](crate::Error::Usage) if the
    /// view makes no sense or is too large for the device, [`Error::Gpu`](crate::Error::Gpu) if the device refuses or is
    /// lost.
    pub fn paint(&mut self, spectrum: &Spectrum, surfaces: &[Surface], view: &View) -> Result<()> {
        for surface in surfaces {
            spectrum.check_isovalue(surface.isovalue)?;
            let opacity = surface.opacity_in(view);
            if !(0.0..=1.0).contains(&opacity) {
                return Err(Error::Usage(format!("opacity {opacity}, expected 0 to 1")));
            }
        }
        view.check(self.device.limits().max_texture_dimension_2d)?;
        let projection =
            view.camera.projection(&spectrum.volume, view.look_at, view.width, view.height);
        let device = self.device.clone();
        while self.layers.len() < surfaces.len() {
            let layer = caught(&device, || Layer::new(&device, spectrum))?;
            self.layers.push(layer);
        }
        for (layer, surface) in self.layers.iter_mut().zip(surfaces) {
            layer.list(spectrum, surface.isovalue, view, &self.sources)?;
            if surface.opacity_in(view) < 1.0 {
                layer.sort_by_depth(projection.eye_from_voxel);
            }
        }
        let n_samples = self.n_samples;
        let kept = self.target.take().filter(|t| (t.width, t.height) == (view.width, view.height));
        let target = match kept {
            Some(target) => target,
            None => caught(&device, || Target::new(&device, view.width, view.height, n_samples))?,
        };
        if view.occlusion && self.occlusion.is_none() {
            self.occlusion = Some(caught(&device, || Occlusion::new(&device, n_samples))?);
        }
        if view.axes && self.edges.is_none() {
            self.edges = Some(caught(&device, || Edges::new(&device, n_samples))?);
        }
        let map = self.map(view);
        let frames: Vec<Frame> = (surfaces.iter().enumerate())
            .map(|(layer, surface)| frame(spectrum, surface, layer, view, &projection, map))
            .collect();
        let opacities: Vec<f32> = surfaces.iter().map(|s| s.opacity_in(view)).collect();
        let mut order: Vec<usize> = (0..surfaces.len()).collect();
        order.sort_by(|&i, &j| {
            let is_clear = |i: usize| opacities[i] < 1.0;
            let inner_first = surfaces[j].isovalue.total_cmp(&surfaces[i].isovalue);
            is_clear(i).cmp(&is_clear(j)).then(match is_clear(i) {
                true => inner_first,
                false => i.cmp(&j),
            })
        });
        let looks: Vec<Look> = (order.into_iter())
            .map(|layer| Look { layer, frame: frames[layer], opacity: opacities[layer] })
            .collect();
        let drawn = caught(&device, || self.passes(spectrum, &target, &looks, view, &projection));
        // What was refused must not be taken for uploaded by the next picture.
        drawn.inspect_err(|_| self.forget())?;
        self.target = Some(target);
        Ok(())
    }

    /// Least and largest corner of the box around what is kept of an isosurface, voxel frame; none where nothing is to
    /// be seen.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub fn bounds(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
        keep: &Keep,
    ) -> Result<Option<[[f64; 3]; 2]>> {
        let mesh = self.mesh_at(spectrum, isovalue)?;
        Ok(if keep.is_all() { mesh.bounds() } else { mesh.with_components(keep).bounds() })
    }

    /// The mesh of an isovalue, caps and all; the next picture of it as the first isosurface has it at hand.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub(crate) fn mesh_at(&mut self, spectrum: &Spectrum, isovalue: f64) -> Result<&SurfaceMesh> {
        spectrum.check_isovalue(isovalue)?;
        Ok(self.layers[0].mesh_at(spectrum, isovalue))
    }

    /// Waits for the last picture and takes it; none before the first.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device is lost.
    pub fn read(&mut self) -> Result<Option<Image>> {
        let Some(target) = &self.target else { return Ok(None) };
        let read = caught(&self.device, || {
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read") });
            target.copy(&mut encoder);
            self.queue.submit([encoder.finish()]);
            target.read(&self.device)
        });
        let image = read.flatten().inspect_err(|_| self.forget())?;
        Ok(Some(image))
    }

    /// The texture that holds the last picture, sRGB; it can be viewed as linear too.
    pub fn texture(&self) -> Option<&wgpu::Texture> {
        self.target.as_ref().map(Target::texture)
    }

    /// What the colours of the first surface of the last picture show; none where they show nothing.
    pub fn attribute(&self) -> Option<&Attribute> {
        self.layers[0].listed.attribute.as_ref()
    }

    /// The map that shows the colours of a view.
    pub fn map(&self, view: &View) -> Map {
        view.map.unwrap_or_else(|| view.color.usual_map(&self.sources))
    }

    /// What colours are to be had from, from the next picture on.
    pub fn set_sources(&mut self, sources: Sources) {
        self.sources = sources;
        self.forget();
    }

    /// What colours are to be had from.
    pub fn sources(&self) -> &Sources {
        &self.sources
    }

    /// Number of triangles of each surface in the last picture.
    pub fn n_triangles(&self, surface: usize) -> usize {
        self.layers.get(surface).map_or(0, |layer| layer.listed.triangles.len())
    }

    /// The triangles of a surface in the last picture: their vertices and the unit normals, voxel frame, that their
    /// corners are shaded with.
    pub fn shaded(&self, surface: usize) -> impl Iterator<Item = ([u32; 3], [[f32; 3]; 3])> + '_ {
        let listed = self.layers.get(surface).map(|layer| &layer.listed.triangles[..]);
        let shaded = |t: &ActiveTriangle| (t.vertices, t.normals.map(normal_of_code));
        listed.unwrap_or_default().iter().map(shaded)
    }

    /// Vertices of the triangles of each surface in the last picture.
    #[cfg(feature = "viewer")]
    pub(crate) fn triangles(&self, surface: usize) -> impl Iterator<Item = [u32; 3]> + '_ {
        let listed = self.layers.get(surface).map(|layer| &layer.listed.triangles[..]);
        listed.unwrap_or_default().iter().map(|t| t.vertices)
    }

    fn forget(&mut self) {
        self.layers.iter_mut().for_each(|layer| layer.listed = Listed::default());
    }

    /// Draws the layers, those that one looks through last.
    fn passes(
        &mut self,
        spectrum: &Spectrum,
        target: &Target,
        looks: &[Look],
        view: &View,
        projection: &Projection,
    ) {
        let n_opaque = looks.iter().filter(|look| look.opacity >= 1.0).count();
        let (opaque, clear) = looks.split_at(n_opaque);
        let keeps_tables = self.resident || looks.len() == 1;
        let mut background = Some(view.background);
        let cut = |look: &Look| cut(view, look.opacity, projection);
        for look in opaque {
            self.surface(
                spectrum,
                target,
                (look, cut(look)),
                view,
                (keeps_tables, &mut background),
            );
        }
        if let Some(background) = background.take_if(|_| clear.is_empty() || view.axes) {
            self.pass(target, (0, 1.0, Step::Surface), 0, Some(background), view);
        }
        // What one looks through has no depth of its own: it lies over what is darkened and over the lines behind it.
        if let Some(occlusion) = self.occlusion.as_ref().filter(|_| view.occlusion && n_opaque > 0)
        {
            occlusion.draw(&self.device, &self.queue, target, projection);
        }
        if let Some(edges) = self.edges.as_ref().filter(|_| view.axes) {
            let seen = (&spectrum.volume, projection, view.background);
            edges.draw(&self.device, &self.queue, target, seen);
        }
        for look in clear {
            self.surface(
                spectrum,
                target,
                (look, cut(look)),
                view,
                (keeps_tables, &mut background),
            );
        }
    }

    /// Draws one layer, piece by piece; takes the background where the picture is still empty.
    fn surface(
        &mut self,
        spectrum: &Spectrum,
        target: &Target,
        (&Look { layer: i, mut frame, opacity }, cut): (&Look, Option<Cut>),
        view: &View,
        (keeps_tables, background): (bool, &mut Option<Background>),
    ) {
        let rank = frame.rank;
        let triangles = std::mem::take(&mut self.layers[i].listed.triangles);
        let n_passes = triangles.len().div_ceil(self.triangles_per_pass).max(1);
        // The cap comes first: the surface behind it is not seen.
        let steps: &[Step] = match view.clip.is_some() && !view.open {
            true => &[Step::Count, Step::Cap, Step::Surface],
            false => &[Step::Surface],
        };
        let passes = steps.iter().flat_map(|&step| {
            let n = if step == Step::Cap { 1 } else { n_passes };
            (0..n).map(move |pass| (step, pass))
        });
        for (step, pass) in passes {
            let first = pass * self.triangles_per_pass;
            let piece = &triangles[first..triangles.len().min(first + self.triangles_per_pass)];
            frame.rank = match self.layers[i].listed.uploaded {
                Some(rank) => rank,
                None => self.upload_piece(spectrum, i, piece, rank),
            };
            if keeps_tables && n_passes == 1 {
                self.layers[i].listed.uploaded = Some(frame.rank);
            }
            let layer = &self.layers[i];
            self.queue.write_buffer(&layer.frame, 0, bytemuck::bytes_of(&frame));
            if let Some(cut) = &cut {
                self.queue.write_buffer(&layer.cut, 0, bytemuck::bytes_of(cut));
            }
            let n_corners = match step {
                Step::Cap => 3,
                _ => 3 * piece.len(),
            };
            self.pass(target, (i, opacity, step), n_corners, background.take(), view);
        }
        self.layers[i].listed.triangles = triangles;
    }

    /// Submits one pass over the uploaded triangles of a layer; `clear` where it is the picture's
    /// first.
    fn pass(
        &self,
        target: &Target,
        (layer, opacity, step): (usize, f32, Step),
        n_corners: usize,
        clear: Option<Background>,
        view: &View,
    ) {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("surface") });
        let (color, depth, stencil) = match clear {
            Some(background) => {
                let [r, g, b, a] = background.linear();
                (
                    wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    wgpu::LoadOp::Clear(1.0),
                    wgpu::LoadOp::Clear(0),
                )
            }
            None => (wgpu::LoadOp::Load, wgpu::LoadOp::Load, wgpu::LoadOp::Load),
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
                stencil_ops: Some(wgpu::Operations { load: stencil, store: wgpu::StoreOp::Store }),
            }),
            ..Default::default()
        });
        if n_corners > 0 {
            let pipeline = self.pipelines.of(step, view, opacity);
            let is_cut = is_cut(view, opacity);
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &self.bind_group(pipeline, layer, (step, is_cut)), &[]);
            pass.draw(0..n_corners as u32, 0..1);
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
    }

    /// The bindings, in the shader's order.
    fn bind_group(
        &self,
        pipeline: &wgpu::RenderPipeline,
        layer: usize,
        (step, is_cut): (Step, bool),
    ) -> wgpu::BindGroup {
        let layer = &self.layers[layer];
        let mut buffers = vec![
            layer.frame.as_entire_binding(),
            self.isovalues.binding(),
            self.first_knot.binding(),
            self.knots.binding(),
            layer.table.binding(),
        ];
        if is_cut {
            buffers.push(layer.cut.as_entire_binding());
        }
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            // A cap knows nothing of triangles.
            .filter(|(binding, _)| step != Step::Cap || [0, 5].contains(binding))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surface"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    /// Uploads the triangles of one pass and, if the device does not keep them, their vertices.
    /// Returns what the uploaded tables call the rank `rank`.
    fn upload_piece(
        &mut self,
        spectrum: &Spectrum,
        layer: usize,
        triangles: &[ActiveTriangle],
        rank: u32,
    ) -> u32 {
        let table = &mut self.layers[layer].table;
        if self.resident {
            table.write(&self.device, &self.queue, triangles);
            return rank;
        }
        let mut triangles = triangles.to_vec();
        let (tables, rank) = tables::selected(spectrum, &mut triangles, rank);
        table.write(&self.device, &self.queue, &triangles);
        self.upload_tables(&tables);
        rank
    }

    fn upload_tables(&mut self, tables: &Tables) {
        self.isovalues.write(&self.device, &self.queue, &tables.isovalues);
        self.first_knot.write(&self.device, &self.queue, &tables.first_knot);
        self.knots.write(&self.device, &self.queue, &tables.knots);
    }
}
