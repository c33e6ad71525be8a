"""Holes that are none: refused on every control with the line of their CYCLE record, and the remedy works."""

from __future__ import annotations

import pytest

from postproc.cli.shared.console import controller_file
from postproc.controllers.model import builtin_files
from postproc.reference.hole_depths import unfit_holes
from tests.postproc.kit import HEAD, codes, convert, good
from toolpaths import read_bytes
from toolpaths.cl.systems.recognise import FORMS
from toolpaths.cl.text.dialects import DIALECTS
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.toolpath import Toolpath

CONTROLLERS = sorted(builtin_files())
KINDS = {"DRILL": "", "DEEP": ",STEP,2", "BRKCHP": ",STEP,2", "TAP": "", "BORE": "", "REAM": "", "FACE": "", "CSINK": "",
         "THRU": ""}
LINE = len(HEAD) + 3


def cycle(record: str, dialect: str | None = None) -> tuple[Toolpath, list[Diagnostic]]:
    """A hole under a CYCLE record, which stands in line LINE."""
    text = "\n".join([*HEAD, "RAPID", "GOTO/0,0,50", f"CYCLE/{record}", "GOTO/10,0,0", "CYCLE/OFF", "FINI"])
    return read_bytes(text, file="hole.apt", dialect=dialect)


def errors(found: list[Diagnostic]) -> list[tuple[str, tuple[int, ...]]]:
    return [(d.code, d.lines) for d in found if d.severity is Severity.ERROR]


@pytest.mark.covering
@pytest.mark.parametrize("dialect", sorted(set(DIALECTS) - set(FORMS)))
@pytest.mark.parametrize("kind", KINDS)
def test_a_hole_of_depth_0_is_refused_in_every_dialect(kind: str, dialect: str) -> None:
    """As NX writes it (FEDTO,0.0000); the wrong sense is refused too, the right one is read."""
    sign = DIALECTS[dialect].depth_sign
    unit = "MMPR,1" if kind == "TAP" else "MMPM,60"
    for depth, refused in (("0.0000", True), ("-0.0", True), (f"{-5 * sign}", True), (f"{5 * sign}", False)):
        _, found = cycle(f"{kind},RAPTO,3,FEDTO,{depth},RTRCTO,3,{unit}{KINDS[kind]}", dialect)
        wrong = [(d.code, d.lines) for d in found if d.code == "cl.cycle-depth"]
        assert wrong == ([("cl.cycle-depth", (LINE,))] if refused else []), (depth, [str(d) for d in found])
        assert all(d.hint for d in found if d.code == "cl.cycle-depth")


@pytest.mark.covering
@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize(("record", "code", "remedy"), [
    ("DRILL,DEPTH,0.000001,MMPM,60,CLEAR,3", "cycle.depth", "DRILL,DEPTH,1,MMPM,60,CLEAR,3"),
    ("DRILL,DEPTH,5,MMPM,60,CLEAR,-5", "cycle.start_plane", "DRILL,DEPTH,5,MMPM,60,CLEAR,2"),
    ("DRILL,DEPTH,5,MMPM,60,CLEAR,3,RTRCTO,-5", "cycle.retract", "DRILL,DEPTH,5,MMPM,60,CLEAR,3,RTRCTO,AUTO"),
    ("DEEP,DEPTH,5,MMPM,60,CLEAR,3,STEP,2,0.001", "cycle.peck", "DRILL,DEPTH,5,MMPM,60,CLEAR,3")])
def test_numbers_that_make_no_hole(name: str, record: str, code: str, remedy: str) -> None:
    """A depth or a peck below the last decimal, planes at or below the bottom: refused; what the hint says is not."""
    controller = controller_file(name)
    path, found = cycle(record)
    assert not errors(found)
    if code == "cycle.peck":
        controller = controller.model_copy(update={"format": controller.format.model_copy(update={"linear_decimals": 2})})
    wrong, = (d for d in unfit_holes(path, controller) if d.severity is Severity.ERROR)
    assert (wrong.code, wrong.lines) == (code, (LINE,)) and wrong.hint
    assert not unfit_holes(cycle(remedy)[0], controller)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_the_conversion_stops_there(name: str) -> None:
    path, found = cycle("DRILL,RAPTO,3,FEDTO,0.0000,RTRCTO,3,MMPM,60")
    assert errors(found) == [("cl.cycle-depth", (LINE,))]
    path, found = cycle("DRILL,DEPTH,0.000001,MMPM,60,CLEAR,3")
    result = convert(path, "mill-3axis", name)
    assert not result.ok and not result.text and "cycle.depth" in codes(result.diagnostics)


def test_a_retract_plane_below_the_start_plane_is_reported() -> None:
    path, _ = cycle("DRILL,DEPTH,5,MMPM,60,CLEAR,3,RTRCTO,1")
    result = good(convert(path, "mill-3axis"))
    assert [d.lines for d in result.diagnostics if d.code == "cycle.retract"] == [(LINE,)]
