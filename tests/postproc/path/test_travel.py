"""Travel at points, in between and on the bulge of arcs; where it is exceeded nothing is written."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from postproc.cli.app import app
from postproc.cli.shared.causes import WITHOUT_MOVE
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from tests.postproc.kit import NX, circle, codes, convert, execute, goto, machine, sample, tilted, toolpath

HALF = ["TOOL PATH/A,TOOL,T", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW"]


def narrow(**travel: tuple[float, float]) -> machines.machine.Machine:
    """mill-3axis with other travel."""
    m = machine("mill-3axis")
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    for letter, (low, high) in travel.items():
        lower[m.axis_names.index(letter)], upper[m.axis_names.index(letter)] = low, high
    return replace(m, limits=replace(m.limits, lower=lower, upper=upper))


def on(m: machines.machine.Machine, *lines: str) -> PostResult:
    import postproc

    return postproc.convert(toolpath(*lines, head=NX), m, setup=SetupFile())


def half_circle(sense: int, upper: bool) -> list[str]:
    """From (10, 0) to (-10, 0) round the origin: over y = 10 or y = -10, written in NX's left-hand sense."""
    first, last = ("10,0,0", "-10,0,0") if (sense > 0) == upper else ("-10,0,0", "10,0,0")
    return ["RAPID", f"GOTO/{first.rsplit(',', 1)[0]},30,0,0,1", "FEDRAT/MMPM,600", f"GOTO/{first}",
            circle([0, 0, 0], [0, 0, -sense], 10), f"GOTO/{last}", "END-OF-PATH"]


@pytest.mark.covering
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("upper", [True, False])
def test_bulge_of_an_arc_counts(sense: int, upper: bool) -> None:
    """Ends at y = 0; the top of the half circle is at y = 10 or -10."""
    inside = on(narrow(Y=(-10.001, 10.001)), *half_circle(sense, upper))
    assert inside.ok, [str(d) for d in inside.diagnostics]
    low, high = inside.extents["Y"]
    assert (round(low, 9), round(high, 9)) == ((0, 10) if upper else (-10, 0))
    limit = (-500, 9.5) if upper else (-9.5, 500)
    outside = on(narrow(Y=limit), *half_circle(sense, upper))
    (d,) = [d for d in outside.diagnostics if d.code == "travel.exceeded"]
    assert not outside.text
    value = "10.0000" if upper else "-10.0000"
    assert f"axis Y goes to {value} mm" in d.message and "allowed" in d.message and "9.5000" in d.message
    assert d.lines[0] == 10, "the line of the arc's end"
    assert on(narrow(Y=(-500, 9.5) if not upper else (-9.5, 500)), *half_circle(sense, upper)).ok, "the other side is free"


@pytest.mark.parametrize(("plane", "letter"),
                         [([0, 1, 0], "X"), ([0, 1, 0], "Z"), ([1, 0, 0], "Y"), ([1, 0, 0], "Z")])
def test_bulge_in_the_upright_planes(plane: list[float], letter: str) -> None:
    """Full circles of radius 10 in ZX and YZ, begun at 45 degrees, so that each end of each axis is a bulge."""
    n = np.array(plane, dtype=float)
    side = np.cross(n, [0, 0, 1.0])
    start = 10 * (side - np.array([0, 0, 1])) / np.sqrt(2)
    lines = ["RAPID", *goto([start + np.array([0, 0, 60])], [[0, 0, 1]]), "FEDRAT/MMPM,600", *goto([start], [[0, 0, 1]]),
             circle([0, 0, 0], plane, 10, ",TIMES,1"), *goto([start]), "END-OF-PATH"]
    extents = on(narrow(), *lines).extents
    assert extents[letter][0] == pytest.approx(-10, abs=1e-3)
    if letter != "Z":
        assert extents[letter][1] == pytest.approx(10, abs=1e-3)
        result = on(narrow(**{letter: (-9.99, 500)}), *lines)
        assert codes(result.diagnostics) >= {"travel.exceeded"}


def test_limit_itself_is_allowed() -> None:
    assert on(narrow(X=(-10, 10)), *half_circle(1, True)).ok


def test_rapids_and_lines_and_linking_moves_count() -> None:
    cut = ["GOTO/0,0,5,0,0,1", "FEDRAT/MMPM,9", "GOTO/1,0,5"]
    for lines, what in ((["RAPID", *cut, "RAPID", "GOTO/501,0,5"], "axis X goes to 501.0000 mm, allowed -500.0000 to 500"),
                        (["RAPID", *cut, "GOTO/0,-402,5"], "axis Y goes to -402.0000 mm, allowed -400.0000 to 400"),
                        (["RAPID", *cut, "RAPID", "GOTO/0,0,401"], "axis Z goes to 401.0000 mm, allowed -300.0000 to 400")):
        result = on(machine("mill-3axis"), *lines, "END-OF-PATH")
        assert any(what in d.message and d.lines for d in result.diagnostics if d.code == "travel.exceeded"), what
        assert not result.text


