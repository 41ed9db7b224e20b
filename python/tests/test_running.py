"""Running: progress, Ctrl-C, threads, memory."""

from __future__ import annotations

import concurrent.futures
import gc
import importlib
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
import warnings

import isospectrum
import numpy as np
import pytest

from .conftest import blobs


def noise(n: int, seed: int = 1) -> np.ndarray:
    """A volume that takes long: every local extremum is a component."""
    return np.random.default_rng(seed).integers(0, 255, (n, n, n), dtype=np.uint8)


def test_progress_is_reported_in_the_calling_thread():
    reports = []
    isospectrum.compute(
        blobs((16, 16, 16)), backend="cpu", progress=lambda done, what: reports.append((threading.get_ident(), done, what))
    )
    assert {thread for thread, *_ in reports} == {threading.get_ident()}
    shares = [done for _, done, _ in reports]
    assert shares == sorted(shares) and 0 <= shares[0] and shares[-1] <= 1
    assert "tracking" in {what for *_, what in reports}


def test_an_exception_of_the_progress_callable_stops_the_work():
    def stop(done: float, what: str) -> None:
        raise RuntimeError("enough")

    began = time.monotonic()
    with pytest.raises(RuntimeError, match="enough"):
        isospectrum.compute(noise(40), backend="cpu", progress=stop)
    assert time.monotonic() - began < 20


