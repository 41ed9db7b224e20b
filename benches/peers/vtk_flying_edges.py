#!/usr/bin/env python3
"""Times a spectrum against VTK's flying edges, alternating in one run.

For each isovalue of a walk in small moves and of random jumps, both run directly one after the other, so
that other load on the machine slows both: the spectrum's list of active triangles and its
mesh with normals, VTK's vtkFlyingEdges3D with normals, one thread each. It prints medians of the ratios
of such pairs; below 1 the spectrum is faster.

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install vtk numpy
    cargo build --release --example query_times
    /tmp/peers/bin/python benches/peers/vtk_flying_edges.py S.isp VOLUME_128x128x128_uint8.raw

The volume is a RAW file whose name contains dimensions and type, or `gyroid:N`, computed here like the
phantom of that name.
"""

import argparse
import json
import os
import random
import re
import statistics
import subprocess
import sys
import time

import numpy
import vtk
from vtk.util import numpy_support


def read_volume(name):
    """The samples, z slowest."""
    if match := re.fullmatch(r"gyroid:(\d+)", name):
        return gyroid(int(match[1]))
    match = re.search(r"_(\d+)x(\d+)x(\d+)_(u?int8|u?int16|float32|float64)\.raw$", name)
    if not match:
        sys.exit(f"{name}: expected a name like volume_128x128x128_uint8.raw, or gyroid:128")
    shape = [int(n) for n in match.groups()[:3]][::-1]
    return numpy.fromfile(name, dtype=match[4]).reshape(shape)


def gyroid(n):
    """The samples of the phantom gyroid:N."""
    axis = numpy.linspace(-1.0, 1.0, n)
    x, y, z = (1.95 * numpy.pi * axis + 2**0.5 * (a + 1) / 7 for a in range(3))
    x, y, z = x[None, None, :], y[None, :, None], z[:, None, None]
    field = numpy.sin(x) * numpy.cos(y) + numpy.sin(y) * numpy.cos(z) + numpy.sin(z) * numpy.cos(x)
    return field.astype(numpy.float32)


def flying_edges(samples):
    """A filter over the samples; `.SetValue(0, c)` and `.Update()` run it."""
    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(samples.ravel(), deep=True))
    filter = vtk.vtkFlyingEdges3D()
    filter.SetInputData(image)
    filter.ComputeNormalsOn()
    filter.ComputeGradientsOff()
    filter.ComputeScalarsOff()
    return filter


class Spectrum:
    """The example program at the other end of a pipe."""

    def __init__(self, program, path):
        self.process = subprocess.Popen(
            [program, path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "RAYON_NUM_THREADS": "1"},
        )
        self.facts = json.loads(self.process.stdout.readline())

    def query(self, isovalue):
        self.process.stdin.write(f"{isovalue!r}\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        if not line:
            sys.exit("query_times ended early")
        return json.loads(line)


def compare(spectrum, filter, isovalues):
    """One row per isovalue: the times of both, ns, and their triangles."""
    rows = []
    for isovalue in isovalues:
        ours = spectrum.query(isovalue)
        filter.SetValue(0, isovalue)
        started = time.perf_counter_ns()
        filter.Update()
        theirs = time.perf_counter_ns() - started
        n = filter.GetOutput().GetNumberOfPolys()
        rows.append({"isovalue": isovalue, "vtk_ns": theirs, "vtk_triangles": n, **ours})
    return rows


def summary(rows):
    def median(of):
        return statistics.median(of(row) for row in rows)

    return {
        "n": len(rows),
        "list_over_vtk": median(lambda r: r["list_ns"] / r["vtk_ns"]),
        "mesh_over_vtk": median(lambda r: r["mesh_ns"] / r["vtk_ns"]),
        "list_us": median(lambda r: r["list_ns"]) / 1e3,
        "mesh_us": median(lambda r: r["mesh_ns"]) / 1e3,
        "vtk_us": median(lambda r: r["vtk_ns"]) / 1e3,
        "triangles": median(lambda r: r["n_triangles"]),
        "vtk_triangles": median(lambda r: r["vtk_triangles"]),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("spectrum")
    parser.add_argument("volume")
    parser.add_argument("--program", default="target/release/examples/query_times")
    parser.add_argument("--range", help="isovalues, LOW:HIGH (default: the middle 80 %% of the range)")
    parser.add_argument("--moves", type=int, default=200, help="isovalues of each kind")
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()

    vtk.vtkSMPTools.Initialize(1)
    filter = flying_edges(read_volume(arguments.volume))
    spectrum = Spectrum(arguments.program, arguments.spectrum)
    low, high = spectrum.facts["range"]
    low, high = low + 0.1 * (high - low), high - 0.1 * (high - low)
    if arguments.range:
        low, high = (float(x) for x in arguments.range.split(":"))

    # A small move is a thousandth of the range: a slider dragged over a thousand pixels.
    walk = [low + (high - low) * i / 1000 for i in range(400, 401 + arguments.moves)]
    numbers = random.Random(1)
    jumps = [numbers.uniform(low, high) for _ in range(arguments.moves)]
    report = {
        "vtk": vtk.vtkVersion.GetVTKVersion(),
        "range": [low, high],
        "all_triangles": spectrum.facts["n_triangles"],
    }
    for name, isovalues in [("small_moves", walk), ("jumps", jumps)]:
        # The first answers of both allocate.
        compare(spectrum, filter, isovalues[:5])
        report[name] = summary(compare(spectrum, filter, isovalues))
    if arguments.json:
        print(json.dumps(report, indent=1))
        return
    print(f"VTK {report['vtk']}, isovalues {low:g} to {high:g}, one thread each")
    for name in ("small_moves", "jumps"):
        s = report[name]
        print(
            f"{name}: list {s['list_us']:.1f} us, mesh {s['mesh_us']:.0f} us, "
            f"flying edges {s['vtk_us']:.0f} us; list / VTK {s['list_over_vtk']:.3f}, "
            f"mesh / VTK {s['mesh_over_vtk']:.3f}; "
            f"triangles {s['triangles']:.0f}, VTK {s['vtk_triangles']:.0f}"
        )


if __name__ == "__main__":
    main()
