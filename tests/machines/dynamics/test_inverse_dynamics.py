"""Forces of motors against d'Alembert on point masses by differences, and against a direct integration with multipliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

import machines
from machines.dynamics.bodies import GRAVITY
from machines.dynamics.build import dynamics_of, lumped
from machines.dynamics.legs import LegDynamics
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel
from machines.machine import Machine
from tests.machines.dynamics.heavy_machines import Points, heavy
from toolpaths.arrays import Floats

OF_LEGS = ["uranesx", "rotary-delta", "hexapod", "h4a-c-table", "h4a-spindle-axis", "h4-rotary", "planar-delta-z",
           "macro-micro", "tripod-head", "tricept", "linear-delta-ac", "tilting-arms-c-table"]
OF_CHAINS = ["mill-3axis", "mill-4axis", "mikron-ucp710", "fork-head-ab", "head-table", "nutating-head"]


def waves(m: Machine, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Joints, rates, accelerations (N, J) of a motion round home."""
    j = np.arange(len(m.axis_names))
    size, w = np.where(m.rotary, 0.2, 15.0), 3.0 + j
    q = m.home + size * np.sin(np.outer(t, w) + j)
    return q, size * w * np.cos(np.outer(t, w) + j), -size * w**2 * np.sin(np.outer(t, w) + j)


def by_differences(m: Machine, t: float) -> Floats:
    """(J,) sum of m (x'' - g).dx/dq over point masses, rotors added; kg mm/s2."""
    points, h, d = Points(m), 2e-4, 1e-4
    assert m.dynamics is not None
    q, _, acceleration = waves(m, np.array([t - h, t, t + h]))
    before, here, after = (points.masses_and_places(row)[1] for row in q)
    mass, _ = points.masses_and_places(q[1])
    force = mass[:, None] * ((after - 2.0 * here + before) / h**2 + [0.0, 0.0, GRAVITY])
    result = np.empty(len(m.axis_names))
    for j in range(len(result)):
        step = d * np.eye(len(result))[j] * (0.01 if m.rotary[j] else 1.0)
        up, down = (points.masses_and_places(q[1] + sign * step)[1] for sign in (1.0, -1.0))
        result[j] = float((force * (up - down)).sum() / (2.0 * step[j]))
    units = np.where(m.rotary, 1e6, 1.0)
    rotor = np.array([m.dynamics.axes[name].rotor for name in m.axis_names]) * units
    return result + rotor * acceleration[1]


@pytest.mark.parametrize("name", OF_CHAINS + OF_LEGS)
def test_forces_are_those_of_point_masses(name: str) -> None:
    m = heavy(name)
    dynamics = dynamics_of(m)
    assert dynamics is not None
    t = np.array([0.37])
    found = dynamics.forces(*waves(m, t))
    expected = np.array([by_differences(m, float(one)) for one in t])
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-5 * np.abs(expected).max(axis=0).max())


@pytest.mark.parametrize("name", ["hexaslide-cone", "mikron-ucp710", "tilting-arms-c-table"])
def test_work_of_the_motors_is_the_energy_gained(name: str) -> None:
    """Integral of the power along a motion = change of q'M q'/2 + work against gravity, which a closed path gives back."""
    m = heavy(name, 1)
    dynamics = dynamics_of(m)
    assert dynamics is not None
    t = np.linspace(0.0, 2.0 * np.pi, 1001)
    q, rate, acceleration = waves(m, t)
    power = (dynamics.forces(q, rate, acceleration) * rate).sum(axis=1)
    still = np.zeros_like(q[:1])
    ends = [np.stack([dynamics.forces(q[k:k + 1], still, one[None], 0.0)[0] for one in np.eye(q.shape[1])])
            for k in (0, 350)]
    np.testing.assert_allclose(ends, np.swapaxes(ends, 1, 2), atol=1e-9 * np.abs(ends).max())
    kinetic = [0.5 * rate[k] @ mass @ rate[k] for k, mass in zip((0, 350), ends, strict=True)]
    against = simpson((dynamics.forces(q, 0.0 * q, 0.0 * q) * rate).sum(axis=1)[:351], x=t[:351])
    assert simpson(power[:351], x=t[:351]) == pytest.approx(kinetic[1] - kinetic[0] + against, abs=1e-6 * max(kinetic))
    assert abs(simpson(power, x=t)) < 1e-6 * max(kinetic)


