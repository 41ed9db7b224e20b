//! The window: an interactive view of a spectrum, `isospectrum view` (feature `viewer`).
//!
//! The [`Painter`](crate::render::Painter) of the module `render` draws into a texture with one texel per pixel of the window,
//! and the window shows the bytes of that texture: the same picture that `render` writes. It is drawn again only if something
//! changes. Moving the camera costs drawing the triangles, changing the isovalue also the list of active triangles. Neither
//! depends on the size of the volume or visits all triangles of the spectrum.
//!
//! Work that takes longer than a frame (reading, computing, the curves over the isovalue) runs in threads that end with their
//! scene.
//!
//! Of a large file only the chunks are read that the shown isovalues need (`file_chunks`); meanwhile the last picture
//! stays. The curves need all chunks, so they are computed on request.

mod actions;
mod camera_control;
mod closing;
mod compute_dialog;
mod computing;
mod controls;
mod cost;
mod cube;
mod curves;
mod file_chunks;
mod file_dialog;
mod fit;
mod history;
mod isovalue_bar;
mod loading;
mod numbers;
mod open_spectra;
mod opening;
mod options;
mod perform;
mod picks;
mod picture;
mod pinned;
mod plot;
mod pointer;
mod pointing;
mod preview;
mod save;
mod scene;
mod start_screen;
mod window;

use std::sync::{Arc, Mutex, PoisonError};

pub use file_chunks::MAX_TRIANGLES;
pub use opening::{Content, Opening};

use crate::error::{Error, Result};
use crate::gpu::Gpu;

/// Opens a window and returns when it is closed.
///
/// # Errors
///
/// [`Error::Gpu`] if there is no adapter, no display, or the device is lost; [`Error::Range`] if an isovalue is outside of the
/// range.
pub fn run(opening: Opening) -> Result<()> {
    let gpu = Arc::new(Gpu::new(opening.adapter.as_deref())?);
    let failure = Arc::new(Mutex::new(None));
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
    let window_failure = failure.clone();
    let result = eframe::run_native(
        "isospectrum",
        options,
        Box::new(move |creation| {
            Ok(Box::new(window::Window::new(creation, gpu, opening, window_failure)?))
        }),
    );
    if let Some(error) = failure.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(error);
    }
    result.map_err(|error| match error {
        eframe::Error::AppCreation(error) => match error.downcast::<Error>() {
            Ok(error) => *error,
            Err(error) => Error::Gpu(format!("no window: {error}")),
        },
        other => Error::Gpu(format!("no window: {}", other.to_string().replace('\n', " "))),
    })
}
