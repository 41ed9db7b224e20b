"""Spectra: meshes at any isovalue, tables, pictures, pages and files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from . import _appearance, _native, _progress
from ._errors import UsageError
from ._isovalue import Isovalue, as_text
from ._mesh import Mesh
from ._picture import Picture
from ._report import Report
from ._sources import volume

if TYPE_CHECKING:
    from ._widget import Widget

#: One isovalue, several, or several with a colour each.
Shown = Union[Isovalue, "dict[Isovalue, str]", Sequence[Isovalue], None]


class Spectrum:
    """The isosurfaces of a volume at all isovalues of a range.

    Returned by :func:`isospectrum.compute` and :func:`isospectrum.open`. A spectrum is immutable, may be used by several threads at
    once, and can be pickled.
    """

    def __init__(self, native: _native.Spectrum) -> None:
        self._native = native
        self._about: dict[str, Any] = json.loads(native.about())

    def __repr__(self) -> str:
        about = self._about
        name, (low, high) = about["volume"]["name"], self.range
        return f"<isospectrum.Spectrum of {name}: {low:g} to {high:g}, {about['n_triangles']} triangles>"

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
        return self._about["tolerance"]

    @property
    def volume(self) -> dict[str, Any]:
        """Description of the volume: ``name``, ``dims`` (x, y, z), ``sample_type``, ``range``, ``placement``."""
        return self._about["volume"]

    @property
    def parameters(self) -> dict[str, Any]:
        """Record of the computation: flags, backend, and the preparation of the volume."""
        return self._about["parameters"]

    @property
    def counts(self) -> dict[str, int]:
        """Statistics of the sweep; empty for a spectrum written by another program."""
        return self._about["parameters"].get("counts") or {}

    @property
    def n_triangles(self) -> int:
        """Number of triangles of all isovalues; a mesh has those that are alive at its isovalue."""
        return self._about["n_triangles"]

    @property
    def n_vertices(self) -> int:
        """Number of vertices, each with a trajectory."""
        return self._about["n_vertices"]

    @property
    def n_knots(self) -> int:
        """Number of knots of all trajectories."""
        return self._about["n_knots"]

    def isovalue(self, c: Isovalue | None = None) -> float:
        """An isovalue as a number. ``None`` is the isovalue at which a page opens: 50 % of the range, or the nearest at which the
        isosurface is large enough to see."""
        if c is None:
            return self._about["shown_first"]
        if isinstance(c, str):
            return self._native.isovalue(c)
        as_text(c)
        return float(c)

    # Meshes.

    def mesh(
        self,
        c: Isovalue | None = None,
        *,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
    ) -> Mesh:
        """The mesh at an isovalue, in the world frame.

        The cost of successive isovalues is that of the triangles that change between them.

        Parameters
        ----------
        c
            The isovalue.
        open
            Leave out the triangles that close the mesh at the border of the volume and beyond its mask. The default is to leave
            them out if the spectrum has a mask.
        keep
            Number of components to keep, the largest by enclosed volume; ``"largest"`` is 1.
        min_volume, min_area
            Leave out components with a smaller enclosed volume or area, in cubes and squares of the unit of the spacing.
        at
            Keep the component nearest to this point (x, y, z) in the world frame, among those that are large enough.

        Raises
        ------
        isospectrum.RangeError
            If the isovalue is outside :attr:`range`.
        """
        return Mesh(self._native, self.isovalue(c), self._is_open(open), _appearance.kept(keep, min_volume, min_area, at))

    def _is_open(self, open: bool | None) -> bool:  # noqa: A002 (as --open)
        """True if meshes are open: the argument, or whether there is a mask."""
        return "mask" in self.parameters.get("preparation", {}) if open is None else bool(open)

    def sweep(
        self, n: int, low: Isovalue | None = None, high: Isovalue | None = None, **options: Any
    ) -> Iterator[Mesh]:
        """Iterate over the meshes at ``n`` evenly spaced isovalues from ``low`` to ``high``, both included; by default the ends of
        the range. ``low`` may be above ``high``. ``options`` are those of :meth:`mesh`."""
        if n < 1:
            raise UsageError(f"sweep of {n} meshes, expected 1 or more")
        first = self.range[0] if low is None else self.isovalue(low)
        last = self.range[1] if high is None else self.isovalue(high)
        for i in range(n):
            t = i / (n - 1) if n > 1 else 0.0
            # A weighted mean gives both ends exactly; clamped against rounding.
            c = min(max(first * (1 - t) + last * t, min(first, last)), max(first, last))
            yield self.mesh(c, **options)

    # Tables.

    @property
    def curves(self) -> np.ndarray:
        """Measures of the isosurfaces at 129 evenly spaced isovalues: a structured array of ``isovalue``, ``components``,
        ``euler``, ``area`` (without caps), ``volume`` (enclosed, caps included; world units) and ``triangles``."""
        if "_curves" not in self.__dict__:
            self._curves = structured(self._native.curves(129))
        return self._curves

    @property
    def events(self) -> np.ndarray:
        """All changes of topology: a structured array of ``isovalue``, ``x``, ``y``, ``z`` (world frame) and ``kind`` (emerge,
        merge, handle-open, split, handle-close, vanish; for ascending isovalues)."""
        return structured(self._native.events())

    def components(
        self,
        c: Isovalue | None = None,
        *,
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
    ) -> np.ndarray:
        """The components of the isosurface at an isovalue, the largest first: a structured array with the columns of
        ``isospectrum components --csv``.

        ``number`` (from 1), ``is_cavity``, ``volume``, ``area``, ``euler``, ``triangles``, ``birth`` and ``death`` (isovalues;
        NaN at the end of the range), ``splits_from`` and ``merges_into`` (number of the larger component; 0 if it emerges or
        vanishes), ``min_x`` to ``max_z`` (bounding box). All in world units.
        """
        columns = self._native.components(self.isovalue(c), _appearance.kept(keep, min_volume, min_area, at))
        for side in ("min", "max"):
            corners = columns.pop(side)
            columns.update({f"{side}_{axis}": corners[:, i] for i, axis in enumerate("xyz")})
        return structured(columns)

    # Files, pages, pictures.

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file (``.isp`` or ``.thesis``) atomically."""
        self._native.save(os.fspath(path))

    def html(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        c: Shown = None,
        title: str | None = None,
        caption: str | None = None,
        credit: str | None = None,
        marks: dict[str, Isovalue] | None = None,
        range: Sequence[Isovalue] | None = None,  # noqa: A002 (as --range)
        tolerance: float = 0.0,
        step: float | None = None,
        camera: Sequence[float] | None = None,
        up: str | None = None,
        orthographic: bool = False,
        color: str = "none",
        color_by: Any = None,
        color_map: str | None = None,
        color_range: str | Sequence[float | str | None] | None = None,
        color_center: float | None = None,
        background: str | None = None,
        light: str = "upper-left",
        clip: str | None = None,
        opacity: float = 1.0,
        occlusion: bool = False,
        wireframe: bool = False,
        axes: bool = False,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
        volume: Any = None,
        still: bool = True,
    ) -> str | None:
        """Write a web page with a slider for the isovalue, in one file; without a path, return the page.

        Parameters
        ----------
        c
            Isovalue at which the page opens. Of several, as in :meth:`render`, the first is that of the slider, and the others are
            always shown.
        title, caption, credit
            Heading, text below the picture, and author.
        marks
            Named isovalues offered to the reader: ``{"bone": 1200, "skin": -200}``.
        range, tolerance, step
            Isovalues to publish; distance within which knots are left out; multiples to which positions are rounded (voxels).
        camera, up, orthographic, color, color_by, color_map, color_range, color_center, light, clip, opacity, occlusion, wireframe
            Initial appearance, as in :meth:`render`; colours are none, quality, lifetime, curvature or component.
        background
            Initial background: white, light or dark; by default that of the reader's browser.
        axes
            Show the box, the axes and a scale bar initially.
        open
            Leave out the caps, as in :meth:`mesh`.
        keep, min_volume, min_area, at
            As in :meth:`mesh`.
        volume
            The volume (as for :func:`isospectrum.compute`), for its histogram; the page does not contain its samples.
        still
            Include a picture for readers without WebGPU and WebGL. It needs a GPU adapter, and is left out without one.
        """
        appearance = self._appearance_arguments(locals())
        page = self._native.html(
            [] if c is None else self._surfaces(c),
            title,
            caption,
            credit,
            [(self.isovalue(c), name) for name, c in (marks or {}).items()],
            None if range is None else _pair(range, self),
            tolerance,
            step,
            appearance,
            None if volume is None else _volume_like(volume, self),
            None if color_by is None else _field_like(color_by, self),
            still,
        )
        if path is None:
            return page
        _native.write_file(os.fspath(path), page.encode())
        return None

    def render(
        self,
        c: Shown = None,
        *,
        size: Sequence[int] = (1024, 768),
        camera: Sequence[float] | None = None,
        up: str | None = None,
        orthographic: bool = False,
        color: str = "none",
        color_by: Any = None,
        color_map: str | None = None,
        color_range: str | Sequence[float | str | None] | None = None,
        color_center: float | None = None,
        legend: bool = True,
        background: str = "white",
        light: str = "upper-left",
        clip: str | None = None,
        opacity: float = 1.0,
        occlusion: bool = False,
        wireframe: bool = False,
        axes: bool = False,
        scale_bar: bool = False,
        label: str | None = None,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
        fit: str = "surface",
        volume: Any = None,
        adapter: str | None = None,
    ) -> Picture:
        """Draw a picture of the isosurface off screen: an array (rows, columns, 4) of uint8, which notebooks display.

        Parameters
        ----------
        c
            An isovalue, several, or several with a colour each: ``{1200: "bone", -200: "skin@0.3"}`` (a name or ``#rrggbb``,
            and an opacity).
        size
            Width and height, pixels.
        camera
            Azimuth and elevation in degrees, and a distance relative to the one at which ``fit`` (``"surface"`` or ``"volume"``)
            fills the picture.
        up, orthographic
            Axis of the volume that points up (``"x"``, ``"-x"``, ...; by default the z axis of the world); parallel projection.
        color
            Quantity that the colours show: none, quality, lifetime, curvature, distance (to the isosurface; needs ``volume``),
            component or normal.
        color_by
            Another volume (as for :func:`isospectrum.compute`), whose values the colours show in place of ``color``. An array has the
            frame of the spectrum's volume.
        color_map
            viridis, cividis, magma, inferno, plasma, or vik with a neutral middle; by default one that suits the quantity.
        color_range, color_center
            Values of the first and the last colour, a pair or a text such as ``"p5:p95"``; value of the middle colour.
        legend
            Draw a legend of the colours.
        background
            white, light, dark or transparent.
        light
            Direction of the main light: upper-left, eye, left, right, above or below.
        clip
            Clip plane perpendicular to an axis of the volume, at a share of its length or a distance from the first sample:
            ``"x:50%"``, ``"z:12.5"``, or ``"-x:50%"`` to keep the other side.
        opacity
            Opacity of the surface, 0 to 1.
        occlusion, wireframe
            Ambient occlusion; draw the edges of the triangles.
        axes, scale_bar
            The box of the volume, the axes of the world and a scale bar; a scale bar alone.
        label
            Text at the top; ``{isovalue}`` is replaced by the isovalue.
        volume
            The volume, for ``color="distance"``.

        Raises
        ------
        isospectrum.GpuError
            If there is no GPU adapter (Mesa's software adapter suffices).
        """
        if fit not in ("surface", "volume"):
            raise UsageError(f"fit {fit!r}, expected surface or volume")
        surfaces = self._surfaces(c)
        if label is not None:
            label = label.replace("{isovalue}", ", ".join(f"{one[0]:.6g}" for one in surfaces))
        width, height = (int(n) for n in size)
        appearance = self._appearance_arguments(locals())
        native = self._native.render(
            surfaces,
            (width, height),
            appearance,
            legend,
            scale_bar,
            label,
            fit == "volume",
            None if volume is None else _volume_like(volume, self),
            None if color_by is None else _field_like(color_by, self),
            adapter,
        )
        return Picture.of(native)

    def _appearance_arguments(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments of a method that describe the appearance, converted for the library."""
        texts = ("up", "color", "color_map", "color_center", "background", "light")
        flags = ("orthographic", "occlusion", "wireframe", "axes")
        camera, clip = arguments["camera"], arguments["clip"]
        return {
            **{name: arguments[name] for name in texts},
            **{flag: bool(arguments[flag]) for flag in flags},
            "camera": None if camera is None else _appearance.camera(camera),
            "color_range": _appearance.color_range(arguments["color_range"]),
            "clip": None if clip is None else _appearance.clip(clip, self.volume),
            "opacity": _appearance.share(arguments["opacity"]),
            "open": self._is_open(arguments["open"]),
            "keep": _appearance.kept(arguments["keep"], arguments["min_volume"], arguments["min_area"], arguments["at"]),
        }

    def _surfaces(self, c: Shown) -> list[tuple[float, int | None, float | None]]:
        """The isovalues to show, each with its colour and opacity."""
        if isinstance(c, dict):
            return [(self.isovalue(one), *_appearance.look(look)) for one, look in c.items()]
        several = c if isinstance(c, Sequence) and not isinstance(c, str) else [c]
        if isinstance(c, np.ndarray):
            several = np.atleast_1d(c).tolist()
        if not several:
            raise UsageError(f"isovalues {c!r}, expected one or more")
        return [(self.isovalue(one), None, None) for one in several]

    def widget(self, c: Isovalue | None = None, **options: Any) -> Widget:
        """A picture with a slider for notebooks (JupyterLab, VS Code, Colab, marimo); needs anywidget.

        ``w.isovalue`` and the slider follow each other; ``w.observe`` reports changes. ``options`` are ``height`` (pixels) and those of
        :meth:`html`.
        """
        from ._widget import Widget

        return Widget(self, c, **options)

    def verify(
        self,
        a: Any,
        *,
        n: int = 64,
        events: int = 16,
        seed: int = 0,
        progress: _progress.Progress = True,
        **frame: Any,
    ) -> Report:
        """Verify the spectrum against the volume it was computed from, given as to :func:`isospectrum.compute` (``frame`` may contain
        ``nan_as``); the recorded preparation is repeated.

        Checks ``n`` random isovalues, both sides of up to ``events`` events, and as many isovalues where triangles change. A spectrum
        that fails raises no exception: see :meth:`Report.check`.
        """
        of = _volume_like(a, self, **frame)
        with _progress.shown(progress, "verifying") as report:
            return Report(self._native.verify(of, n, events, seed, report))


def _from_bytes(data: bytes) -> Spectrum:
    return Spectrum(_native.Spectrum.from_bytes(data))


def _volume_like(a: Any, spectrum: Spectrum, **frame: Any) -> _native.Volume:
    """A volume whose spacing, unless its source has one, is that of the spectrum's volume before its preparation."""
    each = spectrum.parameters.get("preparation", {}).get("downsample") or 1
    frame.setdefault("spacing", [s / each for s in spectrum.volume["placement"]["spacing"]])
    return volume(a, **frame)


def _field_like(a: Any, spectrum: Spectrum) -> _native.Volume:
    """A volume; an array gets the frame of the spectrum's volume."""
    if isinstance(a, np.ndarray):
        placement = spectrum.volume["placement"]
        space, unit = (None if placement[name].lower() == "unknown" else placement[name] for name in ("space", "unit"))
        return volume(
            a,
            spacing=placement["spacing"],
            origin=placement["origin"],
            direction=np.transpose(placement["direction"]),
            space=space,
            unit=unit,
        )
    return volume(a)


def _pair(ends: Sequence[Isovalue], spectrum: Spectrum) -> tuple[float, float]:
    try:
        low, high = ends
    except (TypeError, ValueError):
        raise UsageError(f"range {ends!r}, expected the lowest and the highest isovalue") from None
    return (spectrum.isovalue(low), spectrum.isovalue(high))


def structured(columns: dict[str, Any]) -> np.ndarray:
    """Columns as one structured array."""
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    if not len(next(iter(arrays.values()))):
        # NumPy cannot infer the type of an empty column of texts.
        arrays = {name: a.astype("U12") if a.dtype == float and name == "kind" else a for name, a in arrays.items()}
    table = np.empty(len(next(iter(arrays.values()))), dtype=[(name, a.dtype) for name, a in arrays.items()])
    for name, array in arrays.items():
        table[name] = array
    return table
