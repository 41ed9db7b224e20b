"""Meshes in the types of other packages, which are imported when they are needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

if TYPE_CHECKING:
    import meshio
    import nibabel
    import numpy.typing as npt
    import pyvista
    import trimesh
    from vtkmodules.vtkCommonDataModel import vtkPolyData


class Triangles(Protocol):
    """The part of a mesh that is converted."""

    vertices: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.int32]
    normals: npt.NDArray[np.float32]
    caps: npt.NDArray[np.bool_]
    isovalue: float

    @property
    def n_vertices(self) -> int: ...
    @property
    def n_triangles(self) -> int: ...
    def points(self) -> npt.NDArray[Any]: ...


def to_pyvista(mesh: Triangles) -> pyvista.PolyData:
    import pyvista

    made: pyvista.PolyData = pyvista.PolyData.from_regular_faces(np.array(mesh.points()), mesh.triangles.astype(int))
    made.point_data.active_normals = np.array(mesh.normals)  # type: ignore[assignment]
    made.cell_data["cap"] = mesh.caps.astype(np.uint8)
    made.field_data["isovalue"] = [mesh.isovalue]
    made.set_active_scalars(None)
    return made


def to_vtk(mesh: Triangles) -> vtkPolyData:
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    def array(of: Any, name: str) -> Any:
        made = numpy_to_vtk(np.ascontiguousarray(of), deep=True)
        made.SetName(name)
        return made

    points, cells, made = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(array(mesh.points(), "Points"))
    corners = numpy_to_vtkIdTypeArray(mesh.triangles.astype(np.int64).ravel(), deep=True)
    offsets = numpy_to_vtkIdTypeArray(np.arange(0, 3 * mesh.n_triangles + 1, 3, dtype=np.int64), deep=True)
    cells.SetData(offsets, corners)
    made.SetPoints(points)
    made.SetPolys(cells)
    made.GetPointData().SetNormals(array(mesh.normals, "Normals"))
    made.GetCellData().AddArray(array(mesh.caps.astype(np.uint8), "cap"))
    return made


def to_trimesh(mesh: Triangles) -> trimesh.Trimesh:
    import trimesh

    return trimesh.Trimesh(
        vertices=np.array(mesh.points(), dtype=np.float64),
        faces=mesh.triangles.astype(int),
        vertex_normals=np.array(mesh.normals, dtype=np.float64) if mesh.n_vertices else None,
        face_attributes={"cap": np.array(mesh.caps)},
        metadata={"isovalue": mesh.isovalue},
        process=False,
    )


def to_meshio(mesh: Triangles) -> meshio.Mesh:
    import meshio

    return meshio.Mesh(
        np.array(mesh.points()),
        [("triangle", np.array(mesh.triangles))],
        point_data={"normals": np.array(mesh.normals)},
        cell_data={"cap": [mesh.caps.astype(np.uint8)]},
        field_data={"isovalue": np.array([mesh.isovalue])},
    )


def to_gifti(mesh: Triangles) -> nibabel.gifti.GiftiImage:
    import nibabel

    points = nibabel.gifti.GiftiDataArray(np.array(mesh.vertices), intent="NIFTI_INTENT_POINTSET", datatype="NIFTI_TYPE_FLOAT32")
    triangles = nibabel.gifti.GiftiDataArray(np.array(mesh.triangles), intent="NIFTI_INTENT_TRIANGLE", datatype="NIFTI_TYPE_INT32")
    return nibabel.gifti.GiftiImage(darrays=[points, triangles])
