//! Trajectories of vertices, and lifetimes of vertices and triangles, by their numbers in the spectrum.

use isospectrum::Spectrum;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::arrays::rows;
use crate::errors::usage;

/// The isovalues (k) and positions (k, 3) of the knots of a vertex.
pub(crate) type Trajectory<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Births and deaths.
pub(crate) type Lifetimes<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// The trajectory of a vertex, in the world frame.
///
/// # Errors
///
/// `isospectrum.UsageError` if there is no such vertex.
pub(crate) fn trajectory<'py>(
    py: Python<'py>,
    spectrum: &Spectrum,
    vertex: usize,
) -> PyResult<Trajectory<'py>> {
    let n = spectrum.n_vertices();
    if vertex >= n {
        return Err(usage(format!(
            "vertex {vertex}, expected one of 0 to {}",
            n.saturating_sub(1)
        )));
    }
    let [first, end] = [0, 1].map(|i| spectrum.first_knot()[vertex + i] as usize);
    let knots = &spectrum.knots()[first..end];
    let isovalues: Vec<f64> =
        knots.iter().map(|knot| spectrum.isovalues()[knot.rank as usize]).collect();
    let placement = &spectrum.volume().placement;
    let positions = knots.iter().map(|knot| placement.world_of_voxel(knot.position)).collect();
    Ok((isovalues.into_pyarray(py), rows(py, positions)))
}

/// The isovalues from which each triangle or vertex is part of a mesh, and from which it no longer is.
pub(crate) fn lifetimes<'py>(
    py: Python<'py>,
    spectrum: &Spectrum,
    of_triangles: bool,
) -> Lifetimes<'py> {
    let ends: Vec<[u32; 2]> = if of_triangles {
        spectrum.triangles().iter().map(|t| [t.birth, t.death]).collect()
    } else {
        let mut ends = vec![[u32::MAX, 0]; spectrum.n_vertices()];
        for triangle in spectrum.triangles() {
            for &v in &triangle.vertices {
                let [birth, death] = &mut ends[v as usize];
                (*birth, *death) = ((*birth).min(triangle.birth), (*death).max(triangle.death));
            }
        }
        ends
    };
    // A vertex without triangles is in no mesh.
    let isovalue = |rank: u32| spectrum.isovalues().get(rank as usize).copied().unwrap_or(f64::NAN);
    let of = |end: usize| ends.iter().map(|ends| isovalue(ends[end])).collect::<Vec<f64>>();
    (of(0).into_pyarray(py), of(1).into_pyarray(py))
}
