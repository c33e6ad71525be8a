"""Whole programs next to part, table and fixtures: what touches stops a conversion, and verify finds it in a text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import postproc
from postproc.collision import search
from postproc.collision.program import touching_parts
from postproc.pipeline.result import PostResult
from postproc.readback.execution.poses import BlockPoses
from tests.postproc.kit import machine, toolpath
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Toolpath

HEAD = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
TOOL = """
[tools.1]
gauge_length = 120.0
flute_length = 30.0
shank = [{diameter = 16.0, length = 20.0}]
holder = [{lower = 40.0, upper = 60.0, length = 20.0}, {diameter = 63.0, length = 50.0}]
"""


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> str:
    return f"box = {{low = {[*map(float, low)]}, high = {[*map(float, high)]}}}"


def block(folder: Path, top: float) -> str:
    """A part of 100 x 60 x 40 mm whose top is at z = `top`."""
    mesh = trimesh.creation.box(bounds=[(-10.0, -30.0, top - 40.0), (90.0, 30.0, top)])
    mesh.export(folder / "part.stl")
    return 'part = "part.stl"\n'


def setup_file(folder: Path, bodies: str, rest: str = TOOL) -> Path:
    path = folder / "s.toml"
    path.write_text(f"[bodies]\n{bodies}\n{rest}")
    return path


def line(*extra: str) -> Toolpath:
    """A cut along x on z = 0, from 0 to 80."""
    return toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "GOTO/0,0,0", "GOTO/80,0,0", "RAPID", "GOTO/80,0,50",
                    *extra, head=HEAD)


def converted(path: Toolpath, setup: Path, name: str = "mikron-ucp710",
              controller: str = "linuxcnc") -> PostResult:
    return postproc.convert(path, machine(name), controller=controller, setup=setup)


def collisions(found: tuple[Diagnostic, ...]) -> list[Diagnostic]:
    """What stands against a program, and what was not checked."""
    return [d for d in found if d.code.startswith("collision") and d.severity > 0]


@pytest.mark.parametrize(("top", "depth"), [(-0.001, 0.0), (0.005, 0.0), (0.05, 0.05), (0.4, 0.4)])
def test_a_gouge_is_found_beyond_its_tolerance(tmp_path: Path, top: float, depth: float) -> None:
    result = converted(line(), setup_file(tmp_path, block(tmp_path, top)))
    found = collisions(result.diagnostics)
    if not depth:
        assert result.ok and not found
        return
    assert [d.code for d in found] == ["collision.gouge"] and not result.text
    noted = float(found[0].message.split("cuts ")[1].split(" mm")[0])
    assert noted == pytest.approx(depth, abs=0.005) and "cutter of T1" in found[0].message and "the part" in found[0].message
    assert found[0].lines in ((10,), (11,))  # it comes down to the cut's beginning in line 10


def test_without_bodies_nothing_is_looked_at(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "nearest", None)
    setup = tmp_path / "s.toml"
    setup.write_text(TOOL)
    assert converted(line(), setup).ok


def fixture(low: tuple[float, float, float], high: tuple[float, float, float], frame: str = "table",
            name: str = "clamp") -> str:
    return f'clearance = 0.5\n[[bodies.fixtures]]\nname = "{name}"\nframe = "{frame}"\n{box(low, high)}\n'


def test_a_holder_that_comes_too_near_is_reported_with_the_gap(tmp_path: Path) -> None:
    """The holder begins 50 mm over the tip, with a radius of 20 mm; a wall to z = 60 stands at y = 20.3."""
    result = converted(line(), setup_file(tmp_path, fixture((0, 20.3, -40), (80, 40, 60.0)), TOOL.replace("60.0", "40.0")))
    found = collisions(result.diagnostics)
    assert [d.code for d in found] == ["collision.near"]
    assert found[0].message.startswith("holder of T1 comes within 0.30 mm of fixture clamp, allowed 0.50")


def test_a_fixture_stays_on_the_table_where_the_part_moves(tmp_path: Path) -> None:
    clamp = fixture((115, -10, 0), (130, 10, 70))
    assert converted(line(), setup_file(tmp_path, clamp)).ok
    moved = setup_file(tmp_path, clamp, "[part]\norigin = [60.0, 0.0, 10.0]\n" + TOOL)
    found = collisions(converted(line(), moved).diagnostics)
    assert {d.message.split(" ")[0] for d in found} == {"cutter", "shank", "holder"}
    with_part = setup_file(tmp_path, fixture((115, -10, 0), (130, 10, 70), "part"),
                           "[part]\norigin = [60.0, 0.0, 10.0]\n" + TOOL)
    assert converted(line(), with_part).ok


def test_a_thin_rib_in_the_middle_of_a_rapid_is_found(tmp_path: Path) -> None:
    path = line("RAPID", "GOTO/-80,0,50")
    assert converted(path, setup_file(tmp_path, fixture((20.0, -5, 0), (20.1, 5, 40)))).ok is False
    rib = setup_file(tmp_path, fixture((-33.0, -5, 0), (-32.9, 5, 50.7)))
    found = collisions(converted(path, rib).diagnostics)
    assert [d.code for d in found] == ["collision.touch"] and "cutter of T1 touches fixture clamp by" in found[0].message
    assert float(found[0].message.split(" by ")[1].split(" mm")[0]) == pytest.approx(0.7, abs=0.02)


def test_linking_moves_are_looked_at(tmp_path: Path) -> None:
    """Between a face from above and one at 90 degrees the tool goes round by the safe planes; a post stands there."""
    path = toolpath("MULTAX", "RAPID", "GOTO/0,0,5,0,0,1", "GOTO/0,0,0,0,0,1", "GOTO/20,0,0,0,0,1", "RAPID",
                    "GOTO/20,0,5,0,0,1", "RAPID", "GOTO/45,0,-20,1,0,0", "GOTO/40,0,-20,1,0,0", "GOTO/40,10,-20,1,0,0",
                    "RAPID", "GOTO/45,10,-20,1,0,0", head=HEAD)
    clear = fixture((-60, -60, -80), (-40, -40, -60))
    assert converted(path, setup_file(tmp_path, clear)).ok
    post = fixture((-10, -10, 58), (10, 10, 62))  # over the part, below the safe plane
    found = collisions(converted(path, setup_file(tmp_path, post)).diagnostics)
    assert found and found[0].message.startswith("cutter of T1 touches fixture clamp")


def test_a_tool_that_starts_inside_a_solid_is_found(tmp_path: Path) -> None:
    result = converted(line(), setup_file(tmp_path, fixture((-900, -900, -900), (900, 900, 900))))
    assert any("is inside fixture clamp" in d.message for d in collisions(result.diagnostics))


def test_drills_may_cut_what_they_make_and_nothing_else(tmp_path: Path) -> None:
    hole = ["CYCLE/DRILL,DEPTH,20,MMPM,100,CLEAR,3", "GOTO/0,0,0", "GOTO/40,0,0", "CYCLE/OFF", "RAPID", "GOTO/40,0,60"]
    path = toolpath("RAPID", "GOTO/0,0,50", *hole, head=["UNITS/MM", "CUTTER/6,0", *HEAD[2:]])
    tool = TOOL.replace("gauge", "tip_angle = 118.0\ngauge").replace("diameter = 16.0", "diameter = 6.0")
    assert converted(path, setup_file(tmp_path, block(tmp_path, 0.0), tool)).ok
    clamp = block(tmp_path, 0.0) + fixture((15, -5, 0), (25, 5, 8))
    found = collisions(converted(path, setup_file(tmp_path, clamp, tool)).diagnostics)
    assert [d.message.split(" by ")[0] for d in found] == ["cutter of T1 touches fixture clamp"]


def test_the_rapid_down_to_a_hole_is_no_drilling(tmp_path: Path) -> None:
    """Holes are said to begin on z = 0, the part's top is at 30: the drill comes down through it at rapid."""
    hole = ["CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,RTRCTO,50", "GOTO/0,0,0", "CYCLE/OFF", "RAPID", "GOTO/0,0,60"]
    path = toolpath("RAPID", "GOTO/0,0,50", *hole, head=["UNITS/MM", "CUTTER/6,0", *HEAD[2:]])
    tool = TOOL.replace("gauge", "tip_angle = 118.0\ngauge").replace("flute_length = 30.0",
                                                                     "flute_length = 70.0")
    found = collisions(converted(path, setup_file(tmp_path, block(tmp_path, 30.0), tool)).diagnostics)
    assert [d.code for d in found] == ["collision.gouge"]
    assert converted(path, setup_file(tmp_path, block(tmp_path, 2.5), tool)).ok


