"""`verify` says that the error model of a program has changed since it was written; every controller's comment holds it."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from machines.geometric_error.files.fingerprint import fingerprint
from machines.geometric_error.files.loader import load
from postproc.base.header_words import FINGERPRINT
from postproc.cli.app import app
from tests.postproc.kit import machine

ERRORS = Path("samples/errors")
CONTROLLERS = ["linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"]
MODEL = 'machine = "mikron-ucp710"\n[location]\nEC0Y = 6.0\nEX0S = 4.0\n'


PART = """UNITS/MM
LOADTL/1
SPINDL/RPM,1000,CLW
FEDRAT/MMPM,600
RAPID
GOTO/0,0,20
GOTO/0,0,0
GOTO/40,0,0
GOTO/40,30,-2
RAPID
GOTO/40,30,20
FINI
"""


def run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def common(controller: str = "linuxcnc") -> list[str]:
    return ["-m", "mikron-ucp710", "-c", controller, "--setup", "samples/tools.setup.toml"]


def noted(result: Result, code: str) -> list[str]:
    return [line for line in result.output.splitlines() if code in line]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    (tmp_path / "Fräse 5.toml").write_text(MODEL)
    return tmp_path / "Fräse 5.toml"


def written(model: Path, controller: str = "linuxcnc") -> Path:
    program = model.parent / "part.nc"
    program.with_suffix(".apt").write_text(PART)
    made = run("convert", program.with_suffix(".apt"), *common(controller), "--error-model", model,
               "-o", program)
    assert made.exit_code == 0, made.output
    return program


def verified(program: Path, model: Path, controller: str = "linuxcnc") -> Result:
    return run("verify", program, program.with_suffix(".apt"), *common(controller), "--error-model", model)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_every_controller_keeps_the_fingerprint(controller: str, model: Path) -> None:
    program = written(model, controller)
    stated = re.search(r"fingerprint of the geometric errors ([0-9a-f]{8})\b", program.read_text(),
                       re.IGNORECASE)
    assert stated and stated[1].lower() == fingerprint(load(model, machine("mikron-ucp710")))
    if controller == CONTROLLERS[-1]:
        assert f"fingerprint {stated[1].lower()}" in run("errors", "check", model, "-m", "mikron-ucp710").output
        same = verified(program, model, controller)
        assert same.exit_code == 0 and not noted(same, "verify.error_model")
    model.write_text(MODEL.replace("6.0", "6.5"))
    changed = verified(program, model, controller)
    assert changed.exit_code == 0, changed.output  # half an arcsec is far inside the tolerance
    line, = noted(changed, "verify.error_model_changed")
    assert " warning " in line and stated[1].lower() in line and "then" in line


def test_a_change_beyond_the_tolerance_fails_and_the_change_is_reported_first(model: Path) -> None:
    program = written(model)
    model.write_text(MODEL.replace("4.0", "400.0"))
    result = verified(program, model)
    assert result.exit_code == 1
    assert "verify.error_model_changed" in next(line for line in result.output.splitlines() if "verify." in line)


def test_a_model_that_only_moved_or_was_written_again_is_no_other(model: Path) -> None:
    program = written(model)
    other = model.with_name("other.toml")
    other.write_text(MODEL.replace("EC0Y = 6.0\nEX0S = 4.0", "EX0S =  4\n# new\nEC0Y = 6\n[sigma]\nEC0Y = 1.0"))
    assert not noted(verified(program, other), "verify.error_model")
    other.write_text(MODEL.replace("6.0", "6.5"))
    line, = noted(verified(program, other), "verify.error_model")
    assert " warning " in line and "it is verified with other" in line


def test_programs_without_a_fingerprint_verify_as_ever(model: Path) -> None:
    program = written(model)
    program.write_text(re.sub(r"\(fingerprint.*\n", "", program.read_text()))
    for text in (MODEL, MODEL.replace("6.0", "6.5")):
        model.write_text(text)
        result = verified(program, model)
        assert result.exit_code == 0 and not noted(result, "verify.error_model")


def test_a_program_that_the_control_corrects_names_no_fingerprint(model: Path) -> None:
    model.write_text('corrected_by = "control"\n' + MODEL)
    program = written(model)
    assert FINGERPRINT not in program.read_text()
    model.write_text(model.read_text().replace("6.0", "6.5"))
    assert not noted(verified(program, model), "verify.error_model")


def test_the_sample_with_tables(tmp_path: Path) -> None:
    for file in ERRORS.glob("mikron-ucp710*"):
        shutil.copy(file, tmp_path / file.name)
    model = tmp_path / "mikron-ucp710.toml"
    program = written(model)
    table = tmp_path / "mikron-ucp710-X.csv"
    head, first, *rows = table.read_text().split("\n")
    assert not noted(verified(program, model), "verify.error_model")
    table.write_text("\n".join([head, first, "# again", *rows]))
    assert not noted(verified(program, model), "verify.error_model")
    cells = rows[1].split(",")
    table.write_text("\n".join([head, first, rows[0], ",".join([cells[0], f"{float(cells[1]) + 0.01:.6f}", *cells[2:]]),
                                *rows[2:]]))
    assert noted(verified(program, model), "verify.error_model_changed")
