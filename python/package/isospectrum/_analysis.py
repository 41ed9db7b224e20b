"""Isovalues of interest of a volume and the expected size of its spectrum, without computing it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, SupportsFloat

from . import _native
from ._arguments import number, public
from ._isovalue import Isovalue, as_text, two
from ._sources import volume
from ._tables import structured

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


@dataclass(frozen=True)
class Suggestion:
    """An isovalue of interest.

    Attributes
    ----------
    isovalue : float
        The isovalue.
    by : {"otsu", "persistence"}
        ``"otsu"``: it separates the samples into two classes with the largest variance between them. ``"persistence"``: it is the middle of
        the interval with the most branches of the contour tree that are at least 5 % of the range long.
    reason : str
        The same as a sentence.
    """

    isovalue: float
    by: Literal["otsu", "persistence"]
    reason: str

    def __float__(self) -> float:
        return self.isovalue


@dataclass(frozen=True)
class Analysis:
    """The topology of a volume at all isovalues.

    Attributes
    ----------
    suggestions : list of Suggestion
        Isovalues of interest; each can be used as an isovalue.
    events : structured array
        All changes of topology, as :attr:`Spectrum.events`.
    range : (float, float)
        Smallest and largest sample.
    """

    suggestions: list[Suggestion]
    events: npt.NDArray[np.void]
    range: tuple[float, float]


@public
def analyze(a: Any, **options: Any) -> Analysis:
    """Find the events of a volume, and isovalues of interest with their reasons.

    Parameters
    ----------
    a : array, image, or path
        The volume, as for :func:`isospectrum.compute`.
    **options
        Arguments of :func:`isospectrum.compute` that describe the volume, such as ``spacing`` or ``nan_as``.

    Returns
    -------
    Analysis
        Suggested isovalues and events.

    See Also
    --------
    compute : Computes the mesh of all isovalues.

    Examples
    --------
    >>> import isospectrum, numpy as np
    >>> z, y, x = np.mgrid[:12, :12, :24].astype(float)
    >>> a = np.maximum(5 - np.hypot(np.hypot(x - 6, y - 6), z - 6), 4 - np.hypot(np.hypot(x - 17, y - 6), z - 6))
    >>> for one in isospectrum.analyze(a).suggestions:
    ...     print(one.by, round(one.isovalue, 1))
    otsu -1.0
    persistence 1.5
    """
    given = volume(a, **options)
    found, events = _native.analyze(given)
    return Analysis([Suggestion(c, by, _reason(by, n)) for c, by, n in found], structured(events), given.range)


@dataclass(frozen=True)
class Forecast:
    """The expected size of a spectrum: within a factor of about two of what comes.

    Attributes
    ----------
    n_triangles : int
        Triangles of the spectrum.
    memory : int
        Peak memory of the computation, bytes.
    n_events : int
        Changes of topology in the range, those of equal samples included.
    """

    n_triangles: int
    memory: int
    n_events: int


@public
def forecast(
    a: Any, *, range: Sequence[Isovalue] | npt.NDArray[Any] | str | None = None, error: SupportsFloat = 0.1, **options: Any
) -> Forecast:
    """Estimate the size of a spectrum and the memory of its computation, in about the time of its first steps.

    Parameters
    ----------
    a : array, image, or path
        The volume, as for :func:`isospectrum.compute`.
    range : two isovalues, optional
        Lowest and highest isovalue; by default those of the volume.
    error : float, default 0.1
        Tolerance, in voxels.
    **options
        Arguments of :func:`isospectrum.compute` that describe the volume, such as ``nan_as``.

    Returns
    -------
    Forecast
        What is expected.

    See Also
    --------
    compute : Computes the spectrum; its ``max_triangles`` and ``max_memory`` refuse or cut what is too large.

    Examples
    --------
    >>> import isospectrum, numpy as np
    >>> z, y, x = np.mgrid[:12, :12, :12].astype(float)
    >>> a = np.hypot(np.hypot(x - 6, y - 6), z - 6)
    >>> isospectrum.forecast(a).n_triangles > isospectrum.forecast(a, error=0.4).n_triangles
    True
    """
    ends = None
    if range is not None:
        low, high = two(range, "range")
        ends = (as_text(low), as_text(high))
    tolerance = number(error, "error", "a number above 0", lambda x: 0 < x < float("inf"))
    triangles, memory, n_events = _native.forecast(volume(a, **options), ends, tolerance)
    return Forecast(round(triangles), round(memory), n_events)


def _reason(by: str, n: int | None) -> str:
    if by == "otsu":
        return "separates the samples into two classes with the largest variance between them (Otsu)"
    branches = "1 branch" if n == 1 else f"{n} branches"
    return f"lies in {branches} of the contour tree that are at least 5 % of the range long, the most: here the most components are separate"


for _class in (Suggestion, Analysis, Forecast):
    _class.__module__ = "isospectrum"
del _class
