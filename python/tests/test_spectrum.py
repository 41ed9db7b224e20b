"""Spectra: description, tables, files, pages, pictures, verification."""

from __future__ import annotations

import base64
import copy
import importlib
import json
import pathlib
import pickle
import zlib

import isospectrum
import numpy as np
import pytest
import xarray

from .conftest import blobs, topology


def test_a_spectrum_describes_its_volume(spectrum, array):
    assert spectrum.range == (array.min(), array.max())
    assert spectrum.tolerance == 0.1
    assert spectrum.volume["dims"] == [18, 16, 14] and spectrum.volume["sample_type"] == "float32"
    assert spectrum.counts["steps"] > 10 and spectrum.parameters["backend"] == "cpu"
    assert spectrum.n_triangles > spectrum.mesh(0.3).n_triangles
    assert repr(spectrum).startswith("<isospectrum.Spectrum of blobs: ")
    assert isospectrum.__version__ == "0.1.0"


def test_tables_are_data_frames(spectrum):
    pd = importlib.import_module("pandas")
    for table in (spectrum.curves(), spectrum.events, spectrum.components(0.55)):
        frame = pd.DataFrame(table)
        assert list(frame.columns) == list(table.dtype.names) and len(frame) == len(table) > 1
    assert pd.DataFrame(spectrum.components(spectrum.range[1])).empty


def test_curves_are_the_measures_of_meshes(spectrum):
    curves = spectrum.curves()
    assert len(curves) == 129 and (curves["isovalue"][[0, -1]] == spectrum.range).all()
    for row in curves[[20, 64, 100]]:
        m = spectrum.mesh(row["isovalue"])
        assert (row["components"], row["euler"]) == topology(m.triangles, m.n_vertices)
        assert row["triangles"] == m.n_triangles
        p, q, r = (m.vertices[m.triangles[:, i]].astype(float) for i in range(3))
        assert row["volume"] == pytest.approx(np.einsum("ij,ij->i", p, np.cross(q, r)).sum() / 6, rel=1e-4)
        area = np.linalg.norm(np.cross(q - p, r - p), axis=1)[~m.caps].sum() / 2
        assert row["area"] == pytest.approx(area, rel=1e-4)


def test_events_are_where_topology_changes(spectrum, array):
    events = spectrum.events
    assert set(events["kind"]) <= {"emerge", "merge", "handle-open", "split", "handle-close", "vanish"}
    assert (np.diff(events["isovalue"]) >= 0).all()
    assert events[-1]["kind"] == "vanish" and events[-1]["isovalue"] == pytest.approx(array.max(), rel=1e-9)
    # The two balls part where the one saddle between them is.
    (split,) = events[events["kind"] == "split"]
    assert 5.3 < split["x"] < 12.2
    # The lower ball has lasted since they parted.
    lower, higher = events[events["kind"] == "vanish"]
    assert lower["persistence"] == split["persistence"] == lower["isovalue"] - split["isovalue"]
    assert np.isnan(higher["persistence"])
    for side, n in ((-1, 1), (1, 2)):
        assert len(spectrum.components(split["isovalue"] + side * 1e-4)) == n


