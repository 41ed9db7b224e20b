"""Isovalues as users write them."""

from __future__ import annotations

from typing import Union

from ._errors import UsageError

#: A number, or a text such as ``"50%"``, ``"p99"``, ``"2.5sigma"``, ``"top:1%"``.
Isovalue = Union[float, int, str]


def as_text(isovalue: Isovalue) -> str:
    """An isovalue as the library parses it."""
    if isinstance(isovalue, str):
        return isovalue
    try:
        return repr(float(isovalue))
    except (TypeError, ValueError):
        raise UsageError(f"isovalue {isovalue!r}, expected a number or a text such as '50%'") from None
