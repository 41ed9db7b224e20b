"""Meshes that the program writes, read by VTK, trimesh and USD.

The validator of glTF and three.js are tested in tests/program/readers.rs.
"""

from __future__ import annotations

import importlib
import json

import numpy as np
import pytest

pv = importlib.import_module("pyvista")
trimesh = importlib.import_module("trimesh")
usd = importlib.import_module("pxr.Usd")
usd_geometry = importlib.import_module("pxr.UsdGeom")

ISOVALUE = 0.3
SWEEP = "0.2:0.6:3"

# 32-bit floats of a few tens, as text or not.
ROUNDING = 1e-4


@pytest.fixture(scope="module")
def folder(tmp_path_factory, array, run):
    """The spectrum of the array with a spacing of 0.5 mm."""
    folder = tmp_path_factory.mktemp("readers")
    head = [
        "ObjectType = Image", "NDims = 3", f"DimSize = {' '.join(map(str, array.shape[::-1]))}", "ElementType = MET_FLOAT",
        "ElementSpacing = 0.5 0.5 0.5", "BinaryData = True", "BinaryDataByteOrderMSB = False", "ElementDataFile = LOCAL", "",
    ]  # fmt: skip
    (folder / "blobs.mha").write_bytes("\n".join(head).encode() + array.astype("<f4").tobytes())
    run("compute", folder / "blobs.mha", "-o", folder / "s.isp", "--backend", "cpu", "-q")
    return folder


@pytest.fixture(scope="module")
def wanted(folder, run):
    """Area and volume of the mesh as the program reports them."""
    rows = json.loads(run("components", folder / "s.isp", "-c", ISOVALUE, "--json"))["components"]
    return sum(row["area"] for row in rows), sum(row["volume"] for row in rows)


def extracted(folder, run, name, *flags):
    run("extract", folder / "s.isp", "-c", ISOVALUE, "-o", folder / name, "-q", *flags)
    return folder / name


@pytest.mark.parametrize("ending", ["ply", "stl", "obj", "vtp"])
def test_vtk_reads_a_closed_surface_of_the_same_size(folder, run, wanted, ending):
    # Triangles of an STL file share no vertices.
    mesh = pv.read(extracted(folder, run, f"vtk.{ending}")).clean()
    assert mesh.n_open_edges == 0
    assert mesh.area == pytest.approx(wanted[0], rel=ROUNDING)
    assert mesh.volume == pytest.approx(wanted[1], rel=ROUNDING)


def test_vtk_reads_the_values_that_colours_show(folder, run):
    mesh = pv.read(extracted(folder, run, "colored.vtp", "--color", "quality"))
    ratios = mesh.cell_data["radius_ratio"]
    assert len(ratios) == mesh.n_cells
    assert 0 < np.min(ratios) <= np.max(ratios) <= 1 + ROUNDING


def test_pyvista_reads_a_series_by_its_isovalues(folder, run):
    run("extract", folder / "s.isp", "--sweep", SWEEP, "-o", folder / "series.pvd", "-q")
    reader = pv.get_reader(folder / "series.pvd")
    assert reader.time_values == pytest.approx([0.2, 0.4, 0.6])
    areas = []
    for i in range(3):
        reader.set_active_time_point(i)
        areas.append(reader.read()[0].area)
    # Higher isovalues enclose less.
    assert areas[0] > areas[1] > areas[2] > 0


def test_trimesh_reads_a_watertight_3mf_in_millimetres(folder, run, wanted):
    mesh = trimesh.load(extracted(folder, run, "m.3mf"), force="mesh")
    assert mesh.units in ("mm", "millimeter", "millimeters")
    assert mesh.is_watertight
    assert mesh.area == pytest.approx(wanted[0], rel=ROUNDING)
    assert mesh.volume == pytest.approx(wanted[1], rel=ROUNDING)


def test_usd_reads_every_time_with_a_valid_topology(folder, run):
    run("extract", folder / "s.isp", "--sweep", SWEEP, "-o", folder / "m.usda", "-q")
    stage = usd.Stage.Open(str(folder / "m.usda"))
    assert usd_geometry.GetStageMetersPerUnit(stage) == pytest.approx(0.001)
    meshes = [usd_geometry.Mesh(prim) for prim in stage.Traverse() if prim.IsA(usd_geometry.Mesh)]
    assert len(meshes) == 1
    times = meshes[0].GetPointsAttr().GetTimeSamples()
    assert len(times) == 3
    for time in times:
        points = meshes[0].GetPointsAttr().Get(time)
        valid, why = meshes[0].ValidateTopology(
            meshes[0].GetFaceVertexIndicesAttr().Get(time), meshes[0].GetFaceVertexCountsAttr().Get(time), len(points)
        )
        assert valid, why
