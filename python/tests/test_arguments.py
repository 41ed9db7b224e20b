"""Arguments: those of the program, by one table; all others, and values that mean nothing, are errors of one line."""

from __future__ import annotations

import inspect
import io
import json
import re
import warnings

import isospectrum
import numpy as np
import pytest
import xarray
from isospectrum import _native

from .conftest import blobs

#: Flags of `isospectrum compute` that are no arguments here: output, reports, and computation by other processes.
NOT_HERE = {"output": "to, or save()", "plan": "client", "parts": "parts", "part": "client", "json": "parameters", "help": "help()",
            "quiet": "progress", "verbose": "progress", "version": "__version__"}  # fmt: skip

#: Arguments that only Python has: parts of a frame that files have, and objects.
ONLY_HERE = {"a", "direction", "space", "unit", "name", "level", "client", "parts", "to", "check", "progress"}

FAST = {"backend": "cpu", "progress": False, "check": False, "error": 0.4}


def compute(a=None, **options) -> isospectrum.Spectrum:
    return isospectrum.compute(blobs((8, 8, 8)) if a is None else a, **{**FAST, **options})


def test_every_flag_of_the_program_is_an_argument(run):
    flags = {flag.replace("-", "_") for flag in re.findall(r"^\s+(?:-\w, )?--([a-z-]+)", run("compute", "--help"), re.MULTILINE)}
    assert {"error", "nan_as", "max_triangles", "outside", "series"} <= flags
    arguments = set(inspect.signature(isospectrum.compute).parameters)
    assert flags - arguments - set(NOT_HERE) == set()
    assert arguments - flags - ONLY_HERE == set()


def test_defaults_are_those_of_the_library():
    library = json.loads(_native.default_parameters())
    library["relax"] = library.pop("relax_strength")
    arguments = inspect.signature(isospectrum.compute).parameters
    assert {name: arguments[name].default for name in library} == library


def test_files_are_read_as_the_program_reads_them(tmp_path):
    a = blobs((8, 9, 10))
    (tmp_path / "field.raw").write_bytes(a.astype(">f4").tobytes())
    raw = {"dims": (10, 9, 8), "type": "float32", "endian": "big"}
    expected = compute(a, name="same")._native.to_bytes()
    assert compute(tmp_path / "field.raw", **raw, name="same")._native.to_bytes() == expected
    assert compute(tmp_path / "field.raw", **{**raw, "dims": "10x9x8"}).volume["name"] == "field.raw"
    nib = pytest.importorskip("nibabel")
    nib.save(nib.Nifti1Image(np.stack([0 * a, a, a], axis=-1), np.eye(4)), tmp_path / "time.nii")
    assert compute(tmp_path / "time.nii", frame=1).range == compute(a).range
    with pytest.raises(isospectrum.InputError, match="every sample is 0"):
        compute(tmp_path / "time.nii", frame=0)
    with pytest.raises(isospectrum.Error, match="frame"):
        compute(tmp_path / "time.nii", frame=3)


