"""Types: the stubs match the compiled part, and a user's script passes type checkers in their strict modes."""

from __future__ import annotations

import importlib
import json
import os
import pathlib
import shutil
import subprocess
import sys

import isospectrum

importlib.import_module("mypy")

SCRIPT = pathlib.Path(__file__).parent / "types" / "user_script.py"


def run(*command: object, cwd: pathlib.Path, **variables: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, **variables}
    return subprocess.run([*map(str, command)], cwd=cwd, env=environment, capture_output=True, text=True, check=False, timeout=600)


def test_the_stubs_match_the_compiled_part(tmp_path):
    done = run(sys.executable, "-m", "mypy.stubtest", "--ignore-disjoint-bases", "isospectrum._native", cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_script_passes_mypy_in_its_strict_mode(tmp_path):
    done = run(sys.executable, "-m", "mypy", "--strict", SCRIPT, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_passes_mypy_in_its_strict_mode(tmp_path):
    python = pathlib.Path(__file__).resolve().parents[1]
    done = run(sys.executable, "-m", "mypy", "--config-file", python / "pyproject.toml", "--cache-dir", tmp_path,
               python / "package" / "isospectrum", cwd=tmp_path)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_script_passes_pyright_in_its_strict_mode(tmp_path):
    shutil.copy(SCRIPT, tmp_path)
    settings = {"typeCheckingMode": "strict", "pythonVersion": "3.11", "include": ["user_script.py"]}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    done = run(sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "-p", tmp_path, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


def test_all_public_types_are_known(tmp_path):
    # For this pyright takes the first Python of the path, whatever --pythonpath is.
    path = os.pathsep.join([os.path.dirname(sys.executable), os.environ["PATH"]])
    done = run(sys.executable, "-m", "pyright", "--verifytypes", "isospectrum", "--ignoreexternal", "--outputjson", cwd=tmp_path, PATH=path)
    found = json.loads(done.stdout)["typeCompleteness"]
    unknown = [s["name"] for s in found["symbols"] if s["isExported"] and not s["isTypeKnown"]]
    assert found["completenessScore"] == 1, unknown


def test_the_script_runs(tmp_path):
    done = run(sys.executable, SCRIPT, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_public_names_live_in_the_package():
    for name in isospectrum.__all__:
        assert getattr(isospectrum, name).__module__ == "isospectrum", name
