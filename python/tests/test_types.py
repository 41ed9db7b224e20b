"""Types: the stubs match the compiled part."""

from __future__ import annotations

import importlib
import subprocess
import sys

importlib.import_module("mypy")


def test_the_stubs_match_the_compiled_part(tmp_path):
    command = [sys.executable, "-m", "mypy.stubtest", "--ignore-disjoint-bases", "isospectrum._native"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
