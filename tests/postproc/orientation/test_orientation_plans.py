"""Plans of orientations: the dynamic program, what keeps its axis, the contact of the ball, the command line."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import toolpaths
from machines.machine import Machine, Timing
from postproc.base.options import Options
from postproc.cli.app import app
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.shortest_sequence import seconds, shortest
from postproc.reference.cutter import ball_radius
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, machine
from toolpaths.toolpath import Kind, Tool, Toolpath

BALL = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"]


def passes(count: int, head: list[str] | None = None, axis: str = "0,0,1", pitch: float = 1.0) -> Toolpath:
    """Level passes of 80 mm along x next to each other, rapids between."""
    lines = ["MULTAX"]
    for k in range(count):
        y = pitch * k
        lines += ["RAPID", f"GOTO/0,{y},5,{axis}", "RAPID", f"GOTO/0,{y},0,{axis}", f"GOTO/80,{y},0,{axis}", "RAPID",
                  f"GOTO/80,{y},5,{axis}"]
    text = "\n".join([*(head or BALL), *lines, "FINI"])
    path, found = toolpaths.read_bytes(text.encode(), file="passes.apt")
    assert not toolpaths.diagnostics.has_errors(found), found
    return path


def chosen(path: Toolpath, m: Machine, max_tilt: float = 60.0) -> OrientationChoice:
    choice, found = orient(path, m, SetupFile(), Options(max_tilt=max_tilt))
    assert choice is not None, found
    return choice


@cache
def flat() -> OrientationChoice:
    return chosen(passes(6), machine("mikron-ucp710"))


def test_rapids_with_the_old_axis_belong_to_the_pass_before() -> None:
    """A file that lifts off along the old axis before it turns: each pass has one axis and can be turned."""
    lines = ["MULTAX"]
    for tilt in (0.0, 20.0):
        s, c = np.sin(np.radians(tilt)), np.cos(np.radians(tilt))
        lines += ["RAPID", f"GOTO/0,0,60,0,{s:.9f},{c:.9f}", "RAPID", f"GOTO/0,0,0,0,{s:.9f},{c:.9f}",
                  f"GOTO/80,0,0,0,{s:.9f},{c:.9f}", "RAPID", f"GOTO/80,0,60,0,{s:.9f},{c:.9f}", "RAPID",
                  f"GOTO/0,0,60,0,{s:.9f},{c:.9f}"]
    path, _ = toolpaths.read_bytes("\n".join([*BALL, *lines, "FINI"]).encode(), file="two.apt")
    choice = chosen(path, machine("mikron-ucp710"))
    assert [one.own.one.fixed for one in choice.tried] == ["", ""]
    assert [one.own.one.rows for one in choice.tried] == [(0, 5), (5, 10)]


def test_shortest_is_that_of_all_choices() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        sizes = rng.integers(1, 4, 5)
        states = [rng.uniform(0, 1, k) for k in sizes]
        links = [rng.uniform(0, 1, (a, b)) for a, b in itertools.pairwise([1, *sizes, 1])]
        picked, total = shortest(states, links)
        every = [seconds(choice, states, links) for choice in itertools.product(*(range(k) for k in sizes))]
        assert total == min(every) == seconds(picked, states, links)


def test_auto_is_never_worse() -> None:
    plans = flat().plans
    assert plans["auto"].seconds <= min(plans[name].seconds for name in ("keep", "per-pass", "whole-part"))
    assert plans["whole-part"].seconds <= plans["keep"].seconds


def test_whole_part_pays_where_passes_are_many() -> None:
    """The paper's finding: turning between passes costs more time than it gains, one orientation for all gains."""
    few, many = flat(), chosen(passes(16), machine("mikron-ucp710"))
    assert many.plans["whole-part"].seconds < 0.97 * many.plans["keep"].seconds
    assert many.plans["auto"].seconds <= many.plans["whole-part"].seconds
    gains = [one.plans["keep"].seconds - one.plans["whole-part"].seconds for one in (few, many)]
    assert gains[1] > gains[0]


def test_the_ball_stays_where_it_is() -> None:
    """Every ball centre of the re-oriented path is that of the CL file; rapids too."""
    choice = flat()
    old, new = choice.work.toolpath, choice.toolpath("per-pass")
    assert np.abs(new.axis - old.axis).max() > 0.3
    np.testing.assert_allclose(new.tip + 8.0 * new.axis, old.tip + 8.0 * old.axis, atol=1e-12)
    assert bool((new.kind == old.kind).all()) and bool((new.line == old.line).all())


def test_arcs_move_with_the_ball() -> None:
    text = [*BALL, "MULTAX", "RAPID", "GOTO/10,0,5,0,0,1", "RAPID", "GOTO/10,0,0,0,0,1",
            "CIRCLE/0,0,0,0,0,1,10", "GOTO/0,10,0,0,0,1", "GOTO/-60,40,0,0,0,1", "RAPID", "GOTO/-60,40,5,0,0,1", "FINI"]
    path, found = toolpaths.read_bytes("\n".join(text).encode(), file="arc.apt")
    assert not toolpaths.diagnostics.has_errors(found), found
    choice = chosen(path, machine("mikron-ucp710"))
    new = choice.toolpath("per-pass")
    arc = int(np.flatnonzero(path.kind == Kind.ARC)[0])
    move = new.tip[arc] - path.tip[arc]
    assert np.linalg.norm(move) > 1.0
    np.testing.assert_allclose(new.arcs.center[0] - path.arcs.center[0], move, atol=1e-12)


