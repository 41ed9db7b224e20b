"""The mesh at one isovalue."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, BinaryIO, Literal, SupportsFloat, TypeAlias, Union

import numpy as np

from . import _convert, _native
from ._arguments import path_of, public
from ._errors import UsageError
from ._sources import volume

if TYPE_CHECKING:
    import meshio
    import nibabel
    import numpy.typing as npt
    import pyvista
    import trimesh
    from vtkmodules.vtkCommonDataModel import vtkPolyData

Floats: TypeAlias = "npt.NDArray[np.float32]"
Format = Literal["ply", "stl", "obj", "glb", "vtp", "3mf", "usda"]


class Mesh:
    """The isosurface of one isovalue, as triangles in the world frame.

    Immutable, and independent of its spectrum: it can be pickled, copied and weakly referenced. Arrays are read-only, and conversions are
    copies. It unpacks as the result of ``skimage.measure.marching_cubes`` does: ``vertices, faces, normals, values = mesh``.

    Attributes
    ----------
    vertices : (n, 3) float32
        Positions x, y, z in the world frame, in the unit of the volume's spacing.
    triangles, faces : (m, 3) int32
        Vertex indices, counter-clockwise seen from the outer side.
    normals : (n, 3) float32
        Unit normals of the vertices, towards the outer side: lower values, or higher ones if the spectrum was computed with
        ``outside="high"`` or the mesh made with ``gradient_direction="ascent"``.
    caps : (m,) bool
        True for triangles that close the mesh at the border of the volume.
    isovalue, level : float
        The isovalue.
    vertex_ids, triangle_ids : (n,) and (m,) uint32
        Numbers of the vertices and the triangles in the spectrum, the same at all isovalues; of a mesh that was made with ``ids=True``.

    See Also
    --------
    Spectrum.mesh : Makes a mesh.
    Spectrum.trajectory, Spectrum.lifetimes : Where a vertex is at other isovalues; where vertices and triangles are born and die.

    Examples
    --------
    >>> import isospectrum
    >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
    >>> m = s.mesh(0.3)
    >>> m.euler, m.n_components, m.is_closed
    (2, 1, True)
    >>> vertices, faces, normals, values = m
    """

    __slots__ = ("__weakref__", "_labels", "_surface", "caps", "isovalue", "normals", "triangles", "vertices")

    vertices: Floats
    triangles: npt.NDArray[np.int32]
    normals: Floats
    caps: npt.NDArray[np.bool_]
    isovalue: float
    _surface: _native.Surface
    _labels: npt.NDArray[np.uint32] | None

    def __init__(self, surface: _native.Surface, isovalue: float) -> None:
        vertices, triangles, normals, caps = surface.arrays()
        put = object.__setattr__
        for name, array in (("vertices", vertices), ("triangles", triangles.view(np.int32)), ("normals", normals), ("caps", caps)):
            put(self, name, _frozen(array))
        put(self, "isovalue", isovalue)
        put(self, "_surface", surface)
        put(self, "_labels", None)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a mesh is immutable, {name} cannot be set")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a mesh is immutable, {name} cannot be deleted")

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_parts, (self._surface.parts(), self.isovalue)

    def __repr__(self) -> str:
        return f"<isospectrum.Mesh: {self.n_triangles} triangles, {self.n_vertices} vertices at {self.isovalue:g}>"

    def _repr_html_(self) -> str:
        from ._notebook import of_mesh

        return of_mesh(self)

    def __iter__(self) -> Iterator[npt.NDArray[Any]]:
        return iter((self.vertices, self.triangles, self.normals, self.values))

    @property
    def faces(self) -> npt.NDArray[np.int32]:
        """The triangles, by the name that trimesh and scikit-image have for them."""
        return self.triangles

    @property
    def level(self) -> float:
        """The isovalue, by the name that scikit-image has for it."""
        return self.isovalue

    @property
    def values(self) -> Floats:
        """The isovalue for each vertex (n,), as the fourth result of ``skimage.measure.marching_cubes``."""
        return _frozen(np.full(self.n_vertices, self.isovalue, dtype=np.float32))

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.vertices)

    @property
    def n_triangles(self) -> int:
        """Number of triangles, caps included."""
        return len(self.triangles)

    @property
    def vertex_ids(self) -> npt.NDArray[np.uint32]:
        """Numbers of the vertices in the spectrum (n,)."""
        return self._ids()[0]

    @property
    def triangle_ids(self) -> npt.NDArray[np.uint32]:
        """Numbers of the triangles in the spectrum (m,)."""
        return self._ids()[1]

    def _ids(self) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
        ids = self._surface.ids()
        if ids is None:
            raise UsageError("a mesh without the numbers of its vertices and triangles, expected one of mesh(c, ids=True)")
        return _frozen(ids[0]), _frozen(ids[1])

    # Measures, in the unit of the spacing.

    @property
    def is_closed(self) -> bool:
        """True if each edge has two triangles, as in every mesh that was not made with ``open=True``."""
        edges = np.unique(_edges(self.triangles), axis=0)
        return 2 * len(edges) == 3 * self.n_triangles

    @property
    def area(self) -> float:
        """Area without caps."""
        p, q, r = self._corners()
        return float(np.linalg.norm(np.cross(q - p, r - p), axis=1)[~self.caps].sum() / 2)

    @property
    def volume(self) -> float:
        """Volume inside, caps included: negative for a mesh that is inside out. Of a closed mesh only."""
        if not self.is_closed:
            raise UsageError("the volume of an open mesh, expected a closed one: mesh(c, open=False)")
        p, q, r = self._corners()
        return float(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6)

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """Least and largest corner of the box around the mesh, (2, 3); NaN for an empty mesh."""
        if not self.n_vertices:
            return np.full((2, 3), np.nan)
        v = self.vertices_float64()
        return np.stack([v.min(axis=0), v.max(axis=0)])

    @property
    def euler(self) -> int:
        """Euler characteristic: 2 for a sphere, 0 for a torus; the sum over all components."""
        return self.n_vertices - len(np.unique(_edges(self.triangles), axis=0)) + self.n_triangles

    @property
    def n_components(self) -> int:
        """Number of components."""
        return int(self.labels.max(initial=0))

    @property
    def labels(self) -> npt.NDArray[np.uint32]:
        """The number of the component of each triangle (m,): from 1, the largest by volume first, as in
        :meth:`Spectrum.components` for a mesh of all components."""
        labels = self._labels
        if labels is None:
            labels = _frozen(self._surface.labels())
            object.__setattr__(self, "_labels", labels)
        return labels

    def _corners(self) -> tuple[npt.NDArray[np.float64], ...]:
        """The corners of all triangles, relative to the first vertex."""
        v = self.vertices_float64()
        v = v - (v[0] if len(v) else 0.0)
        p, q, r = (v[self.triangles[:, i]] for i in range(3))
        return p, q, r

    @public
    def sample(self, volume_: Any, /, **frame: Any) -> npt.NDArray[np.float64]:
        """The values of another volume at the vertices.

        Parameters
        ----------
        volume_ : array, image, or path
            As for :func:`isospectrum.compute`; an array without a frame has that of the spectrum's volume, if it has as many samples.
        **frame
            Arguments of :func:`isospectrum.compute` that describe the volume, such as ``spacing``.

        Returns
        -------
        (n,) float64
            The values, interpolated trilinearly; NaN outside of the volume.

        Examples
        --------
        >>> import isospectrum, numpy as np
        >>> z, y, x = np.mgrid[:9, :9, :9].astype(float)
        >>> s = isospectrum.compute((x - 4) ** 2 + (y - 4) ** 2 + (z - 4) ** 2, outside="high", progress=False)
        >>> heights = s.mesh(9).sample(z)
        >>> float(heights.min().round(1)), float(heights.max().round(1))
        (1.1, 6.9)
        """
        return self._surface.sample(volume(volume_, **frame))

    def vertices_float64(self) -> npt.NDArray[np.float64]:
        """The vertices (n, 3) as 64-bit floats, for positions far from the origin, where 32 bits are too coarse."""
        return self._surface.vertices_f64()

    @public
    def save(self, path: str | os.PathLike[str] | BinaryIO, *, format: Format | None = None) -> None:  # noqa: A002 (as --format)
        """Write the mesh as PLY, STL, OBJ, GLB, VTP, 3MF, USDA or GIFTI.

        Parameters
        ----------
        path : path or binary file
            A file is written atomically, with the bytes that ``isospectrum extract`` writes.
        format : {"ply", "stl", "obj", "glb", "vtp", "3mf", "usda"}, optional
            Format of an open file; that of a path is its extension. ``.gii`` is written by nibabel.

        Raises
        ------
        isospectrum.FileError
            If the file cannot be written.
        """
        if hasattr(path, "write"):
            if format is None:
                raise UsageError("an open file without a format, expected format='ply' or another")
            path.write(self._surface.encoded(format))
            return
        path = path_of(path)
        if format is not None and not path.lower().endswith(f".{format}"):
            raise UsageError(f"format {format!r} with {path}, expected none: the format of a path is its extension")
        if path.lower().endswith(".gii"):
            self.to_gifti().to_filename(path)
            return
        self._surface.save(path)

    # Types of other packages.

    def to_pyvista(self) -> pyvista.PolyData:
        """As :class:`pyvista.PolyData`, with the point array ``Normals`` and the cell array ``cap``; copies."""
        return _convert.to_pyvista(self)

    def to_vtk(self) -> vtkPolyData:
        """As ``vtkPolyData``, with the point array ``Normals`` and the cell array ``cap``; copies. Needs VTK only."""
        return _convert.to_vtk(self)

    def to_trimesh(self) -> trimesh.Trimesh:
        """As :class:`trimesh.Trimesh`, vertex for vertex; copies."""
        return _convert.to_trimesh(self)

    def to_meshio(self) -> meshio.Mesh:
        """As :class:`meshio.Mesh`, with the point data ``normals`` and the cell data ``cap``; copies."""
        return _convert.to_meshio(self)

    def to_gifti(self) -> nibabel.gifti.GiftiImage:
        """As ``nibabel.gifti.GiftiImage``, in the world frame; copies."""
        return _convert.to_gifti(self)

    def to_napari(self) -> tuple[Floats, npt.NDArray[np.int32], Floats]:
        """As the data of a surface layer of napari, in its order z, y, x: ``viewer.add_surface(mesh.to_napari())``.

        Returns
        -------
        tuple of vertices, faces and values
            Normals of the faces point to the same side as those of the mesh.
        """
        # A mirrored order of the axes turns triangles over.
        return np.array(self.vertices[:, ::-1]), np.array(self.triangles[:, ::-1]), np.array(self.values)

    def points(self) -> npt.NDArray[Any]:
        """The vertices (n, 3) for other packages: as 64-bit floats if 32 bits are coarse compared with the size of the mesh."""
        v = self.vertices
        if len(v) and np.abs(v).max() > 64 * max(np.ptp(v, axis=0).max(), 1e-300):
            return self.vertices_float64()
        return v


def _frozen(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    array.flags.writeable = False
    return array


def _edges(triangles: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """The edges of all triangles, each as often as it has triangles."""
    return np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)


def _from_parts(parts: Any, isovalue: SupportsFloat) -> Mesh:
    return Mesh(_native.Surface.from_parts(*parts), float(isovalue))


#: A mesh, or one for each of several isovalues.
Meshes = Union[Mesh, "list[Mesh]"]

Mesh.__module__ = "isospectrum"
