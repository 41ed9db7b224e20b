"""Types of the arguments that describe pictures and pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol, SupportsFloat, SupportsIndex, TypedDict, Union

from ._isovalue import Isovalue

if TYPE_CHECKING:
    import numpy.typing as npt

#: A colour: a name, ``"#rrggbb"``, or three numbers from 0 to 1; with an opacity as ``"skin@0.3"``, or four numbers.
Look = Union[str, "Sequence[SupportsFloat]", "npt.NDArray[Any]"]

#: One isovalue, several, or several with a colour each.
Shown = Union[Isovalue, "Mapping[Any, Look]", "Sequence[Isovalue]", "npt.NDArray[Any]", None]

Color = Literal["none", "quality", "lifetime", "curvature", "distance", "component", "normal"]
ColorMap = Literal["viridis", "cividis", "magma", "inferno", "plasma", "vik"]
Background = Literal["white", "light", "dark", "transparent"]
Style = Literal["default", "paper", "studio", "flat"]
Light = Literal["upper-left", "eye", "left", "right", "above", "below"]
Numbers = Union["Sequence[SupportsFloat]", "npt.NDArray[Any]"]


class Slider(Protocol):
    """The widget of a notebook.

    Attributes
    ----------
    isovalue : float
        The isovalue shown.
    height : int
        Height in pixels.
    range : (float, float)
        Lowest and highest isovalue.
    """

    isovalue: float
    height: int

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest isovalue."""
        ...

    def observe(self, handler: Callable[[Any], object], names: str = ...) -> None:
        """Call a function when a value changes."""
        ...


class DrawingOptions(TypedDict, total=False):
    """Arguments of :meth:`isospectrum.Spectrum.render`."""

    size: Sequence[SupportsIndex] | npt.NDArray[Any]
    camera: Numbers | None
    up: str | None
    orthographic: bool
    color: Color
    color_by: Any
    color_map: ColorMap | None
    color_range: str | Sequence[SupportsFloat | str | None] | npt.NDArray[Any] | None
    color_center: SupportsFloat | None
    legend: bool
    style: Style
    background: Background | None
    light: Light | None
    clip: str | None
    opacity: SupportsFloat
    occlusion: bool | None
    wireframe: bool
    silhouette: bool
    axes: bool
    scale_bar: bool
    label: str | None
    open: bool | None
    keep: SupportsIndex | Literal["largest"] | None
    min_volume: SupportsFloat
    min_area: SupportsFloat
    at: Numbers | None
    fit: Literal["surface", "volume"]
    volume: Any
    adapter: str | None
