"""Bodies next to the choice of orientations: what the holder would touch decides, wherever the part stands."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import toolpaths
from postproc.base.options import Options
from postproc.orientation.passes.pass_bodies import PassBodies, pass_bodies
from postproc.orientation.passes.passes import work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.setup.model import load_setup
from tests.postproc.kit import SAMPLES, machine, toolpath
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Toolpath

HEAD = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"]
TOOL = """
[tools.1]
gauge_length = 120.0
flute_length = 20.0
shank = [{diameter = 12.0, length = 30.0}]
holder = [{diameter = 40.0, length = 70.0}]
"""
MACHINE = "mikron-ucp710"


def passes(count: int) -> Toolpath:
    """Level passes of 80 mm along x."""
    lines = ["MULTAX"]
    for k in range(count):
        lines += ["RAPID", f"GOTO/0,{k},5,0,0,1", "RAPID", f"GOTO/0,{k},0,0,0,1", f"GOTO/80,{k},0,0,0,1", "RAPID",
                  f"GOTO/80,{k},5,0,0,1"]
    return toolpath(*lines, head=HEAD)


def setup_file(folder: Path, bodies: str, rest: str = TOOL) -> Path:
    path = folder / "s.toml"
    path.write_text(f"[bodies]\n{bodies}\n{rest}" if bodies else rest)
    return path


def wall(low: np.ndarray, high: np.ndarray, frame: str = "part") -> str:
    low, high = low.round(3).tolist(), high.round(3).tolist()
    return f'[[bodies.fixtures]]\nname = "wall"\nframe = "{frame}"\nbox = {{low = {low}, high = {high}}}\n'


def chosen(path: Toolpath, file: Path) -> tuple[OrientationChoice, list[Diagnostic]]:
    setup, _ = load_setup(file)
    assert setup is not None
    choice, found = orient(path, machine(MACHINE), setup, Options(max_tilt=45.0, setup=str(file)), workers=1)
    assert choice is not None, [str(d) for d in found]
    return choice, found


def bodies_of(path: Toolpath, file: Path) -> PassBodies:
    setup, _ = load_setup(file)
    assert setup is not None
    work, _ = work_of(path, machine(MACHINE), setup, Options(setup=str(file)))
    assert work is not None
    bodies, found = pass_bodies(work, str(file))
    assert bodies is not None, found
    return bodies


def leaning(tilt: float, heading: float) -> np.ndarray:
    a, b = np.radians(tilt), np.radians(heading)
    return np.array([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)])


def test_a_wall_where_the_holder_would_be_decides(tmp_path: Path) -> None:
    path = passes(1)
    free, _ = chosen(path, setup_file(tmp_path, ""))
    best, own = free.tried[0].best, free.tried[0].own
    assert best is not own
    over = np.array([40.0, 0.0, 8.0]) + 92.0 * best.axis
    choice, _ = chosen(path, setup_file(tmp_path, wall(over - 4.0, over + 4.0)))
    one = choice.tried[0]
    assert not one.best.touching and abs(float(one.best.axis @ best.axis)) < 1.0 - 1e-6
    lost = [lost.why for lost in one.rejected if lost.kind == "touches"]
    assert lost and all("of T1 " in str(why) and "fixture wall" in str(why) and "(at line " in str(why) for why in lost)
    assert choice.plans["auto"].seconds >= free.plans["auto"].seconds - 1e-9


def test_an_own_axis_that_touches_is_reported_and_left(tmp_path: Path) -> None:
    over = np.array([40.0, 0.0, 100.0])
    choice, found = chosen(passes(1), setup_file(tmp_path, wall(over - 3.0, over + 3.0)))
    noted = [d for d in found if d.code == "orient.own_touches"]
    assert len(noted) == 1 and "holder of T1 touches fixture wall" in noted[0].message and "(at line " in noted[0].message
    assert all(not made.touching for made in choice.plans["auto"].picked)


def test_a_rib_between_two_points_of_a_pass_is_found(tmp_path: Path) -> None:
    """0.1 mm thick, half path along 80 mm of cut that has no point there."""
    rib = setup_file(tmp_path, wall(np.array([40.0, 15.0, 45.0]), np.array([40.1, 30.0, 60.0])))
    bodies = bodies_of(passes(1), rib)
    assert "holder of T1 touches fixture wall by" in str(bodies.touching(bodies.work.passes[0], leaning(0.0, 0.0)))
    clear = setup_file(tmp_path, wall(np.array([40.0, 22.0, 45.0]), np.array([40.1, 30.0, 60.0])))
    assert bodies_of(passes(1), clear).touching(bodies.work.passes[0], leaning(0.0, 0.0)) is None


def test_a_ball_that_is_turned_cuts_no_deeper(tmp_path: Path) -> None:
    """Its centre stays; what changes is the side above it, which a wall next to the cut meets."""
    mesh = trimesh.util.concatenate([trimesh.creation.box(bounds=[(-20, -20, -30), (100, 60, 0)]),
                                     trimesh.creation.box(bounds=[(-20, 8.0, -10), (100, 60, 40)])])
    mesh.export(tmp_path / "part.ply")
    bodies = bodies_of(passes(1), setup_file(tmp_path, 'part = "part.ply"\ngouge = 0.01\nclearance = 0.3'))
    one = bodies.work.passes[0]
    assert bodies.touching(one, leaning(0.0, 0.0)) is None  # the side lies on the wall
    assert bodies.touching(one, leaning(10.0, -90.0)) is None
    assert "cutter of T1 cuts" in str(bodies.touching(one, leaning(5.0, 90.0)))


def test_the_way_down_to_a_turned_pass_is_looked_at(tmp_path: Path) -> None:
    """A lid over the end of the pass, above everything that is cut."""
    axis = leaning(40.0, 0.0)
    over = np.array([80.0, 0.0, 8.0]) + 130.0 * axis  # behind the holder while it cuts
    lid = setup_file(tmp_path, wall(over - 4.0, over + 4.0))
    bodies = bodies_of(passes(1), lid)
    one = bodies.work.passes[0]
    assert "holder of T1 touches fixture wall" in str(bodies.touching(one, axis))
    assert bodies.touching(one, leaning(0.0, 0.0)) is None


PLACES = ["[part]\norigin = [12.0, -7.0, 20.0]\n", "[part]\nx_axis = [0.0, 1.0, 0.0]\ny_axis = [-1.0, 0.0, 0.0]\n",
          "[part]\norigin = [3.0, 4.0, 5.0]\nx_axis = [0.6, 0.8, 0.0]\ny_axis = [-0.8, 0.6, 0.0]\n"]


@pytest.mark.parametrize("place", PLACES)
def test_where_the_part_stands_changes_nothing_for_what_moves_with_it(tmp_path: Path, place: str) -> None:
    trimesh.creation.icosphere(3, radius=20.0).apply_translation((40.0, 30.0, 20.0)).export(tmp_path / "part.stl")
    given = 'part = "part.stl"\n' + wall(np.array([20.0, -60.0, 20.0]), np.array([30.0, -45.0, 70.0]))
    here = bodies_of(passes(2), setup_file(tmp_path, given))
    there = bodies_of(passes(2), setup_file(tmp_path, given, place + TOOL))
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(12):
        axis = leaning(rng.uniform(5.0, 60.0), rng.uniform(0.0, 360.0))
        pair = [bodies.touches(bodies.work.passes[1], axis_there) for bodies, axis_there in (
            (here, axis), (there, there.work.placement.directions(axis[None])[0]))]
        assert [(t.part, t.body.name) for t in pair[0]] == [(t.part, t.body.name) for t in pair[1]]
        for a, b in zip(*pair, strict=True):
            assert a.distance == pytest.approx(b.distance, abs=0.002 + 0.02 * (a.limit - a.distance))
            seen += 1
    assert seen > 5


def test_fixtures_of_the_table_stay_where_the_part_goes(tmp_path: Path) -> None:
    given = wall(np.array([90.0, -10.0, 0.0]), np.array([110.0, 10.0, 100.0]), "table")
    axis = leaning(30.0, 0.0)
    near = bodies_of(passes(1), setup_file(tmp_path, given))
    away = bodies_of(passes(1), setup_file(tmp_path, given, "[part]\norigin = [-90.0, 0.0, 0.0]\n" + TOOL))
    assert near.touching(near.work.passes[0], axis) and not away.touching(away.work.passes[0], axis)


def test_the_sample_is_clear_as_it_is_and_not_with_a_longer_holder(tmp_path: Path) -> None:
    file = SAMPLES / "bodies" / "test_part.setup.toml"
    path, _ = toolpaths.read(SAMPLES / "test_part.cls")
    bodies = bodies_of(path, file)
    assert all(bodies.touching(one, one.axis) is None for one in bodies.work.passes[::3])
    thick = {index: replace(form, pieces=form.pieces * [3.0, 0.1, 3.0, 0.1, 1.0]) for index, form in bodies.forms.items()}
    assert PassBodies(bodies.work, bodies.bodies, thick).touching(bodies.work.passes[0],
                                                                  bodies.work.passes[0].axis)


def test_the_samples_are_what_their_script_writes(tmp_path: Path) -> None:
    script = SAMPLES / "make_bodies.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, cwd=SAMPLES)
    kept = sorted((SAMPLES / "bodies").iterdir())
    assert [file.name for file in kept] == sorted(file.name for file in tmp_path.iterdir())
    assert all(file.read_bytes() == (tmp_path / file.name).read_bytes() for file in kept)


def test_a_drill_may_be_in_the_hole_that_it_makes(tmp_path: Path) -> None:
    """Its pass is fixed; the part's mesh has no hole. A clamp next to the hole is met all the same."""
    trimesh.creation.box(bounds=[(-20, -20, -40), (60, 20, 0)]).export(tmp_path / "part.stl")
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,15,MMPM,100,CLEAR,3", "GOTO/0,0,0", "GOTO/40,0,0",
                    "CYCLE/OFF", "RAPID", "GOTO/40,0,60", head=["UNITS/MM", "CUTTER/6,0", *HEAD[2:]])
    part = 'part = "part.stl"\nclearance = 0.5\n'
    drill = TOOL.replace("diameter = 12.0", "diameter = 6.0")
    free = bodies_of(path, setup_file(tmp_path, part, drill))
    assert [free.touching(one, one.axis) for one in free.work.passes] == [None] * len(free.work.passes)
    clamp = wall(np.array([18.0, -5.0, 0.0]), np.array([22.0, 5.0, 8.0]))
    met = bodies_of(path, setup_file(tmp_path, part + clamp, drill))
    assert any("cutter of T1 touches fixture wall" in str(met.touching(one, one.axis)) for one in met.work.passes)


def test_a_pass_whose_axis_turns_is_bounded_on_the_way(tmp_path: Path) -> None:
    """The tip stands, the axis leans from -30 to 30 degrees: a wire over it is met by the holder half path."""
    a, b = leaning(30.0, 180.0), leaning(30.0, 0.0)
    lines = ["MULTAX", "RAPID", f"GOTO/0,0,0,{a[0]:.9f},0,{a[2]:.9f}", f"GOTO/0,0.001,0,{b[0]:.9f},0,{b[2]:.9f}"]
    wire = setup_file(tmp_path, wall(np.array([-0.2, -60.0, 119.5]), np.array([0.2, 60.0, 119.9])))
    bodies = bodies_of(toolpath(*lines, head=HEAD), wire)
    one = bodies.work.passes[0]
    assert one.fixed and "holder of T1 touches fixture wall" in str(bodies.touching(one, one.axis))
