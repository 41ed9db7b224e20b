"""Spectra: the mesh at any isovalue, and all that is made of it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from . import _native, _progress
from ._errors import UsageError
from ._mesh import Mesh
from ._picture import Picture
from ._report import Report
from ._sources import triple, volume

if TYPE_CHECKING:
    from ._widget import Widget

#: A number, or a text such as ``"50%"``, ``"p99"``, ``"2.5sigma"``, ``"top:1%"``.
Isovalue = Union[float, int, str]

#: Colours of surfaces by name, as they are seen (sRGB).
COLORS = {
    "blue": 0x85A9CD, "orange": 0xD9A46C, "green": 0x5FAE84, "pink": 0xD184B4, "yellow": 0xE0C95A, "red": 0xC8503C,
    "violet": 0x8C7AC2, "white": 0xF2F2F2, "grey": 0xA0A4AA, "bone": 0xE8DCC0, "skin": 0xE0B090, "muscle": 0xB0564A,
}  # fmt: skip


def as_text(isovalue: Isovalue) -> str:
    """An isovalue as it is written."""
    if isinstance(isovalue, str):
        return isovalue
    try:
        return repr(float(isovalue))
    except (TypeError, ValueError):
        raise UsageError(f"isovalue {isovalue!r}, expected a number or a text such as '50%'") from None


class Spectrum:
    """The isosurfaces of all isovalues of a range.

    :func:`isospectrum.compute` makes one of a volume, :func:`isospectrum.open` reads one. It does not change, may be used by
    several threads at once, and can be pickled.
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

    # What it is of.

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest isovalue."""
        low, high = self._about["range"]
        return (low, high)

    @property
    def tolerance(self) -> float:
        """The tolerance it was computed for, in voxels (the smallest spacing)."""
        return self._about["tolerance"]

    @property
    def volume(self) -> dict[str, Any]:
        """What is known of the volume: ``name``, ``dims`` (x, y, z), ``sample_type``, ``range``, ``placement``."""
        return self._about["volume"]

    @property
    def parameters(self) -> dict[str, Any]:
        """How it was computed: every flag, the backend, what was done to the volume before."""
        return self._about["parameters"]

    @property
    def counts(self) -> dict[str, int]:
        """How often the sweep met trouble, and what it did then; empty of a spectrum that another program wrote."""
        return self._about["parameters"].get("counts") or {}

    @property
    def n_triangles(self) -> int:
        """How many triangles it has in all; a mesh has those that live at its isovalue."""
        return self._about["n_triangles"]

    @property
    def n_vertices(self) -> int:
        """How many vertices, each with a trajectory."""
        return self._about["n_vertices"]

    @property
    def n_knots(self) -> int:
        """How many knots all trajectories have."""
        return self._about["n_knots"]

    def isovalue(self, c: Isovalue | None = None) -> float:
        """The number that a written isovalue means here; of none, the one at which a page opens: 50 % of the range, or the
        nearest with more than a trace to see."""
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

        Successive isovalues cost what changes between them.

        Parameters
        ----------
        c
            The isovalue.
        open
            Leave out the triangles that close the mesh at the border of the volume, and beyond its mask; without a word they
            are left out where the spectrum has a mask.
        keep
            Keep this many components, the largest by enclosed volume; ``"largest"`` is 1.
        min_volume, min_area
            Leave out components that enclose less volume, or have less area: cubes and squares of the unit of the spacing.
        at
            Keep the component whose surface is nearest to this point of the world (x, y, z), of those that are large enough.

        Raises
        ------
        isospectrum.RangeError
            Where the isovalue lies outside :attr:`range`.
        """
        return Mesh(self._native, self.isovalue(c), self._is_open(open), _kept(keep, min_volume, min_area, at))

    def _is_open(self, open: bool | None) -> bool:  # noqa: A002 (as --open)
        """Whether meshes are open: as is said, else where there is a mask."""
        return "mask" in self.parameters.get("preparation", {}) if open is None else bool(open)

    def sweep(
        self, n: int, low: Isovalue | None = None, high: Isovalue | None = None, **options: Any
    ) -> Iterator[Mesh]:
        """The meshes at ``n`` isovalues from ``low`` to ``high`` (both included, the ends of the range without them), one
        after the other, each at the cost of what changes. ``options`` are those of :meth:`mesh`; ``low`` may be the higher
        one."""
        if n < 1:
            raise UsageError(f"sweep of {n} meshes, expected 1 or more")
        first = self.range[0] if low is None else self.isovalue(low)
        last = self.range[1] if high is None else self.isovalue(high)
        for i in range(n):
            t = i / (n - 1) if n > 1 else 0.0
            # Weighted, so that both ends are met exactly; between them for any rounding.
            c = min(max(first * (1 - t) + last * t, min(first, last)), max(first, last))
            yield self.mesh(c, **options)

    # Tables.

    @property
    def curves(self) -> np.ndarray:
        """What the isosurfaces measure at 129 evenly spaced isovalues: a structured array of ``isovalue``, ``components``,
        ``euler``, ``area`` (without caps), ``volume`` (enclosed, caps included; world units) and ``triangles``."""
        if "_curves" not in self.__dict__:
            self._curves = structured(self._native.curves(129))
        return self._curves

    @property
    def events(self) -> np.ndarray:
        """Every change of topology: a structured array of ``isovalue``, ``x``, ``y``, ``z`` (world) and ``kind`` (emerge,
        merge, handle-open, split, handle-close, vanish; seen upwards)."""
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
        NaN where it reaches the end of the range), ``splits_from`` and ``merges_into`` (the number of the larger component;
        0 where it appears or vanishes by itself), ``min_x`` to ``max_z`` (the box around it). World units.
        """
        columns = self._native.components(self.isovalue(c), _kept(keep, min_volume, min_area, at))
        for side in ("min", "max"):
            corners = columns.pop(side)
            columns.update({f"{side}_{axis}": corners[:, i] for i, axis in enumerate("xyz")})
        return structured(columns)

    # Files, pages, pictures.

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it to a file (``.isp``, or ``.thesis``), which appears when it is complete, or not at all."""
        self._native.save(os.fspath(path))

    def html(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        c: Isovalue | None = None,
        title: str | None = None,
        caption: str | None = None,
        credit: str | None = None,
        marks: dict[str, Isovalue] | None = None,
        range: Sequence[Isovalue] | None = None,  # noqa: A002 (as --range)
        tolerance: float = 0.0,
        step: float | None = None,
        open: bool | None = None,  # noqa: A002 (as --open)
        camera: Sequence[float] | None = None,
        axes: bool = False,
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
        volume: Any = None,
        still: bool = True,
    ) -> str | None:
        """Write it as one web page with a slider for the isovalue; returns the page where there is no path.

        Parameters
        ----------
        c
            Isovalue it opens at.
        title, caption, credit
            Heading, what is to be seen, whose work it is.
        marks
            Isovalues that are offered, by name: ``{"bone": 1200, "skin": -200}``.
        range, tolerance, step
            Publish these isovalues only; leave out knots within this distance; round positions to multiples (voxels).
        open, camera, axes
            Without the caps; (azimuth, elevation[, distance]) in degrees; with the box, the axes and a scale bar.
        keep, min_volume, min_area, at
            As in :meth:`mesh`.
        volume
            The volume (as for :func:`isospectrum.compute`), for its histogram; its samples do not go into the page.
        still
            Whether a picture goes into it for those who can see no other; needs an adapter, and is left out without one.
        """
        of = None if volume is None else _volume_like(volume, self)
        page = self._native.html(
            None if c is None else self.isovalue(c),
            title,
            caption,
            credit,
            [(self.isovalue(c), name) for name, c in (marks or {}).items()],
            None if range is None else _pair(range, self),
            tolerance,
            step,
            self._is_open(open),
            None if camera is None else _camera(camera),
            axes,
            _kept(keep, min_volume, min_area, at),
            of,
            still,
        )
        if path is None:
            return page
        _write_beside(os.fspath(path), page.encode())
        return None

    def render(
        self,
        c: Isovalue | dict[Isovalue, str] | Sequence[Isovalue] | None = None,
        *,
        size: Sequence[int] = (1024, 768),
        camera: Sequence[float] | None = None,
        color: str = "none",
        background: str = "white",
        wireframe: bool = False,
        opacity: float = 1.0,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: int | str | None = None,
        min_volume: float = 0.0,
        min_area: float = 0.0,
        at: Sequence[float] | None = None,
        fit: str = "surface",
        adapter: str | None = None,
    ) -> Picture:
        """A picture of the isosurface, drawn without a window: an array (rows, columns, 4) of uint8 that notebooks show.

        Parameters
        ----------
        c
            An isovalue, several, or several with a colour each: ``{1200: "bone", -200: "skin@0.3"}`` (a name or ``#rrggbb``,
            and an opacity).
        size
            Width and height, pixels.
        camera
            Azimuth and elevation in degrees, and the distance; 1 just shows what ``fit`` says (``"surface"`` or
            ``"volume"``).
        color
            What the colours show: none, quality, lifetime, curvature, component or normal.
        background
            white, light, dark or transparent.

        Raises
        ------
        isospectrum.GpuError
            Where there is no adapter (Mesa's software one will do).
        """
        if fit not in ("surface", "volume"):
            raise UsageError(f"fit {fit!r}, expected surface or volume")
        if isinstance(c, dict):
            surfaces = [(self.isovalue(one), *_look(look)) for one, look in c.items()]
        else:
            several = c if isinstance(c, Sequence) and not isinstance(c, str) else [c]
            if isinstance(c, np.ndarray):
                several = np.atleast_1d(c).tolist()
            surfaces = [(self.isovalue(one), None, None) for one in several]
        width, height = (int(n) for n in size)
        native = self._native.render(
            surfaces,
            (width, height),
            None if camera is None else _camera(camera),
            color,
            background,
            wireframe,
            opacity,
            self._is_open(open),
            _kept(keep, min_volume, min_area, at),
            fit == "volume",
            adapter,
        )
        return Picture.of(native)

    def widget(self, c: Isovalue | None = None, **options: Any) -> Widget:
        """A picture with a slider, for notebooks (JupyterLab, VS Code, Colab, marimo): needs anywidget.

        ``w.isovalue`` follows the slider, and the slider follows it; ``w.observe`` tells of changes. ``options`` are ``height``
        (pixels) and those of :meth:`html`.
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
        """Measure it against the volume it was computed from, given as it was to :func:`isospectrum.compute` (``frame`` may
        have ``nan_as``): what was done to the volume before is done again.

        ``n`` random isovalues, both sides of up to ``events`` events, and as many isovalues where triangles change. A
        spectrum that fails is no error: the report says so (:meth:`Report.check`).
        """
        of = _volume_like(a, self, **frame)
        with _progress.shown(progress, "verifying") as told:
            return Report(self._native.verify(of, n, events, seed, told))


def _from_bytes(data: bytes) -> Spectrum:
    return Spectrum(_native.Spectrum.from_bytes(data))


def _volume_like(a: Any, spectrum: Spectrum, **frame: Any) -> _native.Volume:
    """A volume with the spacing that a spectrum's had before it was prepared: an array does not tell it."""
    each = spectrum.parameters.get("preparation", {}).get("downsample") or 1
    frame.setdefault("spacing", [s / each for s in spectrum.volume["placement"]["spacing"]])
    return volume(a, **frame)


