"""Verifying with other options than the header of a program names: the cause is reported first, for people's
programs too."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.pipeline.convert import verify
from postproc.pipeline.result import PostResult, VerifyResult
from tests.postproc.kit import SAMPLES, TOOLS, few_sides
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

ERRORS = str(SAMPLES / "errors" / "mikron-ucp710.toml")
ALL = ("linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")


@cache
def faces() -> Toolpath:
    return few_sides("five_faces.cls")


@cache
def program(controller: str = "linuxcnc", **options: object) -> PostResult:
    result = postproc.convert(faces(), "mikron-ucp710", controller,
                              options=Options(setup=str(TOOLS), **options))
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


def verified(folder: Path, text: str, controller: str = "linuxcnc", **options: object) -> VerifyResult:
    (folder / "a.ngc").write_text(text)
    return verify(folder / "a.ngc", faces(), "mikron-ucp710", controller,
                  options=Options(setup=str(TOOLS), **options))


def errors(result: VerifyResult) -> list[str]:
    return [d.code for d in result.diagnostics if d.severity is Severity.ERROR]


def foreign(text: str) -> str:
    """The program without the comments of its head, as another post might write it."""
    return "\n".join(line for line in text.splitlines() if not line.startswith("("))


@pytest.mark.parametrize("controller", ALL)
def test_chosen_axes_of_the_header_are_asked_for_first(controller: str, tmp_path: Path) -> None:
    text = program(controller, orient="per-pass", max_tilt=50.0).text
    noted = verified(tmp_path, text, controller)
    assert errors(noted) == ["verify.orient"] and noted.diagnostics[0].code == "verify.orient" and not noted.ok
    assert "orient per-pass, max tilt 50" in noted.diagnostics[0].message
    assert "--orient per-pass --max-tilt 50" in noted.diagnostics[0].hint
    assert noted.diagnostics[0].file == str(tmp_path / "a.ngc")


@pytest.mark.parametrize(("orient", "max_tilt"), [("whole-part", 50.0), ("per-pass", 40.0)])
def test_another_plan_or_tilt_is_reported(orient: str, max_tilt: float, tmp_path: Path) -> None:
    noted = verified(tmp_path, program(orient="per-pass", max_tilt=50.0).text, orient=orient,
                     max_tilt=max_tilt)
    assert errors(noted) == ["verify.orient"]
    assert f"--orient {orient} --max-tilt {max_tilt:g}" in noted.diagnostics[0].message


def test_the_plan_of_the_header_is_verified(tmp_path: Path) -> None:
    assert verified(tmp_path, program(orient="per-pass", max_tilt=50.0).text, orient="per-pass", max_tilt=50.0).ok
    assert verified(tmp_path, program().text, max_tilt=50.0).ok


@pytest.mark.parametrize("controller", ALL)
def test_a_plan_that_the_header_does_not_name_is_reported(controller: str, tmp_path: Path) -> None:
    noted = verified(tmp_path, program(controller).text, controller, orient="per-pass")
    assert errors(noted) == ["verify.orient"] and noted.diagnostics[0].code == "verify.orient"
    assert "no chosen tool axes" in noted.diagnostics[0].message and "without --orient" in noted.diagnostics[0].hint


def test_programs_without_our_header_are_verified_with_any_plan(tmp_path: Path) -> None:
    text = foreign(program(orient="per-pass").text)
    assert verified(tmp_path, text, orient="per-pass").ok
    text = text.replace("G54", "(postproc 5-axis of the shop)\nG54", 1)
    assert verified(tmp_path, text, orient="per-pass").ok


@pytest.mark.parametrize("controller", ALL)
def test_a_program_that_corrects_nothing_says_so_before_what_follows(controller: str, tmp_path: Path) -> None:
    noted = verified(tmp_path, program(controller).text, controller, error_model=ERRORS)
    assert errors(noted)[0] == "verify.error_model" and not noted.ok and len(set(errors(noted))) > 1
    first = next(d for d in noted.diagnostics if d.code == "verify.error_model")
    assert "corrects no geometric errors (its header names no error model)" in first.message
    assert first.file == str(tmp_path / "a.ngc")


def test_the_amounts_are_those_that_the_correction_takes_away(tmp_path: Path) -> None:
    """Worst over the ends of feed blocks, against what convert finds at all blocks that it corrects."""
    noted = verified(tmp_path, program().text, error_model=ERRORS)
    message = next(d.message for d in noted.diagnostics if d.code == "verify.error_model")
    found = re.search(r"the tip is off by up to ([\d.]+) mm, allowed 0.01 mm, the axis by ([\d.]+) degrees, allowed 0.05",
                      message)
    corrected = program(error_model=ERRORS).compensation
    assert found and corrected is not None
    assert 0.5 * corrected.tip_before < float(found[1]) <= 1.001 * corrected.tip_before
    assert 0.0 < float(found[2]) * 3.141592653589793 / 180.0 <= 1.001 * corrected.axis_before


def test_errors_that_the_control_corrects_are_named(tmp_path: Path) -> None:
    text = program().text.replace("(feed mode auto)", "(feed mode auto)\n(geometric errors E: corrected by the control, "
                                                      "not in this program)")
    noted = verified(tmp_path, text, error_model=ERRORS)
    first = next(d for d in noted.diagnostics if d.severity is Severity.ERROR)
    assert first.code == "verify.error_model" and "by its header the control does" in first.message


def test_of_another_posts_program_only_its_header_is_reported(tmp_path: Path) -> None:
    noted = verified(tmp_path, foreign(program().text), error_model=ERRORS)
    noted_codes = [d.code for d in noted.diagnostics]
    first = noted.diagnostics[noted_codes.index("verify.error_model")]
    assert first.severity is Severity.WARNING
    assert noted_codes.index("verify.error_model") < noted_codes.index(errors(noted)[0])
    assert "names no error model" in first.message and "corrects no" not in first.message and " off by " not in first.message


def test_another_posts_corrected_program_is_verified_without_a_word(tmp_path: Path) -> None:
    text = program(error_model=ERRORS).text
    for written in (text, foreign(text)):
        noted = verified(tmp_path, written, error_model=ERRORS)
        assert noted.ok and "verify.error_model" not in [d.code for d in noted.diagnostics]


def test_a_corrected_programs_other_fault_is_not_laid_to_the_model(tmp_path: Path) -> None:
    text = program(error_model=ERRORS).text
    block = next(line for line in text.splitlines() if line.startswith("G1 ") and "F" in line)
    noted = verified(tmp_path, text.replace(block + "\n", "", 1), error_model=ERRORS)
    assert errors(noted) and "verify.error_model" not in errors(noted)


def test_cuts_beyond_what_was_measured_are_reported(tmp_path: Path) -> None:
    """Programs are proved there with the error at the end of the range, as they were converted when that was asked for."""
    cl, nc = tmp_path / "a.apt", tmp_path / "a.ngc"
    cl.write_text("UNITS/MM\nLOADTL/1\nSPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,20\nFEDRAT/400,MMPM\nGOTO/0,0,0\nGOTO/60,0,0\nFINI\n")
    for end, noted in ((60.0, False), (30.0, True)):
        model = 'machine = "mill-3axis"\n[components.EXX]\npolynomial = [3.0, 0.5]\n'
        (tmp_path / "m.toml").write_text(f"{model}range = [0, {end}]\n")
        options = Options(error_model=str(tmp_path / "m.toml"), error_beyond=True)
        path, found = toolpaths.read(cl)
        nc.write_text(postproc.convert(path, "mill-3axis", options=options, diagnostics=found).text)
        result = verify(nc, path, "mill-3axis", options=options, diagnostics=found)
        spoken = [d for d in result.diagnostics if d.code == "compensation.range"]
        assert result.ok and bool(spoken) == noted
        assert not noted or ("to 59.98" in spoken[0].message and "they were from 0 to 30" in spoken[0].message)
