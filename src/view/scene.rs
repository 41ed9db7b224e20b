//! The scene: a spectrum, its painter, the shown isovalues, and the textures that the window shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use eframe::{egui, egui_wgpu, wgpu};
use glam::{DVec2, DVec3};

use super::camera_control::{first_hit, pixel_ray};
use super::curves::{Curves, MeshSource};
use super::file_chunks::FileChunks;
use super::loading::Loaded;
use super::numbers::{format_short, step_isovalue, step_size};
use super::picks::PickedComponents;
use super::pinned::{PinnedSurface, linear_of};
use crate::color::{ColorSources, to_srgb};
use crate::color_sources;
use crate::error::Result;
use crate::export::place_in_world;
use crate::file::SpectrumFile;
use crate::gpu::Gpu;
use crate::render::{Image, Painter, Surface, View, WINDOW_FORMAT};
use crate::spectrum::{Measures, Spectrum, event_persistence};
use crate::volume::{Histogram, Statistics, Volume};

/// A spectrum and how it is shown.
pub(super) struct Scene {
    pub(super) name: String,
    /// Of a large file, the loaded chunks: meshes are complete at the isovalues that `chunks` has.
    pub(super) spectrum: Arc<Spectrum>,
    /// Whether the spectrum was computed here and is in no file yet.
    pub(super) is_unsaved: bool,
    /// Whether this is the only isovalue of a volume whose spectrum is not there yet.
    pub(super) is_preview: bool,
    /// Of a large file, the loader of its chunks.
    chunks: Option<FileChunks>,
    /// A second field for colours.
    field: Option<Arc<Volume>>,
    pub(super) samples: Option<Histogram>,
    /// For isovalues given as percentiles.
    pub(super) statistics: Option<Statistics>,
    pub(super) curves: Curves,
    /// Isovalues of events, increasing, without duplicates.
    pub(super) events: Vec<f64>,
    /// The persistence of each event of the spectrum.
    persistence: Vec<f64>,
    pub(super) isovalue: f64,
    /// The last measures and their isovalue.
    measures: Option<(f64, Measures)>,
    /// The colour of the surface at `isovalue`, sRGB; `None` for the default.
    pub(super) color: Option<[u8; 3]>,
    /// Isosurfaces shown in addition to that at `isovalue`.
    pub(super) pinned: Vec<PinnedSurface>,
    pub(super) picks: PickedComponents,
    /// Offered isovalues and their names.
    pub(super) marks: Vec<(f64, String)>,
    /// Up to two points of the surface, to measure the distance between them, voxel frame.
    pub(super) measured: Vec<[f64; 3]>,
    pub(super) painter: Painter,
    /// The inputs of the picture in the painter's texture.
    painted: Option<(Vec<Surface>, View)>,
    texture: Option<RegisteredTexture>,
    /// The annotations over the picture, with their isovalue and view.
    annotations: Option<((f64, View), egui::TextureHandle)>,
    /// Nanoseconds the device took for the last picture.
    gpu_time: Arc<AtomicU64>,
}

/// The painter's texture, registered with egui.
struct RegisteredTexture {
    id: egui::TextureId,
    size: (u32, u32),
}

impl Scene {
    /// Uploads a spectrum.
    pub(super) fn new(
        gpu: &Gpu,
        loaded: Loaded,
        field: Option<Arc<Volume>>,
        window: &egui::Context,
    ) -> Result<Self> {
        let Loaded { name, spectrum, is_computed, is_preview, chunks, samples, statistics, .. } =
            loaded;
        let Loaded { volume, isovalue, .. } = loaded;
        let mut sources = ColorSources::default();
        if let Some(field) = &field {
            sources = sources.with_field(color_sources::field(&spectrum, field)?);
        }
        sources.distance = volume.map(color_sources::distance);
        let mut painter = Painter::new(gpu, &spectrum, u64::MAX)?;
        painter.set_sources(sources);
        let mut events: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
        events.sort_by(f64::total_cmp);
        events.dedup();
        Ok(Scene {
            name,
            // The curves of a file need all of its chunks, so they start on request.
            curves: if chunks.is_some() || is_preview {
                Curves::default()
            } else {
                Curves::start(MeshSource::of(&spectrum), window)
            },
            events,
            persistence: event_persistence(spectrum.events(), spectrum.volume(), spectrum.range()),
            is_unsaved: is_computed,
            is_preview,
            isovalue,
            measures: None,
            color: None,
            pinned: Vec::new(),
            picks: PickedComponents::default(),
            marks: Vec::new(),
            measured: Vec::new(),
            painter,
            samples,
            statistics,
            spectrum,
            chunks,
            field,
            painted: None,
            texture: None,
            annotations: None,
            gpu_time: Arc::default(),
        })
    }

