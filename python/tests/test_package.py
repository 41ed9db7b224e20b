"""What the installed package says about itself, and what it holds besides code."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys

import isospectrum

from .conftest import ROOT


def test_licences_are_those_of_the_repository_and_in_the_package():
    names = importlib.metadata.metadata("isospectrum").get_all("License-File")
    assert sorted(names) == ["licenses/LICENSE-APACHE", "licenses/LICENSE-MIT", "licenses/NOTICES.txt"]
    files = importlib.metadata.files("isospectrum") or []
    for name in names:
        (found,) = (f for f in files if str(f).endswith(f".dist-info/licenses/{name}"))
        text = (ROOT / "python" / name).read_text()
        assert found.read_text() == text
        of_repository = ROOT / name.removeprefix("licenses/")
        assert of_repository.name == "NOTICES.txt" or of_repository.read_text() == text


def test_the_licences_of_all_crates_are_there():
    done = subprocess.run([sys.executable, ROOT / "scripts" / "python-notices", "--check"], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr


def test_metadata_describe_the_package():
    metadata = importlib.metadata.metadata("isospectrum")
    assert {"Typing :: Typed", "Intended Audience :: Science/Research"} <= set(metadata.get_all("Classifier"))
    urls = dict(url.split(", ") for url in metadata.get_all("Project-URL"))
    assert set(urls) == {"Repository", "Documentation", "Changelog", "Issues"}
    # Pages of the repository exist.
    for page in (urls["Documentation"], urls["Changelog"]):
        assert (ROOT / page.split("/blob/main/")[1]).is_file(), page
    assert metadata["Version"] == isospectrum.__version__
    assert f"version: {isospectrum.__version__}\n" in (ROOT / "CITATION.cff").read_text()


def test_the_changelog_is_current():
    text = (ROOT / "python" / "CHANGELOG.md").read_text()
    assert re.search(r"^## \[Unreleased\]$", text, re.MULTILINE)
