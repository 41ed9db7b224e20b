"""Spectra: the mesh at any isovalue, and all that is made of it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
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

#: One isovalue, several, or several with a colour each.
Shown = Union[Isovalue, "dict[Isovalue, str]", Sequence[Isovalue], None]

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
        """Write it as one web page with a slider for the isovalue; returns the page where there is no path.

        Parameters
        ----------
        c
            Isovalue it opens at. Of several, as in :meth:`render`, the first is that of the slider, and the others stay in
            sight.
        title, caption, credit
            Heading, what is to be seen, whose work it is.
        marks
            Isovalues that are offered, by name: ``{"bone": 1200, "skin": -200}``.
        range, tolerance, step
            Publish these isovalues only; leave out knots within this distance; round positions to multiples (voxels).
        camera, up, orthographic, color, color_by, color_map, color_range, color_center, light, clip, opacity, occlusion, wireframe
            How it looks at first, as in :meth:`render`; the colours none, quality, lifetime, curvature and component.
        background
            white, light or dark at first; else what the reader's page is like.
        axes
            With the box, the axes and a scale bar at first.
        open
            Without the caps.
        keep, min_volume, min_area, at
            As in :meth:`mesh`.
        volume
            The volume (as for :func:`isospectrum.compute`), for its histogram; its samples do not go into the page.
        still
            Whether a picture goes into it for those who can see no other; needs an adapter, and is left out without one.
        """
        sight = self._sight(locals())
        page = self._native.html(
            [] if c is None else self._surfaces(c),
            title,
            caption,
            credit,
            [(self.isovalue(c), name) for name, c in (marks or {}).items()],
            None if range is None else _pair(range, self),
            tolerance,
            step,
            sight,
            None if volume is None else _volume_like(volume, self),
            None if color_by is None else _field_like(color_by, self),
            still,
        )
        if path is None:
            return page
        _write_beside(os.fspath(path), page.encode())
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
        up, orthographic
            The axis of the volume that points up (``"x"``, ``"-x"``, ...; else the z axis of the world); parallel projection.
        color
            What the colours show: none, quality, lifetime, curvature, distance (to the isosurface: needs ``volume``),
            component or normal.
        color_by
            Another volume, whose values the colours show in place of ``color``: what can be a volume for
            :func:`isospectrum.compute`; an array has the frame of this one's volume.
        color_map
            viridis, cividis, magma, inferno, plasma, or vik with a neutral middle; else one that suits.
        color_range, color_center
            Numbers of the first and the last colour, a pair or a text such as ``"p5:p95"``; number of the middle one.
        legend
            Whether a legend tells what colours show.
        background
            white, light, dark or transparent.
        light
            Where the main light is: upper-left, eye, left, right, above or below.
        clip
            A plane across an axis of the volume beyond which nothing is drawn, at a share of its length or a length from the
            first sample: ``"x:50%"``, ``"z:12.5"``, or ``"-x:50%"`` for the other side.
        opacity
            How much of what lies behind the surface hides, 0 to 1.
        occlusion, wireframe
            Darken hollows; draw the edges of the triangles.
        axes, scale_bar
            The box of the volume, the axes of the world and a scale bar; a scale bar alone.
        label
            Words at the top; ``{isovalue}`` stands for the isovalue.
        volume
            The volume, for the colours of the distance.

        Raises
        ------
        isospectrum.GpuError
            Where there is no adapter (Mesa's software one will do).
        """
        if fit not in ("surface", "volume"):
            raise UsageError(f"fit {fit!r}, expected surface or volume")
        surfaces = self._surfaces(c)
        if label is not None:
            label = label.replace("{isovalue}", ", ".join(f"{one[0]:.6g}" for one in surfaces))
        width, height = (int(n) for n in size)
        sight = self._sight(locals())
        native = self._native.render(
            surfaces,
            (width, height),
            sight,
            legend,
            scale_bar,
            label,
            fit == "volume",
            None if volume is None else _volume_like(volume, self),
            None if color_by is None else _field_like(color_by, self),
            adapter,
        )
        return Picture.of(native)

    def _sight(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """How a picture or a page looks, as the library takes it: of a method's arguments those that tell it."""
        texts = ("up", "color", "color_map", "color_center", "background", "light")
        flags = ("orthographic", "occlusion", "wireframe", "axes")
        camera, clip = told["camera"], told["clip"]
        return {
            **{name: told[name] for name in texts},
            **{flag: bool(told[flag]) for flag in flags},
            "camera": None if camera is None else _camera(camera),
            "color_range": _color_range(told["color_range"]),
            "clip": None if clip is None else _clip(clip, self),
            "opacity": _share(told["opacity"]),
            "open": self._is_open(told["open"]),
            "keep": _kept(told["keep"], told["min_volume"], told["min_area"], told["at"]),
        }

    def _surfaces(self, c: Shown) -> list[tuple[float, int | None, float | None]]:
        """Isovalues that are shown, each with its colour and opacity."""
        if isinstance(c, dict):
            return [(self.isovalue(one), *_look(look)) for one, look in c.items()]
        several = c if isinstance(c, Sequence) and not isinstance(c, str) else [c]
        if isinstance(c, np.ndarray):
            several = np.atleast_1d(c).tolist()
        if not several:
            raise UsageError(f"isovalues {c!r}, expected one or more")
        return [(self.isovalue(one), None, None) for one in several]

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


def _field_like(a: Any, spectrum: Spectrum) -> _native.Volume:
    """A volume that lies where a spectrum's does, where it does not tell it itself."""
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


def _share(opacity: float) -> float:
    if not 0 <= opacity <= 1:
        raise UsageError(f"opacity {opacity!r}, expected a number from 0 to 1")
    return float(opacity)


def _color_range(ends: str | Sequence[float | str | None] | None) -> str | None:
    """``LOW:HIGH`` as the command line reads it."""
    if ends is None or isinstance(ends, str):
        return ends
    try:
        low, high = ("" if end is None else str(end) for end in ends)
    except (TypeError, ValueError):
        raise UsageError(f"color_range {ends!r}, expected the numbers of the first and the last colour") from None
    return f"{low}:{high}"


def _clip(clip: str, spectrum: Spectrum) -> tuple[tuple[float, float, float], float]:
    """A plane in the voxel frame: its normal, towards what is left out, and where it lies along that."""
    about = spectrum.volume
    side, rest = ("-", clip.strip()[1:]) if clip.strip().startswith("-") else ("", clip.strip())
    axis, _, place = rest.partition(":")
    try:
        a = ("x", "y", "z").index(axis)
        number = float(place.removesuffix("%"))
        if not abs(number) < float("inf") or (place.endswith("%") and not 0 <= number <= 100):
            raise ValueError
    except ValueError:
        raise UsageError(f"clip {clip!r}, expected an axis and a place such as 'x:50%', '-z:12.5'") from None
    spacing = about["placement"]["spacing"]
    length = number / 100 * (about["dims"][a] - 1) * spacing[a] if place.endswith("%") else number
    sign = -1.0 if side else 1.0
    x, y, z = (sign if i == a else 0.0 for i in range(3))
    return (x, y, z), sign * length / min(spacing)


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
