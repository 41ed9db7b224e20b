//! The contour spectrum of a spectrum's own meshes: what the isosurface is like over the isovalue.
//!
//! Found by a thread from the meshes at evenly spaced isovalues, so no volume is needed; drawn as
//! far as it has come. (Bajaj, Pascucci, Schikore 1997, "The contour spectrum".)

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use eframe::egui;

use crate::export::place_in_world;
use crate::spectrum::{Measures, Query, Spectrum, SurfaceMesh};

/// Isovalues along a curve: as many as one can tell apart across a small window.
const N_ISOVALUES: usize = 192;

/// One point of the curves: what the closed mesh is like in the world at an isovalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) isovalue: f64,
    pub(super) measures: Measures,
}

/// The curves, as far as they are known. The thread ends when this goes.
#[derive(Debug)]
pub(super) struct Curves {
    points: Arc<Mutex<Vec<Point>>>,
    stop: Arc<AtomicBool>,
    is_finished: Arc<AtomicBool>,
}

impl Curves {
    /// Starts the thread.
    pub(super) fn start(spectrum: &Arc<Spectrum>, window: &egui::Context) -> Self {
        let curves =
            Curves { points: Arc::default(), stop: Arc::default(), is_finished: Arc::default() };
        let (points, stop) = (curves.points.clone(), curves.stop.clone());
        let is_finished = curves.is_finished.clone();
        let (spectrum, window) = (spectrum.clone(), window.clone());
        thread::spawn(move || {
            let (low, high) = spectrum.range();
            let mut query = Query::new(&*spectrum);
            let mut mesh = SurfaceMesh::default();
            for i in 0..N_ISOVALUES {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let share = (i as f64 + 0.5) / N_ISOVALUES as f64;
                let isovalue = low * (1.0 - share) + high * share;
                if query.mesh_at_into(isovalue, &mut mesh).is_err() {
                    continue;
                }
                let placed = place_in_world(mesh.clone(), &spectrum.volume().placement);
                let point = Point { isovalue, measures: Measures::of(&placed) };
                points.lock().unwrap_or_else(PoisonError::into_inner).push(point);
                window.request_repaint();
            }
            is_finished.store(true, Ordering::Release);
            window.request_repaint();
        });
        curves
    }

    /// All points, once they are known.
    pub(super) fn finished(&self) -> Option<Vec<Point>> {
        self.is_finished.load(Ordering::Acquire).then(|| self.points())
    }

    /// The points so far, by isovalue.
    pub(super) fn points(&self) -> Vec<Point> {
        self.points.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Curves {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}
