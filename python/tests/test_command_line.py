"""The package and the program give equal meshes, files, tables, pages, pictures and messages."""

from __future__ import annotations

import json
import subprocess

import isospectrum
import numpy as np
import pytest

from .conftest import blobs

ROTATED = {
    "spacing": (0.5, 1.0, 2.0),
    "origin": (10.0, -20.0, 5.0),
    "direction": [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
    "unit": "mm",
}


@pytest.fixture(scope="module")
def files(tmp_path_factory, array, run):
    """The array as a file, and the spectrum that the program makes of it."""
    folder = tmp_path_factory.mktemp("program")
    np.save(folder / "blobs.npy", array)
    run("compute", folder / "blobs.npy", "-o", folder / "blobs.isp", "--backend", "cpu", "-q")
    return folder


def test_a_spectrum_equals_that_of_the_program_byte_for_byte(files, array, tmp_path):
    s = isospectrum.compute(array, name="blobs.npy", backend="cpu", progress=False)
    s.save(tmp_path / "ours.isp")
    assert (tmp_path / "ours.isp").read_bytes() == (files / "blobs.isp").read_bytes()
    # A volume can be given as a path.
    isospectrum.compute(files / "blobs.npy", backend="cpu", progress=False).save(tmp_path / "path.isp")
    assert (tmp_path / "path.isp").read_bytes() == (files / "blobs.isp").read_bytes()


@pytest.mark.parametrize("ending, flags, options", [
    ("ply", [], {}), ("stl", ["--open"], {"open": True}), ("obj", ["--keep", "largest"], {"keep": "largest"}),
    ("glb", ["--at", "12,10,7"], {"at": (12, 10, 7)}), ("ply", ["--min-volume", "30"], {"min_volume": 30}),
])  # fmt: skip
def test_a_mesh_equals_that_of_the_program_byte_for_byte(files, run, tmp_path, ending, flags, options):
    s = isospectrum.open(files / "blobs.isp")
    for c in (0.2, "35%", "p99"):
        run("extract", files / "blobs.isp", "-c", c, "-o", tmp_path / f"program.{ending}", *flags)
        s.mesh(c, **options).save(tmp_path / f"ours.{ending}")
        assert (tmp_path / f"ours.{ending}").read_bytes() == (tmp_path / f"program.{ending}").read_bytes()


def ply(path):
    """Vertices, normals and triangles of a binary PLY file, by its header alone."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = head.decode().splitlines()
    count = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    vertex = np.dtype([(n, "<f4") for n in ("x", "y", "z", "nx", "ny", "nz")])
    face = np.dtype([("n", "u1"), ("v", "<i4", 3)])
    vertices = np.frombuffer(body, vertex, count["vertex"])
    faces = np.frombuffer(body, face, count["face"], vertex.itemsize * count["vertex"])
    columns = [np.stack([vertices[n] for n in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz"))]
    return (*columns, faces["v"])


def test_arrays_equal_the_mesh_that_the_program_writes(files, run, tmp_path):
    run("extract", files / "blobs.isp", "-c", "0.3", "-o", tmp_path / "m.ply")
    vertices, normals, triangles = ply(tmp_path / "m.ply")
    m = isospectrum.open(files / "blobs.isp").mesh(0.3)
    assert len(m.triangles) > 100
    assert np.array_equal(m.vertices, vertices)
    assert np.array_equal(m.normals, normals)
    assert np.array_equal(m.triangles, triangles)


def test_a_rotated_frame_gives_the_mesh_of_the_program(run, tmp_path):
    """A MetaImage with the frame that the arguments give."""
    array = blobs((9, 10, 12))
    columns = np.array(ROTATED["direction"]).T
    (tmp_path / "blobs.mha").write_bytes(
        "\n".join([
            "ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False",
            "DimSize = 12 10 9", "ElementType = MET_FLOAT", "ElementSpacing = 0.5 1 2", "Offset = 10 -20 5",
            "TransformMatrix = " + " ".join(f"{x:g}" for x in columns.ravel()), "ElementDataFile = LOCAL\n",
        ]).encode() + array.tobytes()
    )  # fmt: skip
    run("compute", tmp_path / "blobs.mha", "-o", tmp_path / "p.isp", "--backend", "cpu", "-q", "--error", "0.4")
    run("extract", tmp_path / "p.isp", "-c", "0.3", "-o", tmp_path / "p.ply")
    vertices, normals, triangles = (part for part in ply(tmp_path / "p.ply"))
    s = isospectrum.compute(array, **ROTATED, space="LPS", error=0.4, backend="cpu", progress=False)
    m = s.mesh(0.3)
    assert np.array_equal(m.vertices, vertices)
    assert np.array_equal(m.normals, normals)
    assert np.array_equal(m.triangles, triangles)
    assert s.volume["placement"]["unit"] == "mm"


@pytest.mark.parametrize("flags, options", [
    (["--crop", "2:16,:,1:13"], {"crop": ((2, 16), None, slice(1, 13))}),
    (["--crop", "2:16,:,1:13"], {"crop": "2:16,:,1:13"}),
    (["--median", "1", "--smooth", "0.8"], {"median": 1, "smooth": 0.8}),
    (["--downsample", "2"], {"downsample": 2}),
    (["--persistence", "5%"], {"persistence": "5%"}),
    (["--persistence", "0.04", "--range", "20%:0.6"], {"persistence": 0.04, "range": ("20%", 0.6)}),
    (["--min-component", "40"], {"min_component": 40}),
    (["--max-edge", "2", "--start", "p90"], {"max_edge": 2, "start": "p90"}),
])  # fmt: skip
def test_parameters_mean_what_flags_mean(array, run, tmp_path, flags, options):
    np.save(tmp_path / "blobs.npy", array)
    run("compute", tmp_path / "blobs.npy", "-o", tmp_path / "p.isp", "--backend", "cpu", "-q", "--error", "0.4", *flags)
    s = isospectrum.compute(array, name="blobs.npy", error=0.4, backend="cpu", progress=False, **options)
    s.save(tmp_path / "ours.isp")
    assert (tmp_path / "ours.isp").read_bytes() == (tmp_path / "p.isp").read_bytes()
    # Verification needs the original volume only.
    found = s.verify(array, n=6, events=1, progress=False)
    assert found.totals["topology_right"] == found.totals["isovalues"] > 6


def test_a_mask_means_what_the_flag_means(array, run, tmp_path):
    z, y, x = np.indices(array.shape)
    inside = (x - 7) ** 2 + (y - 7) ** 2 + (z - 6) ** 2 < 30
    np.save(tmp_path / "blobs.npy", array)
    np.save(tmp_path / "mask.npy", inside)
    flags = ["--backend", "cpu", "-q", "--error", "0.4", "--mask", tmp_path / "mask.npy", "--persistence", "2%"]
    run("compute", tmp_path / "blobs.npy", "-o", tmp_path / "p.isp", *flags)
    options = {"name": "blobs.npy", "error": 0.4, "backend": "cpu", "progress": False, "persistence": "2%"}
    s = isospectrum.compute(array, mask=tmp_path / "mask.npy", **options)
    s.save(tmp_path / "ours.isp")
    assert (tmp_path / "ours.isp").read_bytes() == (tmp_path / "p.isp").read_bytes()
    # A mask can be an array. Masked meshes are open by default.
    of_array = isospectrum.compute(array, mask=inside, **options).mesh("60%")
    assert np.array_equal(of_array.vertices, s.mesh("60%", open=True).vertices)
    assert len(of_array.triangles) < len(s.mesh("60%", open=False).triangles)
    # The mask is evaluated in the middle of intervals in which a triangle moves by at most a quarter of a voxel.
    middles = of_array.vertices[of_array.triangles].mean(axis=1)
    away = np.abs(middles[:, None] - np.argwhere(inside)[None, :, ::-1]).max(axis=2).min(axis=1)
    assert away.max() <= 0.5 + 0.125
    with pytest.raises(isospectrum.InputError, match="a mask of"):
        isospectrum.compute(array, mask=inside[:5], **options)


def test_tables_equal_those_of_the_program(files, run):
    s = isospectrum.open(files / "blobs.isp")
    listed = json.loads(run("components", files / "blobs.isp", "-c", "0.55", "--json"))["components"]
    ours = s.components(0.55)
    assert len(ours) == len(listed) == 2
    for row, expected in zip(ours, listed):
        assert row["number"] == expected["number"]
        assert [row[k] for k in ("volume", "area", "euler", "triangles")] == [
            expected[k] for k in ("volume", "area", "euler", "n_triangles")
        ]
        for end in ("birth", "death"):
            assert row[end] == expected[end] or np.isnan(row[end]) and expected[end] is None
        assert row["splits_from"] == (expected["splits_from"] or 0)
        assert [row[f"max_{a}"] for a in "xyz"] == expected["bounds"][1]
    assert len(s.components(0.55, keep=1)) == 1
    info = json.loads(run("info", files / "blobs.isp", "--json"))
    assert s.events["isovalue"].tolist() == info["events"]
    assert (s.n_triangles, s.n_vertices, s.n_knots) == (info["n_triangles"], info["n_vertices"], info["n_knots"])


def test_a_page_equals_that_of_the_program(files, run, tmp_path):
    flags = ["--title", "Two balls", "--mark", "0.3=both", "--axes", "-c", "40%"]
    run("html", files / "blobs.isp", "-o", tmp_path / "p.html", *flags, "-q")
    s = isospectrum.open(files / "blobs.isp")
    s.html(tmp_path / "ours.html", title="Two balls", marks={"both": 0.3}, axes=True, c="40%")
    assert (tmp_path / "ours.html").read_bytes() == (tmp_path / "p.html").read_bytes()


def test_a_page_with_all_options_equals_that_of_the_program(files, array, run, tmp_path):
    np.save(tmp_path / "field.npy", array[::-1].copy())
    run("html", files / "blobs.isp", "-o", tmp_path / "p.html", "-q", "-c", "0.3=bone@0.4", "-c", "0.7=red", "--title", "t",
        "--color-by", tmp_path / "field.npy", "--color-map", "vik", "--color-range", "p5:p95", "--color-center", "0.4",
        "--camera", "40,10", "--up", "-x", "--orthographic", "--clip", "-z:25%", "--occlusion", "--wireframe",
        "--silhouette", "--background", "dark", "--light", "below")  # fmt: skip
    s = isospectrum.open(files / "blobs.isp")
    s.html(
        tmp_path / "ours.html",
        c={0.3: "bone@0.4", 0.7: "red"},
        title="t",
        color_by=tmp_path / "field.npy",
        color_map="vik",
        color_range=("p5", "p95"),
        color_center=0.4,
        camera=(40, 10),
        up="-x",
        orthographic=True,
        clip="-z:25%",
        occlusion=True,
        wireframe=True,
        silhouette=True,
        background="dark",
        light="below",
    )
    assert (tmp_path / "ours.html").read_bytes() == (tmp_path / "p.html").read_bytes()


def test_a_spectrum_in_bricks_equals_that_of_the_program(files, array, run, tmp_path):
    run("compute", files / "blobs.npy", "-o", tmp_path / "x.isp", "--brick", "8", "--backend", "cpu", "-q")
    s = isospectrum.compute(array, name="blobs.npy", backend="cpu", brick=8, progress=False)
    theirs = isospectrum.open(tmp_path / "x.isp")
    assert s.parameters == theirs.parameters and s.parameters["bricks"]["side"] == 8
    s.save(tmp_path / "ours.isp")
    for one in (s, isospectrum.open(tmp_path / "ours.isp")):
        assert (one.n_triangles, one.n_vertices, one.range) == (theirs.n_triangles, theirs.n_vertices, theirs.range)
        for c in ("20%", "70%"):
            ours, other = one.mesh(c), theirs.mesh(c)
            assert len(ours.triangles) == len(other.triangles) > 0
            assert {tuple(v) for v in ours.vertices.tolist()} == {tuple(v) for v in other.vertices.tolist()}
    with pytest.raises(isospectrum.FileError):
        isospectrum.open(tmp_path / "none.isp")


def test_a_picture_equals_that_of_the_program(files, run, tmp_path):
    run("render", files / "blobs.isp", "-c", "0.3=bone", "-c", "0.7=#ff0000@0.5", "-o", tmp_path / "p.png",
        "--size", "320x240", "--camera", "40,10,1.2")  # fmt: skip
    s = isospectrum.open(files / "blobs.isp")
    s.render({0.3: "bone", 0.7: "#ff0000@0.5"}, size=(320, 240), camera=(40, 10, 1.2)).save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "p.png").read_bytes()


def test_a_picture_with_all_options_equals_that_of_the_program(files, array, run, tmp_path):
    s = isospectrum.open(files / "blobs.isp")
    run("render", files / "blobs.isp", "-c", "0.4", "-o", tmp_path / "p.png", "--size", "320x240", "--camera", "40,10",
        "--up", "x", "--orthographic", "--clip", "y:40%", "--occlusion", "--axes", "--label", "c = {isovalue}",
        "--color", "distance", "--volume", files / "blobs.npy", "--color-range", "0:0.2", "--color-map", "magma")  # fmt: skip
    appearance = {"camera": (40, 10), "up": "x", "orthographic": True, "clip": "y:40%", "occlusion": True, "axes": True}
    colors = {"color": "distance", "volume": array, "color_range": (0, 0.2), "color_map": "magma"}
    s.render(0.4, size=(320, 240), label="c = {isovalue}", **appearance, **colors).save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "p.png").read_bytes()
    run("render", files / "blobs.isp", "-c", "0.4", "-o", tmp_path / "p.png", "--size", "320x240", "--scale-bar",
        "--light", "left", "--color", "quality", "--no-legend", "--wireframe", "--silhouette", "--clip", "-x:5")  # fmt: skip
    options = {"scale_bar": True, "color": "quality", "legend": False, "wireframe": True, "silhouette": True, "clip": "-x:5", "light": "left"}
    s.render(0.4, size=(320, 240), **options).save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "p.png").read_bytes()


@pytest.mark.parametrize("arguments, call", [
    (["extract", "{s}", "-c", "99", "-o", "{o}.ply"], lambda s, o: s.mesh(99)),
    (["extract", "{s}", "-c", "0.3", "-o", "{o}.xyz"], lambda s, o: s.mesh(0.3).save(f"{o}.xyz")),
    (["info", "{o}.isp"], lambda s, o: isospectrum.open(f"{o}.isp")),
    (["compute", "{o}.npy", "-o", "{o}.isp"], lambda s, o: isospectrum.compute(f"{o}.npy")),
])  # fmt: skip
def test_errors_have_the_messages_of_the_program(files, program, tmp_path, arguments, call):
    s = isospectrum.open(files / "blobs.isp")
    command = [argument.format(s=files / "blobs.isp", o=tmp_path / "out") for argument in arguments]
    done = subprocess.run([program, *command], capture_output=True, text=True, check=False)
    assert done.returncode in (2, 3, 4)
    with pytest.raises(isospectrum.Error) as raised:
        call(s, tmp_path / "out")
    message = str(raised.value)
    if isinstance(raised.value, OSError):
        # Python's form of system errors: the message of the system, and the file.
        assert raised.value.filename in done.stderr and raised.value.strerror in done.stderr
    else:
        assert message in done.stderr


@pytest.mark.parametrize("style", ["paper", "studio", "flat"])
def test_a_style_is_that_of_the_program_and_single_options_win(files, run, tmp_path, style):
    s = isospectrum.open(files / "blobs.isp")
    run("render", files / "blobs.isp", "-c", "0.4", "-o", tmp_path / "p.png", "--size", "160x120", "--style", style)
    picture = s.render(0.4, size=(160, 120), style=style)
    picture.save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "p.png").read_bytes()
    assert (np.asarray(picture) != np.asarray(s.render(0.4, size=(160, 120)))).any()
    run("render", files / "blobs.isp", "-c", "0.4", "-o", tmp_path / "p.png", "--size", "160x120", "--style", style,
        "--background", "light", "--light", "below")  # fmt: skip
    s.render(0.4, size=(160, 120), style=style, background="light", light="below").save(tmp_path / "ours.png")
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "p.png").read_bytes()


def test_an_unknown_style_is_named(files):
    with pytest.raises(isospectrum.Error, match="flat"):
        isospectrum.open(files / "blobs.isp").render(0.4, style="flatt")