def _kept(keep: int | str | None, min_volume: float, min_area: float, at: Any) -> tuple[Any, ...] | None:
    """Which components are kept; none of the limits is None."""
    if keep is None and not min_volume and not min_area and at is None:
        return None
    number = 1 if keep == "largest" else keep
    if number is not None and (not isinstance(number, (int, np.integer)) or number < 1):
        raise UsageError(f"keep {keep!r}, expected 'largest' or a number of components")
    for value, name in ((min_volume, "min_volume"), (min_area, "min_area")):
        if not 0 <= value < float("inf"):
            raise UsageError(f"{name} {value!r}, expected 0 or a number above")
    return (number, float(min_volume), float(min_area), None if at is None else triple(at, "at"))


def _camera(camera: Sequence[float]) -> tuple[float, float, float]:
    try:
        azimuth, elevation, *rest = (float(x) for x in camera)
        (distance,) = rest or [1.0]
    except (TypeError, ValueError):
        raise UsageError(f"camera {camera!r}, expected azimuth, elevation and maybe a distance") from None
    return (azimuth, elevation, distance)


def _pair(ends: Sequence[Isovalue], spectrum: Spectrum) -> tuple[float, float]:
    try:
        low, high = ends
    except (TypeError, ValueError):
        raise UsageError(f"range {ends!r}, expected the lowest and the highest isovalue") from None
    return (spectrum.isovalue(low), spectrum.isovalue(high))


def _look(look: str) -> tuple[int | None, float | None]:
    """``skin@0.3``: a colour and an opacity."""
    name, _, opacity = look.partition("@")
    code = COLORS.get(name)
    try:
        if code is None and name:
            if not (name.startswith("#") and len(name) == 7):
                raise ValueError
            code = int(name[1:], 16)
        share = float(opacity) if opacity else None
    except ValueError:
        raise UsageError(f"look {look!r}, expected #rrggbb or one of {', '.join(COLORS)}, and maybe @opacity") from None
    return code, share


def structured(columns: dict[str, Any]) -> np.ndarray:
    """Columns as one structured array."""
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    if not len(next(iter(arrays.values()))):
        # A column of texts without any tells no type.
        arrays = {name: a.astype("U12") if a.dtype == float and name == "kind" else a for name, a in arrays.items()}
    table = np.empty(len(next(iter(arrays.values()))), dtype=[(name, a.dtype) for name, a in arrays.items()])
    for name, array in arrays.items():
        table[name] = array
    return table


def _write_beside(path: str, data: bytes) -> None:
    """Writes a file beside its place, and moves it there when it is complete."""
    _native.write_file(path, data)
