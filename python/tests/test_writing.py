"""Meshes of several isovalues, morphing meshes and films are those of the program, byte for byte; events count what meshes have."""

from __future__ import annotations

import inspect
import os
import sys

import isospectrum
import numpy as np
import pytest
from isospectrum import _drawing, _looks

from .conftest import blobs


@pytest.fixture(scope="module")
def files(tmp_path_factory, array, run):
    """The spectrum of an array, and another array of the same frame."""
    folder = tmp_path_factory.mktemp("written")
    np.save(folder / "blobs.npy", array)
    np.save(folder / "other.npy", array[::-1].copy())
    run("compute", folder / "blobs.npy", "-o", folder / "blobs.isp", "--backend", "cpu", "-q")
    return folder


def contents(folder) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name, flags, options", [
    ("m.ply", ["-c", "0.4", "--color-by", "other.npy", "--color-map", "vik", "--color-range", "p5:p95"],
     {"c": 0.4, "color_by": "other.npy", "color_map": "vik", "color_range": ("p5", "p95")}),
    ("m.vtp", ["-c", "0.4", "--color", "distance", "--volume", "blobs.npy", "--keep", "largest"],
     {"c": 0.4, "color": "distance", "volume": "blobs.npy", "keep": "largest"}),
    ("m-%02d.obj", ["--sweep", "10%:0.8:4", "--color", "curvature", "--open"], {"sweep": ("10%", 0.8, 4), "color": "curvature", "open": True}),
    ("list.pvd", ["--sweep", "90%:10%:3"], {"sweep": "90%:10%:3"}),
    ("scene.glb", ["-c", "0.3=bone@0.4", "-c", "0.7"], {"c": {0.3: "bone@0.4", 0.7: ""}}),
    ("sweep.usda", ["--sweep", "20%:60%:3", "--min-volume", "30"], {"sweep": ("20%", "60%", 3), "min_volume": 30}),
    ("morph.glb", ["--sweep", "0.1:0.2:3", "--morph"], {"sweep": (0.1, 0.2, 3), "morph": True}),
    ("plain", ["-c", "50%", "--format", "stl"], {"c": "50%", "format": "stl"}),
])  # fmt: skip
def test_meshes_are_those_of_the_program(files, run, tmp_path, monkeypatch, name, flags, options):
    theirs, ours = tmp_path / "theirs", tmp_path / "ours"
    theirs.mkdir(), ours.mkdir()
    monkeypatch.chdir(files)
    run("extract", "blobs.isp", *flags, "-o", theirs / name)
    table = isospectrum.open("blobs.isp").extract(ours / name, **options, progress=False)
    assert contents(ours) == contents(theirs) and len(contents(ours)) > 0
    assert {os.path.basename(file) for file in table["file"]} == set(contents(ours)) - {"list.pvd"}
    assert (table["triangles"] > 100).all() and (np.abs(np.diff(table["isovalue"])) > 0).all()


@pytest.mark.parametrize("flags, options", [
    (["--sweep", "20%:0.6:3", "--label", "c = {isovalue}"], {"sweep": ("20%", 0.6, 3), "label": "c = {isovalue}"}),
    (["--turntable", "4", "-c", "0.3", "-c", "0.6=red"], {"turntable": 4, "c": {0.3: "", 0.6: "red"}}),
    (["--turntable", "2", "-c", "0.3", "--fit", "volume", "--color-by", "other.npy"], {"turntable": 2, "c": 0.3, "fit": "volume", "color_by": "other.npy"}),
])  # fmt: skip
def test_films_are_those_of_the_program(files, run, tmp_path, monkeypatch, flags, options):
    monkeypatch.chdir(files)
    run("render", "blobs.isp", *flags, "--size", "96x64", "-o", tmp_path / "theirs" / "%02d.png", "-q")
    stages = []
    s = isospectrum.open("blobs.isp")
    s.film(tmp_path / "ours" / "%02d.png", **options, size=(96, 64), progress=lambda done, stage: stages.append(stage))
    pictures = contents(tmp_path / "ours")
    assert pictures == contents(tmp_path / "theirs")
    assert len(set(pictures.values())) == len(pictures) == (options.get("turntable") or 3)
    assert set(stages) <= {"", "rendering", "encoding"}


def test_several_surfaces_show_the_inner_ones_as_those_of_the_program(files, run, tmp_path):
    run("render", files / "blobs.isp", "-c", "0.2", "-c", "0.6", "--size", "96x64", "-o", tmp_path / "p.png")
    isospectrum.open(files / "blobs.isp").render([0.2, 0.6], size=(96, 64)).save(tmp_path / "ours.png")
    assert (tmp_path / "p.png").read_bytes() == (tmp_path / "ours.png").read_bytes()


