//! The painter: device resources of a spectrum, and drawing into a texture.
//!
//! # Large spectra
//!
//! If the tables of a spectrum fit the budget and the device's largest binding, they are uploaded once (*resident*), and a new
//! isovalue uploads the list of active triangles only. Otherwise each picture uploads the vertices of its active triangles,
//! each with the knots on both sides of the isovalue. In both cases the triangles are drawn in batches of bounded size, so no
//! mesh is too large. The pictures are equal.

use super::background::Background;
use super::box_edges::BoxEdges;
use super::depth_order;
use super::image::Image;
use super::layer::{Layer, TriangleList};
use super::occlusion::Occlusion;
use super::pipeline::{Pipelines, supported_sample_count, with_error_scope};
use super::projection::Projection;
use super::shader_types::{ActiveTriangle, decode_normal};
use super::storage_buffer::StorageBuffer;
use super::tables::{self, KNOT_BYTES_PER_TRIANGLE};
use super::target::{Target, unpremultiply};
use super::uniforms::{LayerDraw, Picture, frame};
use super::view::{Surface, View};
use crate::color::{Attribute, ColorSources, Map};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::spectrum::{Keep, Mesh, Picked, Spectrum};
use crate::volume::Outside;

/// Draws pictures of one spectrum, of one or more isovalues each; keeps its pipelines and buffers between them. Every call
/// takes the spectrum that the painter was created with.
#[derive(Debug)]
pub struct Painter {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) pipelines: Pipelines,
    pub(super) n_samples: u32,
    /// Created by the first picture that needs it.
    pub(super) occlusion: Option<Occlusion>,
    /// Created by the first picture that needs it.
    pub(super) box_edges: Option<BoxEdges>,
    pub(super) isovalues: StorageBuffer,
    pub(super) first_knot: StorageBuffer,
    pub(super) knots: StorageBuffer,
    /// Whether the tables of the whole spectrum are on the device.
    pub(super) resident: bool,
    /// Largest size of a table on the device, bytes.
    max_bytes: u64,
    /// Largest number of triangles per draw call.
    pub(super) triangles_per_batch: usize,
    pub(super) layers: Vec<Layer>,
    pub(super) sources: ColorSources,
    pub(super) target: Option<Target>,
}

impl Painter {
    /// Compiles the pipelines and uploads the spectrum, with no table on the device larger than `max_bytes` (but at least one
    /// triangle's). The spectrum must pass [`Spectrum::check`].
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device reports an error or is lost.
    pub fn new(gpu: &Gpu, spectrum: &Spectrum, max_bytes: u64) -> Result<Self> {
        let device = gpu.device().clone();
        let queue = gpu.queue().clone();
        let max_bytes = max_bytes.min(device.limits().max_storage_buffer_binding_size);
        let triangles_per_batch = (max_bytes / KNOT_BYTES_PER_TRIANGLE).clamp(1, 1 << 20) as usize;
        let n_samples = supported_sample_count(&device);
        let mut painter = with_error_scope(&device.clone(), || {
            let buffer = |label| StorageBuffer::new(&device, label);
            Painter {
                pipelines: Pipelines::new(&device, n_samples),
                n_samples,
                occlusion: None,
                box_edges: None,
                isovalues: buffer("surface.isovalues"),
                first_knot: buffer("surface.first_knot"),
                knots: buffer("surface.knots"),
                resident: false,
                max_bytes,
                triangles_per_batch,
                layers: Vec::new(),
                sources: ColorSources::default(),
                target: None,
                device,
                queue,
            }
        })?;
        painter.set_spectrum(spectrum)?;
        Ok(painter)
    }

    /// Replaces the spectrum; the sources of colours stay.
    ///
    /// # Errors
    ///
    /// As [`Painter::new`].
    pub(crate) fn set_spectrum(&mut self, spectrum: &Spectrum) -> Result<()> {
        let device = self.device.clone();
        self.resident = tables::largest_table(spectrum) <= self.max_bytes;
        self.layers = vec![with_error_scope(&device, || Layer::new(&device, spectrum))?];
        if self.resident {
            let tables = tables::of_spectrum(spectrum);
            with_error_scope(&device, || self.upload_tables(&tables))?;
        }
        Ok(())
    }

