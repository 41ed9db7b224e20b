"""Arrays that the tests share. All are small: a spectrum of one takes a second or two."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess
import warnings

import isospectrum
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


def grid(shape: tuple[int, int, int]) -> list[np.ndarray]:
    """z, y, x of every sample."""
    return list(np.meshgrid(*(np.arange(n, dtype=float) for n in shape), indexing="ij"))


def blobs(shape: tuple[int, int, int] = (14, 16, 18)) -> np.ndarray:
    """Two balls of unlike size that meet: float32 from about 0 to 1, nothing of it symmetric."""
    z, y, x = grid(shape)
    a = np.exp(-((x - 5.3) ** 2 + (y - 6.1) ** 2 + (z - 6.4) ** 2) / 9)
    b = 0.8 * np.exp(-((x - 12.2) ** 2 + (y - 9.7) ** 2 + (z - 7.2) ** 2) / 7)
    return (a + b).astype(np.float32)


@pytest.fixture(scope="session")
def array() -> np.ndarray:
    return blobs()


@pytest.fixture(scope="session")
def spectrum(array: np.ndarray) -> isospectrum.Spectrum:
    return isospectrum.compute(array, name="blobs", backend="cpu", progress=False)


@pytest.fixture(scope="session")
def program() -> pathlib.Path:
    """The command line's program: $ISOSPECTRUM_PROGRAM, or the newest that was built here."""
    told = os.environ.get("ISOSPECTRUM_PROGRAM")
    built = [pathlib.Path(told)] if told else [ROOT / "target" / p / "isospectrum" for p in ("debug", "release")]
    there = [path for path in built if path.is_file()]
    if not there:
        pytest.fail("no program to compare with: cargo build, or say where it is in $ISOSPECTRUM_PROGRAM")
    return max(there, key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="session")
def run(program: pathlib.Path):
    """Runs the program; returns what it printed."""

    def run(*arguments: object) -> str:
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def data(name: str) -> pathlib.Path:
    """A volume that is not in the repository. Where it is missing, the test says loudly that it did not run."""
    folder = pathlib.Path(os.environ.get("ISOSPECTRUM_DATA", ROOT.parent / "shared" / "data"))
    path = folder / name
    if not path.exists():
        said = f"NOT RUN: {path} is missing ($ISOSPECTRUM_DATA tells where volumes are)"
        warnings.warn(said, stacklevel=2)
        pytest.skip(said)
    return path


def topology(triangles: np.ndarray, n_vertices: int) -> tuple[int, int]:
    """Components and Euler characteristic of a mesh, from its triangles alone."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    t = np.asarray(triangles, dtype=np.int64)
    edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    edges = np.unique(edges, axis=0)
    used = np.unique(t)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(n_vertices, n_vertices))
    _, labels = connected_components(graph, directed=False)
    return len(np.unique(labels[used])), len(used) - len(edges) + len(t)


def chromium() -> str | None:
    """A Chromium to drive: $CHROMIUM, or that of the system."""
    names = ("chromium", "chromium-browser", "google-chrome")
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