def test_a_flat_end_of_unknown_length_is_found_in_the_part(tmp_path: Path) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,-10", "GOTO/80,0,-10", "RAPID", "GOTO/80,0,50",
                    head=["UNITS/MM", "CUTTER/16,0", *HEAD[2:]])
    result = converted(path, setup_file(tmp_path, block(tmp_path, 0.0), "[tools.1]\ngauge_length = 120.0\n"))
    assert not result.ok and "collision.gouge" in {d.code for d in collisions(result.diagnostics)}


def test_a_barrel_is_kept_from_fixtures_and_not_compared_with_the_part(tmp_path: Path) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,-1", "GOTO/80,0,-1", "RAPID", "GOTO/80,0,50",
                    head=["UNITS/MM", "CUTTER/16,85,-77,85,0,0,50", *HEAD[2:]])
    result = converted(path, setup_file(tmp_path, block(tmp_path, 0.0)))
    assert result.ok and [d.code for d in collisions(result.diagnostics)] == ["collision.corner"]
    clear = next(d.message for d in result.diagnostics if d.code == "collision.clear")
    assert "cutter" not in clear and "shank keeps 1 mm from the part" in clear
    adjacent = setup_file(tmp_path, block(tmp_path, 0.0) + fixture((20, 7.5, -5), (30, 20, 10)))
    assert "collision.touch" in {d.code for d in collisions(converted(path, adjacent).diagnostics)}


