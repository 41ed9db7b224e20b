"""Progress bars: tqdm's if it is installed, or a callable of the user."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Any, Union

#: ``True`` for a bar, ``False`` for none, or a callable that takes the finished share (0 to 1) and the current stage.
Progress = Union[bool, Callable[[float, str], object]]


@contextlib.contextmanager
def shown(progress: Progress, what: str) -> Iterator[Callable[[float, str], object] | None]:
    """A callable that takes the finished share and the current stage, or ``None`` if nothing is shown."""
    if callable(progress):
        yield progress
        return
    bar = _bar(what) if progress else None
    if bar is None:
        yield None
        return

    def move(done: float, message: str) -> None:
        bar.set_description_str(message, refresh=False)
        bar.n = round(min(max(done, 0.0), 1.0), 3)
        bar.refresh()

    with bar:
        yield move
        bar.n = 1.0
        bar.refresh()


def _bar(what: str) -> Any:
    """A tqdm bar for the terminal or the notebook; ``None`` without tqdm, or if stderr is no terminal."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return None
    is_notebook = "ipykernel" in sys.modules
    if not is_notebook and not sys.stderr.isatty():
        return None
    return tqdm(
        total=1.0, desc=what, leave=False, bar_format="{desc}: {percentage:3.0f} %|{bar}| {elapsed}", file=sys.stderr
    )
