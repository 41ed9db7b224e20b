"""Arguments of the preparation of a volume, and of the sweep, checked and converted for the library."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

from . import _native
from ._arguments import number, whole
from ._errors import InputError, UsageError
from ._sources import volume

POSITIVE: tuple[str, Callable[[float], bool]] = ("a number above 0", lambda x: 0 < x < math.inf)
NOT_NEGATIVE: tuple[str, Callable[[float], bool]] = ("0 or a number above", lambda x: 0 <= x < math.inf)
SHARE: tuple[str, Callable[[float], bool]] = ("a number from 0 to 1", lambda x: 0 <= x <= 1)

#: The numbers of a sweep. A test compares the names and the defaults with those of the library.
SWEEP_NUMBERS = {
    "error": POSITIVE, "step": POSITIVE, "max_edge": POSITIVE, "min_quality": SHARE, "min_area": NOT_NEGATIVE, "refine_area": NOT_NEGATIVE,
    "relax": SHARE, "relax_force": NOT_NEGATIVE,
}  # fmt: skip


def sweep(arguments: dict[str, Any]) -> dict[str, Any]:
    """The parameters of a sweep that are given."""
    given: dict[str, Any] = {}
    for name, (expected, is_valid) in SWEEP_NUMBERS.items():
        if arguments[name] is not None:
            given[name] = number(arguments[name], name, expected, is_valid)
    for name, least, most in (("samples", 2, 10**6), ("relax_iterations", 0, 10**4), ("starts", 1, 256)):
        if arguments[name] is not None:
            given[name] = whole(arguments[name], name, least, most)
    mesh = arguments["initial_mesh"]
    if mesh is not None:
        if not isinstance(mesh, (str, os.PathLike)):
            raise UsageError(f"initial_mesh {mesh!r}, expected the path of a PLY file")
        given["initial_mesh"] = mesh
    return given


def text(value: Any, name: str) -> str | None:
    """A length, a percentage or a size as the library parses it: a number, or a text such as ``"1.5mm"``."""
    if value is None or isinstance(value, str):
        return value
    return format(number(value, name, "a number or a text", math.isfinite), ".17g")


def mask(source: Any) -> _native.Volume:
    """A mask as a volume."""
    array = getattr(source, "dtype", None) == bool
    if array:
        # A mask that is all true cuts nothing away; samples that are all equal are no volume.
        if bool(source.all()):
            raise InputError("a mask that is true everywhere, expected one with a border inside the volume, or none")
        if not bool(source.any()):
            raise InputError("a mask that is false everywhere, expected one with samples inside")
        source = source.astype("u1")
    return volume(source)


def region(crop: Any, dims: tuple[int, int, int]) -> Any:
    """A region as the library parses it: a text, or for x, y and z a text or a pair of texts."""
    if isinstance(crop, str):
        return crop
    expected = f"crop {crop!r}, expected three parts such as (10, 60), None, ('5mm', '30mm')"
    try:
        parts = list(crop)
    except TypeError:
        raise UsageError(expected) from None
    if len(parts) != 3:
        raise UsageError(expected)
    return [_axis(part, n, expected) for part, n in zip(parts, dims)]


def _axis(part: Any, n: int, expected: str) -> str | tuple[str | None, str | None]:
    if isinstance(part, str):
        return part
    if isinstance(part, slice):
        if part.step not in (None, 1):
            raise UsageError(expected)
        part = part.indices(n)[:2]
    try:
        first, end = (None, None) if part is None else part
    except (TypeError, ValueError):
        raise UsageError(expected) from None
    return _end(first, n, expected), _end(end, n, expected)


def _end(end: Any, n: int, expected: str) -> str | None:
    """A sample number, of which a negative one counts from the end, or a length."""
    if end is None or isinstance(end, str):
        return end
    if isinstance(end, float) and not end.is_integer():
        raise UsageError(expected)
    try:
        at = int(end)
    except (TypeError, ValueError):
        raise UsageError(expected) from None
    return str(at + n if at < 0 else at)
