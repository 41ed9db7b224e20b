"""Pictures, web pages and the widget of a spectrum."""

from __future__ import annotations

import inspect
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat, SupportsIndex

import numpy as np

from . import _appearance, _native
from ._arguments import choice, optional, number, path_of, public, whole
from ._errors import UsageError
from ._isovalue import Isovalue, as_text, two
from ._looks import Background, Color, ColorMap, Light, Numbers, Shown, Slider, Style
from ._picture import Picture
from ._preparation import NOT_NEGATIVE, POSITIVE
from ._sources import volume

if TYPE_CHECKING:
    import numpy.typing as npt

    from ._native import _Volumes

class Drawing:
    """The part of a spectrum that draws. Its users are :class:`isospectrum.Spectrum` and its readers."""

    __slots__ = ()

    _native: _native.Spectrum
    _has_mask: bool

    @property
    def volume(self) -> dict[str, Any]:
        """Description of the volume."""
        raise NotImplementedError

    @property
    def parameters(self) -> dict[str, Any]:
        """Record of the computation."""
        raise NotImplementedError

    def isovalue(self, c: Isovalue | None = None) -> float:
        """An isovalue as a number."""
        raise NotImplementedError

    @public
    def html(
        self,
        path: str | os.PathLike[str] | None = None,
        *,
        c: Shown = None,
        title: str | None = None,
        caption: str | None = None,
        credit: str | None = None,
        marks: Mapping[str, Isovalue] | None = None,
        range: Sequence[Isovalue] | npt.NDArray[Any] | str | None = None,  # noqa: A002 (as --range)
        tolerance: SupportsFloat = 0.0,
        step: SupportsFloat | None = None,
        camera: Numbers | None = None,
        up: str | None = None,
        orthographic: bool = False,
        color: Color = "none",
        color_by: Any = None,
        color_map: ColorMap | None = None,
        color_range: str | Sequence[SupportsFloat | str | None] | npt.NDArray[Any] | None = None,
        color_center: SupportsFloat | None = None,
        style: Style = "default",
        background: Literal["white", "light", "dark"] | None = None,
        light: Light | None = None,
        clip: str | None = None,
        opacity: SupportsFloat = 1.0,
        occlusion: bool | None = None,
        wireframe: bool = False,
        silhouette: bool = False,
        axes: bool = False,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: SupportsIndex | Literal["largest"] | None = None,
        min_volume: SupportsFloat = 0.0,
        min_area: SupportsFloat = 0.0,
        at: Numbers | None = None,
        volume: Any = None,
        slice: bool = False,  # noqa: A002 (as --slice)
        still: bool = True,
    ) -> str | None:
        """Write a web page with a slider for the isovalue, in one file; without a path, return the page.

        Parameters
        ----------
        path : path, optional
            File to write.
        c : isovalue, or several, optional
            Isovalue at which the page opens. Of several, as in :meth:`render`, the first is that of the slider, and the others are
            always shown.
        title, caption, credit : str, optional
            Heading, text below the picture, and author.
        marks : dict, optional
            Named isovalues offered to the reader: ``{"bone": 1200, "skin": -200}``.
        range, tolerance, step : two isovalues, float, float, optional
            Isovalues to publish; distance within which knots are left out; multiples to which positions are rounded (voxels).
        camera, up, orthographic, color, color_by, color_map, color_range, color_center, style, light, clip, opacity, occlusion, wireframe, silhouette : optional
            Initial appearance, as in :meth:`render`; colours are none, quality, lifetime, curvature or component.
        background : {"white", "light", "dark"}, optional
            Initial background: white, light or dark; by default that of the style, else that of the reader's browser.
        axes : bool, default False
            Show the box, the axes and a scale bar initially.
        open : bool, optional
            Leave out the caps, as in :meth:`mesh`.
        keep, min_volume, min_area, at : optional
            As in :meth:`mesh`.
        volume : array, image, or path, optional
            The volume (as for :func:`isospectrum.compute`), for its histogram and slices.
        slice : bool, default False
            Show slices of ``volume`` beside the surface; the page then contains its samples, rounded to 8 bits.
        still : bool, default True
            Include a picture for readers without WebGPU and WebGL. It needs a GPU adapter, and is left out without one.

        Returns
        -------
        str or None
            The page, if no path is given.

        See Also
        --------
        widget : The same in a notebook.

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="sphere:12", progress=False)
        >>> s.html("sphere.html", title="A sphere", marks={"half": 0.5}, still=False)
        """
        if slice and volume is None:
            raise UsageError("slices need the volume of the spectrum: volume=...")
        appearance = self._appearance_arguments(locals())
        page = self._native.html(
            [] if c is None else self._surfaces(c),
            title,
            caption,
            credit,
            [(self.isovalue(c), name) for name, c in (marks or {}).items()],
            None if range is None else _pair(range, self),
            number(tolerance, "tolerance", *NOT_NEGATIVE),
            optional(number, step, "step", *POSITIVE),
            appearance,
            None if volume is None else volume_like(volume, self),
            None if color_by is None else _field_like(color_by, self),
            bool(slice),
            still,
        )
        if path is None:
            return page
        _native.write_file(path_of(path), page.encode())
        return None

    @public
    def render(
        self,
        c: Shown = None,
        *,
        size: Sequence[SupportsIndex] | npt.NDArray[Any] = (1024, 768),
        camera: Numbers | None = None,
        up: str | None = None,
        orthographic: bool = False,
        color: Color = "none",
        color_by: Any = None,
        color_map: ColorMap | None = None,
        color_range: str | Sequence[SupportsFloat | str | None] | npt.NDArray[Any] | None = None,
        color_center: SupportsFloat | None = None,
        legend: bool = True,
        style: Style = "default",
        background: Background | None = None,
        light: Light | None = None,
        clip: str | None = None,
        opacity: SupportsFloat = 1.0,
        occlusion: bool | None = None,
        wireframe: bool = False,
        silhouette: bool = False,
        axes: bool = False,
        scale_bar: bool = False,
        label: str | None = None,
        open: bool | None = None,  # noqa: A002 (as --open)
        keep: SupportsIndex | Literal["largest"] | None = None,
        min_volume: SupportsFloat = 0.0,
        min_area: SupportsFloat = 0.0,
        at: Numbers | None = None,
        fit: Literal["surface", "volume"] = "surface",
        volume: Any = None,
        adapter: str | None = None,
    ) -> Picture:
        """Draw a picture of the isosurface off screen: an array (rows, columns, 4) of uint8, which notebooks display.

        Parameters
        ----------
        c : isovalue, or several, optional
            An isovalue, several, or several with a colour each: ``{1200: "bone", -200: "skin@0.3"}`` (a name or ``#rrggbb``,
            and an opacity; or what matplotlib takes, as ``(1, 0, 0)``).
        size : two ints, default (1024, 768)
            Width and height, pixels.
        camera : two or three floats, optional
            Azimuth and elevation in degrees, and a distance relative to the one at which ``fit`` (``"surface"`` or ``"volume"``)
            fills the picture.
        up, orthographic : str, bool, optional
            Axis of the volume that points up (``"x"``, ``"-x"``, ...; by default the z axis of the world); parallel projection.
        color : {"none", "quality", "lifetime", "curvature", "distance", "component", "normal"}
            Quantity that the colours show: none, quality, lifetime, curvature, distance (to the isosurface; needs ``volume``),
            component or normal.
        color_by : array, image, or path, optional
            Another volume (as for :func:`isospectrum.compute`), whose values the colours show in place of ``color``. An array has the
            frame of the spectrum's volume.
        color_map : str, optional
            viridis, cividis, magma, inferno, plasma, or vik with a neutral middle; by default one that suits the quantity.
        color_range, color_center : two numbers or str, float, optional
            Values of the first and the last colour, a pair or a text such as ``"p5:p95"``; value of the middle colour.
        legend : bool, default True
            Draw a legend of the colours.
        style : {"default", "paper", "studio", "flat"}
            Background, light, colour and occlusion where no other argument gives them: paper (white, a muted colour, occlusion), studio
            (dark, a warm colour, occlusion) or flat (light from the eye, no occlusion).
        background : {"white", "light", "dark", "transparent"}, optional
            white, light, dark or transparent; by default that of the style, else white.
        light : str, optional
            Direction of the main light: upper-left, eye, left, right, above or below; by default that of the style, else upper-left.
        clip : str, optional
            Clip plane perpendicular to an axis of the volume, at a share of its length or a distance from the first sample:
            ``"x:50%"``, ``"z:12.5"``, or ``"-x:50%"`` to keep the other side.
        opacity : float, default 1
            Opacity of the surface, 0 to 1.
        occlusion, wireframe, silhouette : bool, optional
            Ambient occlusion, by default that of the style, else none; draw the edges of the triangles; draw thin lines where the surface
            turns away.
        axes, scale_bar : bool, default False
            The box of the volume, the axes of the world and a scale bar; a scale bar alone.
        label : str, optional
            Text at the top; ``{isovalue}`` is replaced by the isovalue.
        volume : array, image, or path, optional
            The volume, for ``color="distance"``.
        fit : {"surface", "volume"}
            What fills the picture.
        keep, min_volume, min_area, at : optional
            As in :meth:`mesh`.
        open : bool, optional
            Leave out the caps, as in :meth:`mesh`.
        adapter : str, optional
            A part of the name of the GPU adapter.

        Returns
        -------
        Picture
            An array that notebooks display, with a method ``save``.

        Raises
        ------
        isospectrum.GpuError
            If there is no GPU adapter (Mesa's software adapter suffices).

        Examples
        --------
        >>> import isospectrum
        >>> s = isospectrum.compute(phantom="blobs:12", progress=False)
        >>> s.render({"20%": "bone@0.5", "70%": (1, 0, 0)}, size=(64, 48)).shape
        (48, 64, 4)
        """
        surfaces = self._surfaces(c)
        label = labelled(label, [one[0] for one in surfaces])
        pictured, appearance = self._pictured(locals()), self._appearance_arguments(locals())
        volumes = self._volumes(volume, color_by)
        native = self._native.render(surfaces, pictured, appearance, volumes["volume"], volumes["color_by"])
        return Picture.of(native)

    def _pictured(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments of a picture that a page does not have."""
        return {
            "size": _appearance.size(arguments["size"]),
            "fit_volume": choice(arguments["fit"], "fit", ("surface", "volume")) == "volume",
            **{name: bool(arguments[name]) for name in ("legend", "scale_bar")},
            **{name: arguments[name] for name in ("label", "adapter")},
        }

    def _volumes(self, volume: Any, color_by: Any) -> _Volumes:
        """The volumes that colours need, and the files that they are read from."""
        return {
            "volume": None if volume is None else volume_like(volume, self),
            "color_by": None if color_by is None else _field_like(color_by, self),
            "inputs": [os.fspath(one) for one in (volume, color_by) if isinstance(one, (str, os.PathLike))],
        }

    def _appearance_arguments(self, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """The arguments of a method that describe the appearance, converted for the library."""
        texts = ("up", "color_map", "style", "background", "light")
        flags = ("orthographic", "wireframe", "silhouette", "axes")
        camera, clip = arguments["camera"], arguments["clip"]
        return {
            **{name: arguments[name] for name in texts},
            **{flag: bool(arguments[flag]) for flag in flags},
            "occlusion": None if arguments["occlusion"] is None else bool(arguments["occlusion"]),
            "color": _appearance.color(arguments["color"]),
            "color_center": optional(number, arguments["color_center"], "color_center", "a number", lambda x: True),
            "camera": None if camera is None else _appearance.camera(camera),
            "color_range": _appearance.color_range(arguments["color_range"]),
            "clip": None if clip is None else _appearance.clip(clip, self.volume),
            "opacity": _appearance.share(arguments["opacity"]),
            "open": self._is_open(arguments["open"]),
            "keep": _appearance.kept(arguments["keep"], arguments["min_volume"], arguments["min_area"], arguments["at"]),
        }

    def _is_open(self, open: bool | None) -> bool:  # noqa: A002 (as --open)
        """True if meshes are open: the argument, or whether there is a mask."""
        return self._has_mask if open is None else bool(open)

    def _surfaces(self, c: Shown) -> list[tuple[float, int | None, float | None]]:
        """The isovalues to show, each with its colour and opacity."""
        shown: list[tuple[float, int | None, float | None]]
        if isinstance(c, Mapping):
            shown = [(self.isovalue(one), *_appearance.look(look)) for one, look in c.items()]
        else:
            several = several_of(c)
            all_of_them: list[Any] = [c] if several is None else several
            shown = [(self.isovalue(one), None, None) for one in all_of_them]
        if not shown:
            raise UsageError(f"isovalues {c!r}, expected one or more")
        return shown

    def widget(self, c: Isovalue | None = None, **options: Any) -> Slider:
        """A picture with a slider for notebooks (JupyterLab, VS Code, Colab, marimo); needs anywidget.

        Parameters
        ----------
        c : isovalue, optional
            The isovalue that is shown first.
        **options
            ``height`` (pixels), and those of :meth:`html`.

        Returns
        -------
        widget
            ``w.isovalue`` and the slider follow each other; ``w.observe`` reports changes.
        """
        from ._widget import Widget

        of: Any = self
        made: Slider = Widget(of, c, **options)
        return made


#: The arguments of :meth:`Drawing.render` by name, and their defaults.
DEFAULTS = {name: p.default for name, p in inspect.signature(Drawing.render).parameters.items() if p.kind is p.KEYWORD_ONLY}


def labelled(label: str | None, isovalues: Sequence[float]) -> str | None:
    """The text at the top of a picture, with its isovalues."""
    return None if label is None else label.replace("{isovalue}", ", ".join(_native.short_number(c) for c in isovalues))


def several_of(c: Any) -> list[Any] | None:
    """Isovalues that are given as several; ``None`` for a single one."""
    if isinstance(c, np.ndarray):
        return c.ravel().tolist() if c.ndim else None
    return list(c) if isinstance(c, (Sequence, set, frozenset)) and not isinstance(c, (str, bytes)) else None


def volume_like(a: Any, spectrum: Drawing, **frame: Any) -> _native.Volume:
    """A volume whose spacing, unless its source has one, is that of the spectrum's volume before its preparation."""
    each = spectrum.parameters.get("preparation", {}).get("downsample") or 1
    frame.setdefault("spacing", [s / each for s in spectrum.volume["placement"]["spacing"]])
    return volume(a, **frame)


def _field_like(a: Any, spectrum: Drawing) -> _native.Volume:
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


def _pair(ends: Any, spectrum: Drawing) -> tuple[float, float]:
    low, high = two(ends, "range")
    return (spectrum.isovalue(low), spectrum.isovalue(high))
