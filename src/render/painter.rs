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
use super::layout::{ActiveTriangle, Frame, normal_of_code};
use super::look::{Look, frame};
use super::occlusion::Occlusion;
use super::pipeline::{Pipelines, caught, samples_of};
use super::table::Table;
use super::tables::{self, KNOT_BYTES_PER_TRIANGLE};
use super::target::{Target, unmultiply};
use super::{Background, Image, Surface, View};
use crate::color::{Attribute, Map, Sources};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::spectrum::{Keep, Picked, Spectrum, SurfaceMesh};

/// Draws pictures of one spectrum, of one or more isovalues each; keeps its pipelines and buffers
/// between them. Every call takes the spectrum that it was made for.
#[derive(Debug)]
pub struct Painter {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) pipelines: Pipelines,
    pub(super) n_samples: u32,
    /// From the first picture on that wants them.
    pub(super) occlusion: Option<Occlusion>,
    pub(super) edges: Option<Edges>,
    pub(super) isovalues: Table,
    pub(super) first_knot: Table,
    pub(super) knots: Table,
    /// Whether the tables hold the whole spectrum.
    pub(super) resident: bool,
    /// Most bytes of a table on the device.
    bytes: u64,
    /// Most triangles drawn at once.
    pub(super) triangles_per_pass: usize,
    pub(super) layers: Vec<Layer>,
    pub(super) sources: Sources,
    pub(super) target: Option<Target>,
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
                resident: false,
                bytes,
                triangles_per_pass: (bytes / KNOT_BYTES_PER_TRIANGLE).clamp(1, 1 << 20) as usize,
                layers: Vec::new(),
                sources: Sources::default(),
                target: None,
                device,
                queue,
            }
        })?;
        painter.replace(spectrum)?;
        Ok(painter)
    }

    /// Takes another spectrum in place of the one before, of which nothing is kept but the sources of colours.
    ///
    /// # Errors
    ///
    /// As [`Painter::new`].
    pub(crate) fn replace(&mut self, spectrum: &Spectrum) -> Result<()> {
        let device = self.device.clone();
        self.resident = tables::largest_table(spectrum) <= self.bytes;
        self.layers = vec![caught(&device, || Layer::new(&device, spectrum))?];
        if self.resident {
            let tables = tables::all(spectrum);
            caught(&device, || self.upload_tables(&tables))?;
        }
        Ok(())
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
            view.camera.projection(spectrum.volume(), view.look_at, view.width, view.height);
        let device = self.device.clone();
        while self.layers.len() < surfaces.len() {
            let layer = caught(&device, || Layer::new(&device, spectrum))?;
            self.layers.push(layer);
        }
        for (i, (layer, surface)) in self.layers.iter_mut().zip(surfaces).enumerate() {
            // Others have other components.
            let picked = if i == 0 { view.picked.clone() } else { Picked::default() };
            layer.list(spectrum, surface.isovalue, (view, &picked), &self.sources)?;
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
        let looks: Vec<Look> = (in_order(surfaces, view).into_iter())
            .map(|layer| {
                let opacity = surfaces[layer].opacity_in(view);
                Look { layer, frame: frames[layer], opacity }
            })
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

    /// As `mesh_at`, with which of the spectrum's vertices those of the mesh are.
    #[cfg(feature = "viewer")]
    pub(crate) fn mesh_and_vertices(
        &mut self,
        spectrum: &Spectrum,
        isovalue: f64,
    ) -> Result<(&SurfaceMesh, &[u32])> {
        self.mesh_at(spectrum, isovalue)?;
        Ok(self.layers[0].meshed())
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

    /// Waits for the last picture, which was painted with this view, and takes it with all that is written on it.
    ///
    /// # Errors
    ///
    /// [`Error::Gpu`](crate::Error::Gpu) if the device is lost, or nothing was painted.
    pub fn picture(&mut self, spectrum: &Spectrum, view: &View) -> Result<Image> {
        let image = self.read()?;
        let mut image = image.ok_or_else(|| Error::Gpu("nothing was drawn".into()))?;
        if view.background == Background::Transparent {
            unmultiply(&mut image);
        }
        #[cfg(feature = "annotations")]
        self.write_on(&mut image, spectrum, view);
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

    /// Writes on a picture of a view what belongs on it: legend, axes, scale bar, label.
    #[cfg(feature = "annotations")]
    pub(crate) fn write_on(&self, image: &mut Image, spectrum: &Spectrum, view: &View) {
        let View { camera, look_at, width, height, .. } = *view;
        let volume = spectrum.volume();
        let projection = camera.projection(volume, look_at, width, height);
        let shown = self.attribute().map(|attribute| (attribute, self.map(view)));
        super::annotate::Sheet::new(image, view.background).write(
            view,
            &volume.placement,
            &projection,
            shown,
        );
    }

    /// The texture that holds the last picture, sRGB; it can be viewed as linear too.
    #[cfg(feature = "viewer")]
    pub(crate) fn texture(&self) -> Option<&wgpu::Texture> {
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

    pub(super) fn forget(&mut self) {
        self.layers.iter_mut().for_each(|layer| layer.listed = Listed::default());
    }
}

/// Surfaces in the order in which they are drawn: opaque ones, then those that one looks through, of each the inner first.
fn in_order(surfaces: &[Surface], view: &View) -> Vec<usize> {
    let mut order: Vec<usize> = (0..surfaces.len()).collect();
    let is_clear = |i: usize| surfaces[i].opacity_in(view) < 1.0;
    order.sort_by(|&i, &j| {
        let inner_first = surfaces[j].isovalue.total_cmp(&surfaces[i].isovalue);
        is_clear(i).cmp(&is_clear(j)).then(match is_clear(i) {
            true => inner_first,
            false => i.cmp(&j),
        })
    });
    order
}
