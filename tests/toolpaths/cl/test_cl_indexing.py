"""Parts that Creo indexes by ROTATE and TRANS: where the points stand, and what a file may not contradict."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from toolpaths.cl.read import ReadResult, read_bytes, read_file
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind, Toolpath

SAMPLES = Path(__file__).parents[3] / "samples"
sys.path.insert(0, str(SAMPLES))

import make_indexing as m  # noqa: E402  # found on the path set above

FILES = sorted(p for p in SAMPLES.rglob("*") if p.suffix in (".cls", ".apt", ".ncl", ".clt", ".as", ".aptsource"))


def errors(result: ReadResult) -> list[str]:
    return [d.code for d in result.diagnostics if d.severity is Severity.ERROR]


def truth() -> np.ndarray:
    """Every point in the part, by the angles and places of the part alone."""
    found = []
    for start, points, height in ((m.START, (m.SLOT_APPROACH, *m.SLOT), m.HEIGHT),
                                  (m.START + m.STEP / 2, (m.HOLE_APPROACH, *m.HOLE), 0.0)):
        for angle in m.angles(start):
            t = np.radians(angle)
            for x, y, z in points:
                z += height
                found.append((x, y * np.cos(t) - z * np.sin(t), y * np.sin(t) + z * np.cos(t)))
    return np.array(found)


def path_of(run_options: m.SpellingOptions, *changes: tuple[str, str]) -> ReadResult:
    text = m.text_of(run_options)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return read_bytes(text)


@pytest.mark.covering
@pytest.mark.parametrize("units", ["MM", "INCHES"])
@pytest.mark.parametrize("approach", ["before", "between", "after"])
@pytest.mark.parametrize("multax", [False, True])
def test_points_stand_where_the_part_has_them(multax: bool, approach: str, units: str) -> None:
    result = path_of(m.SpellingOptions(multax, approach, units))
    assert not errors(result)
    p = result.toolpath
    assert np.abs(p.tip - truth()).max() < 1e-3
    radius = p.tip[:, 1:] / np.linalg.norm(p.tip[:, 1:], axis=1)[:, None]
    assert np.abs(p.axis[:, 1:] - radius).max() < 1e-4, "radial axes"
    assert laws_hold(p)


def laws_hold(p: Toolpath) -> bool:
    """Each approach lies off what follows along its axis; nothing is cut while the axis changes."""
    cut = np.flatnonzero(p.kind != Kind.RAPID)
    first = cut[p.kind[cut - 1] == Kind.RAPID]
    off = np.einsum("ni,ni->n", p.tip[first - 1] - p.tip[first], p.axis[first])
    same = np.abs(p.axis[cut] - p.axis[cut - 1]).max(axis=1) < 1e-9
    return bool((off > 0).all() and same.all())


def test_what_was_not_added_is_reported() -> None:
    assert "cl.index-translation" in [d.code for d in path_of(m.SpellingOptions()).diagnostics]


def test_table_positions_are_no_systems_of_the_part() -> None:
    assert [f.name for f in path_of(m.SpellingOptions()).toolpath.frames] == ["absolute"]


@pytest.mark.parametrize(("old", "new", "code"), [
    ("ROTATE / AAXIS, INCR, -25.714, CCLW", "ROTATE / AAXIS, INCR, 25.714, CCLW", "cl.index-frame"),
    ("ROTATE / AAXIS, INCR, -45.000, CCLW", "ROTATE / AAXIS, INCR, -44.500, CCLW", "cl.index-frame"),
    ("TRANS / 0.0000000000, 0.0000000000, 56.66", "TRANS / 0.0000000000, 0.0000000000, 59.66", "cl.index-frame"),
    ("18.7138783386\nRAPID", "18.7138783386", "cl.index-cut"),
    ("RAPID\nGOTO / 0.0000000000, 0.0000000000, 12", "RAPID\nGOTO / 0.0000000000, 0.0000000000, -12", "cl.rapid-below"),
])
def test_files_that_contradict_themselves_are_refused(old: str, new: str, code: str) -> None:
    result = path_of(m.SpellingOptions(), (old, new))
    assert set(errors(result)) == {code}, [str(d) for d in result.diagnostics]
    found = next(d for d in result.diagnostics if d.code == code)
    assert found.lines and found.hint


TURNS = """\
$$-> MFGNO / X
UNITS / MM
FEDRAT / 100, MMPM
ROTATE / AAXIS, {0}-30.0, {2}
RAPID
GOTO / 0.0, 0.0, 50.0
GOTO / 9.0, 0.0, 40.0
ROTATE / AAXIS, {1}, {2}
{3}RAPID
GOTO / 0.0, 0.0, 50.0
FINI
"""
REMARK = "$$-> CSYS / 1.0, 0.0, 0.0, 0.0, $\n0.0, 0.258819045, -0.965925826, 0.0, $\n0.0, 0.965925826, 0.258819045, 0.0\n"

WRONG = REMARK.replace("-0.9", "@").replace("0.9", "-0.9").replace("@", "0.9")


@pytest.mark.parametrize(("word", "angle", "sense", "remark", "code"), [
    ("INCR, ", "INCR, -45.0", "CCLW", "", ""), ("ABS, ", "ABS, -75.0", "CCLW", "", ""),
    ("ATANGL, ", "ATANGL, -75.0", "CCLW", "", ""), ("", "INCR, -45.0", "CCLW", "", ""), ("", "-45.0", "CCLW", REMARK, ""),
    ("", "-45.0", "CCLW", "", "cl.index-frame"), ("ABS, ", "ABS, 75.0", "CLW", "", "cl.index-frame"),
    ("ABS, ", "ABS, -75.0", "CCLW", WRONG, "cl.index-frame")])
def test_an_angle_adds_to_that_of_the_table_or_states_it(word: str, angle: str, sense: str, remark: str, code: str) -> None:
    """ABS was added to the angle before: every cut behind the second was turned, and nothing was said."""
    result = read_bytes(TURNS.format(word, angle, sense, remark))
    assert errors(result)[:1] == [code] * bool(code)
    if not code:
        t = np.radians(75.0)
        assert np.abs(result.toolpath.tip[-1] - [0.0, -50.0 * np.sin(t), 50.0 * np.cos(t)]).max() < 1e-6


def test_axes_of_a_subroutine_that_are_radial_already_are_refused() -> None:
    old = "-4.0000000000, $\n 0.0000000000, 0.0000000000, 1.0000000000"
    assert "cl.index-axis" in errors(path_of(m.SpellingOptions(multax=True), (
        old, "-4.0000000000, $\n 0.0000000000, -0.7071067812, 0.7071067812")))


def test_the_remedies_of_an_error_work() -> None:
    """Six numbers in the part's frame and no subroutine, as the hint says."""
    lines = ["$$-> MFGNO / X", "UNITS / MM", "MULTAX / ON", "FEDRAT / 100, MMPM"]
    for angle in m.angles(m.START):
        r = m.turned(angle)
        axis = ", ".join(f"{v:.10f}" for v in r[:, 2])
        lines += [f"ROTATE / AAXIS, INCR, {-(m.START if angle == m.START else m.STEP):.3f}, CCLW", *m.csys(angle, m.HEIGHT)]
        for k, (x, y, z) in enumerate((m.SLOT_APPROACH, *m.SLOT)):
            lines += ["RAPID"] * (k in (0, 3))
            lines.append("GOTO / " + ", ".join(f"{v:.10f}" for v in r @ [x, y, z + m.HEIGHT]) + ", $\n " + axis)
    result = read_bytes("\n".join([*lines, "FINI", ""]))
    assert not errors(result)
    assert np.abs(result.toolpath.tip - truth()[:56]).max() < 1e-3


