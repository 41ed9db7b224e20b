"""Arrays and fixtures of several tests. The arrays are small: a spectrum takes a second or two."""

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
    """Two balls of different size that merge, without symmetry: float32 from about 0 to 1."""
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
    """The command-line program: $ISOSPECTRUM_PROGRAM, or the newest one in `target`."""
    given = os.environ.get("ISOSPECTRUM_PROGRAM")
    candidates = [pathlib.Path(given)] if given else [ROOT / "target" / p / "isospectrum" for p in ("debug", "release")]
    found = [path for path in candidates if path.is_file()]
    if not found:
        pytest.fail("no program to compare with: cargo build, or set $ISOSPECTRUM_PROGRAM to its path")
    return max(found, key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="session")
def run(program: pathlib.Path):
    """Runs the program. Returns its output."""

    def run(*arguments: object) -> str:
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def data(name: str) -> pathlib.Path:
    """A volume that is not in the repository. If it is missing, the test is skipped with a warning."""
    folder = pathlib.Path(os.environ.get("ISOSPECTRUM_DATA", ROOT.parent / "shared" / "data"))
    path = folder / name
    if not path.exists():
        message = f"NOT RUN: {path} is missing ($ISOSPECTRUM_DATA is the folder of volumes)"
        warnings.warn(message, stacklevel=2)
        pytest.skip(message)
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
    """The path of Chromium: $CHROMIUM, or that of the system."""
    names = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
    return os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, names)), None)
