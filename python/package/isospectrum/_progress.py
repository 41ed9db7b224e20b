"""How progress is shown: by tqdm where there is one, by a callable of the user's otherwise."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from typing import Union

#: ``True`` for a bar, ``False`` for none, or a callable that is told the share done (0 to 1) and what is being done.
Progress = Union[bool, Callable[[float, str], object]]


@contextlib.contextmanager
def shown(progress: Progress, what: str) -> Iterator[Callable[[float, str], object] | None]:
    """Something to call with the share done and what is being done, or ``None`` where nobody listens."""
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


def _bar(what: str):  # noqa: ANN202 (a tqdm, if there is one)
    """A bar, in notebooks that of notebooks; none where no tqdm is installed, or nobody looks."""
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
