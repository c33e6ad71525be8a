"""Points of the page against the CL file, the axes in plain matrices, and the time of the estimate."""

from __future__ import annotations

import base64
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from postproc.cycle_time.conversion import estimate_of
from postproc.cycle_time.estimate import Estimate, scaled
from postproc.page.columns import unpacked
from postproc.page.points import columns
from postproc.page.run import Run, run_dict
from postproc.page.skeleton import chain, legs
from postproc.page.tools import tool_rows
from postproc.page.what_if import FACTORS, ORDERS, what_if
from postproc.pipeline.result import PostResult
from tests.postproc.kit import convert, good, machine, setup_of, toolpath
from tests.postproc.page.page_kit import small
from toolpaths.arrays import Floats
from toolpaths.diagnostics import error, info, warning


@cache
def arcs() -> tuple[PostResult, Estimate]:
    """A square with a half circle on a three-axis machine."""
    path = toolpath("GOTO/0,0,10", "GOTO/0,0,0", "CIRCLE/10,0,0,0,0,-1,10,0.03,0.5,10,0", "GOTO/20,0,0", "GOTO/20,30,0",
                    head=["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"])
    result = good(convert(path, "mill-3axis"))
    made = estimate_of(result)
    assert made is not None
    return result, made


def read(run: int = 0) -> dict[str, Floats]:
    points = small().values["runs"][run]["points"]
    return unpacked(base64.b64decode(points["data"]), points["columns"])


def test_every_commanded_position_is_drawn_in_the_part_frame() -> None:
    found = read()
    cuts = found["CL line"] >= 9
    assert set(found["tool"][cuts]) == {4.0}
    tips = np.stack([found[f"part {name}"] for name in "xyz"], axis=1)[cuts]
    for k in range(12):
        wanted = np.array([2.0 * k, k % 3, 10.0 + k % 2])
        assert np.linalg.norm(tips - wanted, axis=1).min() < 0.011, k


def test_arcs_have_places_between_that_lie_on_them() -> None:
    found = {one.name: one.values for one in columns(*arcs())}
    on = found["kind"] == 2
    assert on.sum() >= math.pi / 0.1
    off = np.hypot(found["part x"][on] - 10.0, found["part y"][on]) - 10.0
    assert np.abs(off).max() < 0.002


def test_times_add_up_to_that_of_the_estimate_and_rests_are_in_them() -> None:
    result, made = arcs()
    found = {one.name: one.values for one in columns(result, made)}
    lead = made.timed.pause[made.blocks.pauses.block < 0].sum()
    total = found["time step"].sum() / 1e3 - lead
    assert lead > 0.0 and found["time step"][0] == pytest.approx(1e3 * lead, abs=1.0)
    assert total == pytest.approx(made.timed.end[-1] - made.timed.begin[0], abs=2e-3)
    between = np.maximum(made.timed.begin[1:] - made.timed.end[:-1], 0.0).sum()
    assert found["rest"].sum() / 1e3 == pytest.approx(between, abs=1e-6) and between > 0.0


def test_feed_is_that_of_the_cl_file_and_is_not_passed_in_the_mean() -> None:
    found = {one.name: one.values for one in columns(*arcs())}
    cut = np.isfinite(found["feed programmed"]) & (found["kind"] > 0)
    assert set(found["feed programmed"][cut]) == {600.0}
    assert found["feed reached"][cut].max() < 600.0 * 1.02 and found["feed reached"][cut].max() > 300.0


def test_a_part_that_stands_elsewhere_is_drawn_in_its_own_frame() -> None:
    setup = setup_of('[part]\norigin = [40.0, -25.0, 12.0]\nx_axis = [0, 1, 0]\ny_axis = [-1, 0, 0]\n'
                     '[tools.1]\ngauge_length = 120.0\n')
    result = good(convert(toolpath("GOTO/0,0,10", "GOTO/7,0,0", "GOTO/7,9,0"), "mill-3axis", setup=setup))
    made = estimate_of(result)
    assert made is not None
    found = {one.name: one.values for one in columns(result, made)}
    cuts = np.flatnonzero(found["kind"] == 1)
    assert [found[f"part {name}"][cuts[-1]] for name in "xyz"] == pytest.approx([7.0, 9.0, 0.0], abs=0.002)
    assert found["X"][cuts[-1]] == pytest.approx(40.0 - 9.0, abs=0.002)


def _turn(direction: list[float], point: list[float], degrees: float) -> np.ndarray:
    """A turn about a line as a matrix (4, 4), by its exponential."""
    x, y, z = direction
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0.0]])
    a, made = math.radians(degrees), np.eye(4)
    made[:3, :3] += math.sin(a) * across + (1 - math.cos(a)) * across @ across
    made[:3, 3] = np.array(point) - made[:3, :3] @ np.array(point)
    return made


