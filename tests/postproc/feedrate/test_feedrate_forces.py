"""Limits of motors' forces in the planner: equal to those of axes where they mean the same, kept in samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

import machines
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel
from machines.machine import Machine
from postproc.cycle_time.toppra_check import least_seconds
from postproc.feedrate.motion import Plan
from postproc.feedrate.paths import SplinePath
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.windows import Method
from postproc.planning.planned import limits_at_feed
from toolpaths.arrays import Floats

STRICT = PlannerOptions(strict=True)


@cache
def path(seed: int = 0) -> SplinePath:
    """Joints of three slides by chance."""
    q = np.cumsum(np.random.default_rng(seed).normal(0.0, 1.0, (60, 3)), axis=0)
    made = make_interp_spline(np.linspace(0.0, 60.0, 60), 8.0 * gaussian_filter1d(q, 3, axis=0), k=5)
    return SplinePath(made.t, made.c)


def mill(force: Floats | None = None, mass: float = 50.0, acceleration: float = 1.0, balance: float = 0.0,
         down: float = 0.0) -> Machine:
    """The mill with slides of one mass and forces (3,) N; accelerations of its file times a factor."""
    m = machines.load("mill-3axis")
    m = replace(m, limits=replace(m.limits, acceleration=m.limits.acceleration * acceleration))
    if force is None:
        return m
    axes = {name: AxisMassModel(mass=mass, force=float(f), balance=balance if name == "Z" else 0.0)
            for name, f in zip("XYZ", force, strict=True)}
    return replace(m, dynamics=DynamicsModel(down=(0.0, 0.0, -down), axes=axes))


def pulls(share: float) -> Floats:
    """(3,) N that give each axis of the mill that share of its acceleration: of X the table on it, Y both, Z its head."""
    carried = np.array([50.0, 100.0, 50.0]) if "X' Y'" in machines.load("mill-3axis").structure else np.full(3, 50.0)
    return share * carried * machines.load("mill-3axis").limits.acceleration * 1e-3


def planned(m: Machine, third: bool = True, cutting: float = 0.0) -> Plan:
    """On the path by chance."""
    limits = limits_at_feed(m, m.kinematics, cutting_force=cutting)
    return plan(path(), limits, options=STRICT) if third else plan_second_order(path(), limits)


@pytest.mark.parametrize("third", [True, False])
def test_force_that_never_binds_changes_nothing(third: bool) -> None:
    free, held = planned(mill(), third), planned(mill(pulls(1e3)), third)
    assert held.seconds == free.seconds
    assert np.array_equal(held.pieces[0].profile.pieces, free.pieces[0].profile.pieces)


@pytest.mark.parametrize("third", [True, False])
def test_force_of_a_mass_is_a_limit_of_acceleration(third: bool) -> None:
    """F = m a of slides: the plan of the acceleration limits a, whose own are 50 times as large."""
    by_axes, by_force = planned(mill(acceleration=0.3), third), planned(mill(pulls(0.3), acceleration=50.0), third)
    assert by_force.seconds == pytest.approx(by_axes.seconds, rel=4e-3)  # the mesh is another


def test_less_force_is_never_faster_and_kept_in_every_sample() -> None:
    times = []
    for share in (1.0, 0.5, 0.125):
        made = planned(mill(pulls(share)))
        assert made.solved and made.usage().worst <= 1.0 + 1e-9
        times.append(made.seconds)
    assert all(later >= before * (1.0 - 1e-4) for before, later in pairwise(times))
    assert times[-1] > 1.5 * times[0]


def test_gravity_counterbalance_and_cutting_force_take_their_part() -> None:
    """A head of 50 kg: its 490 N are off one side and on the other, a counterbalance gives them back; a cutting force takes
    as much of both sides."""
    force, weight = pulls(4.0), 50.0 * 9.80665
    level, hung, balanced, less = (planned(m, False).seconds for m in (
        mill(force), mill(force, down=1.0), mill(force, down=1.0, balance=weight), mill(force - [0.0, 0.0, weight])))
    assert balanced == level < 0.999 * hung < 0.998 * less
    weak = pulls(0.5)
    cut, all_less = planned(mill(weak), False, cutting=20.0).seconds, planned(mill(weak - 20.0), False).seconds
    assert cut == pytest.approx(all_less, rel=1e-9) and cut > planned(mill(weak), False).seconds


@pytest.mark.parametrize("kernel", [False, True])
@pytest.mark.parametrize("friction", [(0.0, 0.0), (40.0, 300.0)])
def test_motors_reach_their_limits_on_either_side(kernel: bool, friction: tuple[float, float]) -> None:
    """Whole forces of the samples: Z has 640 N and gives them upwards; braking upwards it has its weight to help. X and Y
    reach both limits, with friction of both kinds too. Second order is as fast as toppra's with the same rows."""
    m = mill(pulls(0.4) + np.array([60.0, 60.0, 580.0]), down=1.0, acceleration=3.0)
    assert m.dynamics is not None
    keys = dict(zip(("friction", "viscous"), friction, strict=True))
    axes = {name: table.model_copy(update=keys) for name, table in m.dynamics.axes.items()}
    m = replace(m, dynamics=m.dynamics.model_copy(update={"axes": axes}))
    limits = limits_at_feed(m, m.kinematics)
    made = plan(path(), limits, options=replace(STRICT, method=Method(kernel))).trajectory()
    assert limits.forces is not None
    of = limits.forces.dynamics
    share = (of.forces(made.q, made.qd, made.qdd) + of.drives.resisting(made.qd, made.qdd)) / limits.forces.limits
    assert (np.abs(share) <= 1.0 + 1e-9).all() and (share.max(axis=0) > [0.85, 0.85, 0.99]).all()
    assert (share.min(axis=0) < [-0.7, -0.7, 0.65]).all()
    own = plan_second_order(path(), limits, options=PlannerOptions(method=Method(kernel)))
    grid = np.concatenate([piece.eased.parameter(piece.profile.sigma)[0] for piece in own.pieces])
    grid = np.clip(np.unique(grid), path().start, path().end)
    assert own.seconds == pytest.approx(least_seconds(_Joints(path()), limits, own.feed, grid), rel=2e-5)


