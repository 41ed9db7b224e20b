"""Meshes as arrays and in the types of other packages; sweeps."""

from __future__ import annotations

import importlib

import isospectrum
import numpy as np
import pytest

from .conftest import blobs, topology


def volume_of(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """The volume enclosed by a closed mesh that is counter-clockwise from outside."""
    p, q, r = (np.asarray(vertices, dtype=float)[triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6)


def test_arrays_have_their_types_and_shapes_and_are_read_only(spectrum):
    m = spectrum.mesh(0.1)
    assert (m.vertices.dtype, m.triangles.dtype, m.normals.dtype, m.caps.dtype) == (
        np.float32, np.int32, np.float32, np.bool_,
    )  # fmt: skip
    n, t = m.n_vertices, m.n_triangles
    assert m.vertices.shape == m.normals.shape == (n, 3) and m.triangles.shape == (t, 3) and m.caps.shape == (t,)
    assert n > 100 and t == 2 * n - 4, "one closed surface without handles"
    assert m.triangles.max() == n - 1
    assert np.allclose(np.linalg.norm(m.normals, axis=1), 1, atol=1e-5)
    for array in (m.vertices, m.triangles, m.normals, m.caps):
        assert array.flags.c_contiguous and not array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert repr(m) == f"<isospectrum.Mesh: {t} triangles, {n} vertices at 0.1>"
    with pytest.raises(AttributeError):
        m.vertex = 1


def test_triangles_and_normals_face_lower_values(spectrum, array):
    m = spectrum.mesh(0.3)
    assert volume_of(m.vertices, m.triangles) > 50
    p, q, r = (m.vertices[m.triangles[:, i]] for i in range(3))
    across = np.einsum("ij,ij->i", np.cross(q - p, r - p), m.normals[m.triangles].mean(axis=1))
    assert (across > 0).mean() > 0.99
    inside = np.rint(m.vertices - 1.5 * m.normals).astype(int)
    assert (array[inside[:, 2], inside[:, 1], inside[:, 0]] > 0.3).mean() > 0.95


def test_a_left_handed_frame_reverses_triangles():
    s = isospectrum.compute(
        blobs((9, 10, 12)), direction=np.diag([1.0, 1.0, -1.0]), spacing=(1, 1, 2), error=0.4, backend="cpu", progress=False
    )
    m = s.mesh(0.3)
    assert volume_of(m.vertices, m.triangles) > 50
    assert m.vertices[:, 2].max() <= 0


def test_a_mesh_far_from_the_origin_keeps_its_shape():
    array = blobs((9, 10, 12))
    far = (1e7, -2e7, 3e7)
    s = isospectrum.compute(array, origin=far, error=0.4, backend="cpu", progress=False)
    near = isospectrum.compute(array, error=0.4, backend="cpu", progress=False).mesh(0.3)
    m = s.mesh(0.3)
    assert np.allclose(m.vertices_float64() - far, near.vertices_float64(), atol=1e-6)
    # Other mesh types get 64-bit positions if 32 bits are not precise enough.
    assert np.allclose(m.to_pyvista().points - far, near.vertices, atol=1e-6)
    assert np.allclose(m.to_trimesh().vertices - far, near.vertices, atol=1e-6)
    assert near.to_pyvista().points.dtype == np.float32


def test_isovalues_are_numbers_and_texts(spectrum, array):
    low, high = spectrum.range
    assert spectrum.isovalue("50%") == pytest.approx((low + high) / 2)
    assert spectrum.isovalue("p99") == pytest.approx(np.percentile(array, 99), abs=0.01)
    assert spectrum.isovalue("top:1%") == spectrum.isovalue("p99")
    assert spectrum.isovalue("1sigma") == pytest.approx(array.mean(dtype=float) + array.std(dtype=float))
    assert spectrum.mesh("50%").isovalue == spectrum.isovalue("50%")
    assert spectrum.mesh(np.float32(0.3)).isovalue == float(np.float32(0.3))
    assert spectrum.mesh().isovalue == spectrum.isovalue()
    for wrong, kind in ((2.0, isospectrum.RangeError), (float("nan"), isospectrum.RangeError),
                        ("half", isospectrum.UsageError), ([1, 2], isospectrum.RangeError),
                        (1j, isospectrum.UsageError)):  # fmt: skip
        with pytest.raises(kind):
            spectrum.mesh(wrong)


def test_the_ends_of_the_range_have_meshes(spectrum):
    low, high = spectrum.range
    assert spectrum.mesh(high).vertices.shape == (0, 3) and spectrum.mesh(high).triangles.shape == (0, 3)
    for c in (low, np.nextafter(low, 1)):
        assert np.isfinite(spectrum.mesh(c).vertices).all()
    empty = spectrum.mesh(high)
    assert empty.to_pyvista().n_points == 0
    assert len(empty.to_trimesh().faces) == 0


def test_components_are_kept(spectrum):
    both = spectrum.mesh(0.55)
    assert topology(both.triangles, both.n_vertices) == (2, 4)
    large = spectrum.mesh(0.55, keep="largest")
    assert topology(large.triangles, large.n_vertices) == (1, 2)
    small = spectrum.mesh(0.55, at=(12, 10, 7))
    assert small.n_triangles + large.n_triangles == both.n_triangles
    assert small.vertices[:, 0].min() > 8 > large.vertices[:, 0].max()
    assert spectrum.mesh(0.55, min_volume=1e6).n_triangles == 0
    for wrong in ({"keep": 0}, {"keep": "all"}, {"min_area": -1}, {"at": (1, 2)}):
        with pytest.raises(isospectrum.UsageError):
            spectrum.mesh(0.55, **wrong)


def test_open_meshes_have_no_caps():
    a = 1 - blobs((8, 9, 10))
    s = isospectrum.compute(a, error=0.4, backend="cpu", progress=False)
    closed, open_ = s.mesh(0.5), s.mesh(0.5, open=True)
    assert closed.caps.any() and not open_.caps.any()
    assert open_.n_triangles == (~closed.caps).sum()


def test_pyvista_and_trimesh_have_the_same_mesh(spectrum, tmp_path):
    importlib.import_module("pyvista")
    trimesh = importlib.import_module("trimesh")
    m = spectrum.mesh(0.3)
    pv_mesh = m.to_pyvista()
    assert np.array_equal(pv_mesh.points, m.vertices)
    assert np.array_equal(pv_mesh.regular_faces, m.triangles)
    assert np.array_equal(pv_mesh.point_data.active_normals, m.normals)
    assert pv_mesh.is_manifold and pv_mesh.volume == pytest.approx(volume_of(m.vertices, m.triangles), rel=1e-5)
    # The converted mesh is a copy.
    pv_mesh.points += 1
    assert not np.array_equal(pv_mesh.points, m.vertices)
    tri = m.to_trimesh()
    assert tri.is_watertight and tri.is_winding_consistent
    assert tri.volume == pytest.approx(volume_of(m.vertices, m.triangles), rel=1e-5)
    assert np.array_equal(tri.faces, m.triangles) and np.allclose(tri.vertex_normals, m.normals, atol=1e-6)
    for ending in ("ply", "stl", "obj", "glb"):
        m.save(tmp_path / f"m.{ending}")
        read = trimesh.load_mesh(tmp_path / f"m.{ending}")
        assert read.volume == pytest.approx(tri.volume, rel=1e-4), ending


def test_pyvista_reads_a_spectrum(spectrum, tmp_path):
    pv = importlib.import_module("pyvista")
    spectrum.save(tmp_path / "x.isp")
    mesh = pv.read(tmp_path / "x.isp")
    assert mesh.n_cells == spectrum.mesh().n_triangles > 100
    assert mesh.field_data["isovalue"][0] == spectrum.isovalue()
    assert pv.read(tmp_path / "x.isp", isovalue="p99").n_cells == spectrum.mesh("p99").n_triangles


def test_a_sweep_yields_the_meshes_one_by_one(spectrum):
    low, high = spectrum.range
    found = list(spectrum.sweep(9))
    assert [m.isovalue for m in found] == pytest.approx(np.linspace(low, high, 9))
    assert (found[0].isovalue, found[-1].isovalue) == (low, high)
    fresh = isospectrum.Spectrum(spectrum._native.from_bytes(spectrum._native.to_bytes()))
    for m in found:
        alone = fresh.mesh(m.isovalue)
        assert np.array_equal(m.vertices, alone.vertices) and np.array_equal(m.triangles, alone.triangles)
    down = list(spectrum.sweep(3, "60%", 0.2, keep=1))
    assert [m.isovalue for m in down] == pytest.approx([spectrum.isovalue("60%"), (spectrum.isovalue("60%") + 0.2) / 2, 0.2])
    assert len(list(spectrum.sweep(1))) == 1
    with pytest.raises(isospectrum.UsageError):
        list(spectrum.sweep(0))


def test_bytes_do_not_depend_on_the_number_of_threads():
    a = blobs((9, 10, 11))
    made = {
        isospectrum.compute(a, threads=n, error=0.3, backend="cpu", progress=False)._native.to_bytes()
        for n in (1, 2, 7, None)
    }
    assert len(made) == 1
