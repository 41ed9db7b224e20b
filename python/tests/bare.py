"""Runs the first lines of the README where nothing but NumPy is installed, and the program. Called by scripts/test-python, and for
each wheel of a release; --without-pictures leaves out the lines that need a GPU adapter."""

from __future__ import annotations

import importlib.metadata
import os
import pathlib
import re
import subprocess
import sys
import tempfile

README = pathlib.Path(__file__).resolve().parents[1] / "README.md"


def main() -> None:
    installed = {d.metadata["Name"].lower() for d in importlib.metadata.distributions()}
    assert installed <= {"isospectrum", "numpy", "pip", "setuptools"}, f"{installed}, expected NumPy only"
    import numpy as np

    z, y, x = np.mgrid[:14, :16, :18].astype(np.float32)
    a = np.exp(-((x - 5) ** 2 + (y - 6) ** 2 + (z - 6) ** 2) / 9) + 0.8 * np.exp(-((x - 12) ** 2 + (y - 9) ** 2 + (z - 7) ** 2) / 7)
    lines = re.findall(r"```python\n(.*?)```", README.read_text(), re.DOTALL)[0]
    if "--without-pictures" in sys.argv:
        lines = "".join(line for line in lines.splitlines(keepends=True) if not line.startswith(("s.render", "s.film")))
    program = pathlib.Path(sys.executable).with_name("isospectrum")
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        exec(compile(lines, "README.md", "exec"), {"a": a})
        assert len(pathlib.Path("m-8.ply").read_bytes()) > 1000
        shown = subprocess.run([program, "info", "x.isp"], check=True, capture_output=True, text=True).stdout
        assert "triangles" in shown, shown
        os.chdir("/")
    print(f"README: {len(lines.splitlines())} lines run in a bare environment")


main()