def test_axes_that_only_creep_are_slowed_by_what_their_friction_leaves() -> None:
    """Constant speed along one slide: viscous friction alone bounds it, exactly; `use` says how much a motion is too
    fast."""
    m = mill(np.full(3, 100.0), down=0.0)
    assert m.dynamics is not None
    axes = {name: table.model_copy(update={"friction": 20.0, "viscous": 160.0}) for name, table in m.dynamics.axes.items()}
    forces = limits_at_feed(replace(m, dynamics=m.dynamics.model_copy(update={"axes": axes})), m.kinematics).forces
    assert forces is not None
    q, along = np.zeros((2, 3)), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    np.testing.assert_allclose(forces.steady(q, along, 0.0 * q)[:, 0], 500.0)
    assert forces.use(q, 500.0 * along, 0.0 * q)[:, 0] == pytest.approx([1.0, 1.0])
    assert forces.use(q, 1000.0 * along, 0.0 * q)[:, 0] == pytest.approx([4.0, 4.0])
    assert forces.use(q, 1000.0 * along, -3600.0 * along)[0, 0] < 1.0


def delta(force: float) -> Machine:
    """UraneSX with masses, its own accelerations out of the way."""
    m = machines.load("uranesx")
    axes = {name: AxisMassModel(mass=70.0, rods=20.0, force=force) for name in m.axis_names}
    model = DynamicsModel(platform=BodyModel(mass=70.0, centre=(0.0, 0.0, 80.0)), axes=axes)
    return replace(m, dynamics=model, limits=replace(m.limits, acceleration=np.full(3, 1e6)))


def around() -> SplinePath:
    """A round trip of the tip, as joints of UraneSX."""
    t = np.linspace(0.0, 0.3, 40)
    tip = np.column_stack([200.0 * np.sin(5.0 * t), 150.0 * np.cos(4.0 * t), 100.0 * np.sin(9.0 * t)])
    q = machines.load("uranesx").kinematics.inverse(tip, np.tile([0.0, 0.0, 1.0], (40, 1)))[0]
    made = make_interp_spline(300.0 * t, q, k=5)
    return SplinePath(made.t, made.c)


def test_pose_dependent_forces_are_kept_and_least_by_toppra() -> None:
    """Samples of the strict plan by the machine's own inverse dynamics; second order as fast as toppra's."""
    m, trip = delta(4000.0), around()
    limits = limits_at_feed(m, m.kinematics)
    made = plan(trip, limits, 2000.0, options=STRICT).trajectory()
    assert limits.forces is not None
    used = np.abs(limits.forces.dynamics.forces(made.q, made.qd, made.qdd)).max() * 1e-3  # weight included, on both sides
    assert 3600.0 < used <= 4000.0 * (1.0 + 1e-9)
    own = plan_second_order(trip, limits, 2000.0)
    grid = np.concatenate([piece.eased.parameter(piece.profile.sigma)[0] for piece in own.pieces])
    grid = np.clip(np.unique(grid), trip.start, trip.end)
    theirs = least_seconds(_Joints(trip), limits, own.feed, grid)
    assert own.seconds == pytest.approx(theirs, rel=2e-3)
    assert made.t[-1] >= own.seconds


class _Joints(SplinePath):
    """With the number of its joints."""

    joints = 3

    def __init__(self, of: SplinePath) -> None:
        self.__dict__.update(vars(of))
