"""Pecks of DEEP2 (1STPECK, SUBPECK) as the control's own cycle where it is equal; pecks that rounding would make more of."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise

import pytest

from postproc.pipeline.result import PostResult
from postproc.verification import second_witness as witnessing
from postproc.verification.read_back import read_back
from postproc.witness.evidence import Case
from tests.postproc.kit import convert, good, setup_of, toolpath
from toolpaths.diagnostics import Severity

NAMES = ["linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "generic-iso"]
FALLING = ["haas-ngc", "heidenhain-tnc640", "siemens-840d"]
HOLES = ["GOTO/0,0,0", "GOTO/10,0,0", "GOTO/20,0,0"]


def deep(first: float, then: float, dwell: float = 0.0, depth: float = 20.88, retract: float = 3.0) -> list[str]:
    return ["RAPID", "GOTO/0,0,50", f"CYCLE/DEEP2,FEDTO,{depth},MMPM,60.,RAPTO,3,RTRCTO,{retract},1STPECK,{first},"
            f"SUBPECK,{then},DWELL,{dwell}", *HOLES, "CYCLE/OFF", "RAPID", "GOTO/0,0,50"]


@cache
def drilled(controller: str, first: float, then: float, dwell: float = 0.0, units: str = "mm",
            depth: float = 20.88) -> PostResult:
    return convert(toolpath(*deep(first, then, dwell, depth)), "mill-3axis", controller,
                   setup_of(f'[output]\nunits = "{units}"\n[tools.1]\ngauge_length = 90\n'))


def pecks(result: PostResult) -> list[float]:
    """Depths at which the tool turns back in the first hole, mm below its top."""
    assert result.comparison is not None and result.comparison.executed is not None
    motion = result.comparison.executed[1]
    depth = [float(90.0 - z) for z in motion.end[:, 2]]
    bottoms = [d for k, d in enumerate(depth[:-1]) if motion.code[k] > 0 and depth[k + 1] < d]
    return bottoms[:bottoms.index(max(bottoms)) + 1]


@pytest.mark.covering
@pytest.mark.parametrize("units", ["mm", "inch"])
@pytest.mark.parametrize("controller", NAMES)
@pytest.mark.parametrize(("first", "then"), [(5.0, 3.0), (5.0, 1.5), (6.0, 5.0)])
def test_the_pecks_are_those_of_the_file(controller: str, first: float, then: float, units: str) -> None:
    """From the start plane, or from the surface: the first deeper than the others, which are all alike."""
    surface = controller in ("heidenhain-tnc640", "siemens-840d")
    result = good(drilled(controller, first, then, 0.0, units))
    found = pecks(result)
    steps = [b - a for a, b in pairwise(found)]
    assert found[0] == pytest.approx(first if surface else first - 3.0, abs=4e-3)
    assert steps[:-1] == pytest.approx([then] * (len(steps) - 1), abs=4e-3) and steps[-1] <= then + 4e-3


def test_they_are_native_where_the_control_has_them() -> None:
    haas, tnc = good(drilled("haas-ngc", 5.0, 3.0)).text, good(drilled("heidenhain-tnc640", 5.0, 3.0)).text
    assert "G83 X0. Y0. Z-20.88 R3. I5. J2. K3. F60." in haas and len(re.findall(r"(?m)^X[12]0\. Y0\.$", haas)) == 2
    for word in ("CYCL DEF 203", "Q202=+5 ", "Q212=+2 ", "Q205=+3 ", "Q213=+0 "):
        assert word in tnc
    assert tnc.count(" M99") == 3
    siemens = good(drilled("siemens-840d", 5.0, 3.0)).text
    assert "MCALL CYCLE83(3,0,3,-20.88,,,5,-0.6,0,0,1,1,,3)" in siemens and siemens.count("MCALL CYCLE83") == 1
    assert "DAM below 0 as the factor" in siemens and "(assumed)" in siemens
    assert "(assumed)" not in good(drilled("siemens-840d", 4.0, 4.0)).text
    assert "P500" in good(drilled("haas-ngc", 5.0, 3.0, 0.5)).text
    assert ",5,-0.6,0.5,0,1,1,,3)" in good(drilled("siemens-840d", 5.0, 3.0, 0.5)).text
    assert "Q211=+0.5 " in good(drilled("heidenhain-tnc640", 5.0, 3.0, 0.5)).text


@pytest.mark.parametrize("controller", NAMES)
def test_what_is_not_equal_is_written_as_moves_and_said_once(controller: str) -> None:
    for first, then in ((5.0, 3.0), (3.0, 5.0)):
        result = good(drilled(controller, first, then))
        said = [d for d in result.diagnostics if d.code == "cycle.as_moves"]
        native = controller in FALLING and then < first
        assert len(said) == (0 if native else 1) and all(d.severity is Severity.INFO and d.count == 3 for d in said)
        assert native or "3 holes of CYCLE/DEEP written as single moves: its pecks are not all alike" in said[0].message
        assert bool(re.search(r"G83|CYCL DEF 20|CYCLE83\(", result.text)) == native
    equal = good(drilled(controller, 4.0, 4.0))
    assert not [d for d in equal.diagnostics if d.code == "cycle.as_moves"]


@pytest.mark.parametrize("controller", ["heidenhain-tnc640", "siemens-840d"])
def test_a_last_peck_of_next_to_nothing_becomes_moves(controller: str) -> None:
    """The depth before it lies within the tolerance of the bottom, of which a cycle would make two bottoms."""
    result = good(drilled(controller, 7.0, 3.499, depth=14.0))
    assert [d.message for d in result.diagnostics if d.code == "cycle.as_moves"] == [
        "3 holes of CYCLE/DEEP written as single moves: its pecks would leave less than 0.02 mm for the last one"]
    assert good(drilled(controller, 7.0, 3.48, depth=14.0)).text.count("MCALL CYCLE83") == (controller == "siemens-840d")


@pytest.mark.parametrize(("controller", "old", "new"), [
    ("haas-ngc", " J2. K3.", " J0. K3."), ("haas-ngc", " K3.", " K4."), ("haas-ngc", " I5.", " I6."),
    ("heidenhain-tnc640", "Q212=+2 ", "Q212=+0 "), ("heidenhain-tnc640", "Q205=+3 ", "Q205=+4 "),
    ("heidenhain-tnc640", "Q202=+5 ", "Q202=+6 "),
    ("siemens-840d", ",-0.6,", ",-0.7,"), ("siemens-840d", ",5,-0.6,", ",6,-0.5,"), ("siemens-840d", ",,3)", ",,4)"),
    ("siemens-840d", ",-0.6,", ",0,")])
def test_deeper_pecks_behind_the_first_are_found(controller: str, old: str, new: str) -> None:
    """Each peck against its own step, not against the largest."""
    result = good(drilled(controller, 5.0, 3.0))
    assert result.job is not None and old in result.text
    found = read_back(result.text.replace(old, new).encode(), result.job, "test.apt")[1]
    assert "deeper pecks" in " ".join(d.message for d in found if d.code == "verify.hole")


@pytest.mark.parametrize(("old", "new", "why"), [
    (",-0.6,", ",2,", "with DAM above 0"), (",1,,3)", ",1)", "_MDEP"), (",-0.6,", ",-2,", "factor from -0.001 to -1")])
def test_strokes_that_no_page_settles_are_not_read(old: str, new: str, why: str) -> None:
    result = good(drilled("siemens-840d", 5.0, 3.0))
    assert result.job is not None and old in result.text
    found = read_back(result.text.replace(old, new).encode(), result.job, "test.apt")[1]
    assert [d.code for d in found] == ["gcode.cycle"] and why in found[0].message


def test_the_second_witness_counts_each_peck(monkeypatch: pytest.MonkeyPatch) -> None:
    """A CL file whose later pecks are smaller than those of the program."""
    result = good(drilled("haas-ngc", 5.0, 3.0))
    assert result.job is not None and result.comparison is not None and result.source is not None
    testify = witnessing.testify

    def smaller(case: Case, executed: object) -> object:
        return testify(replace(case, cl=lambda: case.cl().replace(b"SUBPECK,3.0", b"SUBPECK,2.0")), executed)
    monkeypatch.setattr(witnessing, "testify", smaller)
    said, _ = witnessing.second_witness(result.source, result.asked or result.setup, result.options, result.job,
                                        result.comparison, result.text)
    assert [f.message for f in said.findings] == ["the hole is drilled in deeper pecks than the CL file says"]


def test_pecks_of_both_kinds_stand_next_to_each_other() -> None:
    """I, J and K hold from block to block: a cycle without them begins anew."""
    lines = [*deep(5.0, 3.0)[:-3], "CYCLE/DEEP,FEDTO,12,MMPM,60.,RAPTO,3,RTRCTO,3,INCR,4,DWELL,0", "GOTO/30,0,0",
             *deep(5.0, 3.0)[2:]]
    text = good(convert(toolpath(*lines), "mill-3axis", "haas-ngc")).text
    assert re.search(r"I5\. J2\. K3\. F60\.\n(X\S+ Y\S+\n)+G80\n", text)
    assert re.search(r"G83 X30\. Y0\. Z-12\. R3\. Q4\.", text)


@pytest.mark.covering
@pytest.mark.parametrize("controller", NAMES)
@pytest.mark.parametrize(("depth", "step"), [(9.0, 3.0), (7.62, 2.54), (10.0, 3.33333), (12.0, 4.0)])
def test_pecks_that_divide_the_hole_are_no_more_in_inches(controller: str, depth: float, step: float) -> None:
    """Rounded words leave less than a hundredth of a millimetre, which is no peck."""
    result = good(drilled(controller, step, step, 0.0, "inch", depth))
    assert len(pecks(result)) <= round((depth + 3.0) / step + 0.49999)


@pytest.mark.parametrize(("controller", "first", "then", "units", "depth", "count"), [
    ("haas-ngc", 8.0, 3.0, "inch", 32.0, 10), ("heidenhain-tnc640", 7.3, 2.6, "inch", 22.9, 7),
    ("linuxcnc", 5.0, 3.0, "mm", 14.004, 5), ("siemens-840d", 5.0, 3.0, "mm", 14.004, 5)])
def test_what_rounding_leaves_is_no_peck(controller: str, first: float, then: float, units: str, depth: float,
                                         count: int) -> None:
    """Pecks that divide the depth, their words rounded down, and a file that is 0.004 mm deeper than they are."""
    assert len(pecks(good(drilled(controller, first, then, 0.0, units, depth)))) == count