    /// The file, if it is too large to be in memory as a whole.
    pub(super) fn file(&self) -> Option<&Arc<SpectrumFile>> {
        self.chunks.as_ref().map(FileChunks::file)
    }

    /// Whether chunks are being read.
    pub(super) fn is_reading(&self) -> bool {
        self.chunks.as_ref().is_some_and(FileChunks::is_reading)
    }

    /// Whether the chunks of an isovalue are loaded.
    fn has(&self, isovalue: f64) -> bool {
        self.chunks.as_ref().is_none_or(|chunks| chunks.has(&[isovalue]))
    }

    /// Starts computing the curves of a file, which reads all of it.
    pub(super) fn start_curves(&mut self, window: &egui::Context) {
        if let Some(file) = self.file() {
            self.curves = Curves::start(MeshSource::of_file(file), window);
        }
    }

    /// Takes chunks that a thread has read, and requests those that the shown isovalues need. Returns whether all are loaded.
    fn request_chunks(&mut self, window: &egui::Context) -> Result<bool> {
        let isovalues = self.isovalues();
        let Some(chunks) = &mut self.chunks else { return Ok(true) };
        if let Some(spectrum) = chunks.poll()? {
            self.set_spectrum(spectrum)?;
        }
        let Some(chunks) = &mut self.chunks else { return Ok(true) };
        chunks.request(&isovalues, window);
        Ok(chunks.has(&isovalues))
    }

    /// Reads the chunks that the shown isovalues need, and waits for them.
    ///
    /// # Errors
    ///
    /// Those of reading a file, and of the device.
    pub(super) fn read_chunks(&mut self) -> Result<()> {
        let isovalues = self.isovalues();
        let Some(chunks) = &mut self.chunks else { return Ok(()) };
        let spectrum = chunks.read_at(&isovalues)?;
        spectrum.map_or(Ok(()), |spectrum| self.set_spectrum(spectrum))
    }

    /// Replaces the spectrum after the loaded chunks have changed.
    fn set_spectrum(&mut self, spectrum: Arc<Spectrum>) -> Result<()> {
        self.painter.set_spectrum(&spectrum)?;
        if let Some(field) = &self.field {
            let sources = self.painter.sources().clone();
            let field = color_sources::partial_field(&spectrum, field);
            self.painter.set_sources(sources.with_field(field));
        }
        // The indices of vertices have changed.
        let last = self.picks.isovalue();
        let at = if self.has(last) { last } else { self.isovalue };
        self.picks.find_again(&mut self.painter, &spectrum, at)?;
        (self.spectrum, self.painted) = (spectrum, None);
        Ok(())
    }

    /// The shown isovalues.
    pub(super) fn isovalues(&self) -> Vec<f64> {
        self.surfaces().iter().map(|surface| surface.isovalue).collect()
    }

    /// The shown isosurfaces.
    pub(super) fn surfaces(&self) -> Vec<Surface> {
        let color = self.color.map(linear_of);
        let first = Surface { color, ..self.isovalue.into() };
        std::iter::once(first).chain(self.pinned.iter().map(PinnedSurface::surface)).collect()
    }

    /// Isovalues that are offered by name: the marks, or suggested ones once the curves are known.
    pub(super) fn offered_isovalues(&mut self) -> &[(f64, String)] {
        if self.marks.is_empty()
            && let Some(points) = self.curves.finished()
        {
            let areas: Vec<(f64, f64)> =
                points.iter().map(|p| (p.isovalue, p.measures.area)).collect();
            let suggested = self.spectrum.suggested(&areas, self.statistics.as_ref());
            self.marks = suggested.into_iter().map(|(c, name)| (c, name.to_owned())).collect();
        }
        &self.marks
    }