def test_files_are_written_atomically(spectrum, tmp_path):
    spectrum.save(tmp_path / "x.isp")
    again = isospectrum.open(str(tmp_path / "x.isp"))
    assert again._native.to_bytes() == (tmp_path / "x.isp").read_bytes()
    spectrum.save(tmp_path / "x.thesis")
    assert isospectrum.open(tmp_path / "x.thesis").n_triangles == spectrum.n_triangles
    # Which has no record of the computation.
    assert isospectrum.open(tmp_path / "x.thesis").counts == {} == isospectrum.open(tmp_path / "x.thesis").parameters
    with pytest.raises(isospectrum.UsageError, match="expected a name that ends in .isp or .thesis"):
        spectrum.save(tmp_path / "x.vtk")
    with pytest.raises(isospectrum.FileError) as raised:
        spectrum.save(tmp_path / "nowhere" / "x.isp")
    assert isinstance(raised.value, OSError) and raised.value.errno == 2
    assert raised.value.filename == str(tmp_path / "nowhere" / "x.isp")
    with pytest.raises(isospectrum.FileError):
        spectrum.html(tmp_path / "nowhere" / "x.html", still=False)
    (tmp_path / "cut.isp").write_bytes((tmp_path / "x.isp").read_bytes()[:-100])
    with pytest.raises(isospectrum.InputError, match="cut.isp") as raised:
        isospectrum.open(tmp_path / "cut.isp")
    assert "\n" not in str(raised.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cut.isp", "x.isp", "x.thesis"]


def test_a_spectrum_can_be_pickled_and_copied(spectrum):
    for again in (pickle.loads(pickle.dumps(spectrum)), copy.deepcopy(spectrum)):
        assert np.array_equal(again.mesh(0.3).vertices, spectrum.mesh(0.3).vertices)
        assert again.parameters == spectrum.parameters


def test_a_page_is_text_or_a_file(spectrum, array, tmp_path):
    page = spectrum.html(title="<Two> balls", caption="c", volume=array, still=False, tolerance=0.02, range=("5%", 0.9))
    assert page.startswith("<!DOCTYPE html>") and "&lt;Two&gt; balls" in page
    assert spectrum.html(tmp_path / "x.html", still=False) is None
    assert (tmp_path / "x.html").read_text() == spectrum.html(still=False)
    about = page.split('id="about"', 1)[1].split(">", 1)[1].split("</script>", 1)[0]
    assert sum(json.loads(about)["histogram"]) == ((array >= spectrum.isovalue("5%")) & (array <= 0.9)).sum()
    assert json.loads(about)["slice"] is None
    for wrong in ({"c": 7}, {"marks": {"x": 7}}, {"step": 0}, {"camera": (1,)}, {"volume": array[1:]}, {"slice": True}):
        with pytest.raises(isospectrum.Error):
            spectrum.html(still=False, **wrong)


def test_a_page_with_slices_has_the_samples(spectrum, array):
    page = spectrum.html(volume=array, slice=True, still=False)

    def element(name):
        return page.split(f'id="{name}"', 1)[1].split(">", 1)[1].split("</script>", 1)[0]

    differences = np.frombuffer(zlib.decompress(base64.b64decode(element("slice-samples")), -15), np.uint8)
    codes = np.cumsum(differences, dtype=np.uint8)
    about = json.loads(element("about"))["slice"]
    # Both have x fastest.
    found = about["low"] + about["unit"] * codes.reshape(array.shape)
    assert np.abs(found - array).max() <= 0.501 * about["unit"]


def test_a_picture_is_an_array_that_notebooks_display(spectrum, array, tmp_path):
    picture = spectrum.render(0.3, size=(160, 120))
    assert picture.shape == (120, 160, 4) and picture.dtype == np.uint8
    assert (picture[0, 0] == 255).all() and (picture[60, 80, :3] < 255).any()
    assert picture._repr_png_().startswith(b"\x89PNG")
    picture.save(tmp_path / "p.png")
    assert (tmp_path / "p.png").read_bytes() == picture._repr_png_()
    part = picture[:60]
    assert part._repr_png_() is None
    with pytest.raises(ValueError, match="a slice of a picture"):
        part.save(tmp_path / "part.png")
    two = spectrum.render([0.3, 0.6], size=(160, 120), opacity=0.5, background="dark")
    assert (two[0, 0, :3] < 60).all()
    assert spectrum.render({0.3: "red", "60%": "@0.5"}, size=(32, 32)).shape == (32, 32, 4)
    for wrong in ({"size": (0, 5)}, {"color": "rainbow"}, {"background": "pink"}, {"light": "north"}, {"fit": "all"}, {"c": {0.3: "pinkish"}}):
        with pytest.raises(isospectrum.UsageError):
            spectrum.render(**{"c": 0.3, **wrong})
    for wrong in (
        {"clip": "w:5"}, {"clip": "x:101%"}, {"opacity": 2}, {"up": "up"}, {"color_map": "jet"}, {"color_range": (1, 0)},
        {"color_range": 5}, {"color": "distance"}, {"color": "quality", "color_by": array}, {"c": []},
    ):  # fmt: skip
        with pytest.raises(isospectrum.UsageError):
            spectrum.render(**{"c": 0.3, **wrong})
    with pytest.raises(isospectrum.GpuError):
        spectrum.render(0.3, adapter="no such adapter")


def test_colours_show_another_array_in_the_frame_of_the_volume():
    a = blobs()
    frame = {"spacing": (0.5, 1, 2), "origin": (3, 2, 1), "direction": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]}
    s = isospectrum.compute(a, **frame, unit="mm", backend="cpu", progress=False)
    # On the surface at 0.4 the volume itself is 0.4, the middle colour of vik on this scale.
    own = s.render(0.4, size=(64, 48), color_by=a, color_map="vik", color_range=(0.2, 0.6), legend=False)
    flat = s.render(0.4, size=(64, 48), color_by=np.full_like(a, 0.4) + a * 1e-6, color_map="vik",
                    color_range=(0.2, 0.6), legend=False)  # fmt: skip
    shown = (own[..., :3] < 250).any(axis=-1)
    assert shown.sum() > 100
    assert np.abs(own[..., :3].astype(int) - flat[..., :3])[shown].mean() < 4
    with pytest.raises(isospectrum.InputError, match="expected a volume that overlaps"):
        z, y, x = (np.arange(n, dtype=float) + 1e4 for n in a.shape)
        s.render(0.4, color_by=xarray.DataArray(a, dims=("z", "y", "x"), coords={"z": z, "y": y, "x": x}))