@pytest.mark.parametrize(("x_axis", "y_axis"), [("[1, 0, 0]", "[0, 1, 0]"), ("[0, 1, 0]", "[-1, 0, 0]"),
                                                ("[-1, 0, 0]", "[0, -1, 0]")])
def test_the_part_is_where_it_is_placed_and_turned(tmp_path: Path, x_axis: str, y_axis: str) -> None:
    """A rib of the part, turned with the path, is met wherever it stands; a clamp on the table only where it stands."""
    rib = trimesh.creation.box(bounds=[(20.0, -5.0, -40.0), (20.5, 5.0, 0.4)])
    rib.export(tmp_path / "part.stl")
    rest = f"[part]\norigin = [10.0, 20.0, 30.0]\nx_axis = {x_axis}\ny_axis = {y_axis}\n" + TOOL
    found = collisions(converted(line(), setup_file(tmp_path, 'part = "part.stl"\n', rest)).diagnostics)
    noted = float(found[0].message.split("cuts ")[1].split(" mm")[0])
    assert [d.code for d in found] == ["collision.gouge"] and 0.38 < noted < 0.401
    clamp = fixture((60, 15, 20), (70, 25, 40))
    assert converted(line(), setup_file(tmp_path, clamp, rest)).ok == (x_axis != "[1, 0, 0]")


def test_the_first_way_from_home_is_looked_at(tmp_path: Path) -> None:
    """A plate stands over the first point of the file, out of the path of all that follows."""
    found = collisions(converted(line(), setup_file(tmp_path, fixture((-9, -9, 200), (9, 9, 202)))).diagnostics)
    assert found and found[0].code == "collision.touch" and found[0].lines[0] == 7
    assert "--orient auto avoids paths that touch" in found[0].hint


def test_verify_finds_what_a_program_touches(tmp_path: Path) -> None:
    """The set-up is reported of a clamp only after the program was made."""
    path = line()
    setup = setup_file(tmp_path, block(tmp_path, 0.0))
    result = converted(path, setup)
    assert result.ok
    program = tmp_path / "p.ngc"
    program.write_text(result.text)
    options = postproc.Options(setup=str(setup))
    assert postproc.verify(program, path, machine("mikron-ucp710"), options=options).ok
    setup_file(tmp_path, block(tmp_path, 0.0) + fixture((70, -5, 0), (90, 5, 12)))
    checked = postproc.verify(program, path, machine("mikron-ucp710"), options=options)
    found = collisions(checked.diagnostics)
    assert not checked.ok and found[0].code == "collision.touch" and found[0].file == str(program)
    block_at = program.read_text().splitlines()[found[0].lines[0] - 1]
    assert "X80" in block_at or "Z" in block_at


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "trunnion-bc", "fork-head-ab"])
def test_a_turning_axis_is_bounded_between_the_points(tmp_path: Path, name: str) -> None:
    """The tip stands still while the axis turns by 40 degrees: a wire is met only on the path."""
    tilted = (np.sin(np.radians(40.0)), 0.0, np.cos(np.radians(40.0)))
    path = toolpath("MULTAX", "RAPID", "GOTO/0,0,50,0,0,1", "GOTO/0,0,0,0,0,1",
                    f"GOTO/0,0.001,0,{tilted[0]:.9f},0,{tilted[2]:.9f}", head=HEAD)
    middle = 60.0 * np.array([np.sin(np.radians(20.0)), 0.0, np.cos(np.radians(20.0))])
    half = np.array([0.3, 60.0, 0.3])
    rest = "[part]\norigin = [0.0, 0.0, -60.0]\n" + TOOL
    wire = setup_file(tmp_path, fixture(tuple(middle - half), tuple(middle + half), "part"), rest)
    found = collisions(converted(path, wire, name).diagnostics)
    assert any("holder of T1 touches" in d.message for d in found), found


