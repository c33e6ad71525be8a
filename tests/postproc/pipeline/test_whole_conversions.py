"""Whole conversions against the CL numbers, by the own executor and the own kinematics; cases that once went wrong."""

from __future__ import annotations

import re

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from tests.postproc.kit import (
    angle,
    body,
    convert,
    execute,
    good,
    goto,
    great_circle,
    sample,
    tilted,
    tool_poses,
    toolpath,
)

UP = [[0, 0, 1.0]]


def cut_poses(result: PostResult) -> tuple[np.ndarray, np.ndarray]:
    """(tip, axis) (K, 3) densely along everything that cuts."""
    steps = execute(result)
    poses = [p for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind != "rapid"]
    return np.concatenate([p[0] for p in poses]), np.concatenate([p[1] for p in poses])


@pytest.mark.parametrize(("file", "name", "controller"), [
    ("tool_axis_tour.apt", "mikron-ucp710", "linuxcnc"), ("tool_axis_tour.apt", "head-table", "generic-iso"),
    ("tool_axis_tour.apt", "fork-head-ab", "linuxcnc"), ("blade.cls", "trunnion-bc", "linuxcnc"),
    ("bicubic.cls", "mill-3axis", "generic-iso"), ("indexed_4axis.cls", "mill-4axis", "linuxcnc")])
def test_the_tool_goes_through_every_point_in_order(file: str, name: str, controller: str) -> None:
    """Each cut CL point is met to rounding, later than the one before it; nothing between is off the polyline."""
    result = sample(file, name, controller)
    path = result.toolpath
    tips, axes = cut_poses(result)
    want = np.flatnonzero((path.kind == 1) & (path.role == 0))
    at = 0
    for row in want.tolist():
        for size in (400, 20000):
            window = slice(at, at + size)
            off = np.linalg.norm(tips[window] - path.tip[row], axis=1) + 100 * angle(axes[window], path.axis[row][None])
            hit = np.flatnonzero(off < 0.02)
            if len(hit):
                break
        assert len(hit), f"CL line {path.line[row]}"
        at += int(hit[0])
    joined = np.flatnonzero((path.kind[1:] == 1) & (path.role[1:] == 0)) + 1
    p, d = path.tip[joined - 1], path.tip[joined] - path.tip[joined - 1]
    size = np.maximum((d**2).sum(axis=1), 1e-12)
    for chunk in np.array_split(tips[::211] if not len(path.arcs) and not path.cycles else tips[:0], 40):
        u = np.clip(np.einsum("kmi,mi->km", chunk[:, None] - p, d) / size, 0, 1)
        gap = np.linalg.norm(chunk[:, None] - p - u[..., None] * d, axis=2).min(axis=1, initial=np.inf)
        assert not len(chunk) or gap.max() < 0.0101


@pytest.mark.covering
@pytest.mark.parametrize(("name", "a", "b", "step"), [
    ("mikron-ucp710", (10, 0), (20, 140), 0.0), ("head-table", (10, 0), (20, 140), 0.0),
    ("mikron-ucp710", (10, 0), (20, 140), 0.05), ("fork-head-ab", (10, 0), (20, 140), 0.05),
    ("trunnion-bc", (10, 0), (60, 100), 0.0), ("fork-head-ab", (10, 0), (60, 100), 0.0),
    ("trunnion-bc", (0, 0), (60, 100), 0.0), ("head-table", (0, 0), (60, 100), 0.0),
    ("mikron-ucp710", (10, 30), (10, 210.01), 0.0), ("head-table", (10, 30), (10, 210.01), 0.0)])
def test_turns_on_the_spot(name: str, a: tuple[float, float], b: tuple[float, float], step: float) -> None:
    """However unevenly the turn is divided: the tip stays, the axis keeps to the great circle and arrives."""
    first, last, point = tilted(*a), tilted(*b), np.array([30, 10, 0.0])
    end = point + step * np.array([0, 1, 0])
    result = good(convert(toolpath("RAPID", *goto([point], [first]), *goto([end], [last])), name))
    tips, axes = cut_poses(result)
    assert np.linalg.norm(tips - point, axis=1).max() < 0.01 + step
    circle = great_circle(first, last, np.linspace(0, 1, 2001))
    assert max(angle(axis[None], circle).min() for axis in axes[::15]) < np.radians(0.05)
    assert angle(axes[-1], last) < 1e-5


@pytest.mark.parametrize("lines", [
    ["RAPID", *goto([[30, 10, 0]], UP), "RAPID", *goto([[30, 10, 0]], UP), *goto([[35, 10, 0]], [tilted(20, 140)])],
    ["RAPID", *goto([[30, 10, 0]], UP), *goto([[35, 10, 0], [35, 10, 0]], UP * 2), *goto([[35, 10, 0]], [tilted(20, 9)])],
    ["RAPID", *goto([[3, 1, 0]], UP), *goto([[5, 1, 0]], UP), "RAPID", *goto([[5, 1, 0]], UP), *goto([[5, 1, 5]], UP)],
], ids=["rapid twice", "feed twice before a turn", "rapid on the spot between cuts"])
def test_a_point_twice_is_one_point(lines: list[str]) -> None:
    result = good(convert(toolpath(*lines), "mikron-ucp710"))
    assert result.comparison.unbounded == 0 and result.comparison.tip_bound <= result.options.tolerance


