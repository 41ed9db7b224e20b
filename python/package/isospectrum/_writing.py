"""Meshes of several isovalues, morphing meshes and films of a spectrum, written to files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex, Union

from . import _appearance, _native, _progress
from ._arguments import optional, path_of, public, whole
from ._drawing import DEFAULTS, labelled
from ._errors import UsageError
from ._isovalue import Isovalue, evenly_spaced
from ._looks import Color, ColorMap, DrawingOptions, Numbers, Shown
from ._tables import Tables, structured

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt
    from typing_extensions import Unpack

#: The first and the last isovalue of a sweep, and the number of isovalues; or a text such as ``"10%:90%:40"``.
Sweep = Union[str, "tuple[Isovalue, Isovalue, SupportsIndex]"]

#: Most pictures or meshes of a sweep.
MAX_FRAMES = 100_000


class Writing(Tables):
    """The part of a spectrum that writes several meshes or pictures."""

    __slots__ = ()

    @public
    def extract(
        self,
        path: str | os.PathLike[str],
        c: Shown = None,
        *,
        sweep: Sweep | None = None,
        color: Color = "none",
        color_by: Any = None,
        color_map: ColorMap | None = None,
        color_range: str | Sequence[SupportsFloat | str | None] | npt.NDArray[Any] | None = None,
        color_center: SupportsFloat | None = None,
        volume: Any = None,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: SupportsIndex | Literal["largest"] | None = None,
        min_volume: SupportsFloat = 0.0,
        min_area: SupportsFloat = 0.0,
        at: Numbers | None = None,
        format: Literal["ply", "stl", "obj", "glb", "vtp", "3mf", "usda"] | None = None,  # noqa: A002 (as --format)
        morph: bool = False,
        progress: _progress.Progress = True,
    ) -> npt.NDArray[np.void]:
        """Write the meshes of one isovalue or several, with colours if wanted: the bytes that ``isospectrum extract`` writes.

        Parameters
        ----------
        path : path
            A mesh (.ply, .stl, .obj, .glb, .vtp, .3mf, .usda). For several isovalues: a pattern such as ``"mesh-%d.ply"``, numbered
            from 0; one .glb or .usda with all of them; or a .pvd, which lists .vtp files next to it with the isovalue as their time.
        c : isovalue, or several, optional
            As in :meth:`render`; in a scene of several, each may have a colour: ``{1200: "bone", -200: "skin@0.3"}``.
        sweep : two isovalues and a number, optional
            That many evenly spaced isovalues, both ends included, in place of ``c``: ``("10%", "90%", 40)``. A .glb or .usda
            plays all meshes in twelve seconds.
        color, color_by, color_map, color_range, color_center : optional
            What colours show, as in :meth:`render`. PLY and VTP have the values, too. ``color_by`` is another volume.
        volume : array, image, or path, optional
            The volume, for ``color="distance"``.
        open, keep, min_volume, min_area, at : optional
            As in :meth:`mesh`.
        format : {"ply", "stl", "obj", "glb", "vtp", "3mf", "usda"}, optional
            Format, if the name of the output has no extension.
        morph : bool, default False
            Write one mesh (.glb) that follows the isosurface over ``sweep``, a range without events; the shapes at the isovalues, at
            most 33, become morph targets.
        progress : bool or callable, default True
            As for :func:`isospectrum.compute`.

        Returns
        -------
        structured array
            By mesh ``isovalue``, ``vertices``, ``triangles`` and ``file``.

        See Also
        --------
        Mesh.save : Writes one mesh.
        Mesh.sample : The values of another volume at the vertices.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="blobs:12", progress=False)
        >>> [str(name) for name in s.extract("m-%d.ply", sweep=("20%", "60%", 3), color="curvature")["file"]]
        ['m-0.ply', 'm-1.ply', 'm-2.ply']
        """
        appearance = self._appearance_arguments({**DEFAULTS, **locals()})
        isovalues = None if sweep is None else self._sweep(sweep, c)
        name = path_of(path)
        if morph:
            if isovalues is None:
                raise UsageError("morph without sweep, expected the isovalues to morph between: sweep=('20%', '30%', 9)")
            if color != "none" or color_by is not None or format is not None:
                raise UsageError("morph with color, color_by or format, expected it without: a morphing mesh has no colours and is a .glb")
            with _progress.shown(progress, "writing meshes") as report:
                vertices, triangles, _ = _native.write_morph(self._native, name, isovalues, appearance, report)
            rows = [(one, name, vertices, triangles) for one in isovalues]
        else:
            shown: list[tuple[float, int | None, float | None]]
            shown = self._surfaces(c) if isovalues is None else [(one, None, None) for one in isovalues]
            volumes = self._volumes(volume, color_by)
            with _progress.shown(progress, "writing meshes") as report:
                rows = _native.extract(self._native, name, format, shown, sweep is not None, appearance, volumes, report)
        numbers = {"isovalue": [row[0] for row in rows], "vertices": [row[2] for row in rows], "triangles": [row[3] for row in rows]}
        return structured({**numbers, "file": [row[1] for row in rows]})

    @public
    def film(
        self,
        path: str | os.PathLike[str],
        c: Shown = None,
        *,
        sweep: Sweep | None = None,
        turntable: SupportsIndex | None = None,
        fps: SupportsIndex | None = None,
        progress: _progress.Progress = True,
        **options: Unpack[DrawingOptions],
    ) -> None:
        """Write a film, or numbered pictures: over the isovalues, or around the surface; as ``isospectrum render``.

        Parameters
        ----------
        path : path
            A film (.mp4, .webm), which needs ``ffmpeg``, or a pattern such as ``"frames/%04d.png"``, numbered from 0.
        c : isovalue, or several, optional
            The surfaces of a turntable, as in :meth:`render`.
        sweep : two isovalues and a number, optional
            One picture for each of so many evenly spaced isovalues, both ends included: ``("10%", "90%", 120)``. The camera fits all.
        turntable : int, optional
            Number of pictures from all around the vertical axis, all of the same scale.
        fps : int, default 30
            Pictures per second of a film.
        progress : bool or callable, default True
            As for :func:`isospectrum.compute`.
        **options
            As for :meth:`render`.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="blobs:12", progress=False)
        >>> s.film("frames/%d.png", sweep=("20%", "60%", 3), size=(64, 48), label="c = {isovalue}")
        """
        if (sweep is None) == (turntable is None):
            raise UsageError("a film without sweep or turntable, or with both, expected one: sweep=('10%', '90%', 120) or turntable=90")
        for one in options:
            if one not in DEFAULTS:
                self.render(**options)
        chosen = {**DEFAULTS, **options}
        frames: list[tuple[float, str | None]] = []
        surfaces: list[tuple[float, int | None, float | None]] = []
        label = chosen["label"]
        if sweep is not None:
            frames = [(one, labelled(label, [one])) for one in self._sweep(sweep, c)]
        else:
            surfaces = self._surfaces(c)
            label = labelled(label, [surface[0] for surface in surfaces])
        with _progress.shown(progress, "rendering") as report:
            _native.film(
                self._native,
                path_of(path),
                optional(whole, fps, "fps", 1, 240),
                frames,
                surfaces,
                optional(whole, turntable, "turntable", 2, MAX_FRAMES),
                self._pictured({**chosen, "label": label}),
                self._appearance_arguments(chosen),
                self._volumes(chosen["volume"], chosen["color_by"]),
                report,
            )

    def _sweep(self, sweep: Any, c: Any) -> list[float]:
        """The isovalues of a sweep."""
        if c is not None:
            raise UsageError(f"isovalue {c!r} and sweep, expected one of them")
        try:
            low, high, n = sweep.split(":") if isinstance(sweep, str) else sweep
            n = int(n) if isinstance(n, str) else n
        except (TypeError, ValueError):
            raise UsageError(f"sweep {sweep!r}, expected two isovalues and a number, such as ('10%', '90%', 40)") from None
        first, last = self.isovalue(low), self.isovalue(high)
        return list(evenly_spaced(first, last, whole(n, "number of a sweep", 2, MAX_FRAMES)))
