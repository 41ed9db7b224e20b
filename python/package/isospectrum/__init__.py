"""The isosurface spectrum of a volume: one triangle mesh for every isovalue, precomputed.

>>> import isospectrum
>>> s = isospectrum.compute(a, spacing=(1, 1, 2), unit="mm")    # a[z, y, x]
>>> m = s.mesh("p99")                                           # m.vertices, m.triangles, m.normals
>>> m.save("surface.stl")

**Frames.** Arrays are ``a[z, y, x]``. Everything else is in the order x, y, z: spacing, origin, the columns of the
direction matrix, vertices. Meshes, events and components are in the world frame, in the unit of the spacing.

**Isovalues** are numbers, or texts as on the command line: ``"50%"`` of the range, ``"p99"`` of the samples, ``"2.5sigma"``
above their mean, ``"top:1%"`` of them.

**Errors** are subclasses of :class:`isospectrum.Error`, with the messages of the command line. Ctrl-C stops a computation.
"""

from __future__ import annotations

from ._compute import compute, open
from ._errors import (
    Error,
    FileError,
    GpuError,
    InputError,
    InternalError,
    PromiseWarning,
    RangeError,
    UsageError,
    VerificationError,
)
from ._mesh import Mesh
from ._picture import Picture
from ._report import Report
from ._spectrum import Spectrum

__all__ = [
    "Error",
    "FileError",
    "GpuError",
    "InputError",
    "InternalError",
    "Mesh",
    "Picture",
    "PromiseWarning",
    "RangeError",
    "Report",
    "Spectrum",
    "UsageError",
    "VerificationError",
    "compute",
    "open",
]
__version__: str


def __getattr__(name: str) -> str:
    if name == "__version__":
        from importlib.metadata import version

        return version("isospectrum")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
