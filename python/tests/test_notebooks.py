"""The notebooks run from the first cell to the last and write the files that they name."""

from __future__ import annotations

import pathlib

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[1] / "notebooks"

#: The file that each writes, and its first bytes.
OUTPUTS = {
    "ct_threshold": {"bone.stl": b""},
    "orbital": {"positive.ply": b"ply\n", "negative.ply": b"ply\n"},
    "page_for_a_paper": {"figure.png": b"\x89PNG", "gyroid.html": b"<!DOCTYPE html>", "gyroid.isp": b"\x89ISP"},
}


def test_all_notebooks_are_listed():
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(OUTPUTS)


@pytest.mark.parametrize("name", OUTPUTS)
def test_a_notebook_runs(name, tmp_path):
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "kept without outputs"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    # Pictures and widgets are in the output.
    shown = [output["data"] for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]
    assert any("image/png" in data for data in shown)
    assert name != "ct_threshold" or any("application/vnd.jupyter.widget-view+json" in data for data in shown)
    for file, begins in OUTPUTS[name].items():
        content = (tmp_path / file).read_bytes()
        assert content.startswith(begins) and len(content) > 1000
