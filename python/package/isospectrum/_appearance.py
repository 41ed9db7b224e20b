"""Arguments that describe how pictures and pages look, checked and converted for the library."""

from __future__ import annotations

from typing import Any

from ._arguments import number, whole
from ._errors import UsageError
from ._frame import triple

#: Named colours of surfaces, sRGB.
COLORS = {
    "blue": 0x85A9CD, "orange": 0xD9A46C, "green": 0x5FAE84, "pink": 0xD184B4, "yellow": 0xE0C95A, "red": 0xC8503C,
    "violet": 0x8C7AC2, "white": 0xF2F2F2, "grey": 0xA0A4AA, "bone": 0xE8DCC0, "skin": 0xE0B090, "muscle": 0xB0564A,
}  # fmt: skip


#: Quantities that colours show.
QUANTITIES = ("none", "quality", "lifetime", "curvature", "distance", "component", "normal")


def share(opacity: Any) -> float:
    """A checked opacity."""
    return number(opacity, "opacity", "a number from 0 to 1", lambda x: 0 <= x <= 1)


def size(size: Any) -> tuple[int, int]:
    """Width and height."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise UsageError(f"size {size!r}, expected width and height in pixels, such as (1024, 768)") from None
    return whole(width, "width", 1), whole(height, "height", 1)


def color(quantity: Any) -> str:
    """The quantity that colours show."""
    if isinstance(quantity, str) and quantity in QUANTITIES:
        return quantity
    raise UsageError(
        f"color {quantity!r}, expected one of {', '.join(QUANTITIES)}; a colour of the surface itself is given with its isovalue: "
        "{0.5: 'red'} or {0.5: (1, 0, 0)}"
    )


def color_range(ends: Any) -> str | None:
    """A range of a colour scale as the library parses it: ``LOW:HIGH``."""
    if ends is None or isinstance(ends, str):
        return ends
    try:
        low, high = ("" if end is None else end if isinstance(end, str) else repr(float(end)) for end in ends)
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


def kept(keep: Any, min_volume: Any, min_area: Any, at: Any) -> tuple[Any, ...] | None:
    """The components to keep: number, least volume, least area, point; ``None`` to keep all."""
    limits = [
        number(value, name, f"0 or a number above, in {powers} of the unit of the spacing", lambda x: 0 <= x < float("inf"))
        for value, name, powers in ((min_volume, "min_volume", "cubes"), (min_area, "min_area", "squares"))
    ]
    if keep is None and not any(limits) and at is None:
        return None
    if isinstance(keep, str) and keep != "largest":
        raise UsageError(f"keep {keep!r}, expected 'largest' or a number of components")
    largest = 1 if isinstance(keep, str) else None if keep is None else whole(keep, "keep", 1)
    return (largest, *limits, None if at is None else triple(at, "at"))


def camera(camera: Any) -> tuple[float, float, float]:
    """Azimuth and elevation in degrees, and the relative distance."""
    try:
        azimuth, elevation, *rest = (float(x) for x in camera)
        (distance,) = rest or [1.0]
    except (TypeError, ValueError):
        raise UsageError(f"camera {camera!r}, expected azimuth, elevation and optionally a distance") from None
    return (azimuth, elevation, distance)


def look(look: Any) -> tuple[int | None, float | None]:
    """A colour (sRGB) and an opacity: ``"skin@0.3"``, ``"#f00"``, ``(1, 0, 0)``, or another that matplotlib takes."""
    if isinstance(look, str):
        name, at, opacity = look.partition("@")
        try:
            own = float(opacity) if at else None
        except ValueError:
            raise UsageError(f"look {look!r}, expected an opacity from 0 to 1 after @") from None
        if own is not None and not 0 <= own <= 1:
            raise UsageError(f"look {look!r}, expected an opacity from 0 to 1 after @")
        if name in COLORS or not name:
            return COLORS.get(name), own
        rgba = _of_text(name)
        share_ = own if own is not None else rgba[3] if rgba and len(rgba) == 4 else None
    else:
        try:
            rgba = [float(x) for x in look]
        except (TypeError, ValueError):
            rgba = None
        share_ = rgba[3] if rgba and len(rgba) == 4 else None
    if rgba is None or len(rgba) not in (3, 4) or not all(0 <= x <= 1 for x in rgba):
        names = ", ".join(COLORS)
        raise UsageError(f"look {look!r}, expected #rrggbb, three numbers from 0 to 1, or one of {names}; all colours of matplotlib if it is installed")
    code = 0
    for x in rgba[:3]:
        code = code << 8 | round(255 * x)
    return code, share_


def _of_text(name: str) -> list[float] | None:
    """Three or four numbers of a colour written as ``#rgb``, ``#rrggbb``, ``#rrggbbaa``, or known to matplotlib if it is installed."""
    digits = name[1:]
    try:
        if name.startswith("#") and len(digits) in (3, 4):
            return [int(digit, 16) / 15 for digit in digits]
        if name.startswith("#") and len(digits) in (6, 8):
            return [int(digits[i : i + 2], 16) / 255 for i in range(0, len(digits), 2)]
        from matplotlib import colors

        return list(colors.to_rgba(name)[:3])
    except (ValueError, ImportError):
        return None
