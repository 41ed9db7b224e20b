//! The pictures of a series: what each shows.

use super::pictures::Series;
use crate::error::{Error, Result};
use crate::progress::Progress;
use crate::render::{Renderer, Surface, View};
use std::path::Path;

/// Maximum number of frames of a sweep or a turntable: an hour of film.
pub const MAX_FRAMES: u32 = 100_000;

/// `n` evenly spaced isovalues, both ends included; `from` may be above `to`.
pub fn evenly_spaced(from: f64, to: f64, n: u32) -> Vec<f64> {
    let last = f64::from(n.max(2) - 1);
    // A weighted mean meets both ends exactly.
    let at = |i: u32| {
        let t = f64::from(i) / last;
        (from * (1.0 - t) + to * t).clamp(from.min(to), from.max(to))
    };
    (0..n).map(at).collect()
}

/// The surfaces and the view of each picture of a series.
#[derive(Clone, Debug)]
pub struct Frames(Vec<(Vec<Surface>, View)>);

impl Frames {
    /// Pictures of one isosurface each, all with the camera of `view`, which is fitted to all of them if `is_fitted`. `label`
    /// is the text at the top of the picture of an isovalue.
    ///
    /// # Errors
    ///
    /// [`Error::Range`].
    pub fn sweep(
        renderer: &mut Renderer<'_>,
        mut view: View,
        isovalues: &[f64],
        is_fitted: bool,
        label: &dyn Fn(f64) -> Option<String>,
    ) -> Result<Self> {
        if is_fitted && let Some(bounds) = renderer.bounds(isovalues, &view.keep)? {
            view.fit(renderer.volume(), bounds);
        }
        let frame = |&c: &f64| (vec![Surface::from(c)], view.clone().with_label(label(c)));
        Ok(Frames(isovalues.iter().map(frame).collect()))
    }

    /// `n` pictures of the same surfaces from all around the vertical axis, all of one scale: that at which the surfaces, or
    /// the volume unless `is_fitted`, fill the picture.
    ///
    /// # Errors
    ///
    /// [`Error::Range`].
    pub fn turntable(
        renderer: &mut Renderer<'_>,
        view: &View,
        surfaces: &[Surface],
        is_fitted: bool,
        n: u32,
    ) -> Result<Self> {
        let isovalues: Vec<f64> = surfaces.iter().map(|surface| surface.isovalue).collect();
        let bounds = if is_fitted { renderer.bounds(&isovalues, &view.keep)? } else { None };
        let views = view.turntable(renderer.volume(), bounds, n);
        Ok(Frames(views.into_iter().map(|view| (surfaces.to_vec(), view)).collect()))
    }

    /// Renders all pictures. Each file appears when it is complete; `inputs` are files that must not be replaced.
    ///
    /// # Errors
    ///
    /// Those of [`Renderer::draw_all`]; [`Error::Io`]; [`Error::Usage`] if an output is an input; [`Error::Interrupted`].
    pub fn write(
        &self,
        renderer: &mut Renderer<'_>,
        series: &Series,
        inputs: &[&Path],
        progress: &dyn Progress,
    ) -> Result<()> {
        let n = self.0.len();
        let mut written = series.open(n as u32, inputs)?;
        for (i, (surfaces, view)) in self.0.iter().enumerate() {
            if progress.cancelled() {
                return Err(Error::Interrupted);
            }
            progress.report(i as f64 / n as f64, "rendering");
            written.add(&renderer.draw_all(surfaces, view)?, progress)?;
        }
        progress.report(1.0, "encoding");
        written.finish(progress)
    }
}
