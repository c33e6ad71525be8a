"""Clamps of rotary axes that the program works by the builder's codes: in plan, text, reader, time and second witness."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.machine import ClampCodes, Machine
from postproc.base.options import Options
from postproc.cycle_time.conversion import estimate_of
from postproc.orientation.plans import index_time
from postproc.pipeline.result import PostResult
from postproc.verification import second_witness
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, setup_of, tilted, toolpath
from toolpaths.diagnostics import DiagnosticError, Severity
from toolpaths.toolpath import Toolpath

CODES = {"A": ClampCodes("M10", "M11"), "C": ClampCodes("M12", "M15")}
SETUP = setup_of("[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n")
"""the part off the rotary axes, tools of different lengths"""
CONTROLS = ("fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640", "linuxcnc", "generic-iso")
CASES = [(control, mode) for control in CONTROLS for mode in ("auto", "axes")] + [
    (control, "tcp") for control in CONTROLS[:4]]


@cache
def clamping(codes: bool = True) -> Machine:
    """The Mikron with codes for the clamps of A and C."""
    machine = machines.load("mikron-ucp710")
    return replace(machine, clamps=tuple(CODES.get(a, ClampCodes()) if codes else ClampCodes() for a in machine.axis_names))


def point(tip: np.ndarray, axis: np.ndarray) -> str:
    return "GOTO/" + ",".join(f"{v:.9f}" for v in (*tip, *axis))


@cache
def indexed() -> Toolpath:
    """Two sides, holes in one of them, the same side with another tool, a cut that turns the tool, holes from above."""
    def side(axis: np.ndarray, last: list[str]) -> list[str]:
        return ["RAPID", point(45 * axis, axis), *last, "RAPID", point(45 * axis, axis)]

    def cut(axis: np.ndarray) -> list[str]:
        across = np.cross(axis, [0.0, 0.0, 1.0])
        return side(axis, ["FEDRAT/MMPM,500", point(30 * axis, axis), point(30 * axis + 8 * across, axis), "RAPID",
                           point(45 * axis + 8 * across, axis)])

    def holes(axis: np.ndarray) -> list[str]:
        across = np.cross(axis, [0.1, 0.0, 1.0])
        return side(axis, ["CYCLE/DRILL,DEPTH,8,MMPM,200,CLEAR,2",
                           *(point(30 * axis + k * across, axis) for k in (0, 8)), "CYCLE/OFF"])

    turn = [tilted(30.0, float(t)) for t in np.linspace(0.0, 90.0, 7)]
    turning = ["RAPID", point(45 * turn[0], turn[0]), "FEDRAT/MMPM,400", *(point(30 * a, a) for a in turn), "RAPID",
               point(60 * turn[-1], turn[-1])]
    one, other = tilted(40.0, 77.0), tilted(40.0, -50.0)
    return toolpath(*cut(one), *cut(other), *holes(other), "LOADTL/2", "SPINDL/RPM,2000,CLW", *cut(other), *turning,
                    *holes(np.array([0.0, 0.0, 1.0])))


@cache
def converted(controller: str, output: str) -> PostResult:
    return postproc.convert(indexed(), clamping(), controller, SETUP, Options(output=output))


def switches(text: str) -> list[int]:
    """Numbers of the lines with clamp codes."""
    return [n for n, line in enumerate(text.splitlines()) if re.fullmatch(r"(?:N?\d+ )?M1[0125]", line)]


def verdict(result: PostResult, text: str) -> set[str]:
    """Errors of reading a text back on the job of a conversion."""
    assert result.job is not None
    _, found = read_back(text, result.job, "test.apt", gcode="edited.nc")
    return {d.code for d in found if d.severity is Severity.ERROR}


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "output"), CASES)
def test_axes_are_free_where_they_turn_and_clamped_where_they_cut(controller: str, output: str) -> None:
    result = converted(controller, output)
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and any(what.what == "clamps" for what in result.witness.compared)
    state, position, turned, seen = {"M10": "", "M12": ""}, dict[str, str](), 0, set[str]()
    for block in re.sub(r"\(.*?\)|;.*", "", result.text).splitlines():
        for word in re.findall(r"(?<![A-Z])M1[0125]\b", block):
            state["M10" if word in ("M10", "M11") else "M12"] = word
            seen.add(word)
        for letter, clamp, free in (("A", "M10", "M11"), ("C", "M12", "M15")):
            for value in re.findall(rf"(?<![A-Z]){letter}([-+]?\d+\.?\d*)", block):
                if position.get(letter) != value:
                    assert state[clamp] == free, block
                    turned += 1
                position[letter] = value
        if re.search(r"G68\.2|CYCLE800\(0|PLANE SPATIAL", block):
            assert set(state.values()) == {"M11", "M15"}, block
        if re.search(r"G8[12]\b|M99\b|MCALL CYCLE", block):
            assert set(state.values()) == {"M10", "M12"}, block
    assert seen == {"M10", "M11", "M12", "M15"} and turned > 10


def matters(lines: list[str], n: int) -> bool:
    """True where a cut follows, or the axis of the release in line n turns before its next clamp; from where it stands
    when the program is started nobody knows."""
    code = lines[n].split()[-1]
    if code in ("M10", "M12"):
        return any(re.search(r"G0?1 |G81|M99| F\d", line) for line in lines[n + 1:])
    letter, clamp = ("A", "M10") if code == "M11" else ("C", "M12")
    stop = next((k for k in range(n, len(lines)) if re.search(rf"{clamp}\b", lines[k])), len(lines))
    word = rf"(?<![A-Z]){letter}([-+]?\d+\.?\d*)"
    before = re.findall(word, "\n".join(lines[:n]))[-1:] or ["nan"]
    stated = re.findall(word, "\n".join(lines[n:stop]))
    plane = any(re.search(r"G53\.1|CYCLE800\(0|PLANE SPATIAL", line) for line in lines[n:stop])
    return plane or len({float(v) for v in before + stated}) > 1


@pytest.mark.covering(of=("controller", "output", "third"))
@pytest.mark.parametrize("third", range(3))
@pytest.mark.parametrize(("controller", "output"), [(c, "auto") for c in CONTROLS] + [("fanuc-30i", "axes")])
def test_each_code_that_is_left_out_is_caught(controller: str, output: str, third: int) -> None:
    """Every third code of a control, from another one on for each."""
    result = converted(controller, output)
    lines = ["" if re.match(r"(\d+ )?[(;]", line) else line for line in result.text.splitlines()]
    assert not verdict(result, result.text)
    places = [n for n in switches(result.text) if matters(lines, n)]
    missed = [(n, lines[n]) for n in places[third::3]
              if "verify.clamp" not in verdict(result, "\n".join(lines[:n] + lines[n + 1:]) + "\n")]
    assert len(places) >= 10 and not missed


def test_axes_that_are_free_at_the_end_are_named() -> None:
    result = converted("fanuc-30i", "axes")
    assert result.job is not None and "verify.clamp" not in codes(result.diagnostics)
    for code in ("M10", "M12"):
        before, _, after = result.text.rpartition(f"\n{code}\n")
        _, found = read_back(f"{before}\n{after}", result.job, "test.apt", gcode="edited.nc")
        assert [d.severity for d in found if d.code == "verify.clamp"] == [Severity.WARNING]


def test_a_program_without_clamps_is_refused_by_the_reader() -> None:
    plain = postproc.convert(indexed(), clamping(False), "fanuc-30i", SETUP, Options(output="axes"))
    assert plain.ok and not switches(plain.text)
    assert "verify.clamp" in verdict(converted("fanuc-30i", "axes"), plain.text)
    foreign = verdict(plain, converted("fanuc-30i", "axes").text)
    assert "gcode.unknown_code" in foreign  # a machine without such codes does not know them


@pytest.mark.parametrize("controller", ["fanuc-30i", "heidenhain-tnc640"])
def test_the_second_witness_follows_the_codes_by_itself(controller: str,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    """Codes that the reader sees and the text does not hold: the witness alone can find them missing."""
    result = converted(controller, "auto")
    assert result.job is not None and result.comparison is not None and result.source is not None
    lines = result.text.splitlines()
    for n, what in ((switches(result.text)[0], "turns before"), (switches(result.text)[2], "not clamped")):
        text = "\n".join([*lines[:n], "", *lines[n + 1:]]) + "\n"
        said, _ = second_witness.second_witness(result.source, result.asked or result.setup, result.options, result.job,
                                                result.comparison, text)
        assert any(f.code == "clamp" and what in f.message for f in said.findings), lines[n]


def witnessed(result: PostResult, text: str) -> set[str]:
    """What the second witness says of clamps in a text that the reader did not see."""
    assert result.job is not None and result.comparison is not None and result.source is not None
    said, _ = second_witness.second_witness(result.source, result.asked or result.setup, result.options, result.job,
                                            result.comparison, text)
    return {f.message for f in said.findings if f.code == "clamp"}


@pytest.mark.parametrize(("controller", "output"), [("fanuc-30i", "axes"), ("haas-ngc", "auto"), ("siemens-840d", "tcp"),
                                                    ("heidenhain-tnc640", "auto"), ("linuxcnc", "auto")])
def test_an_axis_is_clamped_before_the_first_block_of_a_cut_and_up_to_the_last(controller: str, output: str) -> None:
    """Each clamp code one block later, through the whole cut, and released and clamped again inside it."""
    axis, along = tilted(40.0, 77.0), np.cross(tilted(40.0, 77.0), [0.0, 0.0, 1.0])
    path = toolpath("RAPID", point(45 * axis, axis), "FEDRAT/MMPM,500",
                    *(point(30 * axis + k * along, axis) for k in (0, 8, 4, 6, 1)), "RAPID", point(45 * axis + along, axis))
    result = postproc.convert(path, clamping(), controller, SETUP, Options(output=output))
    assert result.ok, [str(d) for d in result.diagnostics]
    lines = result.text.splitlines()
    codes_at = {n: lines[n].split()[-1] for n in switches(result.text)}
    begin = next(n for n, line in enumerate(lines) if re.search(r"\bF\d", line))
    before = [n for n, code in codes_at.items() if code in ("M10", "M12") and n < begin]
    assert {codes_at[n] for n in before[-2:]} == {"M10", "M12"} and not any(begin < n < begin + 5 for n in codes_at)
    for n in before[-2:]:
        for at in range(begin, begin + 5) if controller == "fanuc-30i" else (begin, begin + 4):
            text = "\n".join([*lines[:n], *lines[n + 1:at + 1], lines[n], *lines[at + 1:]]) + "\n"
            assert "verify.clamp" in verdict(result, text), (lines[n], lines[at])
            assert any("not clamped" in said for said in witnessed(result, text)), (lines[n], lines[at])
        release = lines[n].replace("M12", "M15").replace("M10", "M11")
        text = "\n".join([*lines[:begin + 1], release, lines[begin + 1], lines[n], *lines[begin + 2:]]) + "\n"
        assert "verify.clamp" in verdict(result, text) and witnessed(result, text)


SHARED = {"one pair": {"A": ClampCodes("M10", "M11"), "C": ClampCodes("M10", "M11")},
          "one release": {"A": ClampCodes("M10", "M11"), "C": ClampCodes("M12", "M11")},
          "one clamp": {"A": ClampCodes("M10", "M11"), "C": ClampCodes("M10", "M15")}}


def sharing(codes_by: dict[str, ClampCodes]) -> Machine:
    return replace(clamping(), clamps=tuple(codes_by.get(a, ClampCodes()) for a in clamping().axis_names))


@cache
def along_a_cone() -> Toolpath:
    """A cut in which C turns and A stands, before and behind it one on a plane, through which both stand."""
    turn, plane = [tilted(30.0, float(t)) for t in np.linspace(0.0, 4.0, 9)], tilted(40.0, -50.0)
    across = np.cross(plane, [0.0, 0.0, 1.0])
    side = ["RAPID", point(60 * plane, plane), "FEDRAT/MMPM,400", *(point(30 * plane + k * across, plane) for k in (0, 8)),
            "RAPID", point(60 * plane + 8 * across, plane)]
    return toolpath(*side, "RAPID", point(60 * turn[0], turn[0]), "FEDRAT/MMPM,400", *(point(30 * a, a) for a in turn),
                    "RAPID", point(60 * turn[-1], turn[-1]), *side)


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "output"), [("fanuc-30i", "axes"), ("haas-ngc", "tcp"), ("siemens-840d", "auto"),
                                                    ("heidenhain-tnc640", "auto"), ("linuxcnc", "auto"),
                                                    ("generic-iso", "auto")])
@pytest.mark.parametrize("name", SHARED)
def test_axes_that_share_a_code_are_freed_and_clamped_together(name: str, controller: str,
                                                               output: str) -> None:
    result = postproc.convert(along_a_cone(), sharing(SHARED[name]), controller, SETUP,
                              Options(output=output))
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and any(what.what == "clamps" for what in result.witness.compared)
    lines = result.text.splitlines()
    found = [lines[n].split()[-1] for n in switches(result.text)]
    closing, opening = ({getattr(one, key) for one in SHARED[name].values()} for key in ("clamp", "unclamp"))
    groups = [(is_open, sorted(group)) for is_open, group in groupby(found, key=opening.__contains__)]
    assert len(groups) >= 4 and groups[0][0]
    assert all(group == sorted(opening if is_open else closing) for is_open, group in groups), found
    places = switches(result.text)
    last = max(n for n in places if any(re.search(r"\bF\d", line) for line in lines[n:]))
    assert lines[last].split()[-1] in closing
    text = "\n".join(lines[:last] + lines[last + 1:]) + "\n"
    assert "verify.clamp" in verdict(result, text) and witnessed(result, text)  # the cut on the plane


@pytest.mark.parametrize("name", SHARED)
def test_axes_that_share_a_code_index_and_drill(name: str) -> None:
    for controller in ("fanuc-30i", "siemens-840d", "heidenhain-tnc640"):
        result = postproc.convert(indexed(), sharing(SHARED[name]), controller, SETUP, Options(output="auto"))
        assert result.ok, [str(d) for d in result.diagnostics]


def test_groups_of_axes_are_joined_by_codes_of_a_third() -> None:
    four = ClampCodes("M40", "M41"), ClampCodes("M50", "M51"), ClampCodes("M40", "M51"), ClampCodes("M60", "M61")
    machine = replace(clamping(), clamps=(ClampCodes(), *four))
    names = clamping().axis_names
    assert machine.clamp_groups == [names[1:4], names[4:]]


def test_an_operation_that_is_taken_up_states_its_clamps() -> None:
    setup = SETUP.model_copy(update={"output": SETUP.output.model_copy(update={"restart": True})})
    axis = tilted(40.0, 77.0)
    lines = ["UNITS/MM", *(line for k in (1, 2) for line in (
        f"TOOL PATH/OP{k},TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "RAPID",
        point(45 * axis, axis), "FEDRAT/MMPM,500", point(30 * axis, axis), "RAPID", point(45 * axis, axis), "END-OF-PATH"))]
    result = postproc.convert(toolpath(*lines, head=[]), clamping(), "fanuc-30i", setup,
                              Options(output="axes"))
    assert result.ok, [str(d) for d in result.diagnostics]
    for part in result.text.split("(OP")[1:]:
        assert re.search(r"M11\b", part) and part.index("M11") < part.index("A40.") < part.index("M10")


def test_clamps_take_the_time_that_the_machine_file_says() -> None:
    result, still = converted("fanuc-30i", "axes"), clamping()
    slow = replace(still, timing=replace(still.timing, clamp=2.0, unclamp=3.0))
    count = {c: len(re.findall(rf"(?m)^{c}$", result.text)) for c in ("M10", "M11", "M12", "M15")}
    times = [estimate_of(replace(result, machine=m)).seconds for m in (still, slow)]
    closing, opening = count["M10"] + count["M12"], count["M11"] + count["M15"]
    more = closing * (2.0 - still.timing.clamp) + opening * (3.0 - still.timing.unclamp)
    assert times[1] - times[0] == pytest.approx(more, rel=1e-6)


@pytest.mark.parametrize(("name", "closing", "opening"),
                         [("one pair", 1, 1), ("one release", 2, 1), ("one clamp", 1, 2)])
def test_plans_count_each_code_of_axes_that_share_one(name: str, closing: int, opening: int) -> None:
    """C alone turns: the codes of both axes are stated; without codes the machine clamps at once."""
    q = np.zeros((2, 5))
    q[1, clamping().axis_names.index("C")] = 1.0
    timing = replace(clamping().timing, clamp=2.0, unclamp=3.0)
    shared, still, own = (index_time._indexed(q[:1], q[1:], replace(m, timing=timing))[0, 0]
                          for m in (sharing(SHARED[name]), clamping(False), clamping()))
    assert (shared - own, still - own) == pytest.approx((2.0 * closing + 3.0 * opening - 5.0, 0.0))


# ---- machine files -----------------------------------------------------------------------------------------

def own(folder: Path, axis: str, *lines: str) -> Path:
    (folder / "own.toml").write_text("\n".join(['base = "mikron-ucp710"', f"[axes.{axis}]", *lines]) + "\n")
    return folder / "own.toml"


@pytest.mark.parametrize(("axis", "lines"), [("A", ['clamp = "M10"']), ("A", ['clamp = "M10"', 'unclamp = "M10"']),
                                              ("X", ['clamp = "M10"', 'unclamp = "M11"']), ("A", ['clamp = "G10"'])])
def test_keys_that_say_no_clamp_are_refused(axis: str, lines: list[str], tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as fault:
        machines.load(own(tmp_path, axis, *lines))
    assert all(d.lines for d in fault.value.diagnostics)
    right = machines.load(own(tmp_path, "A", 'clamp = "M10"', 'unclamp = "M11"'))
    assert right.clamp_codes == {"A": ClampCodes("M10", "M11")}


def test_a_code_with_another_meaning_at_the_control_is_refused() -> None:
    """M13 of a TNC starts spindle and coolant."""
    machine = clamping()
    clashing = replace(machine, clamps=tuple(ClampCodes("M12", "M13") if a == "C" else ClampCodes()
                                             for a in machine.axis_names))
    result = postproc.convert(indexed(), clashing, "heidenhain-tnc640", SETUP, Options(output="axes"))
    assert not result.ok and result.text == "" and "machine.clamp" in codes(result.diagnostics)
    assert postproc.convert(indexed(), clashing, "fanuc-30i", SETUP, Options(output="axes")).ok
