"""A platform as the axes of its control's kinematics: one pose by axes and by drives, rates, limits of axes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import machines
from machines.dynamics.limits import force_limits
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel, StiffnessModel
from machines.kinematics.legs.tip_axes import TipAxes
from machines.machine import Machine
from machines.stiffness.along import tip_compliance
from tests.machines.random_slides import poses_over_workspace
from toolpaths.arrays import Floats

MODULES = {"hexapod": "genhexkins", "rotary-delta": "rotarydeltakins"}


@cache
def on_control(name: str) -> Machine:
    with TemporaryDirectory() as folder:
        file = Path(folder, "own.toml")
        file.write_text(f'base = "{name}"\n[control]\nmodule = "{MODULES[name]}"\n')
        return machines.load(file).on_control()


@pytest.mark.parametrize("name", MODULES)
def test_axes_and_drives_have_the_tool_at_one_place(name: str) -> None:
    machine = on_control(name)
    axes, real = machine.kinematics.with_tool(70.0), machine.by_drives
    assert isinstance(axes, TipAxes) and real is not None and machine.on_control() is machine
    legs = real.kinematics.with_tool(70.0)
    tip, axis = poses_over_workspace(legs, np.random.default_rng(1), 60)
    spin = np.random.default_rng(2).uniform(-0.5, 0.5, 60) * (name == "hexapod")
    q = axes.inverse(tip, axis, spin)[0]
    found = axes.pose(q)
    np.testing.assert_allclose(np.hstack(found[:2]), np.hstack([tip, axis]), atol=1e-9)
    np.testing.assert_allclose(found[2], spin, atol=1e-12)
    drives = axes.drives(q)
    np.testing.assert_allclose(drives, legs.inverse(tip, axis, spin)[0], atol=1e-9)
    np.testing.assert_allclose(on_control(name).kinematics.axes_at(drives), q, atol=1e-9)
    step = 1e-6 * np.random.default_rng(3).normal(size=q.shape)
    by_rates = np.einsum("nij,nj->ni", axes.drive_rates(q), step)
    np.testing.assert_allclose(axes.drives(q + step) - drives, by_rates, atol=1e-8)


@pytest.mark.parametrize("name", MODULES)
def test_an_axis_alone_brings_some_drive_to_its_limit_at_home(name: str) -> None:
    machine = on_control(name)
    assert machine.by_drives is not None
    rates = np.abs(machine.kinematics.drive_rates(machine.home[None])[0])
    for own, theirs in ((machine.limits.velocity, machine.by_drives.limits.velocity),
                        (machine.limits.jerk, machine.by_drives.limits.jerk)):
        np.testing.assert_allclose((rates * own / theirs[:, None]).max(axis=0), 1.0, rtol=1e-9)


def test_what_drives_do_not_reach_axes_do_not_either() -> None:
    axes = on_control("hexapod").kinematics
    assert np.isnan(axes.inverse(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.1]]))).all()
    q = axes.inverse(np.array([[0.0, 0.0, -200.0]]), np.array([[0.0, 0.0, 1.0]]))[0]
    low, high = axes.travel.T
    np.testing.assert_allclose(axes.drive_margins_at(q), np.minimum(axes.drives(q) - low, high - axes.drives(q)))
    assert [name for name, _ in axes.drive_margins] == [f"travel {letter}" for letter in "XYZUVW"]


def test_drives_take_the_time_of_their_fastest_part() -> None:
    """Bent between the ends: more than travel by velocity, and all of it where one drive goes there and back."""
    axes, real = on_control("hexapod").kinematics, on_control("hexapod").by_drives
    assert real is not None
    ends = axes.inverse(np.array([[-100.0, 30.0, -200.0], [100.0, 30.0, -200.0]]), np.tile([0.0, 0.0, 1.0], (2, 1)))[0]
    seconds = axes.drive_seconds(ends[:1], ends[1:], real.limits.velocity)[0]
    at = axes.drives(ends[0] + np.linspace(0.0, 1.0, 2001)[:, None] * (ends[1] - ends[0]))
    fastest = float((np.abs(np.diff(at, axis=0)) * 2000.0 / real.limits.velocity).max())
    apart = float((np.abs(at[-1] - at[0]) / real.limits.velocity).max())
    assert apart < seconds <= fastest < 1.1 * seconds


@pytest.mark.parametrize("name", MODULES)
def test_forces_and_stiffness_of_the_tips_axes_are_those_of_the_drives(name: str) -> None:
    """One motion by axes and by drives takes the same of every motor; what legs, not slides X, Y, Z, yield by."""
    drives = on_control(name).by_drives
    assert drives is not None
    loads = {letter: AxisMassModel(mass=10.0, rods=10.0, force=900.0, viscous=40.0) for letter in drives.axis_names}
    heavy = replace(drives, dynamics=DynamicsModel(platform=BodyModel(mass=70.0), axes=loads),
                    stiffness=StiffnessModel(rod=100.0, drive=50.0))
    tips = heavy.on_control()
    axes, legs = tips.kinematics.with_tool(70.0), heavy.kinematics.with_tool(70.0)
    by_axes, by_drives = force_limits(tips, axes, 50.0), force_limits(heavy, legs, 50.0)
    assert by_axes is not None and by_drives is not None
    t = np.linspace(0.0, 0.5, 41)[:, None]
    size, phase, h = np.where(tips.rotary, 0.05, 20.0), np.arange(axes.joints), 2e-4

    def at(s: Floats) -> Floats:
        return np.asarray(tips.home + size * np.cos(5.0 * s + phase))
    q, rate, acceleration = at(t), -5.0 * size * np.sin(5.0 * t + phase), -25.0 * size * np.cos(5.0 * t + phase)
    before, here, after = (axes.drives(at(s)) for s in (t - h, t, t + h))
    moved = here, (after - before) / (2.0 * h), (after - 2.0 * here + before) / h**2
    np.testing.assert_allclose(by_axes.use(q, rate, acceleration), by_drives.use(*moved), atol=1e-4)
    fast = np.full(len(q), 2.0)
    for one, other in zip(by_axes.rows(q, rate, acceleration, fast), by_drives.rows(*moved, fast), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-4)
    np.testing.assert_allclose(by_axes.standing(q), by_drives.standing(here), rtol=1e-9)
    assert np.isfinite(by_axes.acceleration).all() and by_axes.standing(q).max() > 0.1
    soft = tip_compliance(tips, axes, q), tip_compliance(heavy, legs, here)
    assert (soft[0] is None and soft[1] is None) or np.allclose(*soft)
