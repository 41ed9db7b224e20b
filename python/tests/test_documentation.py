"""Documentation: examples run, and every parameter of a public function is described."""

from __future__ import annotations

import doctest
import inspect
import pydoc
import re

import isospectrum
import numpy as np
import pytest

from .conftest import ROOT, blobs

def examples() -> dict[str, doctest.DocTest]:
    """The examples of all public functions, classes and methods."""
    finder = doctest.DocTestFinder()
    # `module=False`: public names belong to the package, wherever they are defined.
    found = []
    for name in isospectrum.__all__:
        thing = getattr(isospectrum, name)
        # What a class inherits is public as well.
        for part in [c for c in thing.__mro__ if c.__module__.startswith("isospectrum")] if inspect.isclass(thing) else [thing]:
            found += finder.find(part, name, module=False, globs={})
    return {t.name: t for t in found if t.examples}


@pytest.mark.parametrize("name", examples())
def test_examples_of_docstrings_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    failed, tried = runner.run(examples()[name])
    assert tried > 0 and failed == 0


def test_functions_that_return_something_have_examples():
    methods = ("mesh", "sweep", "curves", "trajectory", "lifetimes", "verify", "html", "render")
    expected = {"compute", "open", "analyze", "Mesh", "Spectrum", "Mesh.sample", *(f"Spectrum.{name}" for name in methods)}
    assert expected - set(examples()) == set()


def functions() -> dict[str, object]:
    found: dict[str, object] = {}
    for name in isospectrum.__all__:
        thing = getattr(isospectrum, name)
        if inspect.isfunction(thing):
            found[name] = thing
        elif name in ("Spectrum", "Mesh", "Report"):
            methods = inspect.getmembers(thing, inspect.isfunction)
            found.update({f"{name}.{key}": method for key, method in methods if not key.startswith("_")})
    return found


@pytest.mark.parametrize("name", functions())
def test_every_parameter_is_described(name):
    function = functions()[name]
    text = inspect.getdoc(function) or ""
    described = {word for line in re.findall(r"^(\w[\w, ]*) :|^\*\*(\w+)$", text, re.MULTILINE) for word in re.split(", ", line[0] or line[1])}
    parameters = set(inspect.signature(function).parameters) - {"self"}
    assert parameters - described == set()
    returns = inspect.signature(function).return_annotation
    if parameters and returns not in ("None", None):
        assert "Returns\n-------" in text


def blocks(path: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / path).read_text(), re.DOTALL)


def test_every_line_of_the_guide_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = blocks("docs/guide/python.md")
    assert len(found) >= 8
    namespace: dict[str, object] = {}
    for block in found:
        exec(compile(block, "docs/guide/python.md", "exec"), namespace)
    assert "- [Python](python.md)" in (ROOT / "docs" / "guide" / "SUMMARY.md").read_text()


def test_the_lines_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, *_ = blocks("python/README.md")
    exec(compile(first, "python/README.md", "exec"), {"a": np.repeat(blobs(), 1, axis=0)})
    assert (tmp_path / "m.stl").stat().st_size > 84 and (tmp_path / "x.html").exists()


def test_help_is_three_screens_and_names_what_there_is():
    text = pydoc.plain(pydoc.render_doc(isospectrum))
    assert len(text.splitlines()) <= 120
    functions = [name for name, _ in inspect.getmembers(isospectrum.Spectrum, inspect.isfunction) if not name.startswith("_")]
    assert {"extract", "film", "mesh"} <= set(functions)
    for name in ("compute", "open", "analyze", "forecast", "Mesh", "Report", "Error", "Warning", *functions):
        assert name == "isovalue" or name in text, name
    # The members have theirs.
    for member in (isospectrum.compute, isospectrum.Mesh, isospectrum.Spectrum.film):
        assert "Parameters" in pydoc.render_doc(member) or "Attributes" in pydoc.render_doc(member)
    # Only help passes over the names.
    assert all(name in isospectrum.__all__ for name in ("compute", "Spectrum", "Error"))
    assert "nothing" not in isospectrum.__all__


def test_names_that_a_star_imports_are_all():
    namespace: dict[str, object] = {}
    exec("from isospectrum import *", namespace)
    assert set(isospectrum.__all__) <= set(namespace)
