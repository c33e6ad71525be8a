"""Linking moves of written programs: the tool, a half line from its tip, keeps off everything that is cut."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import postproc
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.kit import (
    Step,
    angle,
    codes,
    convert,
    execute,
    good,
    goto,
    sample,
    setup_of,
    tilted,
    tool_poses,
    tool_setup,
    toolpath,
)
from toolpaths.diagnostics import Severity

MACHINES = ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab"]
SLACK = 0.02


def two_faces(rng: np.random.Generator, tool_change: bool = False) -> list[str]:
    """A cut of 10 mm on one face of a block of 80 mm, then, after a turning rapid, one on another."""
    lines = []
    for k in range(2):
        axis = tilted(rng.uniform(0, 88), rng.uniform(0, 360))
        top = 40 * axis + np.cross(axis, rng.normal(0, 12, 3))
        along = np.cross(axis, [0.3, 0.5, 0.8])
        along /= np.linalg.norm(along)
        lines += ["LOADTL/2"] if k and tool_change else []
        lines += ["RAPID", *goto([top + 20 * axis], [axis]), *goto([top, top + 10 * along, top + 25 * axis], [axis] * 3)]
    return lines


def cut_points(result: PostResult) -> np.ndarray:
    """Tips at the ends of cutting moves, their starts too, from the CL arrays."""
    path = result.toolpath
    cut = path.kind != 0
    return path.tip[cut | np.append(cut[1:], False)]


def check(result: PostResult) -> int:
    """Every sample of every linking step is clear, or on the half line over the pose that it leaves or comes to."""
    points = cut_points(result)
    low, high = points.min(axis=0), points.max(axis=0)
    centre = 0.5 * (low + high)
    radius = np.linalg.norm(points - centre, axis=1).max()
    path = result.toolpath
    tip_cl, axis_cl = path.tip, path.axis
    depth = np.array([path.cycles[c].depth if c >= 0 else 0.0 for c in path.cycle])
    steps = execute(result)
    seen = 0
    for step, (tip, axis) in zip(steps, tool_poses(result, steps), strict=True):
        if step.kind != "rapid":
            continue
        height = np.einsum("ni,ni->n", tip - centre, axis)
        above = height >= ((points - centre) @ axis.T).max(axis=0) - SLACK
        nearest = np.sqrt(np.maximum(((tip - centre) ** 2).sum(axis=1) - np.minimum(height, 0) ** 2, 0))
        offset = tip[:, None] - tip_cl
        up = np.einsum("nmi,mi->nm", offset, axis_cl)
        on_line = (np.linalg.norm(offset - up[..., None] * axis_cl, axis=2) < SLACK) & (up > -depth - SLACK)
        on_line &= angle(axis[:, None], axis_cl[None]) < 1e-3
        ordinary = _between_cl_points(tip, tip_cl)
        assert (above | (nearest >= radius - SLACK) | on_line.any(axis=1) | ordinary).all(), step
        seen += len(tip)
    return seen


def _between_cl_points(tip: np.ndarray, cl: np.ndarray) -> np.ndarray:
    """True (N,) on a straight path between two successive CL points."""
    result = np.zeros(len(tip), dtype=bool)
    for p, q in pairwise(cl):
        d = q - p
        u = np.clip((tip - p) @ d / max(d @ d, 1e-12), 0, 1)
        result |= np.linalg.norm(tip - p - u[:, None] * d, axis=1) < SLACK
    return result


@pytest.mark.covering
@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("tool_change", [False, True])
def test_random_pairs_of_faces(name: str, tool_change: bool) -> None:
    rng, done = np.random.default_rng(17), 0
    for _ in range(6):
        result = convert(toolpath(*two_faces(rng, tool_change)), name)
        if not result.ok:
            assert codes(d for d in result.diagnostics if d.severity == 2) <= {"travel.exceeded", "link.blocked"}
            continue
        assert check(result) > 50
        done += 1
    assert done >= 3


@pytest.mark.covering(count=2)
@pytest.mark.parametrize(("file", "name"), [("five_faces.cls", "mikron-ucp710"), ("five_tilted.cls", "head-table"),
                                            ("five_faces.cls", "fork-head-ab"), ("indexed_4axis.cls", "mill-4axis")])
def test_links_of_the_samples(file: str, name: str) -> None:
    """Drilling included: the legs of holes run on the lines over their points."""
    assert check(sample(file, name)) > 100


def linked(result: PostResult) -> list[list[Step]]:
    """The rapid steps between two cuts."""
    groups: list[list[Step]] = [[]]
    for step in execute(result):
        if step.kind == "rapid":
            groups[-1].append(step)
        elif groups[-1]:
            groups.append([])
    return groups


def test_leaves_and_comes_along_the_tool_axis() -> None:
    a, b = tilted(70, 10), tilted(60, 130)
    path = toolpath("RAPID", *goto([45 * a], [a]), *goto([40 * a], [a]), "RAPID", *goto([45 * b], [b]),
                    *goto([40 * b], [b]))
    for name in MACHINES:
        result = good(convert(path, name))
        steps = execute(result)
        poses = tool_poses(result, steps)
        cuts = [i for i, s in enumerate(steps) if s.kind != "rapid"]
        tip, axis = poses[cuts[0] + 1]
        assert angle(axis, a[None]).max() < 1e-4, "the axis stands while it leaves"
        assert np.linalg.norm(tip - (tip @ a)[:, None] * a, axis=1).max() < SLACK
        assert tip[-1] @ a > 40 + 25
        tip, axis = poses[cuts[1] - 1]
        assert angle(axis, b[None]).max() < 1e-4
        assert np.linalg.norm(tip - (tip @ b)[:, None] * b, axis=1).max() < SLACK


def test_distance_of_the_setup_is_where_the_tool_leaves_to() -> None:
    """distance 100 from the stated centre: every retract ends at least that high along its axis, and `verify` misses what a
    greater one would ask for."""
    setup = SetupFile.model_validate({"clearance": {"centre": (0, 0, 0), "distance": 100.0},
                                      "tools": tool_setup().model_dump()["tools"]})
    a, b = tilted(70, 10), tilted(60, 130)
    path = toolpath("RAPID", *goto([45 * a], [a]), *goto([40 * a], [a]), "RAPID", *goto([45 * b], [b]),
                    *goto([40 * b], [b]))
    for name in MACHINES:
        result = good(convert(path, name, setup=setup))
        steps = execute(result)
        poses = tool_poses(result, steps)
        for i in [i for i, s in enumerate(steps) if s.kind != "rapid"]:
            axis = poses[i][1][-1]
            level = [tip[-1] @ axis for tip, ax in poses[i + 1:i + 3] if angle(ax[-1:], axis[None])[0] < 1e-4]
            assert max(level) > 99.9
        assert not found_under(result, distance=100.0) and not found_under(result, distance=None, margin=50.0)
        for asked in ({"distance": 125.0}, {"distance": None, "margin": 1250.0}):  # of a margin a tenth at least
            assert found_under(result, **asked) == {"verify.safe_plane"}
        assert result.job is not None
        high = replace(result.job.space, centres=result.job.space.centres + np.array([0.0, 0.0, 500.0]))
        low, = read_back(result.text, replace(result.job, space=high), "test.apt", gcode="p.nc")[1]
        assert "below the top of the part" in low.message and low.hint == "let it rise there first", "no distance is offered"


def found_under(result: PostResult, **clearance: float | None) -> set[str]:
    """What `verify` says of a program under a set-up with other safe distances."""
    assert result.job is not None
    setup = result.setup.model_copy(update={"clearance": result.setup.clearance.model_copy(update=clearance)})
    return codes(read_back(result.text, replace(result.job, setup=setup), "test.apt", gcode="p.nc")[1])


def test_tool_is_changed_at_home_only() -> None:
    for file, name in (("five_faces.cls", "mikron-ucp710"), ("pocket.cls", "mill-3axis"),
                       ("five_tilted.cls", "head-table")):
        result = sample(file, name)
        z = result.machine.axis_names.index("Z")
        steps = execute(result)
        changes = [(a, b) for a, b in pairwise(steps) if a.tool != b.tool]
        assert len(changes) == len([n for n in result.text.splitlines() if n.endswith("M6")])
        for before, _ in changes:
            assert before.end[z] == result.machine.home[z]


def test_a_home_inside_the_part_is_named(tmp_path: Path) -> None:
    """Of a machine without an axis that draws the tool back, whose links would go to it through what is cut."""
    slides = "".join(f"[axes.{letter}]\nhome = 1112.43\n" for letter in "XYZ")
    (tmp_path / "low.toml").write_text(f'base = "delta-parallel-z"\n{slides}')
    path = toolpath("LOADTL/1", "SPINDL/RPM,800,CLW", "RAPID", "GOTO/-60,0,65", "FEDRAT/MMPM,900", "GOTO/60,0,-10")
    setup = setup_of("[part]\norigin = [0, 0, -100]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 10\n")
    result = postproc.convert(path, tmp_path / "low.toml", setup=setup)
    assert [d.code for d in result.diagnostics if d.severity is Severity.ERROR] == ["link.home"]
