"""Plans of joints on the road: rewinds between far points, several runs, preferences of the set-up, parallel machines."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.machine import Machine
from postproc.joints import search
from postproc.pipeline.result import PostResult
from postproc.setup.joints import Joints
from postproc.setup.model import SetupFile
from tests.postproc.joint_kit import DEG, machine, tilted
from tests.postproc.kit import goto, tool_setup, toolpath


def limited(name: str, letter: str, low: float, high: float) -> Machine:
    """A machine with other travel of a rotary axis, degrees."""
    m = machine(name)
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    j = m.axis_names.index(letter)
    lower[j], upper[j] = low * DEG, high * DEG
    return replace(m, limits=replace(m.limits, lower=lower, upper=upper))


def cone(turns: float, step: float, tilt: float = 25.0) -> list[str]:
    """One cut round a cone, points `step` degrees apart."""
    phi = np.arange(0, 360 * turns + 1e-9, step)
    tip = np.stack([30 * np.cos(phi * DEG), 30 * np.sin(phi * DEG), -phi / 90], axis=1)
    lines = goto(tip, tilted(tilt, phi))
    return ["RAPID", lines[0], "FEDRAT/MMPM,1000", *lines[1:]]


def run(lines: list[str], m: Machine, setup: SetupFile | None = None, **options: object) -> PostResult:
    result = postproc.convert(toolpath(*lines), m, setup=setup or tool_setup(),
                              options=postproc.Options(**options))
    assert result.ok, [str(d) for d in result.diagnostics]
    return result


@pytest.mark.parametrize("step", [5.0, 60.0, 72.0])
def test_a_rewind_may_stand_between_the_points_of_a_path(step: float) -> None:
    """C within +-190 degrees: the overlap of 20 degrees is passed between two points, so moves are cut there."""
    m = limited("mikron-ucp710", "C", -190, 190)
    m = replace(m, limits=replace(m.limits, lower=np.where(np.arange(5) == 3, 0.0, m.limits.lower)))
    result = run(cone(2.0, step), m)
    path = result.path
    assert len(path.rewinds) == 2
    c = path.q[:, 4] / DEG
    assert c.min() >= -190 - 1e-6 and c.max() <= 190 + 1e-6
    cutting = ~np.isnan(path.u)
    assert np.abs(np.diff(c))[cutting[1:]].max() < 30.0, "no whole turn in the cut"
    last = np.append(path.move[1:] != path.move[:-1], True)
    assert (path.u[last & cutting] == 1.0).all(), "every move comes to its end"
    inner = cutting[1:] & cutting[:-1] & (path.move[1:] == path.move[:-1])
    assert (np.diff(path.u)[inner] > -1e-12).all()


def test_the_winding_of_a_run_looks_ahead_to_the_next() -> None:
    """C within +-370: a run of 300 degrees, then one that goes on from there; the first begins low enough for both."""
    m = limited("mikron-ucp710", "C", -370, 370)
    first, second = cone(0.8, 4.0), cone(0.8, 4.0)
    result = run([*first, "GOHOME", *second], m)
    assert not len(result.path.rewinds)
    home = result.path.home
    c = result.path.q[:, 4] / DEG
    assert np.abs(np.diff(c)[~home[1:] & ~home[:-1]]).max() < 400
    assert c.min() >= -370 and c.max() <= 370


@pytest.mark.parametrize("side", ["positive", "negative"])
def test_the_set_up_chooses_the_side_of_the_tilt_axis(side: str) -> None:
    setup = tool_setup().model_copy(update={"joints": Joints.model_validate({"side": {"B": side}})})
    result = run(cone(0.5, 5.0), machine("trunnion-bc"), setup)
    cutting = ~np.isnan(result.path.u)
    b = result.path.q[cutting, 3]
    assert (b > 0.1).all() if side == "positive" else (b < -0.1).all()


def test_the_set_up_says_where_the_program_begins() -> None:
    setup = tool_setup().model_copy(update={"joints": Joints.model_validate({"start": {"C": 1080.0}})})
    result = run(cone(0.5, 5.0), machine("mikron-ucp710"), setup)
    cutting = ~np.isnan(result.path.u)
    assert np.abs(result.path.q[cutting, 4] / DEG - 1080).max() < 400
    wrong = tool_setup().model_copy(update={"joints": Joints.model_validate({"start": {"B": 0.0}})})
    refused = postproc.convert(toolpath(*cone(0.5, 5.0)), machine("mikron-ucp710"), setup=wrong)
    (d,) = [d for d in refused.diagnostics if d.code == "setup.joints"]
    assert "joints.start.B" in d.message and "A, C" in d.hint and not refused.text


def test_rewinds_with_the_feeds_of_a_plan() -> None:
    """A planned pass ends where the tool is drawn back; the program is read back as ever."""
    result = run(cone(2.5, 15.0), limited("mikron-ucp710", "C", -400, 400), feed="planned")
    assert len(result.path.rewinds) == 1


def test_an_axis_of_very_wide_travel_is_no_harder_than_one_of_few_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its windings are alike: what a rewind costs is looked at once for each difference. The cut leaves the travel of Z."""
    looked, rewind = list[tuple[int, int]](), search._rewind
    monkeypatch.setattr(search, "_rewind", lambda *given: looked.append(given[2:4]) or rewind(*given))
    t = np.linspace(0.0, 2.0 * np.pi, 9)
    sway = np.stack([0.12 * np.sin(t), 0.0 * t, np.sqrt(1.0 - (0.12 * np.sin(t)) ** 2)], axis=1)
    lines = goto(np.stack([15.0 * np.cos(t), 15.0 * np.sin(t), 0.0 * t], axis=1), sway)
    counts = []
    for degrees in (1200.0, 9000.0):
        m = machine("dmg-dmu-80-monoblock")
        wide = [np.where(np.arange(5) == m.axis_names.index("C"), sign * degrees * DEG, own)
                for sign, own in ((-1.0, m.limits.lower), (1.0, m.limits.upper))]
        m = replace(m, limits=replace(m.limits, lower=wide[0], upper=wide[1]))
        postproc.convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,900", *lines[1:]), m, setup=tool_setup())
        counts.append(len(looked))
        looked.clear()
    assert 0 < counts[1] == counts[0] < 400


