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
from postproc.setup.places import PlaceSetup
from postproc.verification.stated_numbers import check_header
from tests.postproc.kit import convert, few_sides
from toolpaths.diagnostics import Severity

SOME = (1, 2)
"""operations of the pocket: one with each tool"""
CONTROLS = ("linuxcnc", "generic-iso", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
SETUP = SetupFile.model_validate({
    "tools": {"1": {"gauge_length": 120.0}, "2": {"gauge_length": 95.5}}, "part": {"origin": (37.0, -23.0, 11.25)}})


def made(control: str, inch: bool) -> PostResult:
    setup = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"units": "inch"})}) if inch else SETUP
    return convert(few_sides("five_tilted.cls"), "mikron-ucp710", control, setup)


def headers(result: PostResult, text: str) -> list[str]:
    assert result.job is not None
    return [d.message for d in check_header(text.encode(), result.job, "p.nc")]


@pytest.mark.covering
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
    path = few_sides("five_tilted.cls")
    program.write_text(result.text.replace("X37.0000 Y", "X36.0000 Y"), "utf-8")
    said = postproc.verify(program, path, "mikron-ucp710", "fanuc-30i", SETUP)
    assert [d.code for d in said.diagnostics if d.severity is Severity.ERROR] == ["verify.header"]
    monkeypatch.setattr(program_header, "_work_offsets", lambda job: [
        line.replace("X37", "X36") for line in _work_offsets(job)])
    assert [d.code for d in made("fanuc-30i", False).diagnostics if d.severity is Severity.ERROR] == ["verify.header"]


@pytest.mark.parametrize("control", CONTROLS)
def test_offsets_under_each_others_names_are_found(control: str) -> None:
    setup = SETUP.model_copy(update={"places": [
        PlaceSetup(name="left", work_offset_code="G54", origin=(-30.0, 0.0, 20.0)),
        PlaceSetup(name="right", work_offset_code="G57", origin=(90.0, -10.0, 5.0))]})
    result = convert(few_sides("pocket.cls", SOME), "mill-3axis", control, setup)
    left, right = re.findall(r"(?i)work offset (.+?) in machine", result.text)[:2]
    other = {left: right, right: left}
    text = re.sub(r"(?i)(?<=work offset )(.+?)(?= in machine)", lambda m: other[m[0]], result.text)
    assert result.ok and headers(result, result.text) == []
    assert any(f"X of work offset {right}" in message for message in headers(result, text))
    named = re.sub(rf"(?<=(?i:work offset) ){re.escape(left)}(?= (?i:in machine))", f"{left}9", result.text)
    assert headers(result, named)[0].startswith(f"the header says work offset {left}9")


@pytest.mark.parametrize("control", CONTROLS)
def test_a_line_that_is_missing_is_found_and_a_folded_one_is_read(control: str, tmp_path: Path) -> None:
    shop = tmp_path / "short.toml"
    shop.write_text(f'base = "{control}"\n[format]\nline_length = 60\n')
    setup = SETUP.model_copy(update={"places": [
        PlaceSetup(name="left", work_offset_code="G54", origin=(-30.0, 0.0, 20.0)),
        PlaceSetup(name="right", work_offset_code="G57", origin=(90.0, -10.0, 5.0))]})
    path = few_sides("pocket.cls", SOME)
    for by in (control, str(shop)):
        result = convert(path, "mill-4axis", by, setup)
        assert result.ok and headers(result, result.text) == []
        lines = result.text.splitlines(keepends=True)
        for named, said in (("place right", "of work offset"), ("tool T2 ", "gauge length of T2 nothing")):
            k = next(n for n, line in enumerate(lines) if named.lower() in line.lower())
            found = headers(result, "".join(lines[:k] + lines[k + 1:]))
            assert by != control or (len(found) == 1 and found[0].startswith(f"the header says {said}")), found
        tool = next(line for line in lines if "tool t1 " in line.lower())
        twice = tool + re.sub(r"(?i)(?<=gauge length )[\d.]+", "99.0000", tool)
        again = headers(result, result.text.replace(tool, twice, 1))
        assert by != control or again[0].startswith("the header says gauge length of T1 99.0000")
        assert headers(result, result.text.replace("A0.0000", "", 1))[0].startswith("the header says A of work offset")
        moved = re.sub("(?i)Y-10.0000", "Y-11.0000", result.text)
        assert headers(result, moved)[0].startswith("the header says Y of work offset")


def test_the_last_of_many_places_is_read_in_a_header_of_many_lines() -> None:
    setup = SETUP.model_copy(update={"places": [
        PlaceSetup(name=f"place number {k}", work_offset_code=f"G54.1 P{k + 1}", origin=(3.25 * k, -4.0 * k, 20.0))
        for k in range(60)]})
    path = toolpaths.read_bytes(b"UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,20\n"
                                b"GOTO/0,0,-1\nGOTO/5,0,-1\nRAPID\nGOTO/5,0,20\nFINI", file="p.apt")[0]
    result = convert(path, "mill-3axis", "fanuc-30i", setup)
    assert result.ok and headers(result, result.text) == []
    assert result.text.index("G54.1 P60") > 4000
    changed = result.text.replace("X191.7500 Y-236.0000", "X191.7500 Y-235.0000", 1)
    assert headers(result, changed)[0].startswith("the header says Y of work offset G54.1 P60 -235.0000")


def test_how_tables_stand_for_a_work_offset_is_read() -> None:
    setup = SETUP.model_copy(update={"places": [
        PlaceSetup(name=f"face {k}", work_offset_code=f"G5{4 + k}", origin=(-20.0, 0.0, 60.0), turn={"A": 90.1234567 * k},
                   measured="turned") for k in range(3)]})
    result = convert(few_sides("pocket.cls", SOME), "mill-4axis", "fanuc-30i", setup)
    assert result.ok and headers(result, result.text) == []
    for other in (" WITH A AT 0:", ":"):
        found = headers(result, result.text.replace(" WITH A AT 90.1235:", other))
        assert len(found) == 1 and found[0].endswith("the program is for A at 90.1235")
