"""Meshes and spectra as objects: independent, immutable, with identities and measures."""

from __future__ import annotations

import copy
import gc
import importlib
import io
import json
import os
import pickle
import subprocess
import sys
import textwrap
import weakref

import isospectrum
import numpy as np
import pytest

from .conftest import blobs, topology


def same(a: isospectrum.Mesh, b: isospectrum.Mesh) -> bool:
    arrays = all(np.array_equal(getattr(a, n), getattr(b, n)) for n in ("vertices", "triangles", "normals", "caps"))
    return arrays and a.isovalue == b.isovalue


def test_a_mesh_stands_by_itself(tmp_path):
    s = isospectrum.compute(blobs((9, 10, 11)), origin=(1, 2, 3), spacing=(1, 1, 2), error=0.4, backend="cpu", progress=False)
    m = s.mesh(0.3, ids=True)
    m.save(tmp_path / "before.ply")
    spectrum = weakref.ref(s)
    for again in (pickle.loads(pickle.dumps(m)), copy.copy(m), copy.deepcopy(m)):
        assert same(again, m) and np.array_equal(again.vertex_ids, m.vertex_ids)
        assert not again.vertices.flags.writeable
    # Small: nothing of the spectrum.
    assert len(pickle.dumps(m)) < 10 * m.vertices.nbytes + 2000
    del s
    gc.collect()
    assert spectrum() is None, "the mesh keeps its spectrum"
    m.save(tmp_path / "after.ply")
    assert (tmp_path / "after.ply").read_bytes() == (tmp_path / "before.ply").read_bytes()
    assert m.vertices_float64().shape == m.vertices.shape


def test_nothing_of_a_mesh_or_a_spectrum_can_be_changed(spectrum):
    m = spectrum.mesh(0.3)
    for name in ("vertices", "isovalue", "something"):
        with pytest.raises(AttributeError):
            setattr(m, name, None)
    for table in (spectrum.curves(3), spectrum.events, spectrum.components(0.3), spectrum.lifetimes()):
        with pytest.raises(ValueError, match="read-only"):
            table[table.dtype.names[0]][:] = 0
    for of in ("volume", "parameters", "counts"):
        getattr(spectrum, of)["name"] = "another"
        assert getattr(spectrum, of).get("name") != "another"
    spectrum.volume["placement"]["spacing"][0] = 7
    assert spectrum.volume["placement"]["spacing"] == [1, 1, 1]
    with pytest.raises(AttributeError):
        spectrum.range = (0, 1)
    with pytest.raises(AttributeError):
        spectrum.anything = 1


def test_the_same_isovalue_again_is_the_same_mesh(spectrum):
    assert spectrum.mesh(0.3) is spectrum.mesh(0.3)
    assert spectrum.mesh(0.3) is not spectrum.mesh(0.3, keep="largest")
    assert spectrum.mesh(0.31) is not spectrum.mesh(0.3)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_process_that_is_forked_after_use_raises_at_once():
    code = """
        import isospectrum, multiprocessing, numpy as np
        a = np.random.default_rng(1).random((6, 6, 6))
        def work(_):
            try:
                return str(isospectrum.compute(a, progress=False, check=False).n_triangles)
            except isospectrum.ForkError as error:
                return f"{type(error).__name__}: {error}"
        fork = multiprocessing.get_context("fork")
        with fork.Pool(1) as pool:
            before = pool.map_async(work, [0]).get(60)[0]
        print(before == work(0))
        with fork.Pool(1) as pool:
            print(pool.map_async(work, [0]).get(60)[0])
    """
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", textwrap.dedent(code)], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert first == "True"
    assert second.startswith("ForkError: this process was forked") and "spawn" in second


def test_a_mesh_is_sent_to_another_process(spectrum):
    m = spectrum.mesh(0.3)
    code = "import pickle, sys; print(pickle.load(sys.stdin.buffer).area)"
    done = subprocess.run([sys.executable, "-c", code], input=pickle.dumps(m), capture_output=True, check=False, timeout=60)
    assert float(done.stdout) == m.area, done.stderr


