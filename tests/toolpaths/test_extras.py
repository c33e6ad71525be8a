"""A package that is not installed is one line that says how to get it, before anything is computed; nothing is written."""

from __future__ import annotations

import importlib.util
import tomllib
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from postproc.cli.app import run_command
from toolpaths.diagnostics import DiagnosticError
from toolpaths.extras import EXTRAS, need

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
_FOUND = importlib.util.find_spec


def _without(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def found(one: str, package: str | None = None) -> ModuleSpec | None:
        return None if one == name else _FOUND(one, package)

    monkeypatch.setattr(importlib.util, "find_spec", found)


def test_a_check_without_toppra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _without("toppra", monkeypatch)
    ran = run_command(["time", str(tmp_path / "none.cls"), "-m", "mill-3axis", "--check", "toppra"])
    assert ran.code == 1 and "pip install 'postproc[check]'" in ran.said[-1], ran.said


@pytest.mark.parametrize("words", [
    "machine show hexapod --figure out.svg",
    f"errors check {SAMPLES}/errors/mikron-ucp710.toml -m mikron-ucp710 --figure out.png",
    f"time {SAMPLES}/pocket.cls -m mill-3axis --figure out.svg",
    f"orient {SAMPLES}/test_part.cls -m mikron-ucp710 --figure out.svg",
    f"convert {SAMPLES}/pocket.cls -m mikron-ucp710 -c linuxcnc -o o.ngc --error-model {SAMPLES}/errors/mikron-ucp710.toml "
    "--residuals out.png", f"report {SAMPLES}/pocket.cls -m mill-3axis -c linuxcnc -o out.html --figures pictures"])
def test_drawings_without_matplotlib(words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _without("matplotlib", monkeypatch)
    monkeypatch.chdir(tmp_path)
    ran = run_command(words.split())
    assert ran.code == 1 and ran.said[-1:] and "pip install 'postproc[figures]'" in ran.said[-1], ran.said
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_is_no_fault() -> None:
    assert [need(name, "this needs") for name in EXTRAS] == [None] * len(EXTRAS)


def test_each_extra_brings_its_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    core = {text.partition(">")[0] for text in project["dependencies"]}
    for name, (package, extra) in EXTRAS.items():
        assert any(text.startswith(package) for text in project["optional-dependencies"][extra]) and package not in core
        with monkeypatch.context() as one:
            _without(name, one)
            with pytest.raises(DiagnosticError, match=rf"extra\.missing.*{package}.*postproc\[{extra}\]"):
                need(name, "this needs")
    assert {"numpy", "scipy", "trimesh", "ruckig"} <= core


def test_all_is_what_the_extras_of_users_bring() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    assert set(extras["all"]) == {text for extra in {extra for _, extra in EXTRAS.values()} for text in extras[extra]}


def test_the_lock_names_no_folder() -> None:
    assert "file:" not in (ROOT / "requirements.lock").read_text("utf-8")
