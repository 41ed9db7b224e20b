//! The contour spectrum of a spectrum's own meshes: what the isosurface is like over the isovalue.
//!
//! Found by a thread from the meshes at evenly spaced isovalues, so no volume is needed; drawn as
//! far as it has come. (Bajaj, Pascucci, Schikore 1997, "The contour spectrum".)

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use eframe::egui;

use crate::export::place_in_world;
use crate::spectrum::{Query, Spectrum, SurfaceMesh};

/// Isovalues along a curve: as many as one can tell apart across a small window.
const N_ISOVALUES: usize = 192;

/// One point of the curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) isovalue: f64,
    /// Components of the closed mesh.
    pub(super) n_components: u32,
    /// Its Euler characteristic.
    pub(super) euler: i64,
    /// Area without caps, world units.
    pub(super) area: f64,
    /// Enclosed volume, caps included, world units.
    pub(super) volume: f64,
}

/// The curves, as far as they are known. The thread ends when this goes.
#[derive(Debug)]
pub(super) struct Curves {
    points: Arc<Mutex<Vec<Point>>>,
    stop: Arc<AtomicBool>,
}

impl Curves {
    /// Starts the thread.
    pub(super) fn start(spectrum: &Arc<Spectrum>, window: &egui::Context) -> Self {
        let curves = Curves { points: Arc::default(), stop: Arc::default() };
        let (points, stop) = (curves.points.clone(), curves.stop.clone());
        let (spectrum, window) = (spectrum.clone(), window.clone());
        thread::spawn(move || {
            let (low, high) = spectrum.range;
            let mut query = Query::new(&spectrum);
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
                let placed = place_in_world(mesh.clone(), &spectrum.volume.placement);
                let point = measure(isovalue, &placed);
                points.lock().unwrap_or_else(PoisonError::into_inner).push(point);
                window.request_repaint();
            }
        });
        curves
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

/// What a closed mesh in the world is like.
fn measure(isovalue: f64, mesh: &SurfaceMesh) -> Point {
    let corner = |v: u32| glam::DVec3::from_array(mesh.positions[v as usize].map(f64::from));
    let origin = mesh.positions.first().map_or(glam::DVec3::ZERO, |_| corner(0));
    let (mut area, mut volume) = (0.0, 0.0);
    let mut parents: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    let mut n_components = parents.len() as u32;
    for (&[a, b, c], &cap) in mesh.triangles.iter().zip(&mesh.caps) {
        let (p, q, r) = (corner(a) - origin, corner(b) - origin, corner(c) - origin);
        if !cap {
            area += 0.5 * (q - p).cross(r - p).length();
        }
        volume += p.dot(q.cross(r)) / 6.0;
        for other in [b, c] {
            let (x, y) = (root(&mut parents, a), root(&mut parents, other));
            if x != y {
                parents[x.max(y) as usize] = x.min(y);
                n_components -= 1;
            }
        }
    }
    // Every edge of a closed mesh has two triangles.
    let n_edges = 3 * mesh.triangles.len() as i64 / 2;
    let euler = mesh.positions.len() as i64 - n_edges + mesh.triangles.len() as i64;
    Point { isovalue, n_components, euler, area, volume: volume.abs() }
}

/// The root of `v`, halving the path to it.
fn root(parents: &mut [u32], mut v: u32) -> u32 {
    while parents[v as usize] != v {
        parents[v as usize] = parents[parents[v as usize] as usize];
        v = parents[v as usize];
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tetrahedra_are_two_components_with_the_volume_of_both() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let far = corners.map(|c: [f32; 3]| c.map(|x| 2.0 * x + 10.0));
        let mesh = SurfaceMesh {
            positions: corners.into_iter().chain(far).collect(),
            normals: vec![[0.0, 0.0, 1.0]; 8],
            triangles: faces.into_iter().chain(faces.map(|f: [u32; 3]| f.map(|v| v + 4))).collect(),
            caps: vec![false; 8],
        };
        let point = measure(7.0, &mesh);
        assert_eq!((point.n_components, point.euler), (2, 4));
        // Coordinates are whole numbers: only sums of a few products are rounded.
        assert!((point.volume - (1.0 + 8.0) / 6.0).abs() < 1e-12, "{}", point.volume);
        let area = (1.5 + 0.75f64.sqrt()) * (1.0 + 4.0);
        assert!((point.area - area).abs() < 1e-12, "{} {area}", point.area);
    }
}
