//! What is seen: a spectrum, its painter, the isovalues, and the texture that the window shows.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use eframe::{egui, egui_wgpu, wgpu};
use glam::{DVec2, DVec3};

use super::curves::{Curves, Meshes};
use super::hand;
use super::held::Held;
use super::layers::{Layer, linear_of};
use super::loading::Loaded;
use super::picks::Picks;
use super::typed;
use crate::color::{Sources, to_srgb};
use crate::error::Result;
use crate::export::place_in_world;
use crate::file::SpectrumFolder;
use crate::gpu::Gpu;
use crate::render::{Image, Painter, SHOWN_FORMAT, Surface, View};
use crate::sources;
use crate::spectrum::{Measures, Spectrum};
use crate::volume::{Histogram, Statistics, Volume};

/// A spectrum on the screen.
pub(super) struct Scene {
    pub(super) name: String,
    /// Of a folder of parts, what is there of it: its meshes are the whole's at the isovalues that `held` has.
    pub(super) spectrum: Arc<Spectrum>,
    /// Of a folder of parts, what is read of it.
    held: Option<Held>,
    /// A second field that colours can show.
    field: Option<Arc<Volume>>,
    pub(super) samples: Option<Histogram>,
    /// What isovalues may be written by.
    pub(super) statistics: Option<Statistics>,
    pub(super) curves: Curves,
    /// Isovalues of events, increasing, each once.
    pub(super) events: Vec<f64>,
    pub(super) isovalue: f64,
    /// The isovalue of the last numbers, and those.
    measures: Option<(f64, Measures)>,
    /// The colour of its surface where it is not the usual one, sRGB.
    pub(super) front: Option<[u8; 3]>,
    /// Isosurfaces that stay beside it.
    pub(super) layers: Vec<Layer>,
    /// Components that were picked.
    pub(super) picks: Picks,
    /// Isovalues that are offered, and what they are.
    pub(super) marks: Vec<(f64, String)>,
    /// Points of the surface between which the distance is told, voxel frame.
    pub(super) measured: Vec<[f64; 3]>,
    pub(super) painter: Painter,
    painted: Option<(Vec<Surface>, View)>,
    texture: Option<Shown>,
    /// What is written over the picture, and of which isovalue and view.
    sheet: Option<((f64, View), egui::TextureHandle)>,
    /// Nanoseconds the device took for the last picture.
    cost: Arc<AtomicU64>,
}

