"""What the installed package says about itself, and what it holds besides code."""

from __future__ import annotations

import importlib.metadata
import pathlib
import re
import signal
import subprocess
import sys
import time

import isospectrum
import pytest
import yaml

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


def test_the_program_is_in_the_package(run, tmp_path):
    program = [pathlib.Path(sys.executable).with_name("isospectrum"), "compute", "--phantom", "sphere:8"]

    def call(*arguments: object, code: int = 0) -> str:
        done = subprocess.run([*map(str, arguments)], capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == code, done.stderr
        return done.stdout + done.stderr

    call(*program, "-o", tmp_path / "ours.isp", "--backend", "cpu", "-q")
    run("compute", "--phantom", "sphere:8", "-o", tmp_path / "theirs.isp", "--backend", "cpu", "-q")
    assert (tmp_path / "ours.isp").read_bytes() == (tmp_path / "theirs.isp").read_bytes()
    assert call(sys.executable, "-m", "isospectrum", "--version") == run("--version")
    assert call(program[0], "--help") == run("--help")
    # Exit codes and messages are those of the program, too.
    assert "no.isp" in call(program[0], "info", tmp_path / "no.isp", code=3)
    assert "did you mean '--error'" in call(*program, "-o", tmp_path / "x.isp", "--tolerance", "3", code=2)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of a terminal")
def test_the_program_is_interrupted_by_a_signal(tmp_path):
    program = pathlib.Path(sys.executable).with_name("isospectrum")
    started = subprocess.Popen(
        [program, "compute", "--phantom", "gyroid:200", "-o", tmp_path / "x.isp", "--backend", "cpu"], stderr=subprocess.PIPE, text=True
    )
    time.sleep(2)
    started.send_signal(signal.SIGINT)
    _, errors = started.communicate(timeout=60)
    assert started.returncode == 130 and "interrupted" in errors and "Traceback" not in errors
    assert list(tmp_path.iterdir()) == []


def test_a_release_has_wheels_for_all_systems():
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "release-python.yml").read_text())
    matrix = workflow["jobs"]["wheels"]["strategy"]["matrix"]
    # `include` beside one list would give the last of them only.
    assert set(matrix) == {"system", "python"} and matrix["python"] == ["3.10", "3.14t", "3.15t"]
    systems = {(system["os"], system.get("linux")) for system in matrix["system"]}
    assert {("ubuntu-24.04", "2_28"), ("ubuntu-24.04", "musllinux_1_2"), ("ubuntu-24.04-arm", "musllinux_1_2"), ("windows-11-arm", None)} <= systems
    commands = " ".join(step.get("run", "") for step in workflow["jobs"]["wheels"]["steps"])
    assert "python/tests/bare.py" in commands
