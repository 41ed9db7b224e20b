"""Frames of volumes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._errors import InputError, UsageError

#: Tolerated relative difference of steps between coordinates: the rounding of 32-bit floats.
MAX_UNEVENNESS = 1e-4

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Frame:
    """Positions of samples: sample (i, j, k) along x, y, z is at ``origin + direction @ (spacing * (i, j, k))``.

    ``axes`` are the columns of the direction matrix: the unit vectors of the grid's x, y and z in the world.
    """

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    axes: tuple[tuple[float, float, float], ...] = IDENTITY
    space: str = ""
    unit: str = ""

    @staticmethod
    def of_matrix(origin: Any, direction: Any, **others: Any) -> Frame:
        """A frame from a 3 x 3 direction matrix, row by row."""
        columns = np.asarray(direction, dtype=float).reshape(3, 3).T
        return Frame(origin=triple(origin, "origin"), axes=tuple(map(tuple, columns.tolist())), **others)


def triple(numbers: Any, name: str) -> tuple[float, float, float]:
    """Three numbers; a single one stands for three equal ones."""
    try:
        if np.ndim(numbers) == 0:
            numbers = (numbers,) * 3
        x, y, z = (float(n) for n in numbers)
    except (TypeError, ValueError):
        raise UsageError(f"{name} {numbers!r}, expected three numbers: x, y, z") from None
    return (x, y, z)


def even(name: Any, along: np.ndarray) -> tuple[float, float]:
    """First value and step of evenly spaced coordinates."""
    if not np.issubdtype(along.dtype, np.number):
        raise InputError(f"coordinates of axis {name} of type {along.dtype}, expected numbers")
    along = along.astype(float)
    steps = np.diff(along)
    step = float((along[-1] - along[0]) / len(steps))
    if not np.isfinite(along).all() or step == 0 or np.abs(steps - step).max() > MAX_UNEVENNESS * abs(step):
        raise InputError(f"coordinates of axis {name}, expected evenly spaced ones")
    return float(along[0]), step
