//! Meshes as arrays, in the world frame.

use isospectrum::export::place_in_world;
use isospectrum::{Mesh, Placement};
use numpy::ndarray::Array2;
use numpy::{Element, IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

/// Vertices per parallel task, which takes about 0.1 ms.
const VERTICES_PER_TASK: usize = 1 << 14;

/// Vertices (n, 3), triangles (m, 3), normals (n, 3), and whether each triangle is a cap (m).
pub(crate) type MeshArrays<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<bool>>,
);

/// Moves a mesh to the world frame and rounds its positions to 32-bit floats, as files do.
pub(crate) fn in_world(mut mesh: Mesh, placement: &Placement) -> Mesh {
    let mut positions = std::mem::take(&mut mesh.positions);
    // Without the positions, which `place_in_world` leaves relative to the origin of the volume.
    let mut mesh = place_in_world(mesh, placement);
    let place = |p: &mut [f32; 3]| *p = placement.world_of_voxel(*p).map(|x| x as f32);
    if positions.len() <= VERTICES_PER_TASK {
        positions.iter_mut().for_each(place);
    } else {
        positions.par_iter_mut().with_min_len(VERTICES_PER_TASK).for_each(place);
    }
    mesh.positions = positions;
    mesh
}

/// The arrays of a mesh, whose memory passes to Python.
pub(crate) fn mesh_arrays(py: Python<'_>, mesh: Mesh) -> MeshArrays<'_> {
    (
        rows(py, mesh.positions),
        rows(py, mesh.triangles),
        rows(py, mesh.normals),
        mesh.caps.into_pyarray(py),
    )
}

/// An array (n, N).
pub(crate) fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> Bound<'_, PyArray2<T>> {
    let shape = (rows.len(), N);
    let all = Array2::from_shape_vec(shape, rows.into_flattened());
    all.expect("as many numbers as the shape has").into_pyarray(py)
}
