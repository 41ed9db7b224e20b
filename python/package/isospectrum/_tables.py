"""Tables of a spectrum, as structured arrays: curves, events, components, trajectories, lifetimes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex

import numpy as np

from . import _appearance
from ._arguments import choice, public, whole
from ._drawing import Drawing
from ._isovalue import Isovalue, two
from ._looks import Numbers

if TYPE_CHECKING:
    import numpy.typing as npt

#: Isovalues of curves by default.
N_CURVE = 129


class Tables(Drawing):
    """The part of a spectrum that has tables."""

    __slots__ = ()

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest isovalue."""
        raise NotImplementedError

    @public
    def curves(self, n: SupportsIndex = N_CURVE, *, range: Sequence[Isovalue] | npt.NDArray[Any] | str | None = None) -> npt.NDArray[np.void]:  # noqa: A002
        """Measures of the isosurfaces at evenly spaced isovalues.

        Parameters
        ----------
        n : int, default 129
            Number of isovalues, both ends included.
        range : two isovalues, optional
            The first and the last; by default the range of the spectrum.

        Returns
        -------
        structured array
            With ``isovalue``, ``components``, ``euler``, ``area`` (without caps), ``volume`` (enclosed, caps included; world units) and
            ``triangles``.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="blobs:12", progress=False)
        >>> s.curves(3, range=("20%", "80%"))["components"].tolist()
        [1, 2, 1]
        """
        low, high = self.range if range is None else (self.isovalue(c) for c in two(range, "range"))
        return structured(self._native.curves(whole(n, "n", 1), (low, high)))

    @property
    def events(self) -> npt.NDArray[np.void]:
        """All changes of topology, by ascending isovalue: a structured array of ``isovalue``, ``x``, ``y``, ``z`` (world frame), ``kind``
        (emerge, merge, handle-open, split, handle-close, vanish), ``persistence`` (isovalues between the extremum of a component and the saddle
        where it merges or splits; NaN for handles, and for the last component), and the exact ``components`` and ``euler`` (Euler characteristic) of
        the isosurface from there up to the next event, caps included: events at one isovalue have the same."""
        return structured(self._native.events())

    @public
    def trajectory(self, vertex: SupportsIndex) -> npt.NDArray[np.void]:
        """The positions of a vertex at all isovalues.

        Parameters
        ----------
        vertex : int
            One of ``Mesh.vertex_ids``.

        Returns
        -------
        structured array
            With ``isovalue``, ``x``, ``y`` and ``z`` (world frame), ascending; between two rows the vertex moves straight.

        See Also
        --------
        lifetimes : Where vertices are born and die.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
        >>> path = s.trajectory(s.mesh(0.3, ids=True).vertex_ids[0])
        >>> bool(path["isovalue"][0] <= 0.3 <= path["isovalue"][-1])
        True
        """
        isovalues, positions = self._native.trajectory(whole(vertex, "vertex"))
        return structured({"isovalue": isovalues, "x": positions[:, 0], "y": positions[:, 1], "z": positions[:, 2]})

    @public
    def lifetimes(self, of: Literal["triangles", "vertices"] = "triangles") -> npt.NDArray[np.void]:
        """The isovalues from which each triangle or vertex is part of a mesh, and from which it no longer is.

        Parameters
        ----------
        of : {"triangles", "vertices"}
            Which; rows are in the order of ``Mesh.triangle_ids`` or ``Mesh.vertex_ids``.

        Returns
        -------
        structured array
            With ``birth`` and ``death``; NaN for a vertex that is part of no mesh.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
        >>> alive = s.lifetimes()[s.mesh(0.3, ids=True).triangle_ids]
        >>> bool((alive["birth"] <= 0.3).all() and (alive["death"] > 0.3).all())
        True
        """
        birth, death = self._native.lifetimes(choice(of, "of", ("triangles", "vertices")) == "triangles")
        return structured({"birth": birth, "death": death})

    @public
    def components(
        self,
        c: Isovalue | None = None,
        *,
        keep: SupportsIndex | Literal["largest"] | None = None,
        min_volume: SupportsFloat = 0.0,
        min_area: SupportsFloat = 0.0,
        at: Numbers | None = None,
    ) -> npt.NDArray[np.void]:
        """The components of the isosurface at an isovalue, the largest first.

        Parameters
        ----------
        c : isovalue, optional
            The isovalue.
        keep, min_volume, min_area, at : optional
            As for :meth:`mesh`.

        Returns
        -------
        structured array
            With the columns of ``isospectrum components --csv``: ``number`` (from 1), ``is_cavity``, ``volume``, ``area``, ``euler``,
            ``triangles``, ``birth`` and ``death`` (isovalues; NaN at the end of the range), ``splits_from`` and ``merges_into`` (number of
            the larger component; 0 if it emerges or vanishes), ``min_x`` to ``max_z`` (bounding box). All in world units.
        """
        columns = self._native.components(self.isovalue(c), _appearance.kept(keep, min_volume, min_area, at))
        for side in ("min", "max"):
            corners = columns.pop(side)
            columns.update({f"{side}_{axis}": corners[:, i] for i, axis in enumerate("xyz")})
        return structured(columns)


def structured(columns: dict[str, Any]) -> npt.NDArray[np.void]:
    """Columns as one structured array, which is read-only."""
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    if not len(next(iter(arrays.values()))):
        # NumPy cannot infer the type of an empty column of texts.
        arrays = {name: a.astype("U12") if a.dtype == float and name == "kind" else a for name, a in arrays.items()}
    table = np.empty(len(next(iter(arrays.values()))), dtype=[(name, a.dtype) for name, a in arrays.items()])
    for name, array in arrays.items():
        table[name] = array
    table.flags.writeable = False
    return table