def test_tqdm_shows_a_bar_on_a_terminal():
    importlib.import_module("tqdm")
    code = """
        import numpy as np, sys, isospectrum
        sys.stderr.isatty = lambda: True
        a = np.random.default_rng(1).random((24, 24, 24))
        isospectrum.compute(a, backend="cpu", check=False)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=True)
    assert "tracking" in done.stderr and "%|" in done.stderr
    quiet = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code).replace("sys.stderr.isatty = lambda: True", "")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert quiet.stderr == ""


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
@pytest.mark.parametrize("size", [24, 100])
def test_ctrl_c_stops_a_computation(size):
    """A small volume is stopped during the sweep, a large one during its topology, which does not poll."""
    code = f"""
        import isospectrum, numpy as np, time
        a = np.random.default_rng(1).random(({size},) * 3)
        print("begin", flush=True)
        began = time.monotonic()
        try:
            isospectrum.compute(a, backend="cpu", progress=False)
        except KeyboardInterrupt:
            print("stopped", flush=True)
            # The cancelled work does not block later work.
            print(isospectrum.compute(a[:6, :6, :6], backend="cpu", progress=False).n_triangles > 0, flush=True)
    """
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert child.stdout.readline() == "begin\n"
    time.sleep(0.5)
    sent = time.monotonic()
    child.send_signal(signal.SIGINT)
    assert child.stdout.readline() == "stopped\n", child.stderr.read()
    waited = time.monotonic() - sent
    assert child.stdout.readline() == "True\n"
    child.communicate(timeout=60)
    assert child.returncode == 0
    # Half a second of grace, and time for a busy machine.
    assert waited < 10


def test_the_interpreter_lock_is_free_while_computing():
    """Another Python thread runs during the computation."""
    counted = [0]
    ended = threading.Event()

    def count() -> None:
        while not ended.wait(0.005):
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    began = time.monotonic()
    isospectrum.compute(blobs((16, 16, 16)), backend="cpu", progress=False)
    took = time.monotonic() - began
    ended.set()
    thread.join()
    # A hundredth of the rate of an idle machine.
    assert counted[0] > max(3, took / 0.5)


def test_twenty_threads_query_one_spectrum(spectrum):
    isovalues = np.linspace(0.05, 0.9, 40)
    expected = {c: spectrum.mesh(c) for c in isovalues}

    def query(seed: int) -> int:
        wrong = 0
        for c in np.random.default_rng(seed).permutation(isovalues):
            m = spectrum.mesh(c)
            wrong += not np.array_equal(m.vertices, expected[c].vertices)
            wrong += not np.array_equal(m.triangles, expected[c].triangles)
            wrong += len(spectrum.components(c)) < 1
        return wrong

    with concurrent.futures.ThreadPoolExecutor(20) as pool:
        assert list(pool.map(query, range(20))) == [0] * 20


def test_twenty_threads_compute_at_once():
    a = blobs((7, 8, 9))
    expected = isospectrum.compute(a, error=0.4, backend="cpu", progress=False)._native.to_bytes()

    def compute(_: int) -> bool:
        s = isospectrum.compute(a, error=0.4, backend="cpu", progress=False)
        return s._native.to_bytes() == expected

    with concurrent.futures.ThreadPoolExecutor(20) as pool:
        assert all(pool.map(compute, range(20)))


def test_a_thousand_meshes_leak_no_memory():
    psutil = importlib.import_module("psutil")
    process = psutil.Process()
    waves = np.sin(np.indices((20, 20, 20), dtype=np.float32) * 0.9).sum(axis=0)
    spectrum = isospectrum.compute(waves, range=(-0.5, 0.5), error=0.2, backend="cpu", progress=False)

    def take(n: int) -> None:
        for i in range(n):
            m = spectrum.mesh(-0.5 + i * 0.618 % 1)
            m.to_pyvista()
            spectrum.components(0) if i % 50 == 0 else None

    take(200)
    gc.collect()
    before = process.memory_info().rss
    take(1000)
    gc.collect()
    grown = process.memory_info().rss - before
    # If the arrays of one mesh in twenty were kept, more memory would be used.
    m = spectrum.mesh(0)
    assert 1000 / 20 * (m.vertices.nbytes + m.triangles.nbytes + m.normals.nbytes) > 5 << 20
    assert grown < 5 << 20, f"{grown} bytes more"


def test_arrays_outlive_their_spectrum():
    s = isospectrum.compute(blobs((9, 10, 11)), error=0.4, backend="cpu", progress=False)
    m = s.mesh(0.3)
    vertices, expected = m.vertices, m.vertices.copy()
    del s, m
    gc.collect()
    np.random.default_rng(0).random(1_000_000)
    assert np.array_equal(vertices, expected)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of Linux")
def test_one_thread_serves_where_the_system_grants_no_other():
    """Root may start threads beyond a limit, so the child becomes somebody else."""
    code = """
        import os, resource
        # What starts threads of its own.
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        import isospectrum, numpy as np
        # Before the child may read no file of Python any more.
        a = np.random.default_rng(1).random((9, 9, 9))
        if os.getuid() == 0:
            os.setgid(65534)
            os.setuid(65534)
        resource.setrlimit(resource.RLIMIT_NPROC, (0, 0))
        for threads in (None, 2):
            s = isospectrum.compute(a, backend="cpu", threads=threads, check=False, progress=False)
            print(s.n_triangles, len(s.mesh("50%").triangles), s.verify(a, n=3, progress=False).data["passed"])
        print(isospectrum._native.Spectrum.from_bytes(s._native.to_bytes()) is not None)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    a = np.random.default_rng(1).random((9, 9, 9))
    s = isospectrum.compute(a, backend="cpu", check=False, progress=False)
    first, second, last = done.stdout.splitlines()
    assert first == second and last == "True"
    assert first.split()[:2] == [str(s.n_triangles), str(len(s.mesh("50%").triangles))]


def test_a_spectrum_that_breaks_promises_causes_a_warning():
    """As the program's compute: a mask is met worse than promised, and smoothing helps."""
    z, y, x = np.mgrid[:16, :16, :16]
    mask = ((x - 7.3) ** 2 + (y - 7.1) ** 2 + (z - 7.7) ** 2 < 16).astype(np.uint8)
    with pytest.warns(isospectrum.PromiseWarning, match="does not keep its promises: .*smooth=0.5 helps") as found:
        isospectrum.compute(mask, name="mask", backend="cpu", progress=False)
    assert len(found) == 1 and found[0].filename == __file__ and str(found[0].message).startswith("mask: ")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        isospectrum.compute(mask, backend="cpu", progress=False, check=False)
        isospectrum.compute(blobs((16, 16, 16)), backend="cpu", progress=False)
