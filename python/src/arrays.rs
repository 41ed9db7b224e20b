//! Meshes as arrays, in the world frame.

use isospectrum::export::place_in_world;
use isospectrum::{Mesh, Placement};
use numpy::ndarray::Array2;
use numpy::{
    Element, IntoPyArray, PyArray1, PyArray2, PyReadwriteArray2, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::errors::usage;

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

/// Rows of three numbers that are given, to be written to.
pub(crate) type Rows<'py, T> = PyReadwriteArray2<'py, T>;

/// The rows of an array (n, 3) that are contiguous in memory.
pub(crate) fn rows_of<'a, T: Element>(
    array: &'a mut Rows<'_, T>,
    name: &str,
) -> PyResult<&'a mut [[T; 3]]> {
    let shape = array.as_array().shape().to_vec();
    // A slice alone could be in the order of Fortran.
    let is_rows = shape[..] == [shape[0], 3] && array.is_c_contiguous();
    match (is_rows, array.as_slice_mut()) {
        (true, Ok(all)) => Ok(all.as_chunks_mut::<3>().0),
        _ => Err(usage(format!(
            "an array of {name} of the shape {shape:?}, expected (n, 3) in C order"
        ))),
    }
}

/// Arrays that a mesh is written to.
pub(crate) struct Target<'a> {
    pub(crate) vertices: &'a mut [[f32; 3]],
    pub(crate) triangles: &'a mut [[i32; 3]],
    pub(crate) normals: &'a mut [[f32; 3]],
}

impl Target<'_> {
    /// Writes a mesh of the voxel frame in the world frame, turned inside out if `is_turned`, as [`in_world`] places it. Returns its
    /// numbers of vertices and triangles; nothing is written if there are fewer rows.
    pub(crate) fn fill(
        self,
        mesh: &Mesh,
        placement: &Placement,
        is_turned: bool,
    ) -> (usize, usize) {
        let size = (mesh.positions.len(), mesh.triangles.len());
        if self.vertices.len().min(self.normals.len()) < size.0 || self.triangles.len() < size.1 {
            return size;
        }
        for (to, p) in self.vertices.iter_mut().zip(&mesh.positions) {
            *to = placement.world_of_voxel(*p).map(|x| x as f32);
        }
        let (turned, sign) = (placement.normals(), if is_turned { -1.0 } else { 1.0 });
        for (to, n) in self.normals.iter_mut().zip(&mesh.normals) {
            *to = turned(n.map(|x| sign * x));
        }
        let is_reversed = is_turned != (placement.span() < 0.0);
        for (to, t) in self.triangles.iter_mut().zip(&mesh.triangles) {
            let [a, b, c] = t.map(|v| v as i32);
            *to = if is_reversed { [a, c, b] } else { [a, b, c] };
        }
        size
    }
}
