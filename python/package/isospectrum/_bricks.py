"""Spectra of arrays that do not fit in memory: one task per brick, in this process or on a dask cluster.

A task takes the samples of its brick and its neighbourhood, and returns the bytes of its part file, which the caller writes to a folder, so
workers need no common file system. Complete parts in the folder are reused, so an interrupted computation can be resumed.
"""

from __future__ import annotations

import contextlib
import os
import zlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from . import _native
from ._errors import InputError, InternalError, UsageError
from ._frame import Frame
from ._sources import sample_type

#: A box of samples along x, y, z: the first sample, and the one after the last.
Block = tuple[tuple[int, int, int], tuple[int, int, int]]
Report = Callable[[float, str], object] | None

#: Tasks submitted per thread of the cluster: the samples of the second are read while the first runs.
TASKS_PER_THREAD = 2


def is_chunked(array: Any) -> bool:
    """True for an array that is read by chunks: dask, Zarr, HDF5."""
    return all(getattr(array, name, None) is not None for name in ("chunks", "shape", "dtype"))


class Blocks:
    """The blocks of an array ``[z, y, x]``."""

    def __init__(self, array: Any) -> None:
        if len(array.shape) != 3:
            raise UsageError(f"an array of {len(array.shape)} axes, expected 3: z, y, x")
        self.array = array
        z, y, x = array.shape
        self.dims = (int(x), int(y), int(z))

    def lazy(self, block: Block) -> Any:
        """The samples of a block, which may not have been read yet."""
        (x, y, z), (i, j, k) = block
        return self.array[z:k, y:j, x:i]


class Local:
    """Runs tasks in this process, one after the other."""

    def run(self, task: Callable[..., Any], blocks: Blocks, jobs: Iterable[tuple[int, Block, tuple[Any, ...]]]) -> Iterator[tuple[int, Any]]:
        for number, block, others in jobs:
            yield number, task(np.asarray(blocks.lazy(block)), *others)

    def shared(self, thing: Any) -> Any:
        return thing


class Cluster:
    """Runs tasks on a dask cluster, at most ``TASKS_PER_THREAD`` per thread at a time."""

    def __init__(self, client: Any) -> None:
        self.client = client

    def run(self, task: Callable[..., Any], blocks: Blocks, jobs: Iterable[tuple[int, Block, tuple[Any, ...]]]) -> Iterator[tuple[int, Any]]:
        import dask
        import dask.array
        from distributed import KilledWorker, as_completed

        if not hasattr(blocks.array, "__dask_graph__"):
            array = blocks.array
            blocks = Blocks(dask.array.from_array(array, chunks=array.chunks, name=False, asarray=False))
        waiting = iter(jobs)
        running: dict[Any, int] = {}
        done = as_completed(loop=self.client.loop)

        def submit() -> None:
            while len(running) < max(1, TASKS_PER_THREAD * sum(self.client.nthreads().values())):
                job = next(waiting, None)
                if job is None:
                    return
                number, block, others = job
                # `pure=False`: dask must neither merge equal tasks nor cache results.
                job_task = dask.delayed(task, pure=False)(blocks.lazy(block), *others)
                future = self.client.compute(job_task)
                running[future] = number
                done.add(future)

        try:
            submit()
            for future in done:
                number = running.pop(future)
                try:
                    found = future.result()
                except KilledWorker as error:
                    raise InternalError(f"brick {number}: every worker that computed it has died ({error})") from error
                yield number, found
                future.release()
                submit()
        finally:
            self.client.cancel(list(running))

    def shared(self, thing: Any) -> Any:
        """An argument of all tasks. It is a task of its own, so dask recreates it if its worker dies."""
        return self.client.submit(_identity, thing, pure=False)


def _identity(thing: Any) -> Any:
    return thing


def _range_of(array: Any, first: tuple[int, int, int], name: str, nan_as: float | None) -> tuple[Any, Any]:
    """Smallest and largest sample of a block."""
    array = np.asarray(array)
    if array.dtype.kind in "iub":
        return int(array.min()), int(array.max())
    array = _samples(array, sample_type(array.dtype, lambda: (0, 0)), nan_as)
    wrong = ~np.isfinite(array)
    if wrong.any():
        at = np.unravel_index(int(wrong.argmax()), array.shape)
        x, y, z = (int(a) + f for a, f in zip(reversed(at), first))
        raise InputError(f"{name}: sample ({x}, {y}, {z}) is {array[at]}, expected finite values")
    return float(array.min()), float(array.max())


def _tally_of(array: Any, dtype: np.dtype, nan_as: float | None, limits: tuple[float, float], own: tuple[int, int, int]) -> tuple[bytes, int]:
    """The compressed tally of a block's own samples, and CRC-32 of all of its samples."""
    array = np.ascontiguousarray(_samples(array, dtype, nan_as))
    x, y, z = own
    return zlib.compress(_native.tally(array[:z, :y, :x], limits), 1), zlib.crc32(array.astype(dtype.newbyteorder("<"), copy=False))