def test_a_setup_that_does_not_know_the_holder_says_what_is_not_checked(tmp_path: Path) -> None:
    bare = "[tools.1]\ngauge_length = 120.0\n"
    result = converted(line(), setup_file(tmp_path, block(tmp_path, 0.0), bare))
    found = collisions(result.diagnostics)
    assert result.ok and {d.code for d in found} == {"collision.unchecked"}
    assert "flute_length" in found[0].hint and "T1" in found[0].message


def test_what_was_compared_is_reported(tmp_path: Path) -> None:
    result = converted(line(), setup_file(tmp_path, block(tmp_path, 0.0) + fixture((115, -10, 0), (130, 10, 70))))
    noted = [d.message for d in result.diagnostics if d.code == "collision.clear"]
    both = "keeps 0.5 mm from the part, fixture clamp"
    assert noted == ["T1, everywhere on its path: cutter is at most 0.02 mm in the part; cutter keeps 0.5 mm from fixture "
                     f"clamp; shank {both}; holder {both}"]


def test_a_bad_mesh_stops_the_conversion(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_bytes(b"")
    result = converted(line(), setup_file(tmp_path, 'part = "part.stl"\n'))
    assert not result.ok and not result.text and [d.code for d in result.diagnostics if d.severity == 2] == ["mesh.empty"]


def test_dog_legs_are_followed(tmp_path: Path) -> None:
    """A rapid of 100 mm in x and 30 mm in y, all axes at their own speed: y is there first, next to the straight line."""
    path = toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/100,30,50", "GOTO/100,30,49", head=HEAD)
    corner = setup_file(tmp_path, fixture((28, 37, 45), (32, 40, 60)))
    corner.write_text(f"{corner.read_text()}\n[output]\nrapids_as_feed = true\n")
    result = converted(path, corner, "mill-3axis", "fanuc-30i")
    assert result.ok and "\nG1 X100. Y30." in result.text
    program = tmp_path / "p.nc"
    program.write_text(result.text.replace("\nG1 X100. Y30.", "\nG0 X100. Y30.").replace("\nZ49.", "\nG1 Z49."))
    options = postproc.Options(setup=str(corner))
    found = collisions(postproc.verify(program, path, machine("mill-3axis"), "fanuc-30i", options=options).diagnostics)
    assert found and found[0].message.startswith("cutter of T1 touches fixture clamp by ")


def test_two_cutters_under_one_number_are_distinguished(tmp_path: Path) -> None:
    """T1 with 16 mm, then T1 with 6 mm; a clamp that only the larger one would meet stands where the smaller one cuts."""
    lines = ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "GOTO/0,0,0", "RAPID", "GOTO/0,0,50", "CUTTER/6,3", "LOADTL/1",
             "RAPID", "GOTO/60,0,50", "RAPID", "GOTO/60,0,2", "GOTO/60,0,0", "GOTO/70,0,0", "RAPID", "GOTO/70,0,50"]
    tool = TOOL.replace("diameter = 16.0", "diameter = 6.0")
    near = fixture((55, 5, -5), (75, 9, 10))
    assert converted(toolpath(*lines, head=HEAD), setup_file(tmp_path, near, tool)).ok
    swapped = [line.replace("CUTTER/6,3", "CUTTER/16,8") for line in lines]
    assert not converted(toolpath(*swapped, head=HEAD), setup_file(tmp_path, near, tool)).ok
    under = fixture((-5, 5, -5), (5, 9, 10))
    found = collisions(converted(toolpath(*lines, head=HEAD), setup_file(tmp_path, under, tool)).diagnostics)
    assert found and found[0].message.startswith("cutter of T1 touches fixture clamp")


def test_the_worst_of_each_part_of_a_program(tmp_path: Path) -> None:
    """A rib across the cut that the holder just touches and the cutter goes through; away from it nothing is found."""
    result = converted(line(), setup_file(tmp_path, fixture((20, -5, -40), (60, 5, 51))))
    assert result.job is not None and result.comparison is not None and result.comparison.executed is not None
    motion, owner = result.comparison.executed[1], result.comparison.owner
    executed = BlockPoses(result.job.control, result.job.kinematics_of, result.job.register_lengths(), None)
    noted = {d.message.split(" touches ")[0]: float(d.message.split(" by ")[1].split(" mm")[0])
             for d in collisions(result.diagnostics)}
    worst = max(noted, key=lambda name: noted[name])
    assert len(noted) == 3 and worst != "holder of T1"
    home = owner >= len(result.job.moves)
    parts = touching_parts(motion, executed, result.job, owner, np.where(home, 1, 0))
    assert list(parts) == [0] and str(parts[0]).startswith(f"{worst} touches fixture clamp by ")
    assert -parts[0].distance == pytest.approx(noted[worst], abs=0.005)
