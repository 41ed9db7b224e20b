//! The still picture of a page.

use super::options::Page;
use crate::color::ColorSources;
use crate::error::Result;
use crate::render::{Background, Gpu, Image, Renderer, Surface, View};
use crate::spectrum::Spectrum;

/// Width and height of the picture, pixels.
const SIZE: (u32, u32) = (640, 480);

/// Renders the picture that a page shows at first, for browsers that cannot draw it ([`Page::still`]). `first` is the isosurface of the slider.
///
/// # Errors
///
/// As [`Renderer::draw_all`].
pub fn still(gpu: &Gpu, spectrum: &Spectrum, page: &Page<'_>, first: Surface) -> Result<Image> {
    let look = &page.look;
    // The page can be light or dark, so the background is transparent.
    let mut view = View::default()
        .with_width(SIZE.0)
        .with_height(SIZE.1)
        .with_open(page.open)
        .with_keep(page.keep)
        .with_camera(page.camera)
        .with_background(Background::Transparent)
        .with_color(page.color)
        .with_map(page.map)
        .with_ends(page.ends)
        .with_light(look.light)
        .with_clip(look.clip)
        .with_occlusion(look.occlusion.unwrap_or(false))
        .with_front(look.front)
        .with_wireframe(look.wireframe.then_some(1.0))
        .with_silhouette(look.silhouette)
        .with_opacity(look.opacity);
    let mut renderer = Renderer::new(gpu, spectrum)?;
    renderer.set_sources(page.field.cloned().unwrap_or_else(ColorSources::default));
    let surfaces: Vec<Surface> = std::iter::once(first).chain(look.also.iter().copied()).collect();
    let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
    if let Some(bounds) = renderer.bounds(&isovalues, &view.keep)? {
        view.fit(spectrum.volume(), bounds);
    }
    renderer.draw_all(&surfaces, &view)
}
