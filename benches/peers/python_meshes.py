#!/usr/bin/env python3
"""Times the Python package against scikit-image, VTK and PyVista, alternating in one run.

For each isovalue of a walk in small moves and of random jumps, all run directly one after the other, so that other load on the
machine slows all of them: `s.mesh(c)` up to arrays of vertices, triangles and normals in Python, and to arrays that are given; VTK's flying edges and
PyVista's `contour` by it, and scikit-image's marching cubes, up to the same. One thread each. It prints medians of the
ratios of such pairs; below 1 the spectrum is faster.

    python3 -m venv /tmp/peers && /tmp/peers/bin/pip install pyvista scikit-image ./python
    isospectrum compute hydrogen_atom_128x128x128_uint8.raw -o hydrogen.isp --step 2
    /tmp/peers/bin/python benches/peers/python_meshes.py hydrogen.isp hydrogen_atom_128x128x128_uint8.raw --range 2:60
"""

import argparse
import os
import random
import statistics
import time

os.environ["RAYON_NUM_THREADS"] = "1"

import numpy  # noqa: E402
import pyvista  # noqa: E402
import skimage  # noqa: E402
import vtk  # noqa: E402
from skimage.measure import marching_cubes  # noqa: E402
from vtk.util.numpy_support import vtk_to_numpy  # noqa: E402
from vtk_flying_edges import flying_edges, read_volume  # noqa: E402

import isospectrum  # noqa: E402


def by_spectrum(spectrum):
    def query(c):
        mesh = spectrum.mesh(c)
        return mesh.vertices, mesh.triangles, mesh.normals

    return query


def into_arrays(spectrum):
    out = tuple(numpy.empty((1 << 20, 3), kind) for kind in (numpy.float32, numpy.int32, numpy.float32))
    return lambda c: spectrum.mesh(c, out=out)


def by_flying_edges(samples):
    filter = flying_edges(samples)

    def query(c):
        filter.SetValue(0, c)
        filter.Update()
        mesh = filter.GetOutput()
        corners = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        return vtk_to_numpy(mesh.GetPoints().GetData()), corners, vtk_to_numpy(mesh.GetPointData().GetNormals())

    return query


def by_pyvista(samples):
    image = pyvista.ImageData(dimensions=samples.shape[::-1])
    image["samples"] = samples.ravel()

    def query(c):
        mesh = image.contour([c], scalars="samples", method="flying_edges", compute_normals=True, compute_scalars=False)
        return mesh.points, mesh.regular_faces, mesh.point_data.active_normals

    return query


def by_scikit_image(samples):
    samples = samples.astype(numpy.float32)

    def query(c):
        vertices, triangles, normals, _ = marching_cubes(samples, c)
        return vertices, triangles, normals

    return query


def timed(query, c):
    started = time.perf_counter_ns()
    arrays = query(c)
    return time.perf_counter_ns() - started, len(arrays[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("spectrum")
    parser.add_argument("volume")
    parser.add_argument("--range", help="isovalues, LOW:HIGH (default: the middle 80 %% of the range)")
    parser.add_argument("--moves", type=int, default=200, help="isovalues of each kind")
    arguments = parser.parse_args()

    vtk.vtkSMPTools.Initialize(1)
    samples = read_volume(arguments.volume)
    spectrum = isospectrum.open(arguments.spectrum)
    low, high = spectrum.range
    low, high = low + 0.1 * (high - low), high - 0.1 * (high - low)
    if arguments.range:
        low, high = (float(x) for x in arguments.range.split(":"))
    peers = {
        "s.mesh(c, out=...)": into_arrays(spectrum),
        "VTK flying edges": by_flying_edges(samples),
        "pyvista.contour": by_pyvista(samples),
        "skimage.measure.marching_cubes": by_scikit_image(samples),
    }
    ours = by_spectrum(spectrum)
    walk = [low + (high - low) * i / 1000 for i in range(400, 401 + arguments.moves)]
    numbers = random.Random(1)
    jumps = [numbers.uniform(low, high) for _ in range(arguments.moves)]
    versions = f"VTK {vtk.vtkVersion.GetVTKVersion()}, PyVista {pyvista.__version__}, scikit-image {skimage.__version__}"
    print(f"{versions}; isovalues {low:g} to {high:g}, one thread each")
    for name, isovalues in [("small moves", walk), ("jumps", jumps)]:
        for c in isovalues[:5]:
            for query in (ours, *peers.values()):
                query(c)
        rows = [(timed(ours, c), {peer: timed(query, c) for peer, query in peers.items()}) for c in isovalues]
        median = statistics.median
        print(f"{name}: s.mesh {median(r[0][0] for r in rows) / 1e3:.0f} us, {median(r[0][1] for r in rows):.0f} triangles")
        for peer in peers:
            ratio = median(r[0][0] / r[1][peer][0] for r in rows)
            them = median(r[1][peer][0] for r in rows) / 1e3
            print(f"  over {peer}: {ratio:.3f} ({them:.0f} us, {median(r[1][peer][1] for r in rows):.0f} triangles)")


if __name__ == "__main__":
    main()
