"""The paper's part of the choice of orientations: vertices, choice within travel, gain from the planned time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from machines.machine import Machine
from machines.polytope import box_vertices, held_axis_polytope
from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import turned
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.vertices import TwoAxisTable, closed_form, numeric, rotation, table_of, vertex_angles
from postproc.orientation.figures import polytopes
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, work_of
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, machine
from toolpaths.arrays import Floats
from toolpaths.units import DEG


def sorted_rows(angles: Floats) -> Floats:
    """Degrees in a fixed order."""
    rows = np.round(angles / DEG, 6)
    return rows[np.lexsort(rows.T[::-1])]


def jerk_only(m: Machine, jerk: float = 5000.0) -> Machine:
    """The machine with no limits but a jerk of the linear axes."""
    linear = ~np.array(m.rotary)
    free = np.full(len(linear), 1e9)
    return replace(m, limits=replace(m.limits, velocity=free, acceleration=free, jerk=np.where(linear, jerk, 1e12)))


def part_passes(name: str = "mikron-ucp710") -> tuple[Machine, dict[int, Pass]]:
    """The passes of the paper's part by their plane Xp, under jerk alone."""
    import toolpaths

    m = jerk_only(machine(name))
    path, _ = toolpaths.read(SAMPLES / "test_part.cls")
    work, found = work_of(path, m, SetupFile(), Options())
    assert work is not None, found
    return m, {round(float(one.tip[1, 0])): one for one in work.passes}




def mikron() -> TwoAxisTable:
    """The table C on A of the paper."""
    table = table_of(machine("mikron-ucp710").kinematics, np.zeros(5))
    assert table is not None
    return table


def test_printed_solutions() -> None:
    """f = (-1, 0, 0), equal limits: A of +-45 degrees, C of +-54.736 and +-125.264 (acceptance figure 13)."""
    found = closed_form(mikron(), np.array([-1.0, 0.0, 0.0]), np.full(3, 5000.0)) / DEG
    assert len(found) == 16
    small = found[np.abs(found[:, 0]) < 90.0]
    np.testing.assert_allclose(np.unique(np.round(small[:, 0], 6)), [-45.0, 45.0], atol=1e-9)
    np.testing.assert_allclose(np.unique(np.round(small[:, 1], 3)), [-125.264, -54.736, 54.736, 125.264])


@pytest.mark.parametrize("direction", [(-1.0, 0.0, 0.0), (0.3, 0.8, 0.2), (0.1, -0.5, 0.6)])
def test_newton_finds_the_closed_form(direction: tuple[float, float, float]) -> None:
    kin, f = machine("mikron-ucp710").kinematics, np.array(direction) / np.linalg.norm(direction)
    limit = np.array([5000.0, 4000.0, 6000.0, 1.0, 1.0])
    np.testing.assert_allclose(sorted_rows(numeric(kin, np.zeros(5), f, limit)),
                               sorted_rows(closed_form(mikron(), f, limit[:3])), atol=1e-5)


def test_every_solution_turns_a_vertex_into_the_direction() -> None:
    """Equation 7 of the paper: f along J v with J = Rz(C) Rx(A), two solutions of each vertex that f rises
    less than it can be turned to, and the reach there is the vertex."""
    rng, kin = np.random.default_rng(9), machine("mikron-ucp710").kinematics
    limit = np.array([5000.0, 4000.0, 6000.0])
    size = float(np.linalg.norm(limit))
    for f in rng.normal(size=(50, 3)):
        f /= np.linalg.norm(f)
        angles = closed_form(mikron(), f, limit)
        assert len(angles) == (16 if abs(f[2]) < np.hypot(*limit[1:]) / size else 0)
        for a, c in angles:
            turned = rotation(np.eye(3)[2], c) @ rotation(np.eye(3)[0], a) @ box_vertices(limit / size).T
            assert np.abs(turned - f[:, None]).max(axis=0).min() < 1e-9
            reach = held_axis_polytope(kin, np.array([[0.0, 0.0, 0.0, a, c]]), np.append(limit, [1.0, 1.0])).reach(f)
            assert reach[0] == pytest.approx(size, rel=1e-9)


def test_no_vertex_on_a_steep_way() -> None:
    """|f_z| above sqrt(2/3) cannot be met (equal limits)."""
    for off, count in ((-1e-6, 16), (1e-6, 0)):
        rise = np.sqrt(2.0 / 3.0) + off
        assert len(closed_form(mikron(), np.array([np.sqrt(1.0 - rise**2), 0.0, rise]), np.ones(3))) == count
    steep = np.array([0.3, 0.48, 0.83])
    assert len(closed_form(mikron(), steep / np.linalg.norm(steep), np.full(3, 1.0))) == 0
    assert len(numeric(machine("mikron-ucp710").kinematics, np.zeros(5), steep / np.linalg.norm(steep), np.ones(5))) == 0