def test_a_mesh_unpacks_as_that_of_scikit_image(spectrum):
    m = spectrum.mesh(0.3)
    vertices, faces, normals, values = m
    assert vertices is m.vertices and faces is m.faces is m.triangles and normals is m.normals
    assert values.shape == (m.n_vertices,) and (values == np.float32(0.3)).all() and m.level == m.isovalue
    # Differences of indices have signs.
    assert (faces[:, 0] - faces[:, 1]).min() < 0


def test_several_isovalues_give_several_meshes(spectrum):
    for several in ([0.2, "50%"], (0.2, "50%"), np.array([0.2, 0.4])):
        found = spectrum.mesh(several)
        assert [m.isovalue for m in found] == [spectrum.isovalue(c) for c in several]
        assert same(found[0], spectrum.mesh(0.2))
    assert spectrum.mesh([]) == []
    assert isinstance(spectrum.mesh(np.array(0.3)), isospectrum.Mesh)


def test_measures_are_those_of_the_components(spectrum):
    m = spectrum.mesh(0.55)
    rows = spectrum.components(0.55)
    assert m.n_components == len(rows) == 2 and m.is_closed
    assert m.area == pytest.approx(rows["area"].sum(), rel=1e-5)
    assert m.volume == pytest.approx(rows["volume"].sum(), rel=1e-5)
    assert (m.n_components, m.euler) == topology(m.triangles, m.n_vertices)
    assert np.allclose(m.bounds, [[rows[f"min_{a}"].min() for a in "xyz"], [rows[f"max_{a}"].max() for a in "xyz"]], atol=1e-5)
    for row in rows:
        of = m.labels == row["number"]
        assert of.sum() == row["triangles"]
        box = m.vertices[m.triangles[of]].reshape(-1, 3)
        assert np.allclose(box.min(0), [row[f"min_{a}"] for a in "xyz"], atol=1e-5)
    empty = spectrum.mesh(spectrum.range[1])
    assert (empty.area, empty.volume, empty.euler, empty.n_components) == (0, 0, 0, 0) and np.isnan(empty.bounds).all()


def test_an_open_mesh_has_no_volume():
    s = isospectrum.compute(1 - blobs((8, 9, 10)), error=0.4, backend="cpu", progress=False, check=False)
    m = s.mesh(0.5, open=True)
    assert not m.is_closed and m.area == pytest.approx(s.mesh(0.5).area)
    with pytest.raises(isospectrum.UsageError, match="open=False"):
        _ = m.volume


def test_vertices_and_triangles_keep_their_numbers(spectrum, tmp_path):
    a, b = spectrum.mesh([0.3, 0.302], ids=True)
    both, at_a, at_b = np.intersect1d(a.vertex_ids, b.vertex_ids, return_indices=True)
    assert len(both) > 0.8 * a.n_vertices
    # The same vertex is in nearly the same place.
    assert np.linalg.norm(a.vertices[at_a] - b.vertices[at_b], axis=1).max() < 0.1
    triangles = {n: t for n, t in zip(a.triangle_ids.tolist(), a.vertex_ids[a.triangles].tolist())}
    shared = [n for n in b.triangle_ids.tolist() if n in triangles]
    of_b = dict(zip(b.triangle_ids.tolist(), b.vertex_ids[b.triangles].tolist()))
    assert len(shared) > 0.8 * a.n_triangles and all(sorted(triangles[n]) == sorted(of_b[n]) for n in shared)
    # Births and deaths of both.
    for m in (a, b):
        for ids, of in ((m.triangle_ids, "triangles"), (m.vertex_ids, "vertices")):
            lives = spectrum.lifetimes(of)[ids]
            assert (lives["birth"] <= m.isovalue).all() and (m.isovalue < lives["death"]).all()
    # A trajectory goes through the vertices of meshes.
    for number, i, j in list(zip(both, at_a, at_b))[:20]:
        path = spectrum.trajectory(number)
        for m, k in ((a, i), (b, j)):
            here = [np.interp(m.isovalue, path["isovalue"], path[axis]) for axis in "xyz"]
            assert np.allclose(here, m.vertices[k], atol=1e-4)
    # The same numbers after a round trip through a file, and for a part of a mesh.
    spectrum.save(tmp_path / "s.isp")
    assert np.array_equal(isospectrum.open(tmp_path / "s.isp").mesh(0.3, ids=True).vertex_ids, a.vertex_ids)
    part, whole = spectrum.mesh(0.55, ids=True, keep="largest"), spectrum.mesh(0.55, ids=True)
    at = np.searchsorted(whole.vertex_ids, part.vertex_ids)
    assert np.array_equal(whole.vertices[at], part.vertices) and part.n_triangles < whole.n_triangles
    assert same(whole, spectrum.mesh(0.55))
    with pytest.raises(isospectrum.UsageError, match="ids=True"):
        _ = spectrum.mesh(0.3).vertex_ids
    with pytest.raises(isospectrum.UsageError, match="expected one of 0 to"):
        spectrum.trajectory(10**9)


