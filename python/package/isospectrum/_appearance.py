"""Arguments that describe how pictures and pages look, checked and converted for the library."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._errors import UsageError
from ._frame import triple

#: Named colours of surfaces, sRGB.
COLORS = {
    "blue": 0x85A9CD, "orange": 0xD9A46C, "green": 0x5FAE84, "pink": 0xD184B4, "yellow": 0xE0C95A, "red": 0xC8503C,
    "violet": 0x8C7AC2, "white": 0xF2F2F2, "grey": 0xA0A4AA, "bone": 0xE8DCC0, "skin": 0xE0B090, "muscle": 0xB0564A,
}  # fmt: skip


def share(opacity: float) -> float:
    """A checked opacity."""
    if not 0 <= opacity <= 1:
        raise UsageError(f"opacity {opacity!r}, expected a number from 0 to 1")
    return float(opacity)


def color_range(ends: str | Sequence[float | str | None] | None) -> str | None:
    """A range of a colour scale as the library parses it: ``LOW:HIGH``."""
    if ends is None or isinstance(ends, str):
        return ends
    try:
        low, high = ("" if end is None else str(end) for end in ends)
    except (TypeError, ValueError):
        raise UsageError(f"color_range {ends!r}, expected the numbers of the first and the last colour") from None
    return f"{low}:{high}"


def clip(clip: str, volume: dict[str, Any]) -> tuple[tuple[float, float, float], float]:
    """A clip plane of a volume in the voxel frame: its normal, which points to the hidden side, and its offset along the normal."""
    side, rest = ("-", clip.strip()[1:]) if clip.strip().startswith("-") else ("", clip.strip())
    axis, _, place = rest.partition(":")
    try:
        a = ("x", "y", "z").index(axis)
        number = float(place.removesuffix("%"))
        if not abs(number) < float("inf") or (place.endswith("%") and not 0 <= number <= 100):
            raise ValueError
    except ValueError:
        raise UsageError(f"clip {clip!r}, expected an axis and a place such as 'x:50%', '-z:12.5'") from None
    spacing = volume["placement"]["spacing"]
    length = number / 100 * (volume["dims"][a] - 1) * spacing[a] if place.endswith("%") else number
    sign = -1.0 if side else 1.0
    x, y, z = (sign if i == a else 0.0 for i in range(3))
    return (x, y, z), sign * length / min(spacing)


def kept(keep: int | str | None, min_volume: float, min_area: float, at: Any) -> tuple[Any, ...] | None:
    """The components to keep: number, least volume, least area, point; ``None`` to keep all."""
    if keep is None and not min_volume and not min_area and at is None:
        return None
    number = 1 if keep == "largest" else keep
    if number is not None and (not isinstance(number, (int, np.integer)) or number < 1):
        raise UsageError(f"keep {keep!r}, expected 'largest' or a number of components")
    for value, name in ((min_volume, "min_volume"), (min_area, "min_area")):
        if not 0 <= value < float("inf"):
            raise UsageError(f"{name} {value!r}, expected 0 or a number above")
    return (number, float(min_volume), float(min_area), None if at is None else triple(at, "at"))


def camera(camera: Sequence[float]) -> tuple[float, float, float]:
    """Azimuth and elevation in degrees, and the relative distance."""
    try:
        azimuth, elevation, *rest = (float(x) for x in camera)
        (distance,) = rest or [1.0]
    except (TypeError, ValueError):
        raise UsageError(f"camera {camera!r}, expected azimuth, elevation and optionally a distance") from None
    return (azimuth, elevation, distance)


def look(look: str) -> tuple[int | None, float | None]:
    """A colour (sRGB) and an opacity, written as ``skin@0.3``."""
    name, _, opacity = look.partition("@")
    code = COLORS.get(name)
    try:
        if code is None and name:
            if not (name.startswith("#") and len(name) == 7):
                raise ValueError
            code = int(name[1:], 16)
        share = float(opacity) if opacity else None
    except ValueError:
        raise UsageError(f"look {look!r}, expected #rrggbb or one of {', '.join(COLORS)}, and optionally @opacity") from None
    return code, share
