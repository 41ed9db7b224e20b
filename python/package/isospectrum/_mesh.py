"""The mesh at one isovalue."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt
    import pyvista
    import trimesh

    from . import _native


class Mesh:
    """The isosurface of one isovalue, as triangles in the world frame.

    Immutable: its arrays are read-only views of memory that the mesh owns, and conversions are copies.

    Attributes
    ----------
    vertices : (n, 3) float32
        Positions x, y, z in the world frame, in the unit of the volume's spacing.
    triangles : (m, 3) uint32
        Vertex indices, counter-clockwise seen from the outer side.
    normals : (n, 3) float32
        Unit normals of the vertices, towards the outer side: lower values, or higher ones if
        the spectrum was computed with ``--outside high``.
    caps : (m,) bool
        True for triangles that close the mesh at the border of the volume.
    isovalue : float
        The isovalue.
    """

    __slots__ = ("_native", "_which", "caps", "isovalue", "normals", "triangles", "vertices")

    vertices: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32]
    caps: npt.NDArray[np.bool_]
    isovalue: float

    def __init__(self, native: _native.Spectrum, isovalue: float, open_: bool, keep: Any) -> None:
        arrays = native.mesh(isovalue, open_, keep)
        for array in arrays:
            array.flags.writeable = False
        self.vertices, self.triangles, self.normals, self.caps = arrays
        self.isovalue = isovalue
        self._native = native
        self._which = (isovalue, open_, keep)

    def __repr__(self) -> str:
        return f"<isospectrum.Mesh: {self.n_triangles} triangles, {self.n_vertices} vertices at {self.isovalue:g}>"

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_triangles(self) -> int:
        """Number of triangles, caps included."""
        return len(self.triangles)

    def vertices_float64(self) -> npt.NDArray[np.float64]:
        """The vertices (n, 3) as 64-bit floats, for positions far from the origin, where 32 bits are too coarse."""
        return self._native.vertices_f64(*self._which)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the mesh as PLY, STL, OBJ or GLB, by the extension of the path, with the bytes that ``isospectrum extract`` writes.

        The file is written atomically.
        """
        self._native.save_mesh(*self._which, os.fspath(path))

    def to_pyvista(self) -> pyvista.PolyData:
        """As :class:`pyvista.PolyData`, with the point array ``Normals`` and the cell array ``cap``; copies."""
        import pyvista

        mesh = pyvista.PolyData.from_regular_faces(np.array(self._points()), self.triangles.astype(int))
        mesh.point_data.active_normals = np.array(self.normals)
        mesh.cell_data["cap"] = self.caps.astype(np.uint8)
        mesh.field_data["isovalue"] = [self.isovalue]
        mesh.set_active_scalars(None)
        return mesh

    def to_trimesh(self) -> trimesh.Trimesh:
        """As :class:`trimesh.Trimesh`, vertex for vertex; copies."""
        import trimesh

        return trimesh.Trimesh(
            vertices=np.array(self._points(), dtype=np.float64),
            faces=self.triangles.astype(int),
            vertex_normals=np.array(self.normals, dtype=np.float64) if self.n_vertices else None,
            face_attributes={"cap": np.array(self.caps)},
            metadata={"isovalue": self.isovalue},
            process=False,
        )

    def _points(self) -> npt.NDArray[Any]:
        """The vertices, as 64-bit floats if 32 bits are coarse compared with the size of the mesh."""
        v = self.vertices
        if len(v) and np.abs(v).max() > 64 * max(np.ptp(v, axis=0).max(), 1e-300):
            return self.vertices_float64()
        return v