def delta(rods: float) -> Machine:
    """The machine of Company 2000, III.5.2.3: r 200, R 800, L 781 mm, M1 70, M2 70 kg, bars of 10 kg, two a leg."""
    m = machines.load("uranesx")
    k = m.kinematics
    turn = np.deg2rad([0.0, 120.0, 240.0])
    ring = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    drives = replace(k.loops.drives, points=800.0 * ring, lengths=np.full(3, 781.0))
    kinematics = replace(k, loops=replace(k.loops, drives=drives, joints=200.0 * ring))
    axes = {name: AxisMassModel(mass=70.0, rods=rods) for name in m.axis_names}
    model = DynamicsModel(down=(0.0, 0.0, 0.0), platform=BodyModel(mass=70.0), axes=axes)
    return replace(m, kinematics=kinematics, dynamics=model)


def integrated(forces: Floats, seconds: float, exact: bool) -> tuple[Floats, Floats, Floats]:
    """Carriages and platform (N, 6) in time, their rates, accelerations: multipliers of the rods' lengths.

    State (q1, q2, q3, x, y, z); rods of 20 kg a leg as masses m/3 and m/6 of their ends, or as halves.
    """
    turn = np.deg2rad([0.0, 120.0, 240.0])
    base = 600.0 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    up = np.array([0.0, 0.0, 1.0])
    own, mixed = (20.0 / 3.0, 20.0 / 6.0) if exact else (10.0, 0.0)
    mass = np.diag([70.0 + own] * 3 + [70.0 + 3.0 * own] * 3)
    mass[:3, 5] = mass[5, :3] = mixed

    def accelerated(y: Floats) -> Floats:
        q, x, rate = y[:3], y[3:6], y[6:]
        r = x - base - q[:, None] * up
        c = np.column_stack([-np.diag(r[:, 2]), r])
        apart = rate[3:] - rate[:3, None] * up
        right = np.concatenate([forces, np.zeros(3), -(apart * apart).sum(axis=1)])
        return np.linalg.solve(np.block([[mass, -c.T], [c, np.zeros((3, 3))]]), right)[:6]
    height = np.sqrt(781.0**2 - 600.0**2)
    start = np.concatenate([np.full(3, height), np.zeros(3), np.zeros(6)])
    t = np.linspace(0.0, seconds, 21)
    found = solve_ivp(lambda _, y: np.concatenate([y[6:], accelerated(y)]), (0.0, seconds), start, "DOP853", t, rtol=1e-11,
                      atol=1e-9).y.T
    return found[:, :6], found[:, 6:], np.array([accelerated(y) for y in found])


def test_forces_that_drove_an_integrated_motion_come_back() -> None:
    """4000, 4000 and -8000 N for 60 ms (III.5.2.3): what the exact rods' equations give back, and the lumped ones'."""
    given = np.array([4000.0, 4000.0, -8000.0]) * 1e3
    m = delta(20.0)
    dynamics = dynamics_of(m)
    assert isinstance(dynamics, LegDynamics)
    for model, exact in ((dynamics, True), (lumped(dynamics), False)):
        place, rate, acceleration = integrated(given, 0.06, exact)
        np.testing.assert_allclose(model.forces(place[:, :3], rate[:, :3], acceleration[:, :3]),
                                   np.tile(given, (21, 1)), atol=1e-5 * 8e6)
        np.testing.assert_allclose(m.kinematics.forward(place[:, :3])[0], place[:, 3:], atol=1e-6)


def test_lumped_masses_are_within_a_tenth_of_exact_rods() -> None:
    """Figure III-10: the platform's acceleration with masses put at the joints, bars of 10 kg next to a platform of 70."""
    given = np.array([4000.0, 4000.0, -8000.0]) * 1e3
    exact, halves = (np.linalg.norm(integrated(given, 0.06, how)[2][:, 3:], axis=1) for how in (True, False))
    apart = np.abs(halves / exact - 1.0)
    assert 0.01 < apart.max() < 0.1


def test_closed_form_of_the_text_with_lumped_masses() -> None:
    """III-17 with Mnac = M1 + 3 Mb and Mmot = M2 + Mb, J of differences, at rest and in motion."""
    m = delta(20.0)
    model = dynamics_of(m)
    assert isinstance(model, LegDynamics)
    rng = np.random.default_rng(2)
    q = m.home[None] * 0.0 + 500.0 + rng.uniform(-40.0, 40.0, (5, 3))
    rate, acceleration = rng.normal(0, 300.0, (5, 3)), rng.normal(0, 3000.0, (5, 3))
    h = 1e-5
    tip = m.kinematics.forward
    second = (tip(q + h * rate + 0.5 * h * h * acceleration)[0] - 2.0 * tip(q)[0]
              + tip(q - h * rate + 0.5 * h * h * acceleration)[0]) / h**2
    expected = 80.0 * acceleration + 100.0 * np.einsum("nij,ni->nj", m.kinematics.jacobian(q)[:, :3], second)
    found = lumped(model).forces(q, rate, acceleration)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=2e-3 * np.abs(expected).max())
