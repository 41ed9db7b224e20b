"""Bricks computed by tasks of dask, also on clusters of processes; chunked arrays are never in memory as a whole."""

from __future__ import annotations

import json
import os
import pathlib
import pickle
import signal
import subprocess
import sys
import textwrap
import threading

import dask.array
import distributed
import isospectrum
import numpy as np
import pytest
import zarr
from isospectrum import _bricks, _native

from .conftest import blobs

SHAPE = (21, 25, 27)
OPTIONS = {"backend": "cpu", "error": 0.3, "brick": 12, "progress": False, "name": "a.npy"}


@pytest.fixture(scope="module")
def array() -> np.ndarray:
    return blobs(SHAPE)


@pytest.fixture(scope="module")
def expected(array, run, tmp_path_factory) -> pathlib.Path:
    """The spectrum that the program computes of the array in bricks: `s.isp`."""
    folder = tmp_path_factory.mktemp("program")
    np.save(folder / "a.npy", array)
    run("compute", folder / "a.npy", "--brick", 12, "--error", 0.3, "--backend", "cpu", "-q", "-o", folder / "s.isp")
    return folder


@pytest.fixture(scope="module")
def cluster():
    """Two workers, each a process of one thread."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        yield cluster


@pytest.fixture
def client(cluster):
    with distributed.Client(cluster, set_as_default=False) as client:
        yield client


def chunked(array: np.ndarray) -> dask.array.Array:
    return dask.array.from_array(array, chunks=(9, 10, 8))


def test_a_cluster_writes_the_same_bytes_as_the_program(array, expected, client, tmp_path):
    s = isospectrum.compute(chunked(array), client=client, to=tmp_path / "s.isp", **OPTIONS)
    assert (tmp_path / "s.isp").read_bytes() == (expected / "s.isp").read_bytes()
    assert s.parameters["bricks"]["n"] == 8
    assert os.listdir(tmp_path) == ["s.isp"]
    in_memory = isospectrum.compute(chunked(array), client=client, **OPTIONS)
    assert in_memory.n_triangles == s.n_triangles
    for c in (0.3, "60%"):
        assert sorted(map(tuple, in_memory.mesh(c).vertices)) == sorted(map(tuple, s.mesh(c).vertices))
    # Without a cluster, one brick after the other.
    isospectrum.compute(chunked(array), to=tmp_path / "here.isp", **OPTIONS)
    assert (tmp_path / "here.isp").read_bytes() == (expected / "s.isp").read_bytes()


@pytest.mark.parametrize("version", [2, 3])
def test_zarr_is_read_by_blocks(array, expected, client, tmp_path, version):
    store = str(tmp_path / "a.zarr")
    z = zarr.create_array(store=store, data=array, chunks=(8, 8, 8), zarr_format=version)
    for source in (z, store):
        isospectrum.compute(source, client=client, to=tmp_path / "z.isp", **OPTIONS)
        assert (tmp_path / "z.isp").read_bytes() == (expected / "s.isp").read_bytes()


@pytest.mark.parametrize("version", [2, 3])
def test_ome_zarr_has_scale_unit_and_origin(array, client, tmp_path, version):
    group = zarr.open_group(str(tmp_path / "image.ome.zarr"), mode="w", zarr_format=version)
    stored = np.stack([np.zeros_like(array), array])[None]
    for level, part in (("0", stored), ("1", stored[..., ::2, ::2, ::2])):
        group.create_array(level, data=np.ascontiguousarray(part), chunks=(1, 1, 8, 8, 8))
    axes = [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}]
    axes += [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"]

    def dataset(path: str, scale: float) -> dict:
        scaling = [{"type": "scale", "scale": [1, 1, 2 * scale, 0.5 * scale, 0.5 * scale]}]
        return {"path": path, "coordinateTransformations": [*scaling, {"type": "translation", "translation": [0, 0, 7, 8, 9]}]}

    image = {"name": "cells", "axes": axes, "datasets": [dataset("0", 1), dataset("1", 2)], "version": "0.4"}
    attributes = {"multiscales": [image]}
    group.attrs.update({"ome": {**attributes, "version": "0.5"}} if version == 3 else attributes)
    options = {"backend": "cpu", "error": 0.3, "progress": False}
    s = isospectrum.compute(tmp_path / "image.ome.zarr", channel=1, client=client, brick=12, **options)
    placement = s.volume["placement"]
    assert (placement["unit"], placement["spacing"], placement["origin"]) == ("um", [0.5, 0.5, 2], [9, 8, 7])
    assert s.volume["name"] == "cells" and s.volume["dims"] == list(reversed(SHAPE))
    same = isospectrum.compute(
        chunked(array), to=tmp_path / "s.isp", name="cells", brick=12, spacing=(0.5, 0.5, 2), origin=(9, 8, 7), unit="um", **options
    )
    assert s._native.to_bytes() == same._native.to_bytes()
    # Whole, and a coarser level.
    coarse = isospectrum.compute(group, channel=1, level=1, **options)
    assert coarse.volume["placement"]["spacing"] == [1, 1, 4] and coarse.volume["dims"] == [14, 13, 11]
    for wrong, message in (
        ({}, "channel None, expected one of 0 to 1"), ({"channel": 2}, "channel 2"), ({"channel": 0, "level": 2}, "level 2"),
    ):  # fmt: skip
        with pytest.raises(isospectrum.UsageError, match=message):
            isospectrum.compute(group, **wrong, **options)
    with pytest.raises(isospectrum.InputError, match="without multiscales"):
        isospectrum.compute(zarr.open_group(str(tmp_path / "none.zarr"), mode="w"), **options)


@pytest.mark.parametrize("dtype", ["u8", "i8", ">i2", "f2", "?", "f8"])
def test_sample_types_equal_those_of_arrays_in_memory(dtype, tmp_path):
    a = np.rint(100 * blobs((9, 10, 11))).astype(np.dtype(dtype)) if dtype != "?" else blobs((9, 10, 11)) > 0.4
    options = {"backend": "cpu", "error": 0.4, "progress": False, "name": "same", "brick": 64}
    whole = isospectrum.compute(a, **options)
    by_chunks = isospectrum.compute(dask.array.from_array(a, chunks=4), to=tmp_path / "s.isp", **options)
    assert by_chunks._native.to_bytes() == whole._native.to_bytes()


def test_values_that_are_not_finite_are_reported_or_replaced(array, client):
    a = array.astype(np.float64)
    a[3, 2, 20] = np.nan
    with pytest.raises(isospectrum.InputError, match=r"a.npy: sample \(20, 2, 3\) is nan, expected finite values"):
        isospectrum.compute(chunked(a), client=client, **OPTIONS)
    b = a.copy()
    b[3, 2, 20] = 0.25
    found, wanted = (isospectrum.compute(chunked(x), client=client, nan_as=0.25, **OPTIONS) for x in (a, b))
    assert found._native.to_bytes() == wanted._native.to_bytes()


@pytest.mark.parametrize("options, message", [
    ({"persistence": 0.1}, "persistence 0.1 needs the whole volume in memory"),
    ({"max_memory": "1GB"}, "max_memory '1GB' needs the whole volume"),
    ({"to": "s.stl"}, "expected a name that ends in .isp"),
    ({"brick": 2}, "bricks of 2 cells, expected 4 or more"),
    ({"range": (0.5, 0.2)}, "expected the lower isovalue first"),
    ({"spacing": 0}, "expected positive numbers"),
])  # fmt: skip
def test_invalid_arguments_are_errors_of_one_line(array, client, options, message):
    with pytest.raises(isospectrum.Error, match=message) as raised:
        isospectrum.compute(chunked(array), client=client, **{**OPTIONS, **options})
    assert "\n" not in str(raised.value)
    with pytest.raises(isospectrum.UsageError, match="read by chunks"):
        isospectrum.compute(array, client=client, **OPTIONS)


class Killer:
    """Kills a worker when the first part is complete, and records the progress."""

    def __init__(self, pids: list[int]) -> None:
        self.pids, self.killed, self.reports = pids, 0, []

    def __call__(self, done: float, what: str) -> None:
        self.reports.append(done)
        if what.endswith("of 8 bricks") and what.startswith("1 ") and not self.killed:
            self.killed = self.pids[0]
            os.kill(self.killed, signal.SIGKILL)


def test_tasks_of_a_killed_worker_are_repeated(array, expected, tmp_path):
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        killer = Killer([worker.pid for worker in cluster.workers.values()])
        options = {**OPTIONS, "progress": killer}
        isospectrum.compute(chunked(array), client=client, to=tmp_path / "s.isp", **options)
    assert killer.killed and killer.reports == sorted(killer.reports) and killer.reports[-1] <= 1
    assert (tmp_path / "s.isp").read_bytes() == (expected / "s.isp").read_bytes()


def started(*arguments: object) -> subprocess.Popen:
    command = [sys.executable, "-m", "distributed.cli.dask_" + str(arguments[0]), *map(str, arguments[1:])]
    return subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


def test_workers_can_join_over_tcp(array, expected, tmp_path):
    """Separate processes that share an address only; one of them is killed."""
    scheduler_file = tmp_path / "scheduler.json"
    processes = [started("scheduler", "--host", "tcp://127.0.0.1", "--port", 0, "--no-dashboard", "--scheduler-file", scheduler_file)]
    try:
        flags = ("--no-nanny", "--nthreads", 1, "--no-dashboard", "--local-directory", tmp_path, "--scheduler-file", scheduler_file)
        processes += [started("worker", *flags) for _ in range(2)]
        with distributed.Client(scheduler_file=str(scheduler_file), timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
            address = json.loads(scheduler_file.read_text())["address"]
            assert address.startswith("tcp://127.0.0.1:")
            killer = Killer([processes[2].pid])
            isospectrum.compute(chunked(array), client=client, to=tmp_path / "s.isp", **{**OPTIONS, "progress": killer})
            assert killer.killed
            assert len(client.scheduler_info()["workers"]) == 1
        assert (tmp_path / "s.isp").read_bytes() == (expected / "s.isp").read_bytes()
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def test_complete_parts_are_reused_and_damaged_ones_recomputed(array, expected, client, tmp_path):
    parts = tmp_path / "parts"

    def done() -> dict[str, int]:
        isospectrum.compute(chunked(array), client=client, parts=parts, to=tmp_path / "s.isp", **OPTIONS)
        assert (tmp_path / "s.isp").read_bytes() == (expected / "s.isp").read_bytes()
        return {path.name: path.stat().st_mtime_ns for path in parts.iterdir()}

    first = done()
    assert len(first) == 8 and done() == first
    damaged = parts / "000005.part"
    damaged.write_bytes(damaged.read_bytes()[:-9])
    (parts / "000002.part").unlink()
    again = done()
    assert {name for name in first if again[name] != first[name]} == {"000002.part", "000005.part"}
    # Two computations at once write the same bytes.
    for path in parts.iterdir():
        path.unlink()
    failed: list[BaseException] = []

    def other() -> None:
        try:
            isospectrum.compute(chunked(array), parts=parts, **OPTIONS)
        except BaseException as error:
            failed.append(error)

    thread = threading.Thread(target=other)
    thread.start()
    done()
    thread.join()
    assert not failed
    # Parts of another volume are not reused.
    other_volume = isospectrum.compute(chunked(array[::-1]), client=client, parts=parts, **OPTIONS)
    assert other_volume._native.to_bytes() != (expected / "s.isp").read_bytes()


def test_parts_that_a_killed_run_has_left_are_removed_by_the_next_for_the_same_file(array, tmp_path):
    # The folder of a run that ends while this test looks: complete parts, and a lock that nobody holds.
    def left_by_a_killed_run(folder: str, target: str) -> pathlib.Path:
        path = tmp_path / folder
        path.mkdir()
        (path / "lock").write_text(target)
        (path / "000000.part").write_bytes(b"part")
        return path

    same, other = left_by_a_killed_run(".isospectrum-a.part", "s.isp"), left_by_a_killed_run(".isospectrum-b.part", "t.isp")
    isospectrum.compute(chunked(array), to=tmp_path / "s.isp", **OPTIONS)
    assert not same.exists() and other.exists()
    assert {path.name for path in tmp_path.iterdir()} == {"s.isp", other.name}


def test_a_killed_run_leaves_a_folder_that_the_next_one_removes(tmp_path):
    # Killed after its first part.
    script = textwrap.dedent("""
        import os, signal, sys
        import dask.array, isospectrum, numpy

        def report(done, stage):
            if "kill" in sys.argv and done > 0.15:
                os.kill(os.getpid(), signal.SIGKILL)

        samples = numpy.random.default_rng(1).random((20, 20, 20), dtype="f4")
        blocks = dask.array.from_array(samples, chunks=10)
        isospectrum.compute(blocks, brick=10, backend="cpu", check=False, to=sys.argv[1], progress=report)
    """)

    def run_until(end: str) -> int:
        return subprocess.run([sys.executable, "-c", script, str(tmp_path / "s.isp"), end], check=False).returncode

    assert run_until("kill") == -signal.SIGKILL
    assert [path.suffix for path in tmp_path.iterdir()] == [".part"]
    assert run_until("end") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["s.isp"]


def test_only_bytes_of_the_part_are_stored(array, tmp_path):
    blocks = _bricks.Blocks(chunked(array))
    samples = np.asarray(array)
    limits = (float(samples.min()), float(samples.max()))
    cut = _native.cut(blocks.dims, 12)
    plan = _native.Plan(
        "a", blocks.dims, "float32", limits, ((0, 0, 0), (1, 1, 1), ((1, 0, 0), (0, 1, 0), (0, 0, 1)), "", ""),
        "low", [_native.tally(samples, limits)], [0] * len(cut), 12, {"error": 0.3}, None, None, lambda first, end: None,
    )  # fmt: skip
    same = pickle.loads(pickle.dumps(plan))
    assert same.to_bytes() == plan.to_bytes() and same.n == 8
    with pytest.raises(isospectrum.InputError, match="not the volume that the plan was made of"):
        plan.part(0, np.asarray(blocks.lazy(plan.required_samples(0))), "cpu", None, 1)
    with pytest.raises(isospectrum.InputError, match="damaged"):
        plan.store(tmp_path, 0, b"none")
    assert not list(tmp_path.iterdir())
    with pytest.raises(isospectrum.InputError, match="8 of 8 parts are missing"):
        plan.merge(tmp_path, lambda first, end: None, None, None)


@pytest.mark.skipif(os.name != "posix", reason="limits of files are those of POSIX")
@pytest.mark.parametrize("where", ["parts", "s.isp"])
def test_a_full_disk_is_an_error_of_one_line_and_leaves_no_partial_file(array, expected, tmp_path, where):
    """A limit on the size of files of this process; workers write no files."""
    code = f"""
        import dask.array, distributed, isospectrum, numpy as np, os, resource, signal
        if __name__ == "__main__":
            a = dask.array.from_array(np.load({str(expected / "a.npy")!r}), chunks=(9, 10, 8))
            options = {OPTIONS!r}
            with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
                if {where!r} != "parts":
                    isospectrum.compute(a, parts="parts", **options)
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (3000, resource.RLIM_INFINITY))
                try:
                    isospectrum.compute(a, parts="parts", to="s.isp" if {where!r} == "parts" else {where!r}, **options)
                except isospectrum.FileError as error:
                    print("said", error.filename, "lines", len(str(error).splitlines()))
                print("there", sorted(n for n in os.listdir(".") if n not in ("main.py", "parts")), len(os.listdir("parts")))
                resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY,) * 2)
                isospectrum.compute(a, parts="parts", to="s.isp", **options)
    """
    (tmp_path / "main.py").write_text(textwrap.dedent(code))
    done = subprocess.run([sys.executable, "main.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    name = "parts/00000" if where == "parts" else where
    said, there = done.stdout.splitlines()[-2:]
    assert said.startswith(f"said {name}") and said.endswith("lines 1"), done.stdout
    assert there == f"there [] {0 if where == 'parts' else 8}", done.stdout
    assert (tmp_path / "s.isp").read_bytes() == (expected / "s.isp").read_bytes()


def test_what_is_open_makes_no_difference(cluster, array):
    """Only the argument decides on a cluster: an open client does not."""
    options = {**OPTIONS, "brick": None}
    del options["name"]
    expected = isospectrum.compute(array, **options)
    with distributed.Client(cluster, set_as_default=True):
        found = isospectrum.compute(chunked(array), **options)
    assert found._native.to_bytes() == expected._native.to_bytes()
    # Not the token of a task of dask.
    assert found.volume["name"] == "array"