@pytest.mark.parametrize("scale", [0.0, 0.01, 0.2, 1.0, 10.0])
def test_trembling_paths(scale: float) -> None:
    """Two hundred points of a random walk with steps of 0.004 mm times the scale, in three axes and in five."""
    rng = np.random.default_rng(1)
    tips = scale * np.cumsum(rng.normal(0, 0.004, (200, 3)), axis=0)
    axes = np.array([0.3, 0.1, 1]) + np.cumsum(rng.normal(0, 0.002, (200, 3)), axis=0)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    flat = good(convert(toolpath("RAPID", "GOTO/0,0,5", *goto(tips)), "mill-3axis"))
    assert flat.comparison.tip_bound <= flat.options.tolerance
    for name in ["mikron-ucp710"] if scale < 0.1 or scale > 1.0 else ["linuxcnc-xyzac-trt"]:
        turned = good(convert(toolpath("RAPID", *goto([[0, 0, 5]], axes[:1]), *goto(tips, axes)), name))
        assert turned.comparison.tip_bound <= turned.options.tolerance


def test_back_and_forth_on_one_line() -> None:
    x = [0, 10, 0, 10, 0.005, 0, 0.005, 0]
    result = good(convert(toolpath("RAPID", "GOTO/0,0,5", *(f"GOTO/{v},0,0" for v in x)), "mill-3axis"))
    assert [s.end[0] for s in execute(result) if s.kind == "feed"] == x


# ---- states around tool changes ----------------------------------------------------------------------------


def test_spindle_stands_at_every_tool_change() -> None:
    """Speeds stated at the place of a change turn the new tool; the own executor knows whether it turns."""
    path = toolpath("COOLNT/ON", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5", "SPINDL/RPM,2000,CLW", "LOADTL/2", "RAPID",
                    "GOTO/0,0,5", "GOTO/1,0,5", "LOADTL/3", "SPINDL/RPM,700,CLW", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5")
    spindle, changes, speeds = 0, [], []
    for block in good(convert(path, "mill-3axis")).text.splitlines():
        spindle = {"M3": 1, "M5": 0}.get((re.findall(r"M[35]\b", block) or [""])[0], spindle)
        speeds += re.findall(r"S(\d+)", block)
        if "M6" in block and not block.startswith("("):
            changes.append(spindle)
    assert changes == [0, 0, 0]
    assert speeds == ["1000", "2000", "700"], "a speed stated before the change waits for it; one stated behind it counts"


def test_spindle_and_coolant_go_on_with_the_next_tool() -> None:
    path = toolpath("COOLNT/ON", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5", "LOADTL/2", "RAPID", "GOTO/0,0,5",
                    "GOTO/1,0,5")
    blocks = body(good(convert(path, "mill-3axis")).text)
    at = blocks.index("T2 M6")
    assert blocks[at:at + 4] == ["T2 M6", "G43 H2", "S1000 M3", "M8"]


def test_spindle_on_turns_the_way_it_turned() -> None:
    path = toolpath("SPINDL/RPM,300,CCLW", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5", "SPINDL/OFF", "RAPID", "GOTO/2,0,5",
                    "SPINDL/ON", "GOTO/3,0,5")
    turns = re.findall(r"^S300 (M\d)$", good(convert(path, "mill-3axis")).text, re.MULTILINE)
    assert turns == ["M4", "M4"]


def test_a_hole_may_be_the_first_motion() -> None:
    path = toolpath("CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3", "GOTO/10,0,0", "GOTO/20,0,0")
    blocks = body(good(convert(path, "mill-3axis")).text)
    assert blocks[blocks.index("Z3"):][1:3] == ["G99 G81 X10 Y0 Z-12 R3 F100", "X20 Y0"]


def test_the_same_hole_twice_and_holes_on_steps() -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3", "GOTO/10,0,0", "GOTO/10,0,0",
                    "GOTO/20,0,15", "GOTO/30,0,0")
    result = good(convert(path, "mill-3axis"))
    feeds = [s.end for s in execute(result) if s.kind == "feed"]
    length = result.setup.tools["1"].gauge_length
    assert np.allclose(feeds, [[10, 0, length - 12], [10, 0, length - 12], [20, 0, length + 3], [30, 0, length - 12]])
    x_at_low = [s.points[(s.points[:, 2] < length + 17.9), 0] for s in execute(result) if s.kind == "rapid"]
    assert not any(((x > 10.01) & (x < 19.99)).any() for x in x_at_low), "up to the higher plane before it crosses"
