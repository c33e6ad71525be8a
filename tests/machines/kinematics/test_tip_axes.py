"""A platform as the axes of its control's kinematics: one pose by axes and by drives, rates, limits of axes."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import machines
from machines.kinematics.legs.tip_axes import TipAxes
from machines.machine import Machine
from tests.machines.random_slides import poses_over_workspace

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
