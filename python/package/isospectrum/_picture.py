"""Pictures as arrays that notebooks display."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from . import _native as native_part


class Picture(np.ndarray):
    """A picture: an array (rows, columns, 4) of uint8, red, green, blue and alpha (sRGB, alpha not multiplied in)."""

    _native: native_part.Picture | None

    @staticmethod
    def of(native: native_part.Picture) -> Picture:
        """A picture from its native object."""
        picture = native.pixels().reshape((*native.shape, 4)).view(Picture)
        picture.flags.writeable = False
        picture._native = native
        return picture

    def __array_finalize__(self, _from: Any) -> None:
        # A slice of a picture is an ordinary array.
        self._native = None

    def _repr_png_(self) -> bytes | None:
        return None if self._native is None else self._native.png()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a PNG file."""
        if self._native is None:
            raise ValueError("a slice of a picture, expected the whole: PIL.Image.fromarray(part).save writes a slice")
        self._native.save(os.fspath(path))
