//! Offscreen rendering of a spectrum.
//!
//! No mesh is extracted for a picture: the trajectories are in storage buffers, and the vertex shader interpolates each vertex
//! at the isovalue (thesis section 4.3). Only the list of active triangles changes with the isovalue. The window uses the same
//! pipeline.
//!
//! # Use
//!
//! A [`Renderer`] keeps its pipelines and buffers and draws any number of pictures; a [`View`] describes a picture;
//! [`Image::write_png`] writes the result.
//!
//! ```no_run
//! # fn draw(spectrum: &isospectrum::spectrum::Spectrum) -> isospectrum::Result<()> {
//! use isospectrum::render::{Color, Gpu, Renderer, View};
//!
//! let gpu = Gpu::new(None)?;
//! let mut renderer = Renderer::new(&gpu, spectrum)?;
//! let view = View::default().with_color(Color::Quality).with_wireframe(1.0);
//! renderer.draw(0.5, &view)?.write_png("half.png".as_ref())?;
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "annotations")]
mod annotate;
mod axis;
mod background;
mod box_edges;
mod camera;
mod depth_order;
mod image;
mod layer;
mod light;
mod occlusion;
mod painter;
mod passes;
mod pipeline;
mod projection;
mod renderer;
mod shader_types;
mod storage_buffer;
mod style;
mod tables;
mod target;
mod uniforms;
mod view;

pub use crate::color::{Color, Map, ScaleEnds, linear};
pub use crate::gpu::Gpu;
pub use axis::Axis;
pub use background::Background;
pub use camera::{BORDER, Camera, FIELD_OF_VIEW, FILL};
pub use image::Image;
pub use light::Light;
pub use painter::Painter;
pub use renderer::{RESIDENT_BYTES, Renderer};
pub use style::{Style, StyleValues};
pub use tables::Memory;
#[cfg(feature = "viewer")]
pub(crate) use target::WINDOW_FORMAT;
pub use uniforms::plain_color;
pub use view::{Clip, Surface, View, reveal_inner};
