"""Checks of arguments: of their names, and of numbers and choices. Messages have the argument, its value and what is expected."""

from __future__ import annotations

import difflib
import functools
import inspect
import operator
import os
from collections.abc import Callable, Sequence
from typing import Any, ParamSpec, TypeVar

from ._errors import ArgumentError, UsageError

P = ParamSpec("P")
R = TypeVar("R")

#: Names of arguments in other programs, and what they are called here.
OTHER_NAMES = {
    "tolerance": "error", "sampling": "spacing", "voxel_size": "spacing", "pitch": "spacing", "affine": "direction", "n_jobs": "threads",
    "workers": "threads", "verbose": "progress", "roi": "crop", "sigma": "smooth", "step_size": "downsample", "threshold": "c", "iso": "c",
    "isovalue": "c", "level": "c", "isosurfaces": "c", "units": "unit", "device": "backend", "labels": "mask", "filename": "path",
    "colormap": "color_map", "cmap": "color_map", "clim": "color_range", "elev": "camera", "azim": "camera", "alpha": "opacity",
    "show_edges": "wireframe", "window_size": "size", "scalar": "array", "scalars": "array", "dataset": "array",
}  # fmt: skip


def public(function: Callable[P, R]) -> Callable[P, R]:
    """A function of the public interface: an argument with an unknown name is an :class:`isospectrum.ArgumentError` with the nearest known
    name."""
    known = inspect.signature(function).parameters
    takes_any = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in known.values())

    @functools.wraps(function)
    def checked(*args: P.args, **kwargs: P.kwargs) -> R:
        if not takes_any:
            for name in kwargs:
                if name not in known:
                    raise ArgumentError(f"{function.__name__}() has no argument {name!r}{nearest(name, list(known))}")
        return function(*args, **kwargs)

    checked.__module__ = "isospectrum"
    return checked


def nearest(name: str, known: list[str]) -> str:
    """The known name that is meant, as the end of a message; empty if there is none."""
    other = OTHER_NAMES.get(name)
    found = [other] if other in known else difflib.get_close_matches(name, [k for k in known if k != "self"], n=1, cutoff=0.5)
    return f": did you mean {found[0]!r}?" if found else ""


def number(value: Any, name: str, expected: str, is_valid: Callable[[float], bool]) -> float:
    """A checked number."""
    try:
        # A text is no number, even if it could be read as one.
        if not isinstance(value, (str, bytes, bool)) and is_valid(float(value)):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise UsageError(f"{name} {value!r}, expected {expected}")


def whole(value: Any, name: str, least: int = 0, most: int | None = None) -> int:
    """A checked whole number."""
    try:
        found = operator.index(value)
        if not isinstance(value, bool) and found >= least and (most is None or found <= most):
            return found
    except TypeError:
        pass
    end = "or more" if most is None else f"to {most}"
    raise UsageError(f"{name} {value!r}, expected a whole number, {least} {end}")


def optional(check: Callable[..., R], value: Any, *others: Any) -> R | None:
    """A checked value, or ``None``."""
    return None if value is None else check(value, *others)


def choice(value: Any, name: str, choices: Sequence[str]) -> str:
    """One of several texts."""
    if isinstance(value, str) and value in choices:
        return value
    raise UsageError(f"{name} {value!r}, expected {', '.join(choices[:-1])} or {choices[-1]}")


def path_of(path: Any, name: str = "path") -> str:
    """A path as a text."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise UsageError(f"{name} {path!r}, expected the path of a file") from None