    /// Draws isosurfaces into the painter's texture: the picture depends on the arguments only, never on previous pictures.
    /// Opaque surfaces come first, each in the order of its triangles' indices, then translucent ones, all of them together from
    /// the farthest triangles to the nearest, as far as slabs of the depth tell.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`], [`Error::Usage`](crate::Error::Usage) if the view is
    /// invalid or too large for the device, [`Error::Gpu`](crate::Error::Gpu) if the device reports an error or is lost.
    pub fn paint(&mut self, spectrum: &Spectrum, surfaces: &[Surface], view: &View) -> Result<()> {
        for surface in surfaces {
            spectrum.check_isovalue(surface.isovalue)?;
            let opacity = surface.opacity_in(view);
            if !(0.0..=1.0).contains(&opacity) {
                return Err(Error::Usage(format!("opacity {opacity}, expected 0 to 1")));
            }
        }
        let limits = self.device.limits();
        view.check(limits.max_texture_dimension_2d)?;
        Target::check((view.width, view.height), limits.max_buffer_size)?;
        let projection =
            view.camera.projection(spectrum.volume(), view.look_at, view.width, view.height);
        let device = self.device.clone();
        while self.layers.len() < surfaces.len() {
            let layer = with_error_scope(&device, || Layer::new(&device, spectrum))?;
            self.layers.push(layer);
        }
        for (i, (layer, surface)) in self.layers.iter_mut().zip(surfaces).enumerate() {
            // Only components of the first surface are picked.
            let picked = if i == 0 { view.picked.clone() } else { Picked::default() };
            layer.update(spectrum, surface.isovalue, view, picked, &self.sources)?;
        }
        self.sort_translucent(spectrum, surfaces, view, &projection);
        let n_samples = self.n_samples;
        let size = (view.width, view.height);
        let target = match self.target.take().filter(|t| (t.width, t.height) == size) {
            Some(target) => target,
            None => with_error_scope(&device, || Target::new(&device, size, n_samples))
                .map_err(|error| Target::too_large(size, n_samples).unwrap_or(error))?,
        };
        if view.occlusion && self.occlusion.is_none() {
            let occlusion = with_error_scope(&device, || Occlusion::new(&device, n_samples))?;
            self.occlusion = Some(occlusion);
        }
        if view.axes && self.box_edges.is_none() {
            let edges = with_error_scope(&device, || BoxEdges::new(&device, n_samples))?;
            self.box_edges = Some(edges);
        }
        let map = self.map(view);
        let order = drawing_order(surfaces, view, spectrum.volume().outside);
        let draws: Vec<LayerDraw> = (order.into_iter())
            .map(|layer| LayerDraw {
                layer,
                frame: frame(spectrum, &surfaces[layer], layer, view, &projection, map),
                opacity: surfaces[layer].opacity_in(view),
            })
            .collect();
        let picture = Picture { spectrum, target: &target, view, projection: &projection };
        let drawn = with_error_scope(&device, || self.draw_layers(&picture, &draws));
        // After an error the uploads are not valid for the next picture.
        drawn.inspect_err(|_| self.invalidate())?;
        self.target = Some(target);
        Ok(())
    }

    /// Minimum and maximum corner of the box around the kept components of an isosurface, voxel frame; `None` if it is empty.
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

    /// The mesh of an isovalue, with caps. The next picture with this first isosurface reuses it.
    ///
    /// # Errors
    ///
    /// [`Error::Range`](crate::Error::Range) outside [`Spectrum::range`].
    pub(crate) fn mesh_at(&mut self, spectrum: &Spectrum, isovalue: f64) -> Result<&Mesh> {
        spectrum.check_isovalue(isovalue)?;
        Ok(self.layers[0].mesh_at(spectrum, isovalue))
    }

    /// As [`Painter::mesh_at`], with the spectrum's indices of the mesh's vertices.
    #[cfg(feature = "viewer")]
    pub(crate) fn mesh_and_vertices(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
    ) -> Result<(&Mesh, &[u32])> {
        self.mesh_at(spectrum, isovalue)?;
        Ok(self.layers[0].mesh_and_vertices())
    }

    /// Waits for the last picture and reads it back; `None` before the first.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device is lost.
    pub fn read(&mut self) -> Result<Option<Image>> {
        let Some(target) = &self.target else { return Ok(None) };
        let read = with_error_scope(&self.device, || {
            let mut encoder = self
                .device
                .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read") });
            target.copy(&mut encoder);
            self.queue.submit([encoder.finish()]);
            target.read(&self.device)
        });
        let image = read.flatten().inspect_err(|_| self.invalidate())?;
        Ok(Some(image))
    }

