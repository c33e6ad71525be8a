"""The stock in the program (BLK FORM) is that of the set-up, in mm and in inches; without one the extents of the cuts."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import machines
import postproc
import toolpaths
from postproc.setup.model import SetupFile
from tests.postproc.kit import codes, good, toolpath


def with_stock(width: float, units: str) -> SetupFile:
    return SetupFile.model_validate({
        "tools": {"1": {"gauge_length": 100.0}, "2": {"gauge_length": 90.0}}, "output": {"units": units},
        "rewind": {"stock": {"low": (-70.0, -70.0, -30.0), "high": (width, 70.0, 0.0)}}})


@pytest.mark.parametrize(("units", "other"), [("mm", "62.5"), ("inch", "2.46063")])
def test_another_stock_is_named_until_the_set_up_has_it(tmp_path: Path, units: str, other: str) -> None:
    path, found = toolpaths.read("samples/pocket.cls")
    machine = machines.load("mill-3axis")
    result = good(postproc.convert(path, machine, "heidenhain-tnc640", with_stock(70.0, units), diagnostics=found))
    program = tmp_path / "p.h"
    program.write_text(re.sub(r"(BLK FORM 0.2 X\+)[\d.]+", rf"\g<1>{other}", result.text))
    said = postproc.verify(program, path, machine, "heidenhain-tnc640", with_stock(70.0, units), diagnostics=found)
    wrong, = (d for d in said.diagnostics if d.code == "verify.stock")
    assert wrong.lines == (3,) and "62.5000 mm" in wrong.message and "70.0000 mm" in wrong.message
    again = postproc.verify(program, path, machine, "heidenhain-tnc640", with_stock(62.5, units), diagnostics=found)
    assert "verify.stock" not in codes(again.diagnostics)


def test_the_stock_of_several_places_holds_all_of_them() -> None:
    path, found = toolpaths.read("samples/pocket.cls")
    places = [{"name": name, "work_offset_code": code, "origin": (x, 0.0, 20.0)} for name, code, x in (
        ("left", "G54", 10.0), ("right", "G55", 160.0))]
    setup = SetupFile.model_validate({**with_stock(70.0, "mm").model_dump(), "places": places})
    result = good(postproc.convert(path, machines.load("mill-3axis"), "heidenhain-tnc640", setup, diagnostics=found))
    assert result.text.splitlines()[1:3] == ["1 BLK FORM 0.1 Z X-70 Y-70 Z-30", "2 BLK FORM 0.2 X+220 Y+70 Z+0"]


def test_without_a_stock_the_form_is_that_of_the_cuts(tmp_path: Path) -> None:
    """One contour is a box too, a millimetre thick; it is graphics alone, so another one or none is proved all the same."""
    path = toolpath("LOADTL/1", "RAPID", "GOTO/5,2,20", "FEDRAT/500,MMPM", "GOTO/5,2,-3", "GOTO/35,2,-3", "GOTO/35,2,20")
    machine, setup = machines.load("mill-3axis"), SetupFile.model_validate({
        "tools": {"1": {"gauge_length": 100.0}}, "part": {"origin": (12.0, -7.0, 30.0)}})
    result = good(postproc.convert(path, machine, "heidenhain-tnc640", setup))
    form = ["1 BLK FORM 0.1 Z X+5 Y+1 Z-3", "2 BLK FORM 0.2 X+35 Y+2 Z+20"]
    assert result.text.splitlines()[1:3] == form and "stock of the graphics: extents of the cuts" in result.text
    program = tmp_path / "p.h"
    for other in (result.text.replace("X+35 Y+2 Z+20", "X+60 Y+9 Z+1"), result.text.replace("\n".join(form) + "\n", "")):
        program.write_text(other)
        assert other != result.text and postproc.verify(program, path, machine, "heidenhain-tnc640", setup).ok