def test_a_mesh_samples_another_volume(array):
    s = isospectrum.compute(array, spacing=(1, 1, 2), origin=(5, 0, 0), backend="cpu", progress=False)
    m = s.mesh(0.3)
    x = np.broadcast_to(np.arange(array.shape[2], dtype=float), array.shape)
    assert np.allclose(m.sample(x, spacing=(1, 1, 2), origin=(5, 0, 0)), m.vertices[:, 0] - 5, atol=1e-5)
    # An array without a frame has that of the spectrum.
    assert np.allclose(m.sample(x), m.vertices[:, 0] - 5, atol=1e-5)
    assert np.allclose(m.sample(array), 0.3, atol=0.05)
    assert np.isnan(m.sample(x, origin=(1000, 0, 0), spacing=2)).all()


def test_curves_have_any_number_and_range(spectrum):
    found = spectrum.curves(5, range=("20%", 0.6))
    assert found["isovalue"].tolist() == pytest.approx(np.linspace(spectrum.isovalue("20%"), 0.6, 5).tolist())
    assert found[-1]["area"] == pytest.approx(spectrum.mesh(0.6).area, rel=1e-5)
    assert len(spectrum.curves()) == 129 and len(spectrum.curves(1)) == 1
    with pytest.raises(isospectrum.Error):
        spectrum.curves(0)
    with pytest.raises(isospectrum.RangeError):
        spectrum.curves(3, range=(0, 7))


@pytest.mark.parametrize("ending", ["ply", "stl", "obj", "glb", "vtp", "3mf", "usda"])
def test_an_open_file_gets_the_bytes_of_a_path(spectrum, tmp_path, ending):
    m = spectrum.mesh(0.3)
    m.save(tmp_path / f"m.{ending}")
    file = io.BytesIO()
    m.save(file, format=ending)
    assert file.getvalue() == (tmp_path / f"m.{ending}").read_bytes()


def test_meshes_in_the_types_of_other_packages(spectrum, tmp_path):
    m = spectrum.mesh(0.3)
    meshio = importlib.import_module("meshio")
    made = m.to_meshio()
    made.write(tmp_path / "m.vtu")
    again = meshio.read(tmp_path / "m.vtu")
    assert np.allclose(again.points, m.vertices) and np.array_equal(again.cells_dict["triangle"], m.triangles)
    pyvista = importlib.import_module("pyvista")
    of_vtk, of_pyvista = pyvista.wrap(m.to_vtk()), m.to_pyvista()
    assert np.array_equal(of_vtk.points, of_pyvista.points) and np.array_equal(of_vtk.faces, of_pyvista.faces)
    assert of_vtk.volume == pytest.approx(m.volume, rel=1e-4)
    nibabel = importlib.import_module("nibabel")
    m.save(tmp_path / "m.surf.gii")
    points, triangles = nibabel.load(tmp_path / "m.surf.gii").agg_data()
    assert np.array_equal(points, m.vertices) and np.array_equal(triangles, m.triangles)
    layers = importlib.import_module("napari.layers")
    vertices, faces, values = layers.Surface(m.to_napari()).data
    assert np.array_equal(vertices[:, ::-1], m.vertices) and (values == np.float32(0.3)).all()
    # Seen in napari's order of axes, the triangles still face outwards.
    p, q, r = (vertices[faces[:, i]].astype(float)[:, ::-1] for i in range(3))
    assert np.einsum("ij,ij->i", p, np.cross(q, r)).sum() < 0