def test_a_limit_of_memory_gives_bricks_or_an_error():
    a = blobs((40, 44, 48))
    # Even a single brick needs more.
    with pytest.raises(isospectrum.UsageError, match="memory"):
        isospectrum.compute(a, backend="cpu", max_memory="1MB", progress=False)
    s = isospectrum.compute(a, range=(0.2, 0.6), backend="cpu", brick=20, max_memory="1GiB", progress=False)
    assert s.parameters["bricks"]["n"] == 8
    ours, whole = s.mesh(0.4), isospectrum.compute(a, range=(0.2, 0.6), backend="cpu", progress=False).mesh(0.4)
    assert topology(ours.triangles, len(ours.vertices)) == topology(whole.triangles, len(whole.vertices))
    assert "bricks" not in isospectrum.compute(blobs(), backend="cpu", max_memory=8e9, progress=False).parameters
    with pytest.raises(isospectrum.UsageError, match="samples take"):
        isospectrum.compute(a, backend="cpu", max_memory="100kB", progress=False)
    for wrong in ({"max_memory": "much"}, {"max_memory": 0}, {"brick": 1}, {"max_memory": "3XB"}):
        with pytest.raises(isospectrum.UsageError):
            isospectrum.compute(a, backend="cpu", progress=False, **wrong)


def test_verification_fails_for_another_volume(spectrum, array):
    found = spectrum.verify(array, n=12, events=2, progress=False)
    found.check()
    assert found and found.passed and not found.failures
    assert (found.rows["euler"] == found.rows["expected_euler"]).all() and len(found.rows) >= 12
    assert found.totals["vertex_deviation"]["p99"] < 2.5 * spectrum.tolerance
    # Another volume of the same range fails with reasons.
    wrong = spectrum.verify(np.ascontiguousarray(array[:, :, ::-1]), n=4, events=0, progress=False)
    assert not wrong and wrong.failures
    with pytest.raises(isospectrum.VerificationError, match="verification failed"):
        wrong.check()
    with pytest.raises(isospectrum.InputError, match="samples"):
        spectrum.verify(array[1:], progress=False)


def test_an_array_is_verified_with_the_spacing_of_the_spectrum(array):
    s = isospectrum.compute(array, spacing=(1, 1, 2), backend="cpu", progress=False)
    s.verify(array, n=6, events=1, progress=False).check()


def test_stubs_and_docstrings_exist():
    folder = pathlib.Path(isospectrum.__file__).parent
    assert (folder / "py.typed").exists() and (folder / "_native.pyi").exists()
    for name in isospectrum.__all__:
        thing = getattr(isospectrum, name)
        assert thing.__doc__, name
        for attribute, value in vars(thing).items() if isinstance(thing, type) else ():
            if not attribute.startswith("_") and callable(value):
                assert value.__doc__, f"{name}.{attribute}"


@pytest.mark.parametrize("options", [{}, {"open": True}, {"keep": "largest"}, {"gradient_direction": "ascent"}])
def test_a_mesh_is_written_to_arrays_that_are_given(options):
    # Left-handed, and far from the origin.
    s = isospectrum.compute(
        blobs(), spacing=(0.5, 1, 2), origin=(1e3, 0, 5), direction=np.diag([1, -1, 1]), backend="cpu", error=0.4, progress=False
    )
    out = (np.full((900, 3), 7, np.float32), np.full((1800, 3), 7, np.int32), np.full((900, 3), 7, np.float32))
    for c in ("20%", "60%", "61%", "20%"):
        m = s.mesh(c, **options)
        vertices, triangles, normals = s.mesh(c, out=out, **options)
        assert np.shares_memory(vertices, out[0]) and np.shares_memory(triangles, out[1]) and np.shares_memory(normals, out[2])
        assert np.array_equal(vertices, m.vertices) and np.array_equal(triangles, m.triangles)
        # Rounding may keep the sign of a zero.
        assert np.array_equal(normals, m.normals)
    # Rows beyond are left as they are.
    for array in out:
        array[:] = 7
    n = len(s.mesh("60%", out=out)[0])
    assert n < 900 and (out[0][n:] == 7).all() and (out[0][:n] != 7).any()
    shown = [(len(t), float(v.sum())) for v, t, _ in s.sweep(4, "20%", "80%", out=out, **options)]
    assert shown == [(m.n_triangles, float(m.vertices.sum())) for m in s.sweep(4, "20%", "80%", **options)]


def test_arrays_that_do_not_fit_are_errors(spectrum):
    def arrays(n=900, dtype=np.float32, order="C"):
        return np.zeros((n, 3), dtype, order)

    frozen = arrays()
    frozen.flags.writeable = False
    good = (arrays(), arrays(1800, np.int32), arrays())
    for out, message in [
        ((arrays(3), *good[1:]), "out for 3 vertices and 1800 triangles, expected [0-9]+ and [0-9]+ or more"),
        ((arrays(dtype=np.float64), *good[1:]), "three writeable arrays"),
        ((frozen, *good[1:]), "three writeable arrays"),
        ((good[0], good[0]), "three writeable arrays"),
        ((np.zeros((900, 4), np.float32), *good[1:]), r"shape \[900, 4\], expected \(n, 3\)"),
        ((arrays(order="F"), *good[1:]), "expected .n, 3. in C order"),
    ]:
        with pytest.raises(isospectrum.UsageError, match=message):
            spectrum.mesh("30%", out=out)
    assert (good[1] == 0).all()
    with pytest.raises(isospectrum.UsageError, match="expected one isovalue"):
        spectrum.mesh(["30%", "40%"], out=good)
    with pytest.raises(isospectrum.RangeError):
        spectrum.mesh(99, out=good)
