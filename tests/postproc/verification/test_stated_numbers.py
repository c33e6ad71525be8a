"""Work offsets and gauge lengths that the header states are those the program is for: an operator types them in."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import postproc
import toolpaths
from postproc.pipeline import program_header
from postproc.pipeline.program_header import _work_offsets
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.stated_numbers import check_header
from tests.postproc.kit import SAMPLES, convert
from toolpaths.diagnostics import Severity

CONTROLS = ("linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
SETUP = SetupFile.model_validate({
    "tools": {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 95.5}}, "part": {"origin": (37.0, -23.0, 11.25)}})


def made(control: str, inch: bool) -> PostResult:
    setup = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"units": "inch"})}) if inch else SETUP
    return convert(toolpaths.read(SAMPLES / "five_tilted.cls")[0], "mikron-ucp710", control, setup)


def headers(result: PostResult, text: str) -> list[str]:
    assert result.job is not None
    return [d.message for d in check_header(text.encode(), result.job, "p.nc")]


@pytest.mark.parametrize("inch", [False, True])
@pytest.mark.parametrize("control", CONTROLS)
def test_a_number_changed_in_the_header_is_found(control: str, inch: bool) -> None:
    result = made(control, inch)
    assert result.ok and headers(result, result.text) == []
    offset = re.search(r"(?i)work offset [^:\n]*: [^\n]*", result.text)
    length = re.search(r"(?i)gauge length [\d.]+", result.text)
    assert offset is not None and length is not None
    for letter in "XYZ":
        changed = re.sub(rf"{letter}(-?)(\d+)\.", lambda m: f"{m[0][:1]}{m[1]}{int(m[2]) + 1}.", offset[0], count=1)
        assert changed != offset[0]
        assert headers(result, result.text.replace(offset[0], changed))[0].startswith(f"the header says {letter} of work")
    longer = re.sub(r"\d+(?=\.)", lambda m: str(int(m[0]) + 1), length[0])
    assert headers(result, result.text.replace(length[0], longer))[0].startswith("the header says gauge length of T")


def test_verify_and_convert_ask_for_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result, program = made("fanuc-30i", False), tmp_path / "p.nc"
    path, found = toolpaths.read(SAMPLES / "five_tilted.cls")
    program.write_text(result.text.replace("X37.0000 Y", "X36.0000 Y"), "utf-8")
    said = postproc.verify(program, path, "mikron-ucp710", "fanuc-30i", SETUP, diagnostics=found)
    assert [d.code for d in said.diagnostics if d.severity is Severity.ERROR] == ["verify.header"]
    monkeypatch.setattr(program_header, "_work_offsets", lambda job: [
        line.replace("X37", "X36") for line in _work_offsets(job)])
    assert [d.code for d in made("fanuc-30i", False).diagnostics if d.severity is Severity.ERROR] == ["verify.header"]