def test_the_chain_of_axes_carries_the_tool_to_the_drawn_tip() -> None:
    """As the page moves the machine: axes one after the other, from the part."""
    run, found = small().values["runs"][0], read()
    skeleton, length = run["skeleton"], 130.25
    for k in range(0, run["points"]["count"], 3):
        made = np.eye(4)
        made[:3, :3] = np.array(skeleton["table_from_part"]["rotation"]).T
        made[:3, 3] = -made[:3, :3] @ skeleton["table_from_part"]["origin"]
        for axis in skeleton["axes"]:
            value, step = float(found[axis["letter"]][k]), np.eye(4)
            step[:3, 3] = np.array(axis["direction"]) * value
            made = made @ (_turn(axis["direction"], axis["point"], value) if axis["turns"] else step)
        tip = made[:3, 3] - length * made[:3, :3] @ np.array(skeleton["tool_axis"])
        assert tip == pytest.approx([found[f"part {name}"][k] for name in "xyz"], abs=0.002)
    assert [axis["letter"] for axis in skeleton["axes"] if axis["carries_part"]] == ["C", "A"]


def test_legs_keep_their_lengths_on_a_table_that_turns() -> None:
    """Rods are rigid, and their ends seen from the table turn with it."""
    one = machine("h4a-c-table")
    job = replace(arcs()[0].job, machine=one)
    q = np.tile(one.home, (3, 1))
    q[1, 0] += 20.0
    q[:, 4] = [0.3, 1.2, -2.0]
    ends = legs(job, q)
    assert ends is not None
    length = np.linalg.norm(ends[..., :3] - ends[..., 3:6], axis=-1)
    assert np.ptp(length, axis=0).max() < 1e-6 and length.min() > 10.0
    straight = legs(job, np.tile(one.home, (1, 1)))
    assert straight is not None
    c, s = math.cos(0.3), math.sin(0.3)
    assert ends[0, :, 0] == pytest.approx(c * straight[0, :, 0] - s * straight[0, :, 1], abs=1e-6)


@pytest.mark.parametrize(("name", "turns"), [("rotary-delta", True), ("triaglide", False), ("hexapod", False)])
def test_legs_stand_on_their_drives(name: str, turns: bool) -> None:
    """The end of an arm is as far from its axis wherever it stands; a foot is on its rail, whose ends stay; a leg of
    changing length stands on its joint alone."""
    one = machine(name)
    job = replace(arcs()[0].job, machine=one)
    q = np.tile(one.home, (2, 1))
    q[1, :3] += 0.2 if turns else 15.0
    parts = legs(job, q)
    assert parts is not None
    foot, start, end = parts[..., :3], parts[..., 6:9], parts[..., 9:]
    length = np.linalg.norm(end - start, axis=-1)
    assert np.ptp(length, axis=0).max() < 1e-6 and np.ptp(start, axis=0).max() < 1e-6
    if turns:
        assert length.min() > 50.0 and np.abs(foot - end).max() < 1e-9 and np.abs(foot[1] - foot[0]).max() > 1.0
    elif name == "hexapod":
        assert length.max() == 0.0 and np.ptp(foot, axis=0).max() < 1e-6
    else:
        assert np.ptp(end, axis=0).max() < 1e-6 and length.min() > 100.0
        assert np.linalg.norm(foot - start, axis=-1) + np.linalg.norm(end - foot, axis=-1) == pytest.approx(length)


def test_what_if_times_are_those_of_a_machine_with_that_limit() -> None:
    _, made = arcs()
    found = what_if(made)
    assert found["counted"] and found["limits"]
    for one in found["limits"]:
        assert one["seconds"][FACTORS.index(1.0)] == made.seconds
        assert one["seconds"][0] > made.seconds - 1e-9
    blocks = scaled(made.blocks, "velocity", np.array([name == "X" for name in made.blocks.axes.letters]), 0.5)
    assert blocks.axes.velocity[0] == 0.5 * made.blocks.axes.velocity[0]
    assert all((getattr(blocks.axes, name)[1:] == getattr(made.blocks.axes, name)[1:]).all() for name in ORDERS)


def test_a_machine_of_axes_has_a_chain_and_no_legs() -> None:
    result, _ = arcs()
    assert result.job is not None and chain(result.machine, result.job) is not None
    assert legs(result.job, np.zeros((2, 3))) is None


def test_tools_have_the_length_of_their_arcs_and_all_times_add_up() -> None:
    """The half circle is 10 pi long, not its chord of 20; what tools take is the whole time, changes among it."""
    result, made = arcs()
    rows, found = tool_rows(result, made), {one.name: one.values for one in columns(result, made)}
    steps = np.linalg.norm(np.diff(np.stack([found[f"part {name}"] for name in "xyz"], axis=1), axis=0), axis=1)
    kind = found["kind"][1:]
    assert rows[0]["cutting_mm"] == pytest.approx(steps[kind == 1].sum() + 10.0 * math.pi, abs=1e-3)
    assert sum(row["time_s"] for row in rows) == pytest.approx(made.seconds, abs=1e-6)


def test_only_errors_are_collisions_and_notes_of_clear_paths_are_none() -> None:
    result = replace(arcs()[0], diagnostics=(info("collision.clear", ""), warning("collision.bound", ""),
                                             error("collision.touch", ""), error("reach.axis", "")))
    found = run_dict(Run(result, None, {}, "part.nc"))["collisions"]
    assert (found["errors"], found["warnings"]) == (1, 1)
