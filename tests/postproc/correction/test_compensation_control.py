"""Error models that are left to the control: said on the console, in diagnostics, JSON and trace; never corrected twice."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app

SAMPLES = Path("samples").resolve()
CL = str(Path(__file__).parents[2].resolve() / "golden/short_five_axis.apt")
OURS = str(SAMPLES / "errors/mikron-ucp710.toml")
RUN = ["-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", str(SAMPLES / "tools.setup.toml")]


@pytest.fixture
def theirs(tmp_path: Path) -> str:
    for file in (SAMPLES / "errors").glob("mikron-ucp710*"):
        shutil.copy(file, tmp_path)
    file = tmp_path / "mikron-ucp710.toml"
    text = file.read_text()
    assert 'corrected_by = "post"' in text
    file.write_text(text.replace('corrected_by = "post"', 'corrected_by = "control"'))
    return str(file)


def run(arguments: list[str], tmp_path: Path, code: int = 0) -> tuple[str, dict[str, Any]]:
    found = CliRunner().invoke(app, [*arguments, "--json", str(tmp_path / "o.json")])
    assert found.exit_code == code, found.output
    return found.output, json.loads((tmp_path / "o.json").read_text())


def noted(values: dict[str, Any], code: str) -> list[dict[str, Any]]:
    return [d for d in values["diagnostics"] if d["code"] == code]


def test_a_conversion_says_who_corrects(tmp_path: Path, theirs: str) -> None:
    text, values = run(["convert", CL, *RUN, "--error-model", theirs, "-o", str(tmp_path / "a.ngc")], tmp_path)
    assert values["geometric_errors"] == {"model": "mikron-ucp710", "corrected_by": "control"}
    found, = noted(values, "compensation.control")
    assert found["severity"].lower() == "info" and found["file"] == theirs
    assert "geometric errors mikron-ucp710: left to the control" in text
    text, values = run(["convert", CL, *RUN, "--error-model", OURS, "-o", str(tmp_path / "b.ngc")], tmp_path)
    assert values["geometric_errors"]["corrected_by"] == "post" and values["geometric_errors"]["tip_before_mm"] > 0.02
    assert "left to the control" not in text and not noted(values, "compensation.control")


def test_a_trace_says_who_corrects(tmp_path: Path, theirs: str) -> None:
    line = str(1 + next(k for k, text in enumerate(Path(CL).read_text().splitlines()) if text.startswith("GOTO")))
    for model, who in ((theirs, "control"), (OURS, "post")):
        found = CliRunner().invoke(app, ["trace", CL, "--line", line, *RUN, "--error-model", model])
        assert ("left to the control, joints are nominal" in found.output) == (who == "control")
        assert ("corrected in the joints" in found.output) == (who == "post")
        _, values = run(["trace", CL, "--line", line, *RUN, "--error-model", model], tmp_path)
        assert values["geometric_errors"] == {"model": "mikron-ucp710", "corrected_by": who}
        moves = values["points"][0]["moves"]
        assert ("nominal_joints" in moves[0]) == (who == "post")
    assert "geometric_errors" not in run(["trace", CL, "--line", line, *RUN], tmp_path)[1]


def test_verify_says_that_both_would_correct(tmp_path: Path, theirs: str) -> None:
    made = str(tmp_path / "a.ngc")
    run(["convert", CL, *RUN, "--error-model", OURS, "-o", made], tmp_path)
    _, values = run(["verify", made, CL, *RUN, "--error-model", theirs], tmp_path, 1)
    found, = noted(values, "verify.error_model")
    assert "both would" in found["message"] and "corrected_by" in found["hint"]
    assert noted(values, "compensation.control")
    _, values = run(["verify", made, CL, *RUN], tmp_path, 1)
    found, = noted(values, "verify.error_model")
    assert "none are given here" in found["message"] and "--error-model" in found["hint"]
