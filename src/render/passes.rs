//! The passes of a picture: which layers, caps, hollows and lines are drawn one after the other, piece by piece.

use super::layout::{ActiveTriangle, Cut};
use super::look::{Look, cut, is_cut};
use super::painter::Painter;
use super::pipeline::Step;
use super::projection::Projection;
use super::tables::{self, Tables};
use super::target::Target;
use super::{Background, View};
use crate::spectrum::Spectrum;

impl Painter {
    /// Draws the layers, those that one looks through last.
    pub(super) fn passes(
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
            let seen = (spectrum.volume(), projection, view.background);
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

    pub(super) fn upload_tables(&mut self, tables: &Tables) {
        self.isovalues.write(&self.device, &self.queue, &tables.isovalues);
        self.first_knot.write(&self.device, &self.queue, &tables.first_knot);
        self.knots.write(&self.device, &self.queue, &tables.knots);
    }
}
