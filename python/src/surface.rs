//! A mesh that stands by itself: it needs no spectrum any more.

use std::path::{Path, PathBuf};

use isospectrum::export::{self, Border, Format, without_caps};
use isospectrum::spectrum::{Components, VolumeInfo};
use isospectrum::{Error, Keep, Mesh};
use numpy::{Element, IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayon::prelude::*;

use crate::arrays::{MeshArrays, in_world, mesh_arrays, rows};
use crate::errors::{raised, usage};
use crate::volume::Volume;
use crate::watch::detached;

/// The numbers in the spectrum of the vertices and of the triangles of a mesh.
pub(crate) type Ids<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<u32>>);

/// A mesh in the voxel frame, and the description of the volume, which places it in the world.
#[pyclass(frozen, module = "isospectrum._native")]
pub(crate) struct Surface {
    pub(crate) mesh: Mesh,
    pub(crate) ids: Option<[Vec<u32>; 2]>,
    pub(crate) volume: VolumeInfo,
}

#[pymethods]
impl Surface {
    /// A surface of what [`Surface::parts`] returns.
    #[staticmethod]
    fn from_parts(
        positions: PyReadonlyArray2<'_, f32>,
        normals: PyReadonlyArray2<'_, f32>,
        triangles: PyReadonlyArray2<'_, u32>,
        caps: PyReadonlyArray1<'_, bool>,
        ids: Option<(PyReadonlyArray1<'_, u32>, PyReadonlyArray1<'_, u32>)>,
        volume: &str,
    ) -> PyResult<Self> {
        let mesh = Mesh {
            positions: triples(&positions)?,
            normals: triples(&normals)?,
            triangles: triples(&triangles)?,
            caps: caps.as_slice().map_err(|e| usage(e.to_string()))?.to_vec(),
        };
        let n = mesh.positions.len();
        if mesh.normals.len() != n
            || mesh.caps.len() != mesh.triangles.len()
            || mesh.triangles.iter().flatten().any(|&v| v as usize >= n)
        {
            return Err(raised(Error::input("a mesh of parts that do not fit together")));
        }
        let whole = |ids: PyReadonlyArray1<'_, u32>| ids.as_slice().map(<[u32]>::to_vec);
        let ids = ids.map(|(v, t)| Ok::<_, numpy::AsSliceError>([whole(v)?, whole(t)?]));
        let ids = ids.transpose().map_err(|e| usage(e.to_string()))?;
        let volume = serde_json::from_str(volume);
        let volume = volume.map_err(|e| raised(Error::input(format!("a mesh: {e}"))))?;
        Ok(Surface { mesh, ids, volume })
    }

    /// Positions, normals and triangles in the voxel frame, caps, numbers, and the description of the volume as JSON.
    #[allow(clippy::type_complexity, reason = "a tuple for Python")]
    fn parts<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(
        Bound<'py, PyArray2<f32>>,
        Bound<'py, PyArray2<f32>>,
        Bound<'py, PyArray2<u32>>,
        Bound<'py, PyArray1<bool>>,
        Option<Ids<'py>>,
        String,
    )> {
        let Mesh { positions, normals, triangles, caps } = self.mesh.clone();
        let volume = serde_json::to_string(&self.volume);
        let volume = volume.map_err(|e| raised(Error::internal(e.to_string())))?;
        let (positions, normals) = (rows(py, positions), rows(py, normals));
        let (triangles, caps) = (rows(py, triangles), caps.into_pyarray(py));
        Ok((positions, normals, triangles, caps, self.ids(py), volume))
    }

    /// The mesh in the world frame, as arrays.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<MeshArrays<'py>> {
        let mesh = detached(py, || Ok(in_world(self.mesh.clone(), &self.volume.placement)))?;
        Ok(mesh_arrays(py, mesh))
    }

    /// The numbers in the spectrum of its vertices and triangles, if they were asked for.
    fn ids<'py>(&self, py: Python<'py>) -> Option<Ids<'py>> {
        let ids = self.ids.as_ref();
        ids.map(|[v, t]| (v.clone().into_pyarray(py), t.clone().into_pyarray(py)))
    }

    /// The vertices in the world frame as 64-bit floats.
    fn vertices_f64<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let place = |&p: &[f32; 3]| self.volume.placement.world_of_voxel(p);
        let placed = detached(py, || Ok(self.mesh.positions.iter().map(place).collect()))?;
        Ok(rows(py, placed))
    }

    /// By triangle, the number of its component: from 1, the largest first.
    fn labels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let found = detached(py, || Ok(Components::of(&self.mesh).of_triangle))?;
        Ok(found.into_iter().map(|number| number + 1).collect::<Vec<u32>>().into_pyarray(py))
    }

    /// The values of a volume at the vertices; NaN outside of it.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        volume: &Bound<'py, Volume>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let volume = &volume.get().0;
        let values = detached(py, || {
            let value = volume.field_in(self.volume.dims, &self.volume.placement);
            Ok(self.mesh.positions.par_iter().map(|&p| value(p)).collect::<Vec<f64>>())
        })?;
        Ok(values.into_pyarray(py))
    }

    /// Writes a mesh file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let placement = &self.volume.placement;
        detached(py, || export::write(&self.mesh, placement, Border::Closed, &path))
    }

    /// The bytes of a mesh file in a format, such as `ply`.
    fn encoded<'py>(&self, py: Python<'py>, format: &str) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = detached(py, || {
            let format = Format::of_path(Path::new(&format!("mesh.{format}")))?;
            let mut bytes = Vec::new();
            let placement = &self.volume.placement;
            export::write_to(&self.mesh, placement, Border::Closed, format, &mut bytes)?;
            Ok(bytes)
        })?;
        Ok(PyBytes::new(py, &bytes))
    }
}

impl Surface {
    /// A mesh, turned inside out if `is_turned`.
    pub(crate) fn new(
        mesh: Mesh,
        ids: Option<[Vec<u32>; 2]>,
        volume: VolumeInfo,
        is_turned: bool,
    ) -> Self {
        let mut mesh = mesh;
        if is_turned {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            mesh.normals.iter_mut().flatten().for_each(|x| *x = -*x);
        }
        Surface { mesh, ids, volume }
    }
}

/// The rows of an array (n, 3).
fn triples<T: Element + Copy>(array: &PyReadonlyArray2<'_, T>) -> PyResult<Vec<[T; 3]>> {
    let all = array.as_slice().map_err(|e| usage(e.to_string()))?;
    match array.as_array().shape() {
        [_, 3] => Ok(all.as_chunks::<3>().0.to_vec()),
        shape => Err(usage(format!("an array of the shape {shape:?}, expected (n, 3)"))),
    }
}

/// The mesh of the kept components, without caps if `open`.
pub(crate) fn shown(mut mesh: Mesh, keep: Option<&Keep>, open: bool) -> Mesh {
    if let Some(keep) = keep {
        mesh = mesh.with_components(keep);
    }
    if open { without_caps(&mesh) } else { mesh }
}

/// As [`shown`], with the numbers in the spectrum of the vertices and triangles that are left.
pub(crate) fn shown_with_ids(
    mesh: &Mesh,
    [vertices, triangles]: [&[u32]; 2],
    keep: Option<&Keep>,
    open: bool,
) -> (Mesh, [Vec<u32>; 2]) {
    let (mesh, kept) = mesh.kept(keep.unwrap_or(&Keep::default()), open);
    let of = |indices: &[u32], ids: &[u32]| indices.iter().map(|&i| ids[i as usize]).collect();
    (mesh, [of(&kept[0], vertices), of(&kept[1], triangles)])
}