def test_one_of_several_arrays_is_chosen_by_its_name(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    image = pyvista.ImageData(dimensions=(8, 8, 8))
    image["density"], image["other"] = blobs((8, 8, 8)).ravel(), np.arange(512.0)
    assert compute(image, array="other").range == (0, 511)
    image.save(tmp_path / "image.vti")
    assert compute(tmp_path / "image.vti", array="density").range == compute(image, array="density").range
    with pytest.raises(isospectrum.UsageError, match="array 'pressure', expected one of"):
        compute(image, array="pressure")
    named = xarray.Dataset({"density": (("z", "y", "x"), blobs((8, 8, 8))), "other": (("z", "y", "x"), np.arange(512.0).reshape(8, 8, 8))})
    assert compute(named, array="other").volume["name"] == "other"
    assert compute(named[["density"]]).volume["name"] == "density"


@pytest.mark.parametrize("argument", [
    {"level": 5.0}, {"channel": 1}, {"frame": 2}, {"array": "a"}, {"series": 0}, {"dims": (8, 8, 8)}, {"type": "uint8"},
    {"endian": "big"}, {"slices": "frames"},
])  # fmt: skip
def test_an_argument_without_effect_is_an_error(argument):
    (name,) = argument
    with pytest.raises(isospectrum.UsageError, match=f"^{name} .* with an array, expected none: it is for"):
        compute(**argument)


@pytest.mark.parametrize("wrong, meant", [
    ("tolerance", "error"), ("presistence", "persistence"), ("n_jobs", "threads"), ("max_triangle", "max_triangles"), ("voxel_size", "spacing"),
])  # fmt: skip
def test_an_unknown_argument_is_a_type_error_with_the_nearest_name(wrong, meant):
    with pytest.raises(TypeError, match=rf"^compute\(\) has no argument '{wrong}': did you mean '{meant}'\?$") as raised:
        compute(**{wrong: 1})
    assert isinstance(raised.value, isospectrum.UsageError)


def test_other_functions_name_the_nearest_argument_too(spectrum):
    for call, name in (
        (lambda: spectrum.mesh(level=0.3), "'c'"),
        (lambda: spectrum.mesh(0.3, min_volum=3), "'min_volume'"),
        (lambda: spectrum.render(0.3, cmap="vik"), "'color_map'"),
        (lambda: next(spectrum.sweep(3, kep=1)), "'keep'"),
        (lambda: isospectrum.analyze(blobs(), spacin=2), "'spacing'"),
    ):
        with pytest.raises(TypeError, match=f"did you mean {name}"):
            call()


def test_warnings_of_the_library_are_python_warnings():
    a = np.clip(np.rint(255 * blobs()), 0, 249).astype(np.uint8)
    a.flat[0] = 249
    with pytest.warns(isospectrum.Warning, match=r"range 240 to 900: the volume has 0 to 249, so 240 to 249 is covered") as found:
        s = compute(a, range=(240, 900))
    assert s.range == (240, 249)
    assert [w.filename for w in found if "900" in str(w.message)] == [__file__]
    assert issubclass(isospectrum.PromiseWarning, isospectrum.Warning) and issubclass(isospectrum.Warning, UserWarning)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(isospectrum.Warning):
            compute(a, range=(240, 900))
        compute(a, range=(100, 200))


def test_max_triangles_refuses_a_large_spectrum():
    with pytest.raises(isospectrum.UsageError, match="triangles expected, more than max_triangles 1.0e3; .*error=0.2 makes larger"):
        compute(blobs(), max_triangles=1000)
    assert compute(blobs(), max_triangles=1e9).n_triangles > 1000


class _NoArray:
    """An object that is no volume."""


MISTAKES = {
    "an isovalue in another colour": lambda s: s.render({0.3: (2, 0, 0)}),
    "a colour as the quantity": lambda s: s.html(color=(1, 0, 0)),
    "one number as the size": lambda s: s.render(0.3, size=300),
    "a negative size": lambda s: s.render(0.3, size=(-10, 10)),
    "isovalues in place of a number": lambda s: s.sweep([3, 4]),
    "a volume with a unit": lambda s: s.mesh(0.3, min_volume="5mm3"),
    "a negative number of isovalues": lambda s: s.verify(blobs(), n=-2),
    "the address of a scheduler": lambda s: isospectrum.compute(blobs(), client="tcp://10.0.0.1:8786"),
    "a data set of two": lambda s: compute(xarray.Dataset({"p": ("x", [1.0]), "q": ("x", [2.0])})),
    "nothing": lambda s: compute(_NoArray()),
    "None": lambda s: isospectrum.compute(None),
    "a mask without a border": lambda s: compute(blobs(), mask=np.ones((14, 16, 18), bool)),
    "a spectrum as a volume": lambda s: compute("x.isp"),
    "a missing file": lambda s: compute("missing.nrrd"),
    "an array of two axes": lambda s: compute(np.zeros((3, 3))),
    "complex numbers": lambda s: compute(np.zeros((3, 3, 3), complex)),
    "NaN": lambda s: compute(np.where(blobs() > 0.5, np.nan, blobs())),
    "a range of one": lambda s: compute(range=3),
    "two numbers as the spacing": lambda s: compute(spacing=(1, 2)),
    "a negative number of threads": lambda s: compute(threads=-1),
    "an isovalue beyond the range": lambda s: s.mesh(7),
    "an isovalue in words": lambda s: s.mesh("half"),
    "a crop of two axes": lambda s: compute(crop=(1, 2)),
    "a mesh format": lambda s: s.mesh(0.3).save("mesh.xyz"),
    "an open file without a format": lambda s: s.mesh(0.3).save(io.BytesIO()),
    "a clip": lambda s: s.render(0.3, clip="w:5"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_an_error_of_one_line_of_the_family(spectrum, mistake):
    with pytest.raises(isospectrum.Error) as raised:
        MISTAKES[mistake](spectrum)
    text = str(raised.value)
    assert text and "\n" not in text and "--" not in text and not text.endswith(".")


@pytest.mark.parametrize("mistake, remedy", [
    ("a colour as the quantity", r"\{0.5: 'red'\}"), ("isovalues in place of a number", r"mesh\(\[3, 4\]\) gives one for each"),
    ("a spectrum as a volume", "isospectrum.open reads"), ("the address of a scheduler", "expected a dask.distributed.Client"),
    ("a data set of two", "no array=, expected one of the data set.s p, q"), ("NaN", "nan_as=VALUE"), ("nothing", "_NoArray, expected an array of numbers"),
    ("None", "None, expected an array of numbers"), ("a volume with a unit", "in cubes of the unit"), ("a mask without a border", "true everywhere"),
])  # fmt: skip
def test_an_error_says_what_helps(spectrum, mistake, remedy):
    with pytest.raises(isospectrum.Error, match=remedy):
        MISTAKES[mistake](spectrum)


def test_colours_are_what_matplotlib_takes(spectrum):
    from isospectrum._appearance import look

    assert look("skin@0.3") == (0xE0B090, 0.3) and look("@0.5") == (None, 0.5)
    assert look((1, 0, 0)) == look("#f00") == look("#ff0000") == (0xFF0000, None)
    assert look(np.array([0, 0.5, 1, 0.25])) == (0x0080FF, 0.25) and look("#00ff0080") == (0x00FF00, 128 / 255)
    pytest.importorskip("matplotlib")
    assert look("tab:blue") == (0x1F77B4, None) and look("C1@0.5") == (0xFF7F0E, 0.5)
    assert spectrum.render({0.3: (1, 0, 0), 0.6: "tab:blue"}, size=(32, 32)).shape == (32, 32, 4)


def test_negative_ends_of_a_crop_count_from_the_end():
    a = blobs()
    expected = compute(a, crop=((2, 16), None, (0, 11)))._native.to_bytes()
    assert compute(a, crop=((2, -2), None, slice(None, -3)))._native.to_bytes() == expected
    assert compute(a, crop=(slice(2, -2), slice(None), (0, -3)))._native.to_bytes() == expected
