"""Types: the stubs tell what the compiled part has, and the package is right by its own."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("mypy")


@pytest.mark.parametrize("arguments", [
    ["mypy.stubtest", "--ignore-disjoint-bases", "isospectrum._native"],
    ["mypy", "--ignore-missing-imports", "-p", "isospectrum"],
])  # fmt: skip
def test_types_are_right(arguments, tmp_path):
    done = subprocess.run([sys.executable, "-m", *arguments], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
