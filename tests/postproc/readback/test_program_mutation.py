"""Programs spoilt in one place: the read-back must refuse every one of them.

What may be changed without harm is left out on purpose: the path above the safe planes, pecks on the path to
a bottom, feeds that an axis limit had reduced below the programmed one, and blocks that linearising put in
with room to spare.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import toolpaths
from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, convert, execute, good, goto, sample, setup_of, tilted, toolpath
from tests.postproc.mutation_kit import Effect, mutants, verdict
from toolpaths.diagnostics import Severity

FLAT = [("pocket.cls", "mill-3axis", "linuxcnc"), ("inch_plate.apt", "mill-3axis", "generic-iso"),
        ("five_faces.cls", "mikron-ucp710", "linuxcnc"), ("indexed_4axis.cls", "mill-4axis", "linuxcnc")]
FIVE = [("tool_axis_tour.apt", "mikron-ucp710", "linuxcnc"), ("tool_axis_tour.apt", "linuxcnc-xyzac-trt", "linuxcnc")]
MOST = 4
BLOCKS = pytest.mark.parametrize("most", [2, pytest.param(6, marks=pytest.mark.slow)])
"""how many blocks of a program have all their numbers changed"""


def found(result: PostResult, lines: list[str]) -> set[str]:
    _, diagnostics = read_back(("\n".join(lines) + "\n").encode(), result.job, "f.cls")
    return codes(d for d in diagnostics if d.severity is Severity.ERROR)


@cache
def cutting(case: tuple[str, str, str]) -> list[int]:
    """0-based lines that cut, but canned cycles (their words are Z, R and Q) and holes in single moves (pecks)."""
    result = sample(*case)
    holes = {int(n) for n in result.toolpath.line[result.toolpath.role == 1]}
    pecked = bool(holes) and not result.program.holes
    lines = sorted({s.line - 1 for s in execute(result) if s.kind != "rapid" and np.isnan(s.level)})
    return [] if pecked else lines


def some(items: list, count: int = MOST) -> list:
    """At most `count` of the items, evenly."""
    return [items[k] for k in np.unique(np.linspace(0, len(items) - 1, count).astype(int))] if items else []


def survivors(result: PostResult, mutants: Iterator[tuple[str, list[str]]]) -> list[str]:
    seen, left = 0, []
    for name, lines in mutants:
        seen += 1
        if not found(result, lines):
            left.append(name)
    assert seen
    return left


def replaced(lines: list[str], i: int, block: str) -> list[str]:
    return [*lines[:i], block, *lines[i + 1:]]


def numbers(result: PostResult, letters: str, steps: tuple[float, ...],
            rows: list[int]) -> Iterator[tuple[str, list[str]]]:
    lines = result.text.splitlines()
    for i in rows:
        for m in re.finditer(rf"([{letters}])(-?[\d.]+)", lines[i]):
            for step in steps:
                block = lines[i][:m.start(2)] + f"{float(m[2]) + step:.4f}" + lines[i][m.end(2):]
                yield f"{i + 1}: {lines[i]} -> {block}", replaced(lines, i, block)


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("case", [*FLAT, *FIVE])
def test_unspoilt_programs_pass(case: tuple[str, str, str]) -> None:
    result = sample(*case)
    assert not found(result, result.text.splitlines())


@BLOCKS
@pytest.mark.parametrize("case", FLAT)
def test_wrong_number(case: tuple[str, str, str], most: int) -> None:
    """0.02 mm off, and far off, in every word of every kind of cutting block."""
    result = sample(*case)
    rows = some(cutting(case), most)
    assert not survivors(result, numbers(result, "XYZ", (0.021, -0.3, 7.0), rows))
    if case == FLAT[0]:
        arcs = [i for i in cutting(case) if re.search(r"\b[IJ]", result.text.splitlines()[i])]
        assert not survivors(result, numbers(result, "IJ", (-0.3, 7.0), some(arcs, 2)))


@BLOCKS
@pytest.mark.parametrize("case", FIVE)
def test_wrong_number_in_five_axes(case: tuple[str, str, str], most: int) -> None:
    result = sample(*case)
    assert not survivors(result, numbers(result, "XYZ", (0.05, -7.0), some(cutting(case), most)))
    assert not survivors(result, numbers(result, "ABC", (10.0, -25.0), some(cutting(case), most)))


@BLOCKS
@pytest.mark.parametrize("case", FLAT[:2])
def test_wrong_number_in_a_canned_cycle(case: tuple[str, str, str], most: int) -> None:
    result = sample(*case)
    lines = result.text.splitlines()
    rows = [i for i, n in enumerate(lines) if re.search(r"G8[1-9]|G73", n)]
    rows += [i + 1 for i in rows if re.fullmatch(r"X\S+ Y\S+", lines[i + 1])]
    assert not survivors(result, numbers(result, "XYZR", (0.021, -0.3, 7.0), some(rows, most)))


@pytest.mark.parametrize("case", FLAT[:3])
def test_missing_block(case: tuple[str, str, str]) -> None:
    result = sample(*case)
    lines = result.text.splitlines()
    assert not survivors(result, ((f"{i + 1}: {lines[i]}", [*lines[:i], *lines[i + 1:]]) for i in some(cutting(case))))


@pytest.mark.parametrize("case", FLAT[:3])
def test_swapped_blocks(case: tuple[str, str, str]) -> None:
    result = sample(*case)
    lines, rows = result.text.splitlines(), cutting(case)
    pairs = [i for i in rows if i + 1 in rows and lines[i] != lines[i + 1]]
    assert not survivors(result, ((f"{i + 1}: {lines[i]} <> {lines[i + 1]}",
                                   [*lines[:i], lines[i + 1], lines[i], *lines[i + 2:]]) for i in some(pairs)))


@pytest.mark.covering
@pytest.mark.parametrize("case", [*FLAT[:3], FIVE[0]])
@pytest.mark.parametrize(("code", "other"), [("G1", "G0"), ("G2", "G3"), ("G3", "G2"), ("G93", "G94")])
def test_wrong_motion_code(case: tuple[str, str, str], code: str, other: str) -> None:
    result = sample(*case)
    lines = result.text.splitlines()
    rows = [i for i in cutting(case) if re.search(rf"{code}\b", lines[i])]
    if rows:
        assert not survivors(result, ((f"{i + 1}: {lines[i]}", replaced(lines, i, re.sub(rf"{code}\b", other, lines[i])))
                                      for i in some(rows, 2)))


@pytest.mark.parametrize("case", FLAT)
def test_feed_doubled(case: tuple[str, str, str]) -> None:
    result = sample(*case)
    lines = result.text.splitlines()
    rows = [i for i, n in enumerate(lines) if re.search(r"F[\d.]+$", n) and not n.startswith("(")]
    assert not survivors(result, ((f"{i + 1}: {lines[i]}", replaced(lines, i, re.sub(
        r"F([\d.]+)", lambda m: f"F{2 * float(m[1]):.4f}", lines[i]))) for i in some(rows)))


def test_feed_doubled_all_over_a_five_axis_move() -> None:
    """Inverse time: every F of one CL move doubled."""
    axes = np.array([tilted(20 + 5 * k, 30) for k in range(4)])
    tips = np.array([[0, 0, 0], [20, 0, 0], [40, 0, 0], [60, 0, 0.0]])
    result = good(convert(toolpath("RAPID", *goto(tips[:1], axes[:1]), "FEDRAT/MMPM,100", *goto(tips[1:], axes[1:])),
                          "mikron-ucp710"))
    lines = result.text.splitlines()
    rows = [i for i, n in enumerate(lines) if re.search(r"F[\d.]+$", n)]
    assert len(rows) > 6
    assert "verify.feed" in found(result, [re.sub(r"F([\d.]+)$", lambda m: f"F{2 * float(m[1]):.4f}", n) for n in lines])


@pytest.mark.covering
@pytest.mark.parametrize("case", FLAT)
@pytest.mark.parametrize(("pattern", "code"), [
    (r"T1 M6", ""), (r"T2 M6", ""), (r"S\d+ M3", "verify.state"), (r"M8", "verify.state"), (r"G43 H1.*", ""),
    (r"G43 H2.*", "")])
def test_missing_change_of_state(case: tuple[str, str, str], pattern: str, code: str) -> None:
    """The first of its kind left out, so that nothing later makes up for it."""
    result = sample(*case)
    lines = result.text.splitlines()
    at = next(i for i, n in enumerate(lines) if re.fullmatch(pattern, n))
    got = found(result, [*lines[:at], *lines[at + 1:]])
    assert got and (not code or code in got)


@pytest.mark.covering
@pytest.mark.parametrize("case", FLAT)
@pytest.mark.parametrize(("pattern", "text"), [(r"T1 M6", "T2 M6"), (r"G43 H1(.*)", r"G43 H2\1"),
                                               (r"G43 H2(.*)", r"G43 H1\1"), (r"S\d+ M3", "S1 M3"),
                                               (r"G43 H1(.*)", r"G43 H9\1")])
def test_wrong_tool_register_or_speed(case: tuple[str, str, str], pattern: str, text: str) -> None:
    result = sample(*case)
    lines = result.text.splitlines()
    at = next(i for i, n in enumerate(lines) if re.fullmatch(pattern, n))
    assert found(result, replaced(lines, at, re.sub(pattern, text, lines[at])))


@pytest.mark.parametrize("case", FLAT)
def test_spindle_the_wrong_way_round(case: tuple[str, str, str]) -> None:
    result = sample(*case)
    assert "verify.state" in found(result, result.text.replace(" M3\n", " M4\n").splitlines())


@pytest.mark.parametrize(("old", "new"), [("G21 ", "G20 "), ("G90 ", "G91 "), ("\nG54\n", "\nG55\n")])
def test_wrong_preamble(old: str, new: str) -> None:
    result = sample(*FLAT[0])
    assert found(result, result.text.replace(old, new, 1).splitlines())


def test_rapid_into_uncut_metal() -> None:
    """Pecks in single moves: the rapid back into the hole may end above the last depth, not below it."""
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DEEP,DEPTH,12,RAPTO,3,RTRCTO,70,MANUAL,MMPM,100,STEP,5",
                    "GOTO/10,0,0")
    result = good(convert(path, "mill-3axis"))
    lines = result.text.splitlines()
    for old, new, bad in (("Z-1.746", "Z-11.9", True), ("Z-1.746", "Z-2.1", True), ("Z-6.746", "Z-7.5", True),
                          ("Z-1.746", "Z-1", False), ("Z-6.746", "Z1", False)):
        assert bool(found(result, replaced(lines, lines.index(old), new))) == bad, (old, new)


@pytest.mark.parametrize(("old", "new", "code"), [
    (r"\nZ([\d.]+)\nG53", r"\nZ-\1\nG53", "verify.link"), ("G64 P0.002 Q0.001\n", "", "verify.smoothing"),
    ("G64 P0.002", "G64 P2", "verify.smoothing"), ("G53 G0 Z400", "G0 Z400", "verify.travel"), ("M2\n", "", "gcode.no_end")])
def test_spoilt_next_to_the_path(old: str, new: str, code: str) -> None:
    """The retract at the end, the control's smoothing, travel, the end itself."""
    result = sample(*FLAT[0])
    spoilt, count = re.subn(old, new, result.text)
    assert count and code in found(result, spoilt.splitlines())