def _part_of(array: Any, plan: _native.Plan, number: int, dtype: np.dtype, nan_as: float | None, runs: tuple[str, str | None, int | None]) -> bytes:
    """The bytes of a part file."""
    return plan.part(number, _samples(array, dtype, nan_as), *runs)


def _samples(array: Any, dtype: np.dtype, nan_as: float | None) -> np.ndarray:
    """Samples in their type, with values that are not finite replaced. Arrays received over a network may be unaligned."""
    samples: np.ndarray = np.require(np.asarray(array).astype(dtype, copy=False), requirements="A")
    if nan_as is not None and dtype.kind == "f":
        samples = np.where(np.isfinite(samples), samples, dtype.type(nan_as))
    return samples


def compute(
    array: Any,
    frame: Frame,
    *,
    client: Any,
    name: str,
    nan_as: float | None,
    outside: str,
    parameters: dict[str, Any],
    ends: tuple[str, str] | None,
    start: str | None,
    brick: int | None,
    runs: tuple[str, str | None, int | None],
    parts: str | os.PathLike[str] | None,
    to: str | os.PathLike[str] | None,
    report: Report,
) -> _native.Spectrum:
    """Compute the spectrum of an array in bricks; `runs` is backend, adapter and threads of the sweeps."""
    if to is not None and os.path.splitext(os.fspath(to))[1] != ".isp":
        raise UsageError(f"{os.fspath(to)}: expected a name that ends in .isp")
    if nan_as is not None and not np.isfinite(nan_as):
        raise UsageError(f"nan_as {nan_as}, expected a finite number")
    blocks = Blocks(array)
    work: Local | Cluster = Local() if client is None else Cluster(client)
    # A dask worker runs one task per thread.
    backend, adapter, threads = runs
    runs = (backend, adapter, 1 if threads is None and client is not None else threads)
    cut = _native.cut(blocks.dims, brick)
    report = report or (lambda done, stage: None)

    def all_of(task: Callable[..., Any], jobs: Iterable[tuple[int, Block, tuple[Any, ...]]], stage: str, share: tuple[float, float]) -> list[Any]:
        found: list[Any] = [None] * len(cut)
        for n, (number, one) in enumerate(work.run(task, blocks, jobs), 1):
            found[number] = one
            report(share[0] + (share[1] - share[0]) * n / len(cut), f"{stage}: {n} of {len(cut)} bricks")
        return found

    given = np.dtype(array.dtype)
    if given.kind not in "iubf":
        sample_type(given, lambda: (0, 0))
    ranges = all_of(_range_of, ((i, b, (b[0], name, nan_as)) for i, b in enumerate(cut)), "finding the range", (0.0, 0.05))
    low, high = min(r[0] for r in ranges), max(r[1] for r in ranges)
    dtype = sample_type(given, lambda: (low, high))
    limits = (float(low), float(high))
    own = [tuple(e - f - (e < n) for f, e, n in zip(first, end, blocks.dims)) for first, end in cut]
    surveyed = all_of(_tally_of, ((i, b, (dtype, nan_as, limits, own[i])) for i, b in enumerate(cut)), "surveying the samples", (0.05, 0.1))
    tallies, checksums = [zlib.decompress(t) for t, _ in surveyed], [crc for _, crc in surveyed]

    def read_block(first: tuple[int, int, int], end: tuple[int, int, int]) -> np.ndarray:
        return _samples(blocks.lazy((first, end)), dtype, nan_as)

    plan = _native.Plan(
        name, blocks.dims, dtype.name, limits, (frame.origin, frame.spacing, frame.axes, frame.space, frame.unit),
        outside, tallies, checksums, brick, parameters, ends, start, read_block,
    )  # fmt: skip
    with contextlib.ExitStack() as stack:
        if parts is None:
            # The disk of the result has room for the parts.
            folder = os.fspath(stack.enter_context(_native.WorkFolder(to)))
        else:
            folder = os.fspath(parts)
            os.makedirs(folder, exist_ok=True)
        missing = [i for i in range(plan.n) if not plan.is_complete(folder, i)]
        shared = work.shared(plan)
        jobs = ((i, plan.required_samples(i), (shared, i, dtype, nan_as, runs)) for i in missing)
        for n, (number, made) in enumerate(work.run(_part_of, blocks, jobs), 1):
            plan.store(folder, number, made)
            report(0.1 + 0.85 * n / len(missing), f"{n} of {len(missing)} bricks")
        return plan.merge(folder, read_block, to, lambda done, stage: report(0.95 + 0.05 * done, stage))