    /// Follows the picked components to the current isovalue, and sets them in the view.
    pub(super) fn update_picks(&mut self, view: &mut View) -> Result<()> {
        if !self.has(self.isovalue) {
            return Ok(());
        }
        self.picks.follow(&mut self.painter, &self.spectrum, self.isovalue)?;
        view.picked = self.picks.picked();
        Ok(())
    }

    /// Keeps only the component under a pixel, or hides it; returns whether there is one.
    pub(super) fn pick(&mut self, view: &View, pixel: DVec2, is_hiding: bool) -> Result<bool> {
        let Some(point) = self.point_under(view, pixel) else { return Ok(false) };
        let (painter, spectrum) = (&mut self.painter, &self.spectrum);
        self.picks.pick(painter, spectrum, self.isovalue, point.to_array(), is_hiding)?;
        Ok(true)
    }

    /// Shows the first of some isosurfaces, and pins the others.
    pub(super) fn show_surfaces(&mut self, surfaces: &[Surface]) -> Result<()> {
        surfaces.iter().try_for_each(|surface| self.spectrum.check_isovalue(surface.isovalue))?;
        if let Some((first, others)) = surfaces.split_first() {
            self.isovalue = first.isovalue;
            self.color = first.color.map(|color| color.map(to_srgb));
            let pinned = others.iter().enumerate().map(|(i, other)| PinnedSurface::new(i, other));
            self.pinned = pinned.collect();
        }
        Ok(())
    }

    /// Moves the isovalue by some steps; fine ones are a tenth.
    pub(super) fn step_by(&mut self, steps: f64, is_fine: bool) {
        let range = self.spectrum.range();
        let size = step_size(range);
        let size = if is_fine { 0.1 * size } else { size };
        self.isovalue = step_isovalue(self.isovalue, steps, size, range);
    }

    /// Measures of the closed mesh at the isovalue in the world; `None` until its chunks are loaded.
    pub(super) fn measures(&mut self) -> Option<Measures> {
        if !self.has(self.isovalue) {
            return None;
        }
        if self.measures.is_none_or(|(isovalue, _)| isovalue != self.isovalue) {
            let mesh = self.painter.mesh_at(&self.spectrum, self.isovalue).ok()?;
            let placed = place_in_world(mesh.clone(), &self.spectrum.volume().placement);
            self.measures = Some((self.isovalue, Measures::of(&placed)));
        }
        self.measures.map(|(_, measures)| measures)
    }

    /// The change of the largest persistence at an isovalue with its place in the world, and the number of others; none without an event.
    pub(super) fn event_in_words(&self, isovalue: f64) -> Option<String> {
        let (events, volume) = (self.spectrum.events(), self.spectrum.volume());
        let here = || (0..events.len()).filter(|&i| events[i].isovalue == isovalue);
        let first = here().max_by(|&i, &j| self.persistence[i].total_cmp(&self.persistence[j]))?;
        let place = volume.placement.world_of_voxel(events[first].position.map(|x| x as f32));
        let [x, y, z] = place.map(format_short);
        let change = events[first].kind.in_words(volume.outside);
        let more = match here().count() {
            1 => String::new(),
            n => format!("; {} more", n - 1),
        };
        Some(format!("{change} at {x}, {y}, {z}{more}"))
    }

    /// Number of triangles drawn.
    pub(super) fn n_triangles(&self) -> usize {
        (0..=self.pinned.len()).map(|i| self.painter.n_triangles(i)).sum()
    }

    /// The time of the device for the last picture, from its submission on.
    pub(super) fn gpu_time(&self) -> Duration {
        Duration::from_nanos(self.gpu_time.load(Ordering::Relaxed))
    }

    /// Paints if anything has changed and all chunks are loaded, and returns the texture. Its size is that of the view.
    pub(super) fn paint(
        &mut self,
        render_state: &egui_wgpu::RenderState,
        context: &egui::Context,
        view: &View,
    ) -> Result<egui::TextureId> {
        if let Some(RegisteredTexture { id, .. }) = self.texture
            && !self.request_chunks(context)?
        {
            return Ok(id);
        }
        let inputs = (self.surfaces(), view.clone());
        if self.painted.as_ref() != Some(&inputs) {
            let started = Instant::now();
            self.painted = None;
            self.painter.paint(&self.spectrum, &inputs.0, view)?;
            let gpu_time = self.gpu_time.clone();
            render_state.queue.on_submitted_work_done(move || {
                gpu_time.store(started.elapsed().as_nanos() as u64, Ordering::Relaxed);
            });
            self.painted = Some(inputs);
        }
        Ok(self.register_texture(render_state, (view.width, view.height)))
    }