HEAD = "$$-> MFGNO / X\nUNITS / MM\nFEDRAT / 100, MMPM\n"


def test_a_remark_before_its_rotate_is_not_turned_again() -> None:
    text = HEAD + "\n".join([*m.csys(45.0, 0.0), "ROTATE / AAXIS, INCR, -45, CCLW", "RAPID", "GOTO / 0,0,10", ""])
    assert read_bytes(text).toolpath.tip[0] == pytest.approx([0, -10 * 0.5 ** 0.5, 10 * 0.5 ** 0.5])


def test_points_after_trans_back_stand_about_the_axis() -> None:
    text = HEAD + "DEFSUB / 1\nGOTO / 0,0,0\nENDSUB\nROTATE / AAXIS, INCR, -45, CCLW\n" + "\n".join(m.csys(45.0, 50.0)) + (
        "\nRAPID\nGOTO / 0,0,5\nTRANS / 0,0,50\nCALSUB / 1\nTRANS / 0,0,-50\nRAPID\nGOTO / 0,0,80\nTRANS / 0,0,0\nFINI\n")
    result = read_bytes(text)
    assert not errors(result)
    assert np.linalg.norm(result.toolpath.tip, axis=1) == pytest.approx([55, 50, 80])


def test_a_pattern_on_both_sides_of_the_origin_keeps_its_minus() -> None:
    text = HEAD + ("DEFSUB / 1\nGOTO / 0,0,0\nENDSUB\nROTATE / AAXIS, INCR, -90, CCLW\nRAPID\nGOTO / 0,0,9\nTRANS / 5,0,0\n"
                   "CALSUB / 1\nTRANS / -5,0,0\nCALSUB / 1\nFINI\n")
    assert read_bytes(text).toolpath.tip[1:, 0].tolist() == [5, -5]


