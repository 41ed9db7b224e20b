//! The render passes of a picture: layers, caps, occlusion and the volume's box, in order, each layer in batches of triangles.

use std::collections::BTreeMap;
use std::ops::Range;

use super::background::Background;
use super::depth_order::{self, Run};
use super::painter::Painter;
use super::pipeline::PassKind;
use super::shader_types::ActiveTriangle;
use super::tables::{self, Tables};
use super::uniforms::{LayerDraw, Picture, cut, is_cut, is_eye_cut_off};
use super::view::View;
use crate::spectrum::Spectrum;

/// A draw of one layer.
#[derive(Clone, Debug)]
struct LayerPass {
    layer: usize,
    opacity: f32,
    kind: PassKind,
    /// Of the uploaded triangles, or of the one triangle that covers the picture for a cap.
    corners: Range<u32>,
}

/// Whether the clip plane is closed where it cuts surfaces.
fn has_caps(view: &View) -> bool {
    view.clip.is_some() && !view.open
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
            // The cap comes first, because it hides the surface behind it.
            self.draw_cap(picture, draw, keeps_tables, &mut background);
            let all = 0..self.n_drawn(draw);
            self.draw_triangles(
                picture,
                draw,
                PassKind::Surface,
                all,
                keeps_tables,
                &mut background,
            );
        }
        if let Some(background) = background.take_if(|_| translucent.is_empty() || view.axes) {
            self.render_pass(picture, &[], Some(background));
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
        if !translucent.is_empty() {
            self.draw_translucent(picture, translucent, keeps_tables, &mut background);
        }
    }

    /// Draws translucent layers, inner ones first in the list: all of them together, from the farthest triangles to the nearest.
    fn draw_translucent(
        &mut self,
        picture: &Picture<'_>,
        draws: &[LayerDraw],
        keeps_tables: bool,
        background: &mut Option<Background>,
    ) {
        // All that remains is behind the plane, or in front of it.
        let are_caps_last = is_eye_cut_off(picture.view, picture.projection);
        if !are_caps_last {
            for draw in draws {
                self.draw_cap(picture, draw, keeps_tables, background);
            }
        }
        let slabs: Vec<&[u32]> =
            draws.iter().map(|draw| self.layers[draw.layer].list.slabs()).collect();
        let runs = depth_order::runs(&slabs);
        let fits = |draw: &LayerDraw| self.n_drawn(draw) <= self.triangles_per_batch;
        if keeps_tables && draws.iter().all(fits) {
            for draw in draws {
                self.upload(picture, draw, 0..self.n_drawn(draw), keeps_tables);
            }
            let passes = runs.iter().map(|run| {
                let &LayerDraw { layer, opacity, .. } = &draws[run.surface];
                let corners = 3 * run.first as u32..3 * run.end as u32;
                LayerPass { layer, opacity, kind: PassKind::Surface, corners }
            });
            let passes: Vec<LayerPass> = passes.collect();
            self.render_pass(picture, &passes, background.take());
        } else {
            for Run { surface, first, end } in runs {
                let (draw, kind) = (&draws[surface], PassKind::Surface);
                self.draw_triangles(picture, draw, kind, first..end, keeps_tables, background);
            }
        }
        if are_caps_last {
            for draw in draws {
                self.draw_cap(picture, draw, keeps_tables, background);
            }
        }
        if let Some(background) = background.take() {
            self.render_pass(picture, &[], Some(background));
        }
    }

    /// Closes one layer where the clip plane cuts it.
    fn draw_cap(
        &mut self,
        picture: &Picture<'_>,
        draw: &LayerDraw,
        keeps_tables: bool,
        background: &mut Option<Background>,
    ) {
        if !has_caps(picture.view) {
            return;
        }
        let all = 0..self.n_drawn(draw);
        self.draw_triangles(picture, draw, PassKind::CountFaces, all, keeps_tables, background);
        let &LayerDraw { layer, opacity, .. } = draw;
        let pass = LayerPass { layer, opacity, kind: PassKind::Cap, corners: 0..3 };
        self.render_pass(picture, &[pass], background.take());
    }

    /// Draws triangles of one layer in batches. The first pass of a picture clears it and takes the background.
    fn draw_triangles(
        &mut self,
        picture: &Picture<'_>,
        draw: &LayerDraw,
        kind: PassKind,
        triangles: Range<usize>,
        keeps_tables: bool,
        background: &mut Option<Background>,
    ) {
        let &LayerDraw { layer, opacity, .. } = draw;
        // A layer without triangles has its uniforms, too, and clears the picture.
        for first in (triangles.start..triangles.end.max(triangles.start + 1))
            .step_by(self.triangles_per_batch)
        {
            let batch = first..triangles.end.min(first + self.triangles_per_batch);
            let corners = 0..3 * batch.len() as u32;
            self.upload(picture, draw, batch, keeps_tables);
            let pass = LayerPass { layer, opacity, kind, corners };
            self.render_pass(picture, &[pass], background.take());
        }
    }

    /// Uploads triangles of a layer, unless all of them are on the device, and its uniforms.
    fn upload(
        &mut self,
        &Picture { spectrum, view, projection, .. }: &Picture<'_>,
        &LayerDraw { layer: i, mut frame, opacity }: &LayerDraw,
        batch: Range<usize>,
        keeps_tables: bool,
    ) {
        frame.rank = match self.layers[i].list.uploaded_rank {
            Some(rank) => rank,
            None => {
                let is_whole = batch.len() == self.layers[i].list.drawn().len();
                let batch = self.layers[i].list.drawn()[batch].to_vec();
                let rank = self.upload_batch(spectrum, i, batch, frame.rank);
                self.layers[i].list.uploaded_rank = (keeps_tables && is_whole).then_some(rank);
                rank
            }
        };
        let layer = &self.layers[i];
        self.queue.write_buffer(&layer.frame, 0, bytemuck::bytes_of(&frame));
        if let Some(cut) = &cut(view, opacity, projection) {
            self.queue.write_buffer(&layer.cut, 0, bytemuck::bytes_of(cut));
        }
    }

    /// Number of triangles of a layer.
    fn n_drawn(&self, draw: &LayerDraw) -> usize {
        self.layers[draw.layer].list.drawn().len()
    }

    /// Submits a pass that draws uploaded triangles; `clear` for the first pass of a picture.
    fn render_pass(
        &self,
        &Picture { target, view, .. }: &Picture<'_>,
        draws: &[LayerPass],
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
        let mut bind_groups: BTreeMap<usize, wgpu::BindGroup> = BTreeMap::new();
        for draw in draws.iter().filter(|draw| !draw.corners.is_empty()) {
            let pipeline = self.pipelines.of(draw.kind, view, draw.opacity);
            let group = bind_groups
                .entry(draw.layer)
                .or_insert_with(|| self.bind_group(pipeline, draw, view));
            render_pass.set_pipeline(pipeline);
            render_pass.set_bind_group(0, &*group, &[]);
            render_pass.draw(draw.corners.clone(), 0..1);
        }
        drop(render_pass);
        self.queue.submit([encoder.finish()]);
    }

    /// The bindings, in the shader's order.
    fn bind_group(
        &self,
        pipeline: &wgpu::RenderPipeline,
        pass: &LayerPass,
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
        mut triangles: Vec<ActiveTriangle>,
        rank: u32,
    ) -> u32 {
        let buffer = &mut self.layers[layer].triangle_buffer;
        if self.resident {
            buffer.write(&self.device, &self.queue, &triangles);
            return rank;
        }
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
