"""Isovalues of interest of a volume, without computing a spectrum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from . import _native
from ._arguments import public
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


def _reason(by: str, n: int | None) -> str:
    if by == "otsu":
        return "separates the samples into two classes with the largest variance between them (Otsu)"
    branches = "1 branch" if n == 1 else f"{n} branches"
    return f"lies in {branches} of the contour tree that are at least 5 % of the range long, the most: here the most components are separate"


for _class in (Suggestion, Analysis):
    _class.__module__ = "isospectrum"
del _class
