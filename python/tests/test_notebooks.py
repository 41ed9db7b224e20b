"""The notebooks run from the first cell to the last, give the outputs that are stored, and write the files that they name."""

from __future__ import annotations

import pathlib
import re

import nbformat
import pytest
from nbclient import NotebookClient
from nbconvert import HTMLExporter

NOTEBOOKS = pathlib.Path(__file__).resolve().parents[1] / "notebooks"

#: The file that each writes, and its first bytes.
OUTPUTS = {
    "ct_threshold": {"bone.stl": b""},
    "orbital": {"positive.ply": b"ply\n", "negative.ply": b"ply\n"},
    "page_for_a_paper": {"figure.png": b"\x89PNG", "gyroid.html": b"<!DOCTYPE html>", "gyroid.isp": b"\x89ISP"},
}

#: Largest size of a notebook with its outputs, bytes: a browser on GitHub shows a megabyte.
MAX_BYTES = 1_000_000

VIEW = "application/vnd.jupyter.widget-view+json"


def test_all_notebooks_are_listed():
    assert {path.stem for path in NOTEBOOKS.glob("*.ipynb")} == set(OUTPUTS)


def texts(notebook) -> list[str]:
    """What cells print and return as text, without what differs from run to run."""
    found = []
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            if output.output_type == "stream" and output.name == "stdout":
                found.append(output.text)
            elif "data" in output and VIEW not in output.data:
                found.append(re.sub(r" at 0x[0-9a-f]+", "", output.data.get("text/plain", "")))
    return found


@pytest.mark.parametrize("name", OUTPUTS)
def test_a_notebook_runs(name, tmp_path):
    path = NOTEBOOKS / f"{name}.ipynb"
    stored, notebook = (nbformat.read(path, as_version=4) for _ in range(2))
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    # To store outputs: scripts/python-notebooks.
    assert texts(stored) == texts(notebook) and len(texts(stored)) > 3
    assert path.stat().st_size < MAX_BYTES and "widgets" not in stored.metadata
    # Pictures and widgets are in the output.
    shown = [output["data"] for cell in stored.cells for output in cell.get("outputs", []) if "data" in output]
    assert any("image/png" in data for data in shown)
    assert name != "ct_threshold" or any(VIEW in data for data in shown)
    for file, begins in OUTPUTS[name].items():
        content = (tmp_path / file).read_bytes()
        assert content.startswith(begins) and len(content) > 1000


@pytest.mark.parametrize("name", OUTPUTS)
def test_an_exported_notebook_shows_a_picture_for_each_widget(name):
    notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
    data = [output["data"] for cell in notebook.cells for output in cell.get("outputs", []) if "data" in output]
    page, _ = HTMLExporter(embed_images=True).from_notebook_node(notebook)
    widgets = [shown for shown in data if VIEW in shown]
    pictures = [shown["image/png"].strip() for shown in data if "image/png" in shown and "text/html" not in shown]
    assert all(shown["image/png"].strip() in pictures for shown in widgets)
    assert len(pictures) > 0 and all("".join(picture.split()) in "".join(page.split()) for picture in pictures)