def test_no_room_above_the_part_is_refused() -> None:
    """Cutting 10 mm below the end of Z: no linking move fits above it."""
    result = on(machine("mill-3axis"), "RAPID", "GOTO/0,0,390,0,0,1", "FEDRAT/MMPM,9", "GOTO/1,0,390",
                "END-OF-PATH")
    assert codes(result.diagnostics) & {"travel.exceeded", "link.blocked"} and not result.text


def test_a_cut_beyond_travel_is_named_before_the_links_to_it() -> None:
    """Lower links put no cut inside travel; the first approach was named, with the hint to lower it."""
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 950.0}}})
    result = convert(toolpath("RAPID", "GOTO/-900,0,60", "GOTO/-900,0,2", "GOTO/0,0,2"), "mill-3axis", setup=setup)
    found = [d for d in result.diagnostics if d.code == "travel.exceeded" and "axis X" in d.message]
    assert len(found) == 1 and "linking" not in found[0].message
    assert found[0].hint == "move the part in the set-up (part.origin)"


def test_tool_length_counts() -> None:
    """A gauge length of 120 lifts Z by 120."""
    path = toolpath("RAPID", "GOTO/0,0,5", "GOTO/1,0,5", "RAPID", "GOTO/1,0,250")
    for length, fits in ((149.99, True), (150.01, False)):
        setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": length}}})
        result = convert(path, "mill-3axis", setup=setup)
        assert result.ok == fits and ("travel.exceeded" in codes(result.diagnostics)) != fits


@pytest.mark.parametrize(("length", "advised"), [(None, False), (30.0, True)])
def test_a_shorter_tool_is_advised_where_the_tool_has_a_length(length: float | None, advised: bool) -> None:
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": length}} if length else {}})
    result = convert(toolpath("RAPID", "GOTO/0,0,390", "GOTO/1,0,390", "RAPID", "GOTO/1,0,420"), "mill-3axis", setup=setup)
    hints = [d.hint for d in result.diagnostics if d.code == "travel.exceeded"]
    assert hints and all(("shorter tool" in hint) == advised for hint in hints)


@pytest.mark.parametrize(("clearance", "advice"), [({"distance": 700.0}, "lower clearance.distance"),
                                                   ({"centre": (0, 0, 900)}, "put clearance.centre nearer to the part"),
                                                   ({}, "lower clearance.margin")])
def test_the_key_that_brings_links_down_is_the_one_in_force(clearance: dict[str, object], advice: str) -> None:
    setup = SetupFile.model_validate({"clearance": clearance, "tools": {"1": {"gauge_length": 250.0}}})
    result = convert(toolpath("RAPID", "GOTO/0,0,100", "GOTO/1,0,149"), "mill-3axis", setup=setup)
    hints = [d.hint for d in result.diagnostics if d.code == "travel.exceeded"]
    assert hints and all(advice in hint for hint in hints)
    assert all("move the part" not in WITHOUT_MOVE[hint] and advice in WITHOUT_MOVE[hint] for hint in hints)


def test_rotary_travel_in_degrees() -> None:
    """A head-table machine tilts to 110 degrees."""
    path = toolpath("RAPID", *goto([[0, 0, 50], [0, 0, 40]], [tilted(115, 0), tilted(115, 0)]))
    (d,) = [d for d in convert(path, "head-table").diagnostics if d.code == "travel.exceeded" and "axis B" in d.message]
    assert "allowed -30.0000 to 110.0000 degrees" in d.message and "axis B goes to 115.0000 degrees" in d.message


@pytest.mark.parametrize(("file", "name"), [("pocket.cls", "mill-3axis"), ("tool_axis_tour.apt", "mikron-ucp710"),
                                            ("five_faces.cls", "head-table"), ("indexed_4axis.cls", "mill-4axis")])
def test_extents_are_those_of_the_executed_text(file: str, name: str) -> None:
    """Every axis from the own executor, densely, home included."""
    result = sample(file, name)
    steps = execute(result)
    unit = np.where(np.array(result.machine.rotary), 180 / np.pi, 1.0)
    points = np.concatenate([result.machine.home[None] * unit, *(s.points for s in steps)])
    for j, letter in enumerate(result.machine.axis_names):
        low, high = result.extents[letter]
        assert low == pytest.approx(points[:, j].min(), abs=2e-3), letter
        assert high == pytest.approx(points[:, j].max(), abs=2e-3), letter


def test_nothing_is_written_and_an_old_file_stays(tmp_path: Path) -> None:
    source, old, new = tmp_path / "far.apt", tmp_path / "old.ngc", tmp_path / "sub" / "new.ngc"
    source.write_text("\n".join([*HALF, "RAPID", "GOTO/0,0,5,0,0,1", "RAPID", "GOTO/900,0,5", "END-OF-PATH", "FINI"]))
    old.write_bytes(b"%\r\nprecious\x00\n")
    for out in (old, new):
        got = CliRunner().invoke(app, ["convert", str(source), "-m", "mill-3axis", "-c", "linuxcnc", "-o", str(out)])
        assert got.exit_code == 1
        assert re.search(r"far\.apt:8: error \[travel\.exceeded\] axis X goes to 900\.0000 mm", got.stderr)
    assert old.read_bytes() == b"%\r\nprecious\x00\n"
    assert not new.exists() and sorted(p.name for p in tmp_path.iterdir()) == ["far.apt", "old.ngc"]