def test_an_approach_that_stands_over_the_subroutine_stays() -> None:
    text = HEAD + ("DEFSUB / 1\nGOTO / 1,0,0\nENDSUB\nROTATE / AAXIS, INCR, -90, CCLW\nRAPID\nGOTO / 6,0,9\nTRANS / 5,0,0\n"
                   "CALSUB / 1\nFINI\n")
    assert read_bytes(text).toolpath.tip[:, 0].tolist() == [6, 6]


def test_a_subroutine_that_runs_turned_elsewhere_stands_about_the_axis_from_the_first_call_on() -> None:
    text = HEAD + "DEFSUB / 1\nGOTO / 0,0,40\nENDSUB\n" + "\n".join(m.csys(0.0, 50.0)) + (
        "\nRAPID\nGOTO / 0,0,60\nCALSUB / 1\nROTATE / AAXIS, INCR, -90, CCLW\n") + "\n".join(m.csys(90.0, 50.0)) + (
        "\nRAPID\nGOTO / 0,0,60\nCALSUB / 1\nFINI\n")
    result = read_bytes(text)
    assert not errors(result)
    assert np.linalg.norm(result.toolpath.tip, axis=1)[[1, 3]] == pytest.approx([40, 40])


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.name)
def test_no_rapid_of_a_sample_goes_below_what_its_tool_cuts(path: Path) -> None:
    assert "cl.rapid-below" not in [d.code for d in read_file(path).diagnostics]


@pytest.mark.parametrize(("text", "lines"), [
    ("GOTO/0,0,5\nGOTO/0,0,-1\nRAPID\nGOTO/5,0,-2\nGOTO/5,0,0\n", (6,)),
    ("GOTO/0,0,5\nGOTO/0,0,-1\nRAPID\nGOTO/5,0,-1\nGOTO/5,0,0\n", ()),
    ("RAPID\nGOTO/0,0,-2,0,-1,0\nGOTO/0,-3,0,0,-1,0\nRAPID\nGOTO/0,0,9,0,0,1\nGOTO/0,0,1,0,0,1\n", (4,)),
    ("CYCLE/DRILL,DEPTH,9,CLEAR,1\nGOTO/0,0,0\nCYCLE/OFF\nRAPID\nGOTO/0,0,-8\n", ()),
])
def test_a_rapid_below_all_cuts_is_a_warning_elsewhere(text: str, lines: tuple[int, ...]) -> None:
    found = [d for d in read_bytes("UNITS/MM\nFEDRAT/9\n" + text).diagnostics if d.code == "cl.rapid-below"]
    assert [d.lines for d in found] == ([lines] if lines else [])
    assert all(d.severity is Severity.WARNING for d in found)
