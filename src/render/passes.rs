//! The render passes of a picture: layers, caps, occlusion and the volume's box, in order, each layer in batches of triangles.

use super::background::Background;
use super::painter::Painter;
use super::pipeline::PassKind;
use super::shader_types::ActiveTriangle;
use super::tables::{self, Tables};
use super::uniforms::{LayerDraw, Picture, cut, is_cut};
use super::view::View;
use crate::spectrum::Spectrum;

/// A pass over one layer.
#[derive(Clone, Copy)]
struct LayerPass {
    layer: usize,
    opacity: f32,
    kind: PassKind,
}

impl Painter {
    /// Draws the layers, translucent ones last.
    pub(super) fn draw_layers(&mut self, picture: &Picture<'_>, draws: &[LayerDraw]) {
        let Picture { spectrum, target, view, projection } = *picture;
        let n_opaque = draws.iter().filter(|draw| draw.opacity >= 1.0).count();
        let (opaque, translucent) = draws.split_at(n_opaque);
        // Without resident tables, layers overwrite each other's.
        let keeps_tables = self.resident || draws.len() == 1;
        // The first pass clears the picture and takes the background.
        let mut background = Some(view.background);
        for draw in opaque {
            self.draw_layer(picture, draw, keeps_tables, &mut background);
        }
        if let Some(background) = background.take_if(|_| translucent.is_empty() || view.axes) {
            let pass = LayerPass { layer: 0, opacity: 1.0, kind: PassKind::Surface };
            self.render_pass(picture, pass, 0, Some(background));
        }
        // Translucent layers write no depth: they blend over the occlusion and over the lines behind them.
        if let Some(occlusion) = self.occlusion.as_ref().filter(|_| view.occlusion && n_opaque > 0)
        {
            occlusion.draw(&self.device, &self.queue, target, projection);
        }
        if let Some(edges) = self.box_edges.as_ref().filter(|_| view.axes) {
            let (volume, background) = (spectrum.volume(), view.background);
            edges.draw(&self.device, &self.queue, target, volume, projection, background);
        }
        for draw in translucent {
            self.draw_layer(picture, draw, keeps_tables, &mut background);
        }
    }

    /// Draws one layer in batches of triangles. Its first pass clears the picture if `background` is still there.
    fn draw_layer(
        &mut self,
        picture: &Picture<'_>,
        &LayerDraw { layer: i, mut frame, opacity }: &LayerDraw,
        keeps_tables: bool,
        background: &mut Option<Background>,
    ) {
        let Picture { spectrum, view, .. } = *picture;
        let cut = cut(view, opacity, picture.projection);
        let rank = frame.rank;
        let triangles = std::mem::take(&mut self.layers[i].list.triangles);
        let n_batches = triangles.len().div_ceil(self.triangles_per_batch).max(1);
        // The cap comes first, because it hides the surface behind it.
        let kinds: &[PassKind] = match view.clip.is_some() && !view.open {
            true => &[PassKind::CountFaces, PassKind::Cap, PassKind::Surface],
            false => &[PassKind::Surface],
        };
        let passes = kinds.iter().flat_map(|&kind| {
            let n = if kind == PassKind::Cap { 1 } else { n_batches };
            (0..n).map(move |batch| (kind, batch))
        });
        for (kind, batch) in passes {
            let first = batch * self.triangles_per_batch;
            let batch = &triangles[first..triangles.len().min(first + self.triangles_per_batch)];
            frame.rank = match self.layers[i].list.uploaded_rank {
                Some(rank) => rank,
                None => self.upload_batch(spectrum, i, batch, rank),
            };
            if keeps_tables && n_batches == 1 {
                self.layers[i].list.uploaded_rank = Some(frame.rank);
            }
            let layer = &self.layers[i];
            self.queue.write_buffer(&layer.frame, 0, bytemuck::bytes_of(&frame));
            if let Some(cut) = &cut {
                self.queue.write_buffer(&layer.cut, 0, bytemuck::bytes_of(cut));
            }
            let n_corners = if kind == PassKind::Cap { 3 } else { 3 * batch.len() };
            let pass = LayerPass { layer: i, opacity, kind };
            self.render_pass(picture, pass, n_corners, background.take());
        }
        self.layers[i].list.triangles = triangles;
    }

    /// Submits one pass over the uploaded triangles of a layer; `clear` for the first pass of a picture.
    fn render_pass(
        &self,
        &Picture { target, view, .. }: &Picture<'_>,
        pass: LayerPass,
        n_corners: usize,
        clear: Option<Background>,
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
        let mut render_pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
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
            let pipeline = self.pipelines.of(pass.kind, view, pass.opacity);
            render_pass.set_pipeline(pipeline);
            render_pass.set_bind_group(0, &self.bind_group(pipeline, pass, view), &[]);
            render_pass.draw(0..n_corners as u32, 0..1);
        }
        drop(render_pass);
        self.queue.submit([encoder.finish()]);
    }

    /// The bindings, in the shader's order.
    fn bind_group(
        &self,
        pipeline: &wgpu::RenderPipeline,
        pass: LayerPass,
        view: &View,
    ) -> wgpu::BindGroup {
        let layer = &self.layers[pass.layer];
        let mut buffers = vec![
            layer.frame.as_entire_binding(),
            self.isovalues.binding(),
            self.first_knot.binding(),
            self.knots.binding(),
            layer.triangle_buffer.binding(),
        ];
        if is_cut(view, pass.opacity) {
            buffers.push(layer.cut.as_entire_binding());
        }
        let entries: Vec<wgpu::BindGroupEntry<'_>> = (0..)
            .zip(buffers)
            // The shader of caps reads the uniforms only.
            .filter(|(binding, _)| pass.kind != PassKind::Cap || [0, 5].contains(binding))
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("surface"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    /// Uploads the triangles of one batch and, if the tables are not resident, their vertices. Returns the index of `rank` in
    /// the uploaded tables.
    fn upload_batch(
        &mut self,
        spectrum: &Spectrum,
        layer: usize,
        triangles: &[ActiveTriangle],
        rank: u32,
    ) -> u32 {
        let buffer = &mut self.layers[layer].triangle_buffer;
        if self.resident {
            buffer.write(&self.device, &self.queue, triangles);
            return rank;
        }
        let mut triangles = triangles.to_vec();
        let (tables, rank) = tables::of_triangles(spectrum, &mut triangles, rank);
        buffer.write(&self.device, &self.queue, &triangles);
        self.upload_tables(&tables);
        rank
    }

    pub(super) fn upload_tables(&mut self, tables: &Tables) {
        self.isovalues.write(&self.device, &self.queue, &tables.isovalues);
        self.first_knot.write(&self.device, &self.queue, &tables.first_knot);
        self.knots.write(&self.device, &self.queue, &tables.knots);
    }
}