def test_cut_short() -> None:
    result = sample(*FLAT[0])
    lines = result.text.splitlines()
    for share in (0.3, 0.6, 0.9):
        assert "gcode.no_end" in found(result, lines[:int(share * len(lines))])
        assert "verify.not_reached" in found(result, [*lines[:int(share * len(lines))], "M2"])


def test_the_program_of_another_path() -> None:
    result, other = sample("pocket.cls", "mill-3axis"), sample("inch_plate.apt", "mill-3axis")
    assert found(result, other.text.splitlines())


def test_linking_moves_through_the_part() -> None:
    """The level of an index move lowered into the block: 3+2 drilling, every rapid at the safe plane."""
    result = sample("five_faces.cls", "mikron-ucp710")
    lines = result.text.splitlines()
    at = lines.index("T2 M6")
    row = next(i for i in range(at, len(lines)) if re.fullmatch(r"Z1\d\d\.\d+", lines[i]))
    assert found(result, replaced(lines, row, "Z-20"))


# ---- every kind of change, on every control and in every mode ----------------------------------------------

OFF_AXES = """\
[part]
origin = [37.0, -23.0, 11.0]
x_axis = [0.9563047559630355, 0.29237170472273677, 0.0]
y_axis = [-0.29237170472273677, 0.9563047559630355, 0.0]
[tools.1]
gauge_length = 120.0
[tools.2]
gauge_length = 95.5
[tools.3]
gauge_length = 133.25
"""
"""the part off the rotary axes and turned about z, tools of different lengths: what stands on the crossing hides faults"""
GOLDEN = Path(__file__).parents[2] / "golden"
SIX = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso")
CHANGED = [(source, controller, mode) for controller in SIX for source, mode in (
    (GOLDEN / "three_laws.cls", "auto"), (GOLDEN / "three_laws.cls", "axes"), (GOLDEN / "every_cycle.cls", "auto"))
    if controller not in ("linuxcnc", "generic-iso") or source.stem != "every_cycle"]