@pytest.mark.skipif(sys.platform == "win32", reason="the encoder of this test is a shell script")
def test_a_film_is_encoded_by_ffmpeg(files, tmp_path, monkeypatch):
    encoder = tmp_path / "ffmpeg"
    encoder.write_text('#!/bin/sh\nfor last; do :; done\n[ "$last" = -version ] || ls | grep -c png > "$last"\n')
    encoder.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    s = isospectrum.open(files / "blobs.isp")
    s.film(tmp_path / "f.mp4", sweep=(0.2, 0.6, 5), size=(32, 32), fps=10, progress=False)
    assert (tmp_path / "f.mp4").read_text() == "5\n"
    encoder.write_text('#!/bin/sh\nfor last; do :; done\n[ "$last" = -version ] || { echo "no such encoder" >&2; exit 3; }\n')
    with pytest.raises(isospectrum.FileError, match="ffmpeg fails: no such encoder"):
        s.film(tmp_path / "g.webm", sweep=(0.2, 0.6, 2), size=(32, 32), progress=False)
    assert {path.name for path in tmp_path.iterdir()} == {"ffmpeg", "f.mp4"}


@pytest.mark.parametrize("call, message", [
    (lambda s, d: s.extract(d / "m.ply", [0.2, 0.3]), "one placeholder for the number of the file"),
    (lambda s, d: s.extract(d / "m.stl", 0.3, color="curvature"), "STL and 3MF have no colours"),
    (lambda s, d: s.extract(d / "m.ply", 0.3, sweep=(0.1, 0.2, 3)), "expected one of them"),
    (lambda s, d: s.extract(d / "m.glb", sweep=(0.1, 0.2)), "expected two isovalues and a number"),
    (lambda s, d: s.extract(d / "m.glb", sweep="0.1:0.2:x"), "expected two isovalues and a number"),
    (lambda s, d: s.extract(d / "m.glb", sweep=(0.1, 0.2, 1)), "expected a whole number, 2 to 100000"),
    (lambda s, d: s.extract(d / "m.glb", sweep=("10%", "90%", 5), morph=True), "events between .* the widest here is from"),
    (lambda s, d: s.extract(d / "m.glb", 0.3, morph=True), "morph without sweep"),
    (lambda s, d: s.extract(d / "m.ply", sweep=(0.1, 0.2, 5), morph=True), "a name that ends in .glb"),
    (lambda s, d: s.extract(d / "m.glb", 99), "outside the range"),
    (lambda s, d: s.extract(d / "m.glb", 0.3, colour="quality"), "did you mean 'color'"),
    (lambda s, d: s.film(d / "%d.png"), "expected one: sweep="),
    (lambda s, d: s.film(d / "%d.png", sweep=(0.1, 0.2, 3), widht=3), "no argument 'widht'"),
    (lambda s, d: s.film(d / "%d.png", sweep=(0.1, 0.2, 3), fps=3), "fps= needs a film"),
    (lambda s, d: s.film(d / "a.png", turntable=3), "one placeholder"),
    (lambda s, d: s.film(d / "a.mp4", turntable=3, size=(33, 32)), "expected even numbers"),
    (lambda s, d: s.film(d / "%d.png", turntable=1), "turntable 1, expected a whole number, 2"),
    (lambda s, d: s.film(d / "%d.png", sweep=(0.1, 99, 2)), "outside the range"),
])  # fmt: skip
def test_mistakes_are_errors_of_one_line(spectrum, tmp_path, call, message):
    with pytest.raises(isospectrum.Error, match=message) as raised:
        call(spectrum, tmp_path)
    assert "\n" not in str(raised.value) and "--" not in str(raised.value)
    assert contents(tmp_path) == {}


def test_no_input_is_replaced(files):
    s = isospectrum.open(files / "blobs.isp")
    before = (files / "blobs.isp").read_bytes()
    with pytest.raises(isospectrum.UsageError, match="both input and output"):
        s.extract(files / "blobs.isp", 0.3, format="ply", progress=False)
    assert (files / "blobs.isp").read_bytes() == before


def test_options_of_a_film_are_those_of_a_picture():
    assert set(_looks.DrawingOptions.__annotations__) == set(_drawing.DEFAULTS)
    parameters = inspect.signature(isospectrum.Spectrum.render).parameters
    assert set(_drawing.DEFAULTS) == set(parameters) - {"self", "c"}


@pytest.mark.parametrize("options", [{}, {"range": (0.2, 0.7)}, {"persistence": "5%"}, {"outside": "high"}])
def test_events_count_what_the_meshes_have(options):
    rng = np.random.default_rng(3)
    a = blobs((9, 10, 12)) + rng.normal(0, 0.05, (9, 10, 12)).astype(np.float32)
    s = isospectrum.compute(a, error=0.4, backend="cpu", progress=False, check=False, **options)
    events = s.events
    assert len(events) > 5 or "persistence" in options
    assert (np.diff(events["isovalue"]) >= 0).all()
    following = np.append(events["isovalue"][1:], s.range[1])
    for event, end in zip(events, following):
        # At the event, and anywhere below the next one.
        for c in {float(event["isovalue"]), float((event["isovalue"] + end) / 2)}:
            if c < end or c == event["isovalue"] == end == s.range[1]:
                m = s.mesh(c)
                assert (m.n_components, m.euler) == (event["components"], event["euler"]), c