    /// Paints a picture and reads it back.
    pub(super) fn picture(&mut self, view: &View) -> Result<Image> {
        self.read_chunks()?;
        self.painted = None;
        self.painter.paint(&self.spectrum, &self.surfaces(), view)?;
        self.painter.picture(&self.spectrum, view)
    }

    /// The annotations over the picture, the same as `render` draws; `None` if there are none.
    pub(super) fn annotations(
        &mut self,
        window: &egui::Context,
        view: &View,
    ) -> Option<egui::TextureId> {
        if !view.axes && self.painter.attribute().is_none() {
            self.annotations = None;
            return None;
        }
        let inputs = (self.isovalue, view.clone());
        if let Some((_, texture)) = self.annotations.as_ref().filter(|(last, _)| *last == inputs) {
            return Some(texture.id());
        }
        let pixels = vec![0; 4 * view.width as usize * view.height as usize];
        let mut image = Image { width: view.width, height: view.height, pixels };
        self.painter.annotate(&mut image, &self.spectrum, view);
        let size = [view.width, view.height].map(|n| n as usize);
        let image = egui::ColorImage::from_rgba_unmultiplied(size, &image.pixels);
        let texture = window.load_texture("annotations", image, egui::TextureOptions::NEAREST);
        let id = texture.id();
        self.annotations = Some((inputs, texture));
        Some(id)
    }

    /// Goes to the next isovalue with events, up or down, if there is one.
    pub(super) fn go_to_event(&mut self, is_up: bool) {
        let next = match is_up {
            true => self.events.iter().find(|&&c| c > self.isovalue),
            false => self.events.iter().rfind(|&&c| c < self.isovalue),
        };
        let (low, high) = self.spectrum.range();
        let next = next.copied().filter(|c| (low..=high).contains(c));
        self.isovalue = next.unwrap_or(self.isovalue);
    }

    /// Registers the painter's texture with egui; again when its size has changed, because it is then another texture.
    fn register_texture(
        &mut self,
        window: &egui_wgpu::RenderState,
        size: (u32, u32),
    ) -> egui::TextureId {
        if let Some(registered) = self.texture.as_ref().filter(|texture| texture.size == size) {
            return registered.id;
        }
        let Some(texture) = self.painter.texture() else { return egui::TextureId::default() };
        let view = texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(WINDOW_FORMAT),
            usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
            ..Default::default()
        });
        let nearest = wgpu::FilterMode::Nearest;
        let mut renderer = window.renderer.write();
        let id = match &self.texture {
            Some(RegisteredTexture { id, .. }) => {
                renderer.update_egui_texture_from_wgpu_texture(&window.device, &view, nearest, *id);
                *id
            }
            None => renderer.register_native_texture(&window.device, &view, nearest),
        };
        self.texture = Some(RegisteredTexture { id, size });
        id
    }

    /// The point of the surface under a pixel, voxel frame.
    pub(super) fn point_under(&self, view: &View, pixel: DVec2) -> Option<DVec3> {
        let spectrum = &self.spectrum;
        let triangles = self.surfaces().into_iter().enumerate().flat_map(|(i, surface)| {
            let isovalue = surface.isovalue;
            let rank = spectrum.rank_at(isovalue).unwrap_or(0);
            self.painter.triangles(i).map(move |vertices| {
                vertices.map(|v| {
                    let position = spectrum.vertex_at(v, rank, isovalue);
                    DVec3::from_array(position.map(f64::from))
                })
            })
        });
        let is_kept = |p: DVec3| {
            view.clip.is_none_or(|clip| DVec3::from_array(clip.normal).dot(p) <= clip.offset)
        };
        first_hit(pixel_ray(view, spectrum.volume(), pixel), triangles, is_kept)
    }

    /// Removes the texture from egui.
    pub(super) fn close(&mut self, window: &egui_wgpu::RenderState) {
        if let Some(RegisteredTexture { id, .. }) = self.texture.take() {
            window.renderer.write().free_texture(&id);
        }
    }
}