def test_lobes_of_both_signs_face_outwards():
    z, y, x = np.mgrid[:12, :12, :20].astype(float)
    field = np.exp(-((x - 5) ** 2 + (y - 6) ** 2 + (z - 6) ** 2) / 9) - np.exp(-((x - 14) ** 2 + (y - 6) ** 2 + (z - 6) ** 2) / 9)
    s = isospectrum.compute(field, error=0.3, backend="cpu", progress=False, check=False)
    positive = s.mesh(0.4)
    negative = s.mesh(-0.4, keep="largest", gradient_direction="ascent")
    assert positive.volume > 0
    assert s.mesh(-0.4).n_components == 2 or s.mesh(-0.4).volume > 0
    lobe = s.mesh(-0.4, at=(14, 6, 6), gradient_direction="ascent")
    inside_out = s.mesh(-0.4, at=(14, 6, 6))
    assert lobe.volume == pytest.approx(-inside_out.volume) and lobe.volume > 10
    outwards = lobe.vertices - np.array([14, 6, 6])
    assert (np.einsum("ij,ij->i", lobe.normals, outwards) > 0).all()
    assert np.array_equal(lobe.vertices, inside_out.vertices) and negative.n_triangles > 0
    assert same(s.mesh(0.4, gradient_direction="descent"), positive)


def test_a_distance_field_has_meshes_of_positive_volume(run, tmp_path):
    z, y, x = np.mgrid[:12, :12, :12].astype(np.float32)
    distance = np.sqrt((x - 5.4) ** 2 + (y - 5.6) ** 2 + (z - 5.3) ** 2)
    s = isospectrum.compute(distance, name="d.npy", outside="high", backend="cpu", progress=False)
    m = s.mesh(4)
    # The tolerance of a tenth of a voxel is a fortieth of the radius.
    assert m.volume == pytest.approx(4 / 3 * np.pi * 4**3, rel=3 / 40)
    assert (np.einsum("ij,ij->i", m.normals, m.vertices - np.array([5.4, 5.6, 5.3])) > 0).all()
    assert s.mesh(4, gradient_direction="descent").volume == pytest.approx(-m.volume)
    # As the program's.
    np.save(tmp_path / "d.npy", distance)
    run("compute", tmp_path / "d.npy", "-o", tmp_path / "d.isp", "--outside", "high", "--backend", "cpu", "-q")
    s.save(tmp_path / "ours.isp")
    assert (tmp_path / "ours.isp").read_bytes() == (tmp_path / "d.isp").read_bytes()


def test_isovalues_are_suggested_with_reasons(array, run, tmp_path):
    np.save(tmp_path / "a.npy", array)
    found = isospectrum.analyze(array)
    program = json.loads(run("analyze", tmp_path / "a.npy", "--json"))
    assert [(s.isovalue, s.by) for s in found.suggestions] == [(c["isovalue"], c["by"]) for c in program["candidates"]]
    assert len(found.events) == program["n_events"] and found.range == (array.min(), array.max())
    two = found.suggestions[1]
    assert two.reason.startswith("lies in 1 branch of the contour tree")
    s = isospectrum.compute(array, backend="cpu", progress=False)
    assert s.mesh(two).n_components == 2


def test_the_forecast_is_that_of_the_program(array, run, tmp_path):
    np.save(tmp_path / "a.npy", array)
    program = json.loads(run("compute", tmp_path / "a.npy", "-o", tmp_path / "a.isp", "--backend", "cpu", "--json", "--range", "20%:0.8"))["forecast"]
    found = isospectrum.forecast(array, range=("20%", 0.8))
    assert (found.n_triangles, found.memory, found.n_events) == (round(program["triangles"]), round(program["memory"]), program["events"])
    with pytest.raises(isospectrum.UsageError, match="error 0, expected a number above 0"):
        isospectrum.forecast(array, error=0)
    with pytest.raises(TypeError, match="did you mean 'spacing'"):
        isospectrum.forecast(array, spacin=2)


def test_notebooks_show_spectra_and_meshes(spectrum):
    text = spectrum._repr_html_()
    for part in ("blobs, 18 x 16 x 14 float32", "<svg", "data:image/png;base64,iVBOR", "0.1 voxel"):
        assert part in text, part
    m = spectrum.mesh(0.55)
    assert f"{m.n_vertices}, {m.n_triangles}" in m._repr_html_() and "2, 4" in m._repr_html_()
    assert "empty" in spectrum.mesh(spectrum.range[1])._repr_html_()