def test_tilt_limit_and_travel_hold() -> None:
    choice = chosen(passes(2), machine("mikron-ucp710"), max_tilt=20.0)
    for plan in choice.plans.values():
        assert all(np.degrees(np.arccos(made.axis[2])) < 20.0 + 1e-6 and not made.refused for made in plan.picked)
    assert any("tilt 4" in str(why) or "tilt 5" in str(why) for tried in choice.tried for _, why, _ in tried.rejected)


def test_slow_clamps_keep_the_axis() -> None:
    """Indexing time decides: with clamps of ten seconds `auto` turns no more than it must."""
    m = machine("mikron-ucp710")
    slow = chosen(passes(3), replace(m, timing=Timing(0.0, 10.0, 10.0)))
    assert [made.axis.tolist() for made in slow.plans["auto"].picked] == [[0.0, 0.0, 1.0]] * 3


@pytest.mark.parametrize(("head", "why"), [
    (["UNITS/MM", "CUTTER/16", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"], "orient.cutter"),
    (["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"], "orient.cutter"),
    (["UNITS/MM", "CUTTER/16,2", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"], "")])
def test_cutters_that_are_no_known_ball(head: list[str], why: str) -> None:
    choice, found = orient(passes(2, head), machine("mikron-ucp710"), SetupFile())
    assert [d.code for d in found if d.code.startswith("orient")] == ([why] if why else [])
    assert (choice is None) == (why == "orient.cutter")
    if choice is not None:
        new, old = choice.toolpath("auto"), choice.work.toolpath
        assert np.array_equal(new.tip, old.tip) and np.array_equal(new.axis, old.axis)


def test_radius_of_cutters() -> None:
    assert ball_radius(Tool(1, diameter=16.0, corner_radius=8.0)) == 8.0
    assert ball_radius(Tool(1, diameter=16.0, corner_radius=1.0)) == 0.0
    assert ball_radius(Tool(1, diameter=16.0)) is None and ball_radius(None) is None
    assert ball_radius(Tool(1, shape="DRILL", diameter=8.0)) == 0.0


def test_drilling_and_turning_axes_are_fixed() -> None:
    turning = ["MULTAX", "RAPID", "GOTO/0,0,9,0,0,1", "GOTO/0,0,0,0,0,1", "GOTO/80,0,0,0,0.6,0.8"]
    holes = ["RAPID", "GOTO/0,0,30,0,0,1", "CYCLE/DRILL,DEPTH,9,MMPM,100,CLEAR,3", "GOTO/9,0,0", "GOTO/19,0,0", "CYCLE/OFF"]
    path, _ = toolpaths.read_bytes("\n".join([*BALL, *turning, *holes, "FINI"]).encode(), file="both.apt")
    fixed = [one.own.one.fixed for one in chosen(path, machine("mikron-ucp710")).tried]
    assert fixed[0] == "the tool axis turns within the pass" and fixed[1].startswith("drilling")


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """Three passes in a file."""
    rows = [row for y in range(3) for row in ("RAPID", f"GOTO/0,{y},5,0,0,1", "RAPID", f"GOTO/0,{y},0,0,0,1",
                                              f"GOTO/80,{y},0,0,0,1", "RAPID", f"GOTO/80,{y},5,0,0,1")]
    (tmp_path / "passes.apt").write_text("\n".join([*BALL, "MULTAX", *rows, "FINI"]))
    return tmp_path / "passes.apt"


def test_command_and_its_keys(part: Path) -> None:
    got = CliRunner().invoke(app, ["orient", str(part), "-m", "mikron-ucp710", "--json", "-"])
    assert got.exit_code == 0, got.stderr
    values = json.loads(got.stdout)
    assert values["machine"] == "mikron-ucp710" and len(values["passes"]) == 3
    assert {"pass", "orientation_deg", "time_s", "reference_time_s", "limiting_axis", "rejected"} <= set(values["passes"][0])
    assert values["passes"][0]["limiting_axis"] in ("X", "Y", "Z")
    assert set(values["passes"][0]["orientation_deg"]) == {"A", "C"}
    assert {"keep", "per_pass", "whole_part", "auto"} <= set(values["plans"])
    assert all(values["plans"][name]["time_s"] > 0.0 for name in ("keep", "per_pass", "whole_part", "auto"))


def test_converted_and_proved(tmp_path: Path, part: Path) -> None:
    """The re-oriented toolpath is what is written and read back; `verify` with the same choice agrees."""
    out = tmp_path / "p.ngc"
    common = ["-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", str(SAMPLES / "tools.setup.toml"), "--orient", "per-pass"]
    got = CliRunner().invoke(app, ["convert", str(part), *common, "-o", str(out)])
    assert got.exit_code == 0, got.stderr
    text = out.read_text()
    assert "orient per-pass" in text and "A45" in text.replace(".0000", "")
    got = CliRunner().invoke(app, ["verify", str(out), str(part), *common])
    assert got.exit_code == 0, got.stderr
    got = CliRunner().invoke(app, ["verify", str(out), str(part), *common[:-1], "keep"])
    assert got.exit_code == 1