@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "linuxcnc-xyzac-trt", "linuxcnc-xyzbc-trt"])
def test_reach_at_solutions_is_that_of_a_vertex(name: str) -> None:
    """On any machine whose table turns twice: sqrt(3) times the limit of one axis, which no orientation exceeds."""
    kin = machine(name).kinematics.with_tool(100.0)
    rotary = np.flatnonzero(kin.rotary)
    limit = np.where(kin.rotary, np.inf, 5.0)
    f = np.array([0.8, -0.5, 0.2]) / np.linalg.norm([0.8, -0.5, 0.2])
    angles = vertex_angles(kin, np.zeros(5), f, np.where(kin.rotary, 1.0, 5.0))
    assert len(angles) >= 4
    q = np.zeros((len(angles), 5))
    q[:, rotary] = angles
    np.testing.assert_allclose(held_axis_polytope(kin, q, limit).reach(f), 5.0 * np.sqrt(3.0), rtol=1e-8)


def test_choice_within_travel_with_smallest_angles() -> None:
    """A of the Mikron ends at -30 degrees: of the solutions of a level pass A = +45 is left; the least |C| is taken."""
    m, passes = part_passes()
    found = tried(passes[30], m, AllowedAxes(90.0 * DEG))
    assert found.aimed is not None
    angles = found.aimed.rotary()
    assert 30.0 < angles["A"] < 60.0 and abs(angles["C"]) < 90.0
    level = vertex_angles(passes[30].kin, np.zeros(5), np.array([0.0, 1.0, 0.0]), m.limits.jerk) / DEG
    assert level[:, 0].min() < -30.0


@pytest.mark.parametrize("name", ["fork-head-ab", "nutating-head"])
def test_heads_do_not_turn_the_polytope(name: str) -> None:
    """Where both rotary joints carry the tool the slides stand to the part as ever: nothing aims, nothing is gained."""
    kin = machine(name).kinematics.with_tool(100.0)
    limit = np.where(kin.rotary, 1.0, 5.0)
    assert len(vertex_angles(kin, np.zeros(5), np.array([0.8, 0.6, 0.0]), limit)) == 0
    m, passes = part_passes(name)
    found = tried(passes[30], m, AllowedAxes(60.0 * DEG))
    assert found.best is found.own


@pytest.mark.parametrize(("plane", "least", "most"), [(0, 5.0, 16.0), (30, 15.0, 16.73)])
def test_gain_as_printed(plane: int, least: float, most: float) -> None:
    """Xp = 30 gains 16 % within a point (table 2); no pass more than the ideal 1 - 3^(-1/6) of a straight one."""
    m, passes = part_passes()
    found = tried(passes[plane], m, AllowedAxes(60.0 * DEG))
    assert found.aimed is not None
    gain = 100.0 * (1.0 - found.aimed.seconds / found.own.seconds)
    assert least < gain < most
    assert found.best.seconds <= found.aimed.seconds * (1.0 + 1e-3)


def test_pass_0_as_printed() -> None:
    """0.7268 s at A = C = 0."""
    m, passes = part_passes()
    assert turned(passes[0], passes[0].axis, m).seconds == pytest.approx(0.7268, rel=2e-3)


def test_bound_is_below_the_plan() -> None:
    """On random orientations of all passes, and near it on the flattest."""
    rng = np.random.default_rng(9)
    m, passes = part_passes()
    for one in (passes[0], passes[15], passes[30]):
        for axis in np.column_stack((rng.uniform(-0.6, 0.6, (6, 2)), np.ones(6))):
            made = turned(one, axis / np.linalg.norm(axis), m)
            if not made.refused:
                assert 0.5 * made.seconds < made.bound <= made.seconds * (1.0 + 1e-3)
    flat = turned(passes[30], passes[30].axis, m)
    assert flat.bound > 0.97 * flat.seconds


def test_edges_of_a_box() -> None:
    """Triangles of one face count as one: 12 edges of a turned box, none of a flat one."""
    rng = np.random.default_rng(5)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)]) @ turn.T
    faces, edges = polytopes.hull(corners)
    assert len(faces) == 12 and len(edges) == 12
    assert sorted(np.round(np.linalg.norm(corners[edges[:, 0]] - corners[edges[:, 1]], axis=1), 9).tolist()) == [2.0] * 4 + [
        4.0] * 4 + [6.0] * 4
    assert len(polytopes.hull(corners * [1.0, 1.0, 0.0])[1]) == 0 and len(polytopes.hull(corners[:3])[1]) == 0
