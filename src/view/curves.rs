//! The contour spectrum: measures of the isosurface as functions of the isovalue (Bajaj, Pascucci, Schikore 1997, "The contour
//! spectrum").
//!
//! A thread computes them from the meshes at evenly spaced isovalues, so no volume is needed. The window shows the points
//! computed so far.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use eframe::egui;

use crate::error::Result;
use crate::export::place_in_world;
use crate::file::{FileQuery, SpectrumFile};
use crate::spectrum::{Measures, Mesh, Query, Spectrum};
use crate::volume::{Placement, between};

/// Number of isovalues of a curve: enough for the width of a small window.
const N_ISOVALUES: usize = 192;

/// One point of the curves: measures of the closed mesh in the world at an isovalue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) isovalue: f64,
    pub(super) measures: Measures,
}

/// The meshes of a spectrum or of a file.
#[derive(Debug)]
pub(super) struct MeshSource {
    query: MeshQuery,
    range: (f64, f64),
    placement: Placement,
}

#[derive(Debug)]
enum MeshQuery {
    Spectrum(Box<Query<Arc<Spectrum>>>),
    File(Box<FileQuery>),
}

impl MeshSource {
    /// The meshes of a spectrum.
    pub(super) fn of(spectrum: &Arc<Spectrum>) -> MeshSource {
        MeshSource {
            query: MeshQuery::Spectrum(Box::new(Query::new(spectrum.clone()))),
            range: spectrum.range(),
            placement: spectrum.volume().placement,
        }
    }

    /// The meshes of a file.
    pub(super) fn of_file(file: &Arc<SpectrumFile>) -> MeshSource {
        let query = FileQuery::new(file.clone());
        MeshSource {
            query: MeshQuery::File(Box::new(query)),
            range: file.description().range(),
            placement: file.description().volume().placement,
        }
    }

    fn mesh_at_into(&mut self, isovalue: f64, mesh: &mut Mesh) -> Result<()> {
        match &mut self.query {
            MeshQuery::Spectrum(query) => query.mesh_at_into(isovalue, mesh),
            MeshQuery::File(query) => query.mesh_at_into(isovalue, mesh),
        }
    }
}

/// The curves computed so far. Dropping this ends the thread.
#[derive(Debug, Default)]
pub(super) struct Curves {
    points: Arc<Mutex<Vec<Point>>>,
    is_started: bool,
    stop: Arc<AtomicBool>,
    is_finished: Arc<AtomicBool>,
}

impl Curves {
    /// Starts the thread.
    pub(super) fn start(mut meshes: MeshSource, window: &egui::Context) -> Self {
        let (points, stop, is_finished) = (Arc::default(), Arc::default(), Arc::default());
        let curves = Curves { points, is_started: true, stop, is_finished };
        let (points, stop) = (curves.points.clone(), curves.stop.clone());
        let (is_finished, window) = (curves.is_finished.clone(), window.clone());
        thread::spawn(move || {
            let mut mesh = Mesh::default();
            for i in 0..N_ISOVALUES {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let isovalue = between(meshes.range, (i as f64 + 0.5) / N_ISOVALUES as f64);
                if meshes.mesh_at_into(isovalue, &mut mesh).is_err() {
                    continue;
                }
                let placed = place_in_world(mesh.clone(), &meshes.placement);
                let point = Point { isovalue, measures: Measures::of(&placed) };
                points.lock().unwrap_or_else(PoisonError::into_inner).push(point);
                window.request_repaint();
            }
            is_finished.store(true, Ordering::Release);
            window.request_repaint();
        });
        curves
    }

    /// Whether a thread was started.
    pub(super) fn is_started(&self) -> bool {
        self.is_started
    }

    /// All points, once the thread has finished.
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