/// The painter's texture as the window knows it.
struct Shown {
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
        let Loaded { name, spectrum, held, samples, statistics, volume, isovalue } = loaded;
        let mut sources = Sources::default();
        if let Some(field) = &field {
            sources = sources.with_field(sources::field(&spectrum, field)?);
        }
        sources.distance = volume.map(sources::distance);
        let mut painter = Painter::new(gpu, &spectrum, u64::MAX)?;
        painter.set_sources(sources);
        let mut events: Vec<f64> = spectrum.events().iter().map(|e| e.isovalue).collect();
        events.sort_by(f64::total_cmp);
        events.dedup();
        Ok(Scene {
            name,
            // Of a folder they need all that the window does not read.
            curves: if held.is_some() {
                Curves::default()
            } else {
                Curves::start(Meshes::of(&spectrum), window)
            },
            events,
            isovalue,
            measures: None,
            front: None,
            layers: Vec::new(),
            picks: Picks::default(),
            marks: Vec::new(),
            measured: Vec::new(),
            painter,
            samples,
            statistics,
            spectrum,
            held,
            field,
            painted: None,
            texture: None,
            sheet: None,
            cost: Arc::default(),
        })
    }

    /// The folder of parts that this is of.
    pub(super) fn folder(&self) -> Option<&SpectrumFolder> {
        self.held.as_ref().map(Held::folder)
    }

    /// Whether chunks are being read.
    pub(super) fn is_reading(&self) -> bool {
        self.held.as_ref().is_some_and(Held::is_reading)
    }

    /// Starts the curves of a folder, all of which is read for them.
    ///
    /// # Errors
    ///
    /// [`Error::Input`](crate::Error::Input) if what is known of the whole passes no check.
    pub(super) fn start_curves(&mut self, window: &egui::Context) -> Result<()> {
        if let Some(folder) = self.folder() {
            self.curves = Curves::start(Meshes::of_folder(folder)?, window);
        }
        Ok(())
    }

    /// Takes in what a thread has read. Asks for what the isovalues shown need; whether that is there.
    fn ask(&mut self, window: &egui::Context) -> Result<bool> {
        let isovalues = self.isovalues();
        let Some(held) = &mut self.held else { return Ok(true) };
        if let Some(spectrum) = held.poll()? {
            self.replace(spectrum)?;
        }
        let Some(held) = &mut self.held else { return Ok(true) };
        held.ask(&isovalues, window);
        Ok(held.has(&isovalues))
    }

    /// Reads what the isovalues shown need.
    ///
    /// # Errors
    ///
    /// Those of a folder of parts, and of the device.
    fn read(&mut self) -> Result<()> {
        let isovalues = self.isovalues();
        let Some(held) = &mut self.held else { return Ok(()) };
        let read = held.read_at(&isovalues)?;
        read.map_or(Ok(()), |spectrum| self.replace(spectrum))
    }

    /// Shows another part of a folder.
    fn replace(&mut self, spectrum: Arc<Spectrum>) -> Result<()> {
        self.painter.replace(&spectrum)?;
        if let Some(field) = &self.field {
            let sources = self.painter.sources().clone();
            self.painter.set_sources(sources.with_field(sources::values(&spectrum, field)));
        }
        // Its vertices have other numbers.
        let last = self.picks.isovalue();
        let has_last = self.held.as_ref().is_some_and(|held| held.has(&[last]));
        let at = if has_last { last } else { self.isovalue };
        self.picks.find_again(&mut self.painter, &spectrum, at)?;
        (self.spectrum, self.painted) = (spectrum, None);
        Ok(())
    }

    /// The isovalues shown.
    pub(super) fn isovalues(&self) -> Vec<f64> {
        self.surfaces().iter().map(|surface| surface.isovalue).collect()
    }

    /// The isosurfaces shown.
    pub(super) fn surfaces(&self) -> Vec<Surface> {
        let color = self.front.map(linear_of);
        let first = Surface { color, ..self.isovalue.into() };
        std::iter::once(first).chain(self.layers.iter().map(Layer::surface)).collect()
    }

    /// Isovalues that are offered by name: those that were marked, else suggested ones once the curves are known.
    pub(super) fn offered(&mut self) -> &[(f64, String)] {
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

    /// Takes over into the view which components were picked, wherever they are by now.
    pub(super) fn follow(&mut self, view: &mut View) -> Result<()> {
        if self.held.as_ref().is_some_and(|held| !held.has(&[self.isovalue])) {
            return Ok(());
        }
        self.picks.follow(&mut self.painter, &self.spectrum, self.isovalue)?;
        view.picked = self.picks.picked();
        Ok(())
    }

    /// Keeps the component under a pixel alone, or hides it; whether there is one.
    pub(super) fn pick(&mut self, view: &View, pixel: DVec2, is_hiding: bool) -> Result<bool> {
        let Some(point) = self.point_under(view, pixel) else { return Ok(false) };
        let at = (self.isovalue, point.to_array());
        self.picks.pick(&mut self.painter, &self.spectrum, at, is_hiding)?;
        Ok(true)
    }

    /// Shows the first of some isosurfaces, and the others beside it.
    pub(super) fn show_surfaces(&mut self, surfaces: &[Surface]) -> Result<()> {
        surfaces.iter().try_for_each(|one| self.spectrum.check_isovalue(one.isovalue))?;
        if let Some((first, others)) = surfaces.split_first() {
            self.isovalue = first.isovalue;
            self.front = first.color.map(|color| color.map(to_srgb));
            self.layers = others.iter().enumerate().map(|(i, one)| Layer::told(i, one)).collect();
        }
        Ok(())
    }

    /// How far one notch or key goes.
    pub(super) fn step(&self) -> f64 {
        typed::step(self.spectrum.range())
    }

    /// Steps through the isovalues.
    pub(super) fn step_by(&mut self, notches: f64, is_fine: bool) {
        let step = if is_fine { 0.1 * self.step() } else { self.step() };
        self.isovalue = typed::stepped(self.isovalue, notches, step, self.spectrum.range());
    }

    /// What the closed mesh at the isovalue, which is drawn, is like in the world.
    pub(super) fn measures(&mut self) -> Option<Measures> {
        if self.held.as_ref().is_some_and(|held| !held.has(&[self.isovalue])) {
            return None;
        }
        if self.measures.is_none_or(|(isovalue, _)| isovalue != self.isovalue) {
            let mesh = self.painter.mesh_at(&self.spectrum, self.isovalue).ok()?;
            let placed = place_in_world(mesh.clone(), &self.spectrum.volume().placement);
            self.measures = Some((self.isovalue, Measures::of(&placed)));
        }
        self.measures.map(|(_, measures)| measures)
    }

    /// Makes the picture fit the surface, if there is any.
    pub(super) fn fit(&mut self, view: &mut View) -> Result<()> {
        self.read()?;
        let mesh = self.painter.mesh_at(&self.spectrum, self.isovalue)?;
        if let Some(bounds) = mesh.with_shown(&view.keep, &view.picked).bounds() {
            view.fit(self.spectrum.volume(), bounds);
        }
        Ok(())
    }

    /// Triangles drawn.
    pub(super) fn n_triangles(&self) -> usize {
        (0..=self.layers.len()).map(|i| self.painter.n_triangles(i)).sum()
    }

    /// How long the device took for the last picture, from its submission on.
    pub(super) fn cost(&self) -> Duration {
        Duration::from_nanos(self.cost.load(Ordering::Relaxed))
    }

    /// Paints, if anything has changed and all is there, and returns the texture. Its size is that of the view.
    pub(super) fn paint(
        &mut self,
        window: (&egui_wgpu::RenderState, &egui::Context),
        view: &View,
    ) -> Result<egui::TextureId> {
        let (window, context) = window;
        if let Some(Shown { id, .. }) = self.texture
            && !self.ask(context)?
        {
            return Ok(id);
        }
        let wanted = (self.surfaces(), view.clone());
        if self.painted.as_ref() != Some(&wanted) {
            let started = Instant::now();
            self.painted = None;
            self.painter.paint(&self.spectrum, &wanted.0, view)?;
            let cost = self.cost.clone();
            window.queue.on_submitted_work_done(move || {
                cost.store(started.elapsed().as_nanos() as u64, Ordering::Relaxed);
            });
            self.painted = Some(wanted);
        }
        Ok(self.shown(window, (view.width, view.height)))
    }

    /// Paints and takes the picture.
    pub(super) fn picture(&mut self, view: &View) -> Result<Image> {
        self.read()?;
        self.painted = None;
        self.painter.paint(&self.spectrum, &self.surfaces(), view)?;
        self.painter.picture(&self.spectrum, view)
    }

    /// What is written over the picture, if anything is: as `render` writes it.
    pub(super) fn written(
        &mut self,
        window: &egui::Context,
        view: &View,
    ) -> Option<egui::TextureId> {
        if !view.axes && self.painter.attribute().is_none() {
            self.sheet = None;
            return None;
        }
        let wanted = (self.isovalue, view.clone());
        if let Some((_, sheet)) = self.sheet.as_ref().filter(|(shown, _)| *shown == wanted) {
            return Some(sheet.id());
        }
        let pixels = vec![0; 4 * view.width as usize * view.height as usize];
        let mut image = Image { width: view.width, height: view.height, pixels };
        self.painter.write_on(&mut image, &self.spectrum, view);
        let size = [view.width, view.height].map(|n| n as usize);
        let sheet = egui::ColorImage::from_rgba_unmultiplied(size, &image.pixels);
        let sheet = window.load_texture("sheet", sheet, egui::TextureOptions::NEAREST);
        let id = sheet.id();
        self.sheet = Some((wanted, sheet));
        Some(id)
    }

    /// Goes to the next isovalue with events, up or down; whether there is one.
    pub(super) fn next_event(&mut self, is_up: bool) -> bool {
        let next = match is_up {
            true => self.events.iter().find(|&&c| c > self.isovalue),
            false => self.events.iter().rfind(|&&c| c < self.isovalue),
        };
        let (low, high) = self.spectrum.range();
        let next = next.copied().filter(|c| (low..=high).contains(c));
        self.isovalue = next.unwrap_or(self.isovalue);
        next.is_some()
    }

    /// The painter's texture, known to the window; a picture of another size is another texture.
    fn shown(&mut self, window: &egui_wgpu::RenderState, size: (u32, u32)) -> egui::TextureId {
        if let Some(shown) = self.texture.as_ref().filter(|shown| shown.size == size) {
            return shown.id;
        }
        let Some(texture) = self.painter.texture() else { return egui::TextureId::default() };
        let bytes = texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(SHOWN_FORMAT),
            usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
            ..Default::default()
        });
        let nearest = wgpu::FilterMode::Nearest;
        let mut renderer = window.renderer.write();
        let id = match &self.texture {
            Some(Shown { id, .. }) => {
                renderer.update_egui_texture_from_wgpu_texture(
                    &window.device,
                    &bytes,
                    nearest,
                    *id,
                );
                *id
            }
            None => renderer.register_native_texture(&window.device, &bytes, nearest),
        };
        self.texture = Some(Shown { id, size });
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
        hand::first_hit(hand::ray(view, spectrum.volume(), pixel), triangles, is_kept)
    }

    /// Takes the texture back from the window.
    pub(super) fn close(&mut self, window: &egui_wgpu::RenderState) {
        if let Some(Shown { id, .. }) = self.texture.take() {
            window.renderer.write().free_texture(&id);
        }
    }
}
