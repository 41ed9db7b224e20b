//! The window: a spectrum in the hand, `isospectrum view` (feature `viewer`).
//!
//! The surface is drawn by the [`Painter`](crate::render::Painter) that `render` uses, into a texture
//! of as many pixels as its part of the window has, and the window shows that texture byte for byte:
//! what is seen is what `render` writes. It is drawn anew only when something of it changes; then a
//! turn of the camera costs the triangles that are drawn, and a move of the isovalue in addition the
//! list of the living ones. Nothing depends on the size of the volume, or looks at all triangles.
//!
//! What takes longer than a frame runs in a thread of its own and ends when its scene goes: reading
//! and computing, the curves over the isovalue.
//!
//! Of a folder of parts those chunks are read that what is shown needs (`held`); until they are there the picture stays as it was.
//! What asks for all of them, the curves, is computed when it is asked for.

mod act;
mod actions;
mod chooser;
mod cube;
mod curves;
mod empty;
mod hand;
mod held;
mod history;
mod layers;
mod loading;
mod opened;
mod options;
mod picks;
mod picture;
mod plot;
mod pointing;
mod rows;
mod save;
mod scene;
mod typed;
mod window;

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::{Error, Result};
use crate::file::SpectrumFolder;
use crate::gpu::Gpu;
use crate::render::{Surface, View};
use crate::spectrum::Spectrum;
use crate::sweep::Parameters;
use crate::volume::Volume;

/// What a window shows at first.
#[derive(Debug, Default)]
pub enum Content {
    /// Nothing: files are dropped on it.
    #[default]
    Nothing,
    /// A spectrum and the name to show.
    Spectrum(String, Box<Spectrum>),
    /// A folder of parts and the name to show. No more is read of it than what is shown needs.
    Folder(String, Box<SpectrumFolder>),
    /// A volume, whose spectrum is computed in the window.
    Volume(Box<Volume>),
}

/// How a window opens.
#[derive(Debug, Default)]
pub struct Opening {
    /// What it shows.
    pub content: Content,
    /// The volume of the spectrum: its samples are shown behind the curves, and `p99` can be typed.
    pub volume: Option<Volume>,
    /// A second field that colours can show.
    pub field: Option<Volume>,
    /// The first isosurface, and others that stay beside it; without any that of [`Spectrum::shown_first`], or of the folder.
    pub surfaces: Vec<Surface>,
    /// Isovalues that are offered by name; without any some are suggested.
    pub marks: Vec<(f64, String)>,
    /// How the surface looks; the width and height are those of the window, points.
    pub view: View,
    /// Parameters of spectra that are computed in the window.
    pub parameters: Parameters,
    /// A part of the name of the adapter.
    pub adapter: Option<String>,
    /// Where pictures and meshes go.
    pub folder: PathBuf,
}

/// Opens a window and returns when it is closed.
///
/// # Errors
///
/// [`Error::Gpu`] if there is no adapter, no display, or the device is lost; [`Error::Range`] if
/// an isovalue lies outside the range.
pub fn run(opening: Opening) -> Result<()> {
    let gpu = Arc::new(Gpu::new(opening.adapter.as_deref())?);
    let failure = Arc::new(Mutex::new(None));
    let keep = failure.clone();
    let mut options = eframe::NativeOptions {
        viewport: eframe::egui::ViewportBuilder::default()
            .with_app_id("isospectrum")
            .with_inner_size([opening.view.width as f32, opening.view.height as f32])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        centered: true,
        ..Default::default()
    };
    options.wgpu_options.wgpu_setup =
        eframe::egui_wgpu::WgpuSetup::Existing(eframe::egui_wgpu::WgpuSetupExisting {
            instance: gpu.instance().clone(),
            adapter: gpu.adapter().clone(),
            device: gpu.device().clone(),
            queue: gpu.queue().clone(),
        });
    let opened = gpu.clone();
    let run = eframe::run_native(
        "isospectrum",
        options,
        Box::new(move |creation| {
            Ok(Box::new(window::Window::new(creation, opened, opening, keep)?))
        }),
    );
    if let Some(error) = failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(error);
    }
    run.map_err(|error| match error {
        eframe::Error::AppCreation(error) => match error.downcast::<Error>() {
            Ok(error) => *error,
            Err(error) => Error::Gpu(format!("no window: {error}")),
        },
        other => Error::Gpu(format!("no window: {}", other.to_string().replace('\n', " "))),
    })
}
