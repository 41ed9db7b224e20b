"""The notebooks run from their first cell to their last, and leave what they say."""

from __future__ import annotations

import pathlib

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[1] / "notebooks"

#: What each leaves behind.
LEAVES = {
    "ct_threshold": {"bone.stl": b""},
    "orbital": {"positive.ply": b"ply\n", "negative.ply": b"ply\n"},
    "page_for_a_paper": {"figure.png": b"\x89PNG", "gyroid.html": b"<!DOCTYPE html>", "gyroid.isp": b"\x89ISP"},
}


def test_all_notebooks_are_listed():
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(LEAVES)


@pytest.mark.parametrize("name", LEAVES)
def test_a_notebook_runs(name, tmp_path):
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "kept without outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    # Every picture and widget is there to be seen.
    shown = [output["data"] for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]
    assert any("image/png" in data for data in shown)
    assert name != "ct_threshold" or any("application/vnd.jupyter.widget-view+json" in data for data in shown)
    for file, begins in LEAVES[name].items():
        content = (tmp_path / file).read_bytes()
        assert content.startswith(begins) and len(content) > 1000