EACH = 3
"""changes of each program that every run of the tests looks at; the whole of them with -m slow"""
HARMLESS = {
    "same": "the same motion, states and times: words that state what holds already, a block twice that goes nowhere",
    "placed": "only rapids between operations end elsewhere: the read-back has found them clear of the part, inside travel",
    "near": "everything ends within the tolerance, by which it has been compared, in the time of its move, no rounder",
    "warned": "a warning says so: axes that end the program away from home, more stops or rests than the CL file has",
}


@cache
def off_axes(source: Path, controller: str, mode: str) -> tuple[PostResult, Effect]:
    """A program for a machine whose pivots are next to its origin, and what it does."""
    path, _ = toolpaths.read(source)
    result = good(convert(path, "trunnion-bc", controller, setup_of(OFF_AXES), output=mode))
    assert result.job is not None
    comparison, _ = read_back(result.text.encode(), result.job, "f.cls")
    assert comparison is not None
    return result, Effect.of(result.job, comparison)


def judged(source: Path, controller: str, mode: str, count: int | None, start: int = 0) -> list[str]:
    """Changes that pass although they do harm, of `count` evenly picked ones (None: all)."""
    result, effect = off_axes(source, controller, mode)
    assert result.job is not None
    every = list(mutants(result.text, result.controller.comment.open.strip()))
    picked = every if count is None else some(every[start % len(every):], count)
    assert picked
    verdicts = [(one, verdict(result.job, one.text, effect)) for one in picked]
    return [f"{one}: {said}" for one, said in verdicts if said.split()[0] not in ("caught", *HARMLESS)]


@pytest.mark.covering
@pytest.mark.parametrize(("source", "controller", "mode"), CHANGED, ids=lambda v: getattr(v, "stem", v))
def test_no_change_is_silent_and_harmful(source: Path, controller: str, mode: str) -> None:
    assert judged(source, controller, mode, EACH, SIX.index(controller)) == []


@pytest.mark.slow
@pytest.mark.parametrize(("source", "controller", "mode"), CHANGED, ids=lambda v: getattr(v, "stem", v))
def test_none_of_all_changes_is_silent_and_harmful(source: Path, controller: str, mode: str) -> None:
    assert judged(source, controller, mode, None) == []


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc"])
def test_a_hole_that_the_file_does_not_tap_is_not_tapped(controller: str) -> None:
    """A cycle that is left out, or another one, behind taps: the spindle would turn back at the bottom."""
    result, _ = off_axes(GOLDEN / "every_cycle.cls", controller, "auto")
    for other in ("G84 ", ""):
        assert "verify.tap" in found(result, re.sub("G85 ", other, result.text, count=1).splitlines())
