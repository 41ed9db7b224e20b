"""Isovalues as users write them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, SupportsFloat, Union

from ._errors import UsageError

#: A number, or a text such as ``"50%"``, ``"p99"``, ``"2.5sigma"``, ``"top:1%"``.
Isovalue = Union[SupportsFloat, str]


def as_text(isovalue: Isovalue) -> str:
    """An isovalue as the library parses it."""
    if isinstance(isovalue, str):
        return isovalue
    try:
        return repr(float(isovalue))
    except (TypeError, ValueError):
        raise UsageError(f"isovalue {isovalue!r}, expected a number or a text such as '50%'") from None


def two(ends: Any, name: str) -> tuple[Isovalue, Isovalue]:
    """The lowest and the highest isovalue of a range."""
    try:
        if isinstance(ends, str):
            low, high = ends.split(":")
        else:
            low, high = ends
    except (TypeError, ValueError):
        raise UsageError(f"{name} {ends!r}, expected the lowest and the highest isovalue, such as (10, 200) or ('5%', '95%')") from None
    return low, high


def evenly_spaced(first: float, last: float, n: int) -> Iterator[float]:
    """Evenly spaced isovalues. A weighted mean gives both ends exactly; clamped against rounding."""
    for i in range(n):
        t = i / (n - 1) if n > 1 else 0.0
        yield min(max(first * (1 - t) + last * t, min(first, last)), max(first, last))
