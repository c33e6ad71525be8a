"""Clearances: distance of bars, margins of the built-in machines, moves that pass a stop between their ends."""

from dataclasses import replace

import numpy as np
import pytest

import machines
from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.reach import Margins, is_checked, reach, reach_between, segment_distance
from tests.machines.random_slides import random_slides

NAMES = ("uranesx", "h4a-c-table", "h4a-spindle-axis")


def parallel(name: str) -> OnLegs | LegsWithAxis:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs | LegsWithAxis)
    return kinematics


def joints(kinematics: OnLegs | LegsWithAxis, n: int, seed: int = 0) -> np.ndarray:
    slides = random_slides(kinematics, np.random.default_rng(seed), n)
    return slides if isinstance(kinematics, OnLegs) else np.column_stack([slides, np.zeros(n)])


def test_segment_distance_is_the_least_over_both_segments() -> None:
    rng = np.random.default_rng(0)
    ends = rng.uniform(-1, 1, (4, 400, 3))
    ends[3, :50] = ends[2, :50] + (ends[1, :50] - ends[0, :50])  # parallel ones
    found = segment_distance(*ends)
    s = np.linspace(0, 1, 201)
    one = ends[0][:, None] + s[:, None] * (ends[1] - ends[0])[:, None]
    two = ends[2][:, None] + s[:, None] * (ends[3] - ends[2])[:, None]
    for i in range(400):
        searched = np.sqrt(((one[i][:, None] - two[i][None]) ** 2).sum(axis=2).min())
        assert found[i] <= searched + 1e-12 and found[i] > searched - 0.02


@pytest.mark.parametrize("name", NAMES)
def test_the_built_in_machines_clear_everything_in_their_workspace(name: str) -> None:
    kinematics = parallel(name)
    margins = reach(kinematics, joints(kinematics, 5000))
    assert margins.values.shape == (5000, len(margins.names)) and len(margins.names) > 10
    assert not margins.passed()


def test_workspace_margins_are_the_distance_to_the_faces() -> None:
    kinematics = parallel("uranesx")
    place = np.array([[0.0, 0.0, 0.0], [240.0, -251.0, 100.0]])
    q = kinematics.inverse(place, np.tile([0.0, 0.0, 1.0], (2, 1)))[0]
    np.testing.assert_allclose(reach(kinematics, q).values[:, :3],
                               [[250, 250, 250], [10, -1, 150]], atol=1e-8)
    long = kinematics.with_tool(100.0)
    np.testing.assert_allclose(reach(long, q).values[:, :3], [[250, 250, 250], [10, -1, 150]], atol=1e-8)


def test_tilt_and_joint_margins_count_from_their_stops() -> None:
    kinematics = parallel("h4a-c-table")
    clearance = kinematics.clearance
    assert clearance is not None
    kinematics = replace(kinematics, on_legs=replace(kinematics.on_legs, clearance=replace(
        clearance, carriage_angle=0.3, platform_angle=0.4)))
    q = joints(kinematics, 300)
    margins = reach(kinematics, q)
    rig, middle = kinematics.rig(q), kinematics.middle_rig()
    column = dict(zip(margins.names, margins.values.T, strict=True))
    np.testing.assert_allclose(column["tilt"], np.pi / 4 - np.abs(rig.tilt), atol=1e-9)
    rod, before = (r.ends[:, 2] - r.carriages[:, 2] for r in (rig, middle))
    swing = np.arccos(np.clip(rod @ before[0] / 1e6, -1, 1))
    np.testing.assert_allclose(column["joint Z at slide"], 0.3 - swing, atol=1e-7)
    c, s = np.cos(rig.tilt), np.sin(rig.tilt)
    level = np.stack([rod[:, 0], c * rod[:, 1] + s * rod[:, 2], c * rod[:, 2] - s * rod[:, 1]], axis=1)
    np.testing.assert_allclose(column["joint Z at platform"],
                               0.4 - np.arccos(np.clip(level @ before[0] / 1e6, -1, 1)), atol=1e-7)
    assert margins.angular[margins.names.index("tilt")] and not margins.angular[0]


def test_rods_side_by_side_keep_their_spacing() -> None:
    """Parallel slides, parallel rods: the gap is the spacing of the lines less two radii."""
    kinematics = parallel("delta-parallel-z")
    clearance = ClearanceSizes(leg=np.array([0, 0, 1, 2]), shift=np.array([[0, 40.0, 0], [0, -40, 0], [0, 0, 0], [0, 0, 0]]),
                               rod_radius=10.0)
    names = reach(replace(kinematics, clearance=clearance), joints(kinematics, 5)).names
    assert "rod X1 - rod X2" not in names, "rods of one leg stay parallel"
    assert "rod X1 - rod Y1" in names
    assert "rod Y1 - rod Z1" not in names, "they end in one joint"


def test_a_rail_in_the_way_of_a_rod_shows() -> None:
    kinematics = parallel("uranesx")
    clearance = kinematics.clearance
    assert clearance is not None and clearance.rail_offset is not None
    low = np.tile([0.0, 1800.0], (3, 1))
    inward = replace(kinematics, clearance=replace(clearance, rail_offset=-clearance.rail_offset, rail_ends=low))
    passed = reach(inward, joints(kinematics, 50)).passed()
    assert passed and "slide" in passed[0][0] and not passed[0][1] and passed[0][4] < 0.0


def test_joints_without_a_pose_have_no_margins() -> None:
    assert np.isnan(reach(parallel("uranesx"), np.array([[0.0, 0.0, 4000.0]])).values).all()
    assert reach(parallel("uranesx"), np.empty((0, 3))).values.shape[0] == 0


def test_between_ends_finds_a_stop_that_only_the_middle_passes() -> None:
    """Two corners of the workspace: straight joints bulge out of the box between them."""
    kinematics = parallel("uranesx")
    place = np.array([[-250.0, 250.0, 0.0], [250.0, 250.0, 0.0], [250.0, 249.0, 0.0]])
    q = kinematics.inverse(place, np.tile([0.0, 0.0, 1.0], (3, 1)))[0]
    ends = reach(kinematics, q)
    assert ends.values.min() > -1e-9
    between = reach_between(kinematics, q)
    fine = np.array([0.0])[:, None] + np.linspace(0, 1, 2001)[:, None] * (q[1] - q[0]) + q[0]
    dense = reach(kinematics, fine)
    assert dense.values.min() < -1.0
    y = between.names.index("workspace y")
    assert between.values[0, y] < 0.0
    assert between.values[0, y] < 0.9 * dense.values[:, y].min()
    assert between.values.shape == (2, len(ends.names))
    np.testing.assert_array_less(between.values, np.minimum(ends.values[:-1], ends.values[1:]) + 1e-12)


def test_between_ends_reports_joints_that_lose_the_platform() -> None:
    kinematics = parallel("uranesx")
    q = np.array([[1000.0, 1000.0, 1000.0], [1000.0, 1000.0, 4000.0]])
    assert np.isnan(reach_between(kinematics, q).values).all()


def test_passed_lists_the_worst_first() -> None:
    margins = Margins(("a", "b", "c"), np.array([False, False, True]), np.zeros(3, dtype=bool),
                      np.array([[-1.0, -2, 1], [-3.0, 5, -0.1]]))
    assert margins.passed() == [("a", False, 2, 1, -3.0), ("b", False, 1, 0, -2.0), ("c", True, 1, 1, -0.1)]


def test_serial_machines_are_not_checked() -> None:
    assert not is_checked(machines.load("mikron-ucp710").kinematics)
    assert all(is_checked(parallel(name)) for name in NAMES)
