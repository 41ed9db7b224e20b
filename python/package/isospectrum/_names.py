"""The list of public names, of which ``help`` shows none in full."""

from __future__ import annotations

import sys


class PublicNames(list[str]):
    """The names of ``__all__``.

    ``help(isospectrum)`` would print the help of every function and class, with all that exceptions and arrays inherit: 3,000 lines.
    The documentation of the package lists them; the help of each is its own. So ``pydoc`` alone, which asks for each name whether it
    is public, finds none.
    """

    def __contains__(self, name: object) -> bool:
        return sys._getframe(1).f_globals.get("__name__") != "pydoc" and super().__contains__(name)
