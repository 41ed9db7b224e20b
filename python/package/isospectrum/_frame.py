"""Where samples lie in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ._errors import UsageError

IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Frame:
    """Where samples lie: sample (i, j, k) along x, y, z at ``origin + direction @ (spacing * (i, j, k))``.

    ``axes`` are the columns of the direction matrix: the unit vectors along which x, y and z of the grid point in the world.
    """

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)
    axes: tuple[tuple[float, float, float], ...] = IDENTITY
    space: str = ""
    unit: str = ""

    @staticmethod
    def of_matrix(origin: Any, direction: Any, **others: Any) -> Frame:
        """With a direction matrix of 3 x 3 numbers, row by row."""
        columns = np.asarray(direction, dtype=float).reshape(3, 3).T
        return Frame(origin=triple(origin, "origin"), axes=tuple(map(tuple, columns.tolist())), **others)


def triple(numbers: Any, name: str) -> tuple[float, float, float]:
    """Three finite numbers; one stands for three equal ones."""
    try:
        if np.ndim(numbers) == 0:
            numbers = (numbers,) * 3
        x, y, z = (float(n) for n in numbers)
    except (TypeError, ValueError):
        raise UsageError(f"{name} {numbers!r}, expected three numbers: x, y, z") from None
    return (x, y, z)
