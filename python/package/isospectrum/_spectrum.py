"""Spectra: meshes at any isovalue, and files. Tables are in ``_tables``, pictures and pages in ``_drawing``, meshes and films as files in ``_writing``."""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex, TypedDict, overload

import numpy as np

from . import _appearance, _native, _progress
from ._arguments import choice, path_of, public, whole
from ._drawing import several_of, volume_like
from ._errors import Error, UsageError
from ._isovalue import Isovalue, as_text, evenly_spaced
from ._looks import Numbers
from ._mesh import Mesh
from ._report import Report
from ._writing import Writing

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

#: Arrays that a mesh is written to: vertices, triangles, normals.
Arrays = tuple["npt.NDArray[np.float32]", "npt.NDArray[np.int32]", "npt.NDArray[np.float32]"]


class MeshOptions(TypedDict, total=False):
    """Arguments of :meth:`Spectrum.mesh`."""

    open: bool | None
    keep: SupportsIndex | Literal["largest"] | None
    min_volume: SupportsFloat
    min_area: SupportsFloat
    at: Numbers | None
    gradient_direction: Literal["descent", "ascent"] | None
    ids: bool


class Spectrum(Writing):
    """The isosurfaces of a volume at all isovalues of a range.

    Returned by :func:`isospectrum.compute` and :func:`isospectrum.open`. A spectrum is immutable, may be used by several threads at
    once, and is pickled as the bytes of its file.

    See Also
    --------
    compute : Computes a spectrum.
    open : Opens a spectrum that has been saved.
    Mesh : The mesh at one isovalue.

    Examples
    --------
    >>> import isospectrum
    >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
    >>> s.mesh("60%")
    <isospectrum.Mesh: 816 triangles, 410 vertices at 0.220048>
    """

    __slots__ = ("__weakref__", "_about", "_has_mask", "_last", "_native", "_picture")

    _about: dict[str, Any]
    _last: tuple[Any, Mesh | None]
    _picture: str | None

    def __init__(self, native: _native.Spectrum) -> None:
        put = object.__setattr__
        put(self, "_native", native)
        about = json.loads(native.about())
        # A file of the thesis has no record of the computation.
        about["parameters"] = about["parameters"] or {}
        put(self, "_about", about)
        put(self, "_has_mask", "mask" in (about["parameters"].get("preparation") or {}))
        #: The last mesh, and what it was asked for by.
        put(self, "_last", (None, None))
        put(self, "_picture", None)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a spectrum is immutable, {name} cannot be set")

    def __repr__(self) -> str:
        about = self._about
        name, (low, high) = about["volume"]["name"], self.range
        return f"<isospectrum.Spectrum of {name}: {low:g} to {high:g}, {about['n_triangles']} triangles>"

    def _repr_html_(self) -> str:
        from ._notebook import of_spectrum

        return of_spectrum(self)

    def __reduce__(self) -> tuple[Any, ...]:
        return _from_bytes, (self._native.to_bytes(),)

    # Description.

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest isovalue."""
        low, high = self._about["range"]
        return (low, high)

    @property
    def tolerance(self) -> float:
        """Tolerance of the computation, in voxels (the smallest spacing)."""
        return float(self._about["tolerance"])

    @property
    def volume(self) -> dict[str, Any]:
        """Description of the volume, a copy: ``name``, ``dims`` (x, y, z), ``sample_type``, ``range``, ``placement``, ``outside``."""
        return copy.deepcopy(self._about["volume"])

    @property
    def parameters(self) -> dict[str, Any]:
        """Record of the computation, a copy: flags, backend, and the preparation of the volume."""
        return copy.deepcopy(self._about["parameters"])

    @property
    def counts(self) -> dict[str, int]:
        """Statistics of the sweep, a copy; empty for a spectrum written by another program."""
        return dict(self._about["parameters"].get("counts") or {})

    @property
    def n_triangles(self) -> int:
        """Number of triangles of all isovalues; a mesh has those that are alive at its isovalue."""
        return int(self._about["n_triangles"])

    @property
    def n_vertices(self) -> int:
        """Number of vertices, each with a trajectory."""
        return int(self._about["n_vertices"])

    @property
    def n_knots(self) -> int:
        """Number of knots of all trajectories."""
        return int(self._about["n_knots"])

    @public
    def isovalue(self, c: Isovalue | None = None) -> float:
        """An isovalue as a number.

        Parameters
        ----------
        c : isovalue, optional
            A number or a text such as ``"50%"``; ``None`` is the isovalue at which a page opens: 50 % of the range, or the nearest at
            which the isosurface is large enough to see.

        Returns
        -------
        float
            The number, which may be outside of the range if it was given as one.
        """
        if c is None:
            return float(self._about["shown_first"])
        return self._native.isovalue(c) if isinstance(c, str) else float(as_text(c))

    # Meshes.

    @overload
    def mesh(self, c: str | None = None, **options: Unpack[MeshOptions]) -> Mesh: ...  # type: ignore[overload-overlap]
    @overload
    def mesh(self, c: Sequence[Isovalue] | npt.NDArray[Any], **options: Unpack[MeshOptions]) -> list[Mesh]: ...  # type: ignore[overload-overlap]
    @overload
    def mesh(self, c: SupportsFloat, **options: Unpack[MeshOptions]) -> Mesh: ...
    @overload
    def mesh(self, c: SupportsFloat | str | None = None, *, out: Arrays, **options: Unpack[MeshOptions]) -> Arrays: ...

    @public
    def mesh(
        self,
        c: Any = None,
        *,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: SupportsIndex | Literal["largest"] | None = None,
        min_volume: SupportsFloat = 0.0,
        min_area: SupportsFloat = 0.0,
        at: Numbers | None = None,
        gradient_direction: Literal["descent", "ascent"] | None = None,
        ids: bool = False,
        out: Arrays | None = None,
    ) -> Mesh | list[Mesh] | Arrays:
        """The mesh at an isovalue, in the world frame.

        The cost of successive isovalues is that of the triangles that change between them; the same isovalue again costs nothing.

        Parameters
        ----------
        c : isovalue, or several, optional
            The isovalue; ``None`` as for :meth:`isovalue`. Several give a list of meshes.
        open : bool, optional
            Leave out the triangles that close the mesh at the border of the volume and beyond its mask. The default is to leave
            them out if the spectrum has a mask.
        keep : int or "largest", optional
            Number of components to keep, the largest by enclosed volume; ``"largest"`` is 1.
        min_volume, min_area : float, optional
            Leave out components with a smaller enclosed volume or area, in cubes and squares of the unit of the spacing.
        at : three floats, optional
            Keep the component nearest to this point (x, y, z) in the world frame, among those that are large enough.
        gradient_direction : {"descent", "ascent"}, optional
            Side of triangles and normals, as in scikit-image: ``"descent"`` is towards lower values, for objects of high values;
            ``"ascent"`` towards higher ones, as for the negative lobe of an orbital. The default is the outer side of the spectrum.
        ids : bool, default False
            Give the mesh the numbers of its vertices and triangles in the spectrum. The whole spectrum is then read.
        out : tuple of three arrays, optional
            Arrays for vertices (n, 3) float32, triangles (m, 3) int32 and normals (n, 3) float32, in C order, to which the mesh is written
            in place of new ones. They may have more rows, which are left as they are.

        Returns
        -------
        Mesh, list of Mesh, or tuple of three arrays
            The mesh, independent of the spectrum; with ``out`` the parts of its arrays that have the mesh.

        Raises
        ------
        isospectrum.RangeError
            If the isovalue is outside :attr:`range`.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="blobs:12", progress=False)
        >>> [m.n_components for m in s.mesh(["20%", "50%"])]
        [1, 2]
        """
        options = (
            self._is_open(open),
            _appearance.kept(keep, min_volume, min_area, at),
            self._is_turned(gradient_direction),
            bool(ids),
        )
        several = several_of(c)
        if out is not None:
            if several is not None or ids:
                raise UsageError("out with several isovalues or ids, expected one isovalue without ids")
            return self._fill(self.isovalue(c), out, *options)
        if several is not None:
            return [self._mesh(self.isovalue(one), *options) for one in several]
        return self._mesh(self.isovalue(c), *options)

    def _mesh(self, isovalue: float, *options: Any) -> Mesh:
        last, mesh = self._last
        if last == (isovalue, *options) and mesh is not None:
            return mesh
        mesh = Mesh(self._native.surface(isovalue, *options), isovalue)
        object.__setattr__(self, "_last", ((isovalue, *options), mesh))
        return mesh

    def _fill(self, isovalue: float, out: Arrays, open: bool, keep: Any, is_turned: bool, _ids: bool) -> Arrays:  # noqa: A002 (as --open)
        try:
            vertices, triangles, normals = out
            n, m = self._native.fill(isovalue, open, keep, is_turned, vertices, triangles, normals)
        except (TypeError, ValueError) as error:
            # Those of the package say more.
            if isinstance(error, Error):
                raise
            raise UsageError("out, expected three writeable arrays: vertices (n, 3) float32, triangles (m, 3) int32, normals (n, 3) float32") from None
        if min(len(vertices), len(normals)) < n or len(triangles) < m:
            raise UsageError(f"out for {min(len(vertices), len(normals))} vertices and {len(triangles)} triangles, expected {n} and {m} or more")
        return vertices[:n], triangles[:m], normals[:n]

    def _is_turned(self, gradient_direction: str | None) -> bool:
        """True if a mesh faces the inner side of the spectrum."""
        own = "ascent" if str(self._about["volume"]["outside"]).lower() == "high" else "descent"
        return gradient_direction is not None and choice(gradient_direction, "gradient_direction", ("descent", "ascent")) != own

    @overload
    def sweep(
        self, n: SupportsIndex, low: Isovalue | None = None, high: Isovalue | None = None, **options: Unpack[MeshOptions]
    ) -> Iterator[Mesh]: ...
    @overload
    def sweep(
        self, n: SupportsIndex, low: Isovalue | None = None, high: Isovalue | None = None, *, out: Arrays, **options: Unpack[MeshOptions]
    ) -> Iterator[Arrays]: ...

    @public
    def sweep(
        self,
        n: SupportsIndex,
        low: Isovalue | None = None,
        high: Isovalue | None = None,
        *,
        out: Arrays | None = None,
        **options: Unpack[MeshOptions],
    ) -> Iterator[Mesh] | Iterator[Arrays]:
        """The meshes at evenly spaced isovalues, one after the other.

        Parameters
        ----------
        n : int
            Number of isovalues.
        low, high : isovalue, optional
            First and last isovalue, both included; by default the ends of the range. ``low`` may be above ``high``.
        out : tuple of three arrays, optional
            As for :meth:`mesh`: each mesh is written over the one before.
        **options
            As for :meth:`mesh`.

        Returns
        -------
        iterator of Mesh, or of tuples of three arrays
            Computed when they are asked for.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
        >>> [m.n_components for m in s.sweep(3, 0, 0.6)]
        [1, 1, 1]
        """
        if several_of(n) is not None:
            raise UsageError(f"sweep of {n!r} meshes, expected a whole number of them: mesh({n!r}) gives one for each isovalue")
        for name in options:
            if name not in MeshOptions.__annotations__:
                self.mesh(**options)
        n = whole(n, "n", 1)
        first = self.range[0] if low is None else self.isovalue(low)
        last = self.range[1] if high is None else self.isovalue(high)
        if out is not None:
            given = out
            return (self.mesh(c, out=given, **options) for c in evenly_spaced(first, last, n))
        return (self.mesh(c, **options) for c in evenly_spaced(first, last, n))

    # Files and verification.

    @public
    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file atomically.

        Parameters
        ----------
        path : path
            A name that ends in ``.isp``, or in ``.thesis`` for the layout of the thesis.

        Raises
        ------
        isospectrum.FileError
            If it cannot be written.
        """
        self._native.save(path_of(path))

    @public
    def verify(
        self,
        a: Any,
        *,
        n: SupportsIndex = 64,
        events: SupportsIndex = 16,
        seed: SupportsIndex = 0,
        progress: _progress.Progress = True,
        **frame: Any,
    ) -> Report:
        """Verify the spectrum against the volume it was computed from; the recorded preparation is repeated.

        Checks ``n`` random isovalues, both sides of up to ``events`` events, and as many isovalues where triangles change. A spectrum
        that fails raises no exception: see :meth:`Report.check`.

        Parameters
        ----------
        a : array, image, or path
            The volume, as for :func:`isospectrum.compute`.
        n, events, seed : int, default 64, 16, 0
            Numbers of isovalues and of events, and what random isovalues follow from.
        progress : bool or callable, default True
            As for :func:`isospectrum.compute`.
        **frame
            Arguments of :func:`isospectrum.compute` that describe the volume, such as ``nan_as``.

        Returns
        -------
        Report
            What was found; true if every promise holds.

        Examples
        --------
        >>> import isospectrum, numpy as np
        >>> z, y, x = np.mgrid[-1:1:9j, -1:1:9j, -1:1:9j]
        >>> a = x + y**2 - z**2
        >>> isospectrum.compute(a, progress=False).verify(a, n=4, progress=False).check()
        """
        of = volume_like(a, self, **frame)
        numbers = (whole(n, "n", 0, 10**6), whole(events, "events", 0, 2**32), whole(seed, "seed", 0, 2**64 - 1))
        with _progress.shown(progress, "verifying") as report:
            return Report(self._native.verify(of, *numbers, report))


def _from_bytes(data: bytes) -> Spectrum:
    return Spectrum(_native.Spectrum.from_bytes(data))


Spectrum.__module__ = "isospectrum"
