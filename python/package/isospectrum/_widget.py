"""The page in a notebook: an anywidget that shows it in an iframe and exchanges messages with it."""

from __future__ import annotations

import base64
import pathlib
from typing import Any, Protocol

try:
    import anywidget
    import traitlets
except ImportError as missing:
    raise ImportError("the widget needs anywidget: pip install 'isospectrum[widget]'") from missing

from ._errors import GpuError, RangeError
from ._isovalue import Isovalue
from ._looks import DrawingOptions
from ._picture import Picture


class _Pages(Protocol):
    """The part of a spectrum that the widget uses."""

    @property
    def range(self) -> tuple[float, float]: ...
    def isovalue(self, c: Isovalue | None = None) -> float: ...
    def render(self, c: Any = None, **options: Any) -> Picture: ...
    def _repr_html_(self) -> str: ...
    def html(self, path: None = None, *, c: Any = None, **options: Any) -> str | None: ...


class Widget(anywidget.AnyWidget):
    """A picture of a spectrum with a slider for the isovalue.

    Attributes
    ----------
    isovalue : float
        The isovalue shown. It and the slider follow each other; ``observe(f, names="isovalue")`` reports changes.
    height : int
        Height in pixels.
    range : (float, float)
        Lowest and highest isovalue.
    """

    _esm = pathlib.Path(__file__).with_name("widget.js")
    _page = traitlets.Unicode().tag(sync=True)
    isovalue = traitlets.Float().tag(sync=True)
    height = traitlets.Int(480, min=100).tag(sync=True)
    range = traitlets.Tuple(traitlets.Float(), traitlets.Float(), read_only=True)

    def __init__(self, spectrum: _Pages, c: Isovalue | None = None, *, height: int = 480, **options: Any) -> None:
        isovalue = spectrum.isovalue(c)
        options.setdefault("still", False)
        ends = spectrum.range
        if options.get("range") is not None:
            low, high = options["range"]
            ends = (spectrum.isovalue(low), spectrum.isovalue(high))
            if c is None:
                isovalue = min(max(isovalue, ends[0]), ends[1])
        page = spectrum.html(c=isovalue, **options)
        self._spectrum = spectrum
        self._options = {name: value for name, value in options.items() if name in DrawingOptions.__annotations__ and value is not None}
        self.set_trait("range", ends)
        super().__init__(_page=page, isovalue=isovalue, height=height)

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget; where no widget can be shown, as in a notebook that is exported, its picture at the isovalue that it has when the
        cell runs, or the numbers of the spectrum without a GPU adapter."""
        shown = super()._repr_mimebundle_(**options)
        if shown is None:
            return None
        data, metadata = shown
        try:
            size = (4 * self.height // 3, self.height)
            png = self._spectrum.render(self.isovalue, size=size, **self._options)._repr_png_()
            still = {"image/png": base64.b64encode(png or b"").decode()}
        except GpuError:
            still = {"text/html": self._spectrum._repr_html_()}
        return {**data, **still}, metadata

    @traitlets.validate("isovalue")
    def _inside(self, proposal: Any) -> float:
        low, high = self.range
        if not low <= proposal.value <= high:
            raise RangeError(f"isovalue {proposal.value:g} lies outside the range {low:g} to {high:g}")
        return float(proposal.value)
