"""OME-Zarr images: one level of a Zarr group's pyramid, with its scale and unit.

Reads the `multiscales` metadata of OME-NGFF, versions 0.1 to 0.5. No samples are loaded here; they are read later, block by block.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from . import _native
from ._errors import InputError, UsageError
from ._frame import Frame, triple

#: Axes of versions 0.1 and 0.2, which do not name them.
OLDEST_AXES = ("t", "c", "z", "y", "x")

#: Metadata files by which a Zarr group or array is recognised, of versions 3 and 2.
METADATA_FILES = ("zarr.json", ".zgroup", ".zarray")


class Volume3:
    """An array ``[z, y, x]`` taken from an array with more axes or another order; blocks are read on access."""

    def __init__(self, array: Any, index: tuple[Any, ...], order: tuple[int, int, int]) -> None:
        self._array, self._index, self._order = array, index, order
        spatial = [n for n, at in zip(array.shape, index) if at is None]
        self.shape = tuple(spatial[i] for i in order)
        chunks = [n for n, at in zip(array.chunks, index) if at is None]
        self.chunks = tuple(chunks[i] for i in order)
        self.dtype, self.ndim = np.dtype(array.dtype), 3

    def __getitem__(self, part: Any) -> np.ndarray:
        parts = part if isinstance(part, tuple) else (part,)
        parts = parts + (slice(None),) * (3 - len(parts))
        if not all(isinstance(p, slice) for p in parts):
            raise TypeError(f"{part!r}, expected slices")
        stored = dict(zip(self._order, parts))
        axes = iter(range(3))
        whole = tuple(stored[next(axes)] if at is None else at for at in self._index)
        return np.asarray(self._array[whole]).transpose(self._order)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self[:], dtype=dtype)


class Image:
    """A level of an image: an array ``[z, y, x]``, which is not loaded, and its frame."""

    def __init__(self, array: Any, frame: Frame, name: str) -> None:
        self.array, self.frame, self.name = array, frame, name


def is_folder(source: Any) -> bool:
    """True for the path of a Zarr folder."""
    return isinstance(source, (str, os.PathLike)) and any(os.path.isfile(os.path.join(source, m)) for m in METADATA_FILES)


def opened(source: Any) -> Any:
    """Open the array or group if a source is the path of a Zarr folder; otherwise return the source."""
    if is_folder(source):
        import zarr

        return zarr.open(os.fspath(source), mode="r")
    return source


def is_group(source: Any) -> bool:
    """True for a Zarr group."""
    return hasattr(source, "group_keys") and hasattr(source, "attrs")


def image(group: Any, level: int, channel: int | None, frame: int | None) -> Image:
    """A level of the image in a group, at the given channel and frame if there are several."""
    attrs = dict(group.attrs)
    attrs = attrs.get("ome", attrs)
    try:
        scales = attrs["multiscales"][0]
        levels = scales["datasets"]
    except (KeyError, IndexError, TypeError):
        raise InputError("a Zarr group without multiscales, expected an image of OME-Zarr, or an array") from None
    if not 0 <= level < len(levels):
        raise UsageError(f"level {level}, expected 0 to {len(levels) - 1}")
    array = group[levels[level]["path"]]
    axes = [a if isinstance(a, dict) else {"name": a} for a in scales.get("axes", OLDEST_AXES[-array.ndim :])]
    names = [str(a.get("name", "")).lower() for a in axes]
    if len(names) != array.ndim or not set("zyx") <= set(names):
        raise InputError(f"an image of the axes {', '.join(names)}, expected z, y and x among {array.ndim}")
    index = tuple(_at(n, size, {"c": channel, "t": frame}) for n, size in zip(names, array.shape))
    spatial = [n for n in names if n in "zyx"]
    z, y, x = (spatial.index(n) for n in "zyx")
    scale, origin = _placed([*levels[level].get("coordinateTransformations", []), *scales.get("coordinateTransformations", [])], len(names))
    at = [names.index(n) for n in "xyz"]
    units = [str(axes[i].get("unit") or "") for i in at]
    mm = [_native.unit_in_mm(unit) for unit in units]
    # Converted to the unit of x.
    known = all(mm)
    to = [m / mm[0] if known else 1.0 for m in mm]  # type: ignore[operator]
    spacing = triple([scale[i] * t for i, t in zip(at, to)], "spacing")
    first = triple([origin[i] * t for i, t in zip(at, to)], "origin")
    name = str(scales.get("name") or getattr(group, "basename", "") or getattr(group, "name", "").rsplit("/", 1)[-1])
    return Image(Volume3(array, index, (z, y, x)), Frame(first, spacing, unit=units[0] if known else ""), name or "array")


def _at(name: str, size: int, indices: dict[str, int | None]) -> int | None:
    """The index along an axis that is not spatial; ``None`` for a spatial axis."""
    if name in "zyx":
        return None
    axis = {"c": "channel", "t": "frame"}.get(name, name)
    at = indices.get(name)
    if at is None and size == 1:
        return 0
    if at is None or not 0 <= at < size:
        raise UsageError(f"{axis} {at}, expected one of 0 to {size - 1}")
    return at


def _placed(transformations: list[dict[str, Any]], n: int) -> tuple[list[float], list[float]]:
    """Combined scale and translation along all axes of a sequence of transformations."""
    scale, origin = [1.0] * n, [0.0] * n
    for transformation in transformations:
        kind = transformation.get("type")
        numbers = transformation.get(kind) if kind in ("scale", "translation") else None
        if kind == "identity":
            continue
        if not isinstance(numbers, (list, tuple)) or len(numbers) != n:
            raise InputError(f"a transformation {transformation!r}, expected a scale or a translation along {n} axes")
        if kind == "scale":
            scale = [a * float(b) for a, b in zip(scale, numbers)]
            origin = [a * float(b) for a, b in zip(origin, numbers)]
        else:
            origin = [a + float(b) for a, b in zip(origin, numbers)]
    return scale, origin
