"""The program ``isospectrum``: the console script of the package, and ``python -m isospectrum``."""

from __future__ import annotations

import signal
import sys

from . import _native


def main() -> int:
    """Run the program with the arguments of this process, and return its exit code."""
    # Python's own handler would turn the exit code of an interrupted command into an exception.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _native.run_program(["isospectrum", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
