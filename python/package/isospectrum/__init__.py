"""The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.

>>> import isospectrum
>>> s = isospectrum.compute(a, spacing=(1, 1, 2), unit="mm")    # a[z, y, x]
>>> m = s.mesh("p99")                                           # m.vertices, m.triangles, m.normals
>>> m.save("surface.stl")

==================  ======================================================================================
:func:`compute`      the :class:`Spectrum` of an array, an image or a file
:func:`open`         a spectrum that has been saved
:func:`analyze`      isovalues of interest, without computing a spectrum
:func:`forecast`     the expected size of a spectrum
:class:`Spectrum`    ``mesh``, ``sweep``, ``curves``, ``events``, ``components``, ``trajectory``, ``lifetimes``,
                     ``extract``, ``render``, ``film``, ``html``, ``widget``, ``verify``, ``save``
:class:`Mesh`        arrays, measures, ``sample``, ``save``, ``to_pyvista``, ``to_trimesh``, ``to_napari``, ...
:class:`Report`      what ``verify`` found: ``check``, ``totals``
:class:`Picture`     an array of pixels, with ``save``
==================  ======================================================================================

**Frames.** Arrays are ``a[z, y, x]``. Everything else is in the order x, y, z: spacing, origin, the columns of the
direction matrix, vertices. Meshes, events and components are in the world frame, in the unit of the spacing.

**Isovalues** are numbers, or texts as on the command line: ``"50%"`` of the range, ``"p99"`` of the samples, ``"2.5sigma"``
above their mean, ``"top:1%"`` of them.

Each has help of its own: ``help(isospectrum.compute)``, ``help(isospectrum.Spectrum.render)``.

**Errors** are subclasses of :class:`isospectrum.Error`, warnings of :class:`isospectrum.Warning`. Ctrl-C stops a computation.
"""

from __future__ import annotations

import os as _os

from . import _native
from ._analysis import Analysis, Forecast, Suggestion, analyze, forecast
from ._compute import compute, open
from ._errors import (
    ArgumentError,
    Error,
    FileError,
    ForkError,
    GpuError,
    InputError,
    InternalError,
    PromiseWarning,
    RangeError,
    UsageError,
    VerificationError,
    Warning,
)
from ._mesh import Mesh
from ._names import PublicNames as _PublicNames
from ._picture import Picture
from ._report import Report
from ._spectrum import Spectrum

__all__ = [
    "Analysis",
    "ArgumentError",
    "Error",
    "FileError",
    "Forecast",
    "ForkError",
    "GpuError",
    "InputError",
    "InternalError",
    "Mesh",
    "Picture",
    "PromiseWarning",
    "RangeError",
    "Report",
    "Spectrum",
    "Suggestion",
    "UsageError",
    "VerificationError",
    "Warning",
    "analyze",
    "compute",
    "forecast",
    "open",
]
for _class in (Picture, Report):
    _class.__module__ = "isospectrum"
del _class
# Type checkers read the list above.
globals()["__all__"] = _PublicNames(__all__)
if hasattr(_os, "register_at_fork"):
    _os.register_at_fork(after_in_child=_native.after_fork)
__version__: str


def __getattr__(name: str) -> str:
    if name == "__version__":
        from importlib.metadata import version

        return version("isospectrum")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
