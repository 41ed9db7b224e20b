"""Warnings that name the line of the user's program."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable

from ._errors import Warning  # noqa: A004 (isospectrum.Warning)


def warn(text: str, category: type[Warning] = Warning) -> None:
    """Warn at the line that has called the package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__package__") == __package__:
        level, frame = level + 1, frame.f_back
    warnings.warn(text, category, stacklevel=level)


def warn_all(texts: Iterable[str]) -> None:
    """Called by the compiled part with the warnings of the library."""
    for text in texts:
        warn(text)