def test_choices_are_reported() -> None:
    """A within -30 to 120: the other side cannot hold 45 degrees."""
    result = run(cone(0.5, 5.0, 45.0), machine("mikron-ucp710"))
    (d,) = [d for d in result.diagnostics if d.code == "joints.chosen"]
    assert "exceed axis travel" in d.message


NUTATED = """base = "{base}"
[kinematics.axes.B]
direction = [0.0, 0.7071067811865476, {z}0.7071067811865476]
[axes.B]
travel = [-180, 180]
[axes.C]
travel = [-720, 720]
"""


@pytest.mark.covering
@pytest.mark.parametrize(("base", "sign"), [("trunnion-bc", "-"), ("trunnion-bc", ""), ("head-table", "")])
@pytest.mark.parametrize("seed", range(3))
def test_nutating_axes_pass_the_direction_of_the_table(base: str, sign: str, seed: int,
                                                       tmp_path: Path) -> None:
    """With a nutating axis the table turns while the tool is tilted along a great circle: at the pole it
    stands where both sides of the path need it, not where it stood at the points before."""
    file = tmp_path / "nutated.toml"
    file.write_text(NUTATED.format(base=base, z=sign))
    rng = np.random.default_rng(seed)
    tilts, sides = rng.uniform(4, 40, 6), rng.uniform(0, 360, 6)
    axis = tilted(np.where(np.arange(12) % 2, 0.0, np.repeat(tilts, 2)), np.repeat(sides, 2))
    points = goto(rng.uniform(-40, 40, (12, 3)) * [1, 1, 0.1], axis)
    result = run(["RAPID", points[0], "FEDRAT/MMPM,1000", *points[1:]], machines.load(file))
    assert result.comparison is not None
    assert result.comparison.worst_tip < 0.01 and result.comparison.worst_axis < 0.05 * DEG