    /// Waits for the last picture, which was painted with this view, reads it back and annotates it.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device is lost, or nothing was painted.
    #[cfg_attr(
        not(feature = "annotations"),
        allow(unused_variables, reason = "only annotations need it")
    )]
    pub fn picture(&mut self, spectrum: &Spectrum, view: &View) -> Result<Image> {
        let image = self.read()?;
        let mut image = image.ok_or_else(|| Error::Gpu("nothing was drawn".into()))?;
        if view.background == Background::Transparent {
            unpremultiply(&mut image);
        }
        #[cfg(feature = "annotations")]
        self.annotate(&mut image, spectrum, view);
        #[cfg(not(feature = "annotations"))]
        if view.label.is_some()
            || view.axes
            || view.scale_bar
            || (view.legend && self.attribute().is_some())
        {
            return Err(Error::Usage(
                "a legend, axes, a scale bar or a label: built without the feature `annotations`"
                    .into(),
            ));
        }
        Ok(image)
    }

    /// Draws the annotations of a view onto its picture: legend, axes, scale bar, label.
    #[cfg(feature = "annotations")]
    pub(crate) fn annotate(&self, image: &mut Image, spectrum: &Spectrum, view: &View) {
        let View { camera, look_at, width, height, .. } = *view;
        let volume = spectrum.volume();
        let projection = camera.projection(volume, look_at, width, height);
        let colors = self.attribute().map(|attribute| (attribute, self.map(view)));
        super::annotate::Canvas::new(image, view.background).annotate(
            view,
            &volume.placement,
            &projection,
            colors,
        );
    }

    /// The texture of the last picture, sRGB; its view format can be linear, too.
    #[cfg(feature = "viewer")]
    pub(crate) fn texture(&self) -> Option<&wgpu::Texture> {
        self.target.as_ref().map(Target::texture)
    }

    /// The values that colour the first surface of the last picture; `None` for colours without values.
    pub fn attribute(&self) -> Option<&Attribute> {
        self.layers[0].list.attribute.as_ref()
    }

    /// The colour map of a view.
    pub fn map(&self, view: &View) -> Map {
        view.map.unwrap_or_else(|| view.color.default_map(&self.sources))
    }

    /// Sets the data for colours, from the next picture on.
    pub fn set_sources(&mut self, sources: ColorSources) {
        self.sources = sources;
        self.invalidate();
    }

    /// The data for colours.
    pub fn sources(&self) -> &ColorSources {
        &self.sources
    }

    /// Sorts the triangles of translucent surfaces for drawing.
    fn sort_translucent(
        &mut self,
        spectrum: &Spectrum,
        surfaces: &[Surface],
        view: &View,
        projection: &Projection,
    ) {
        let towards_eye = projection.eye_from_voxel.row(2).truncate();
        let depths = self.layers.iter_mut().zip(surfaces).map(|(layer, surface)| {
            let is_translucent = surface.opacity_in(view) < 1.0;
            is_translucent.then(|| layer.depths(spectrum, surface.isovalue, towards_eye))
        });
        let depths: Vec<Option<Vec<f32>>> = depths.collect();
        let range = depth_order::range(depths.iter().flatten().flatten());
        for (layer, depths) in self.layers.iter_mut().zip(&depths) {
            layer.sort(depths.as_deref().map(|depths| (depths, range)));
        }
    }

    fn active_triangles(&self, surface: usize) -> &[ActiveTriangle] {
        self.layers.get(surface).map_or(&[], |layer| &layer.list.triangles)
    }

    /// Number of triangles of a surface in the last picture.
    pub fn n_triangles(&self, surface: usize) -> usize {
        self.active_triangles(surface).len()
    }

    /// The triangles of a surface in the last picture: their vertices and the unit normals, voxel frame, that shade their
    /// corners.
    pub fn shaded(&self, surface: usize) -> impl Iterator<Item = ([u32; 3], [[f32; 3]; 3])> + '_ {
        let shaded = |t: &ActiveTriangle| (t.vertices, t.normals.map(decode_normal));
        self.active_triangles(surface).iter().map(shaded)
    }

    /// Vertices of the triangles of a surface in the last picture.
    #[cfg(feature = "viewer")]
    pub(crate) fn triangles(&self, surface: usize) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.active_triangles(surface).iter().map(|t| t.vertices)
    }

    /// Makes the next picture list and upload all triangles again.
    fn invalidate(&mut self) {
        self.layers.iter_mut().for_each(|layer| layer.list = TriangleList::default());
    }
}

/// Indices of the surfaces in drawing order: opaque ones, then translucent ones, inner surfaces first.
fn drawing_order(surfaces: &[Surface], view: &View, outside: Outside) -> Vec<usize> {
    let mut order: Vec<usize> = (0..surfaces.len()).collect();
    let is_translucent = |i: usize| surfaces[i].opacity_in(view) < 1.0;
    order.sort_by(|&i, &j| {
        let lower_first = surfaces[i].isovalue.total_cmp(&surfaces[j].isovalue);
        let inner_first = match outside {
            Outside::Low => lower_first.reverse(),
            Outside::High => lower_first,
        };
        is_translucent(i).cmp(&is_translucent(j)).then(match is_translucent(i) {
            true => inner_first,
            false => i.cmp(&j),
        })
    });
    order
}
