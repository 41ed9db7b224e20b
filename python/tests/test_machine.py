"""Adapters, threads: what is started, when, and how often."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import isospectrum
import numpy as np
import pytest

from .conftest import blobs


def run(code: str, **environment: str) -> list[str]:
    """The lines that a fresh process prints, which writes nothing to stderr and has no folder for a display."""
    inherited = {name: value for name, value in os.environ.items() if name not in ("XDG_RUNTIME_DIR", "WAYLAND_DISPLAY", "DISPLAY")}
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], env={**inherited, **environment}, capture_output=True, text=True, check=False, timeout=240
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout.splitlines()


def test_adapters_are_looked_for_only_if_a_volume_is_large_and_once():
    """The Vulkan loader tells when it looks for adapters."""
    code = """
        import isospectrum, numpy as np, os, sys
        n = int(os.environ["SIDE"])
        ramp = np.indices((n, n, n)).sum(axis=0).astype(np.float32)
        for _ in range(2):
            isospectrum.compute(ramp, range=(n, n + 1), progress=False, check=False, error=0.4)
        print("XDG_RUNTIME_DIR" in os.environ)
    """
    n_times = {}
    for side in ("10", "40"):
        environment = {k: v for k, v in os.environ.items() if k != "XDG_RUNTIME_DIR"}
        done = subprocess.run(
            [sys.executable, "-c", textwrap.dedent(code)], env={**environment, "VK_LOADER_DEBUG": "info", "SIDE": side},
            capture_output=True, text=True, check=True, timeout=240,
        )  # fmt: skip
        assert done.stdout == "False\n"
        assert "XDG_RUNTIME_DIR" not in done.stderr
        n_times[side] = done.stderr.count("Vulkan Loader Version")
    assert n_times == {"10": 0, "40": 1}


def test_an_adapter_is_opened_once():
    """After the first use no driver can be found any more, and none is needed."""
    code = """
        import isospectrum, numpy as np, os
        a = np.random.default_rng(1).random((6, 6, 6))
        def name():
            try:
                s = isospectrum.compute(a, backend="gpu", progress=False, check=False)
                picture = s.render("50%", size=(16, 16))
                return s.parameters["backend"]
            except isospectrum.GpuError as error:
                return "GpuError"
        first = name() if "VK_DRIVER_FILES" not in os.environ else None
        os.environ["VK_DRIVER_FILES"] = os.environ["VK_ICD_FILENAMES"] = os.devnull
        print(name() == first, first is not None, name())
    """
    (line,) = run(code)
    assert line.startswith("True True ") and "GpuError" not in line
    assert run(code, VK_DRIVER_FILES=os.devnull, VK_ICD_FILENAMES=os.devnull) == ["False False GpuError"]


def test_too_many_threads_cause_a_warning_and_fewer_threads():
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with pytest.warns(isospectrum.Warning, match=f"10000 threads on {processors} processors: {4 * processors} are used"):
        isospectrum.compute(blobs((6, 6, 6)), threads=10_000, backend="cpu", progress=False, check=False)
    for wrong in (-1, 0, 1.5, "two", True):
        with pytest.raises(isospectrum.UsageError, match="threads .*, expected a whole number, 1 or more"):
            isospectrum.compute(blobs((6, 6, 6)), threads=wrong, backend="cpu", progress=False)


def test_threads_make_no_difference():
    a = np.random.default_rng(2).random((7, 7, 7))
    one, two = (isospectrum.compute(a, threads=n, backend="cpu", progress=False, check=False)._native.to_bytes() for n in (1, np.int64(2)))
    assert one == two
