"""The volume that an error model is looked at in: travel or workspace of its machine, as far as the model reaches."""

from __future__ import annotations

from itertools import product

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.model import ErrorModel
from machines.machine import Machine
from toolpaths.arrays import Floats

TURN = np.pi
"""rad in either direction from 0 of an axis that goes round"""
CORNERS = 4
"""one place of so many is at a corner"""
INSIDE = 1e-9
"""mm or rad"""


def ranges(model: ErrorModel, machine: Machine) -> tuple[Floats, Floats]:
    """(lower, upper) (J,) of each joint: its travel, as far as the model was measured; empty where lower > upper.

    Axes that go round are taken over what was measured of them, else half a turn in either direction.
    """
    lower, upper = (np.array(x) for x in (machine.limits.lower, machine.limits.upper))
    for letter, (least, most) in measured(model).items():
        if letter in machine.axis_names:
            j = machine.axis_names.index(letter)
            lower[j], upper[j] = max(lower[j], least), min(upper[j], most)
    return np.where(np.isfinite(lower), lower, -TURN), np.where(np.isfinite(upper), upper, TURN)


def measured(model: ErrorModel) -> dict[str, tuple[float, float]]:
    """(least, greatest) position of each axis or coordinate of a map, mm or rad, that all that is known of it holds for."""
    found = [(c.name.axis, c.curve.range) for c in model.axes.components]
    if model.map is not None:
        found += [(letter, (float(nodes[0]), float(nodes[-1]))) for letter, nodes, period in
                  zip(model.map.letters, model.map.nodes, model.map.periods, strict=True) if not period]
    result: dict[str, tuple[float, float]] = {}
    for letter, (least, most) in found:
        low, high = result.get(letter, (least, most))
        result[letter] = max(low, least), min(high, most)
    return result


def samples(model: ErrorModel, machine: Machine, actual: Actual, count: int) -> Floats:
    """Coordinates w (N, 3 + R), N <= count, spread over the volume and at its corners; only where the model holds."""
    lower, upper = ranges(model, machine)
    if np.any(lower > upper):
        return np.zeros((0, 3 + actual.turns + actual.held))
    w = actual.coordinates(_joints(machine, lower, upper, np.random.default_rng(0), count))
    w = w[np.isfinite(actual.aim(w)[0]).all(axis=1)]
    return np.asarray(w[~actual.outside(w, INSIDE).any(axis=1)])


def middle(machine: Machine) -> Floats:
    """(J,) joints in the middle of the workspace of a machine on rods, at 0 within travel of a serial one."""
    zero, platform = np.clip(np.zeros(len(machine.axis_names)), machine.limits.lower, machine.limits.upper), \
        machine.kinematics.over_workspace
    if platform is None:
        return zero
    box = platform.workspace
    at = np.append(box.middle, np.clip(0.0, *box.tilt))[None]
    return np.asarray(platform.joints_at(at, zero[None, 4:])[0])


def corners(machine: Machine, lower: Floats, upper: Floats, fixed: Floats) -> Floats:
    """Joints (M, J) with the slides at their ends, or the platform at the corners of its box; the rest as `fixed` (J,)."""
    platform = machine.kinematics.over_workspace
    if platform is not None:
        ends = np.array(list(product(*zip(platform.workspace.lower, platform.workspace.upper, strict=True))))
        tilt = np.full((len(ends), 1), np.clip(0.0, *platform.workspace.tilt))
        return platform.joints_at(np.hstack([ends, tilt]), np.tile(fixed[4:], (len(ends), 1)))
    rotary = np.array(machine.rotary)
    ends = np.array(list(product(*zip(np.where(rotary, fixed, lower), np.where(rotary, fixed, upper), strict=True))))
    return np.unique(ends, axis=0)


def section(machine: Machine, lower: Floats, upper: Floats, across: int, up: int,
            count: int) -> tuple[Floats, Floats, Floats]:
    """Joints (count^2, J) over two slides, or two directions of the platform (0, 1, 2 for x, y, z), the rest
    in the middle; and the positions (count,) of both, mm."""
    platform, rest = machine.kinematics.over_workspace, middle(machine)
    box = platform.workspace if platform is not None else None
    j = [across, up] if box else [machine.axis_names.index("XYZ"[k]) for k in (across, up)]
    ends = (box.lower, box.upper) if box else (lower, upper)
    one, two = (np.linspace(ends[0][k], ends[1][k], count) for k in j)
    grid = np.stack(np.meshgrid(one, two), axis=-1).reshape(-1, 2)
    at = np.tile(np.append(box.middle, np.clip(0.0, *box.tilt)) if box else rest, (len(grid), 1))
    at[:, j] = grid
    if platform is not None:
        at = platform.joints_at(at, np.tile(rest[4:], (len(grid), 1)))
    return at, one, two


def _joints(machine: Machine, lower: Floats, upper: Floats, rng: np.random.Generator, count: int) -> Floats:
    platform = machine.kinematics.over_workspace
    if platform is None:
        return _spread(lower, upper, rng, count)
    box = platform.workspace
    low, high = (np.append(ends, tilt) for ends, tilt in zip((box.lower, box.upper), box.tilt, strict=True))
    return platform.joints_at(_spread(low, high, rng, count), _spread(lower[4:], upper[4:], rng, count))


def _spread(lower: Floats, upper: Floats, rng: np.random.Generator, count: int) -> Floats:
    """(count, K) even between the ends, every CORNERS-th row at some ends."""
    rows = rng.uniform(lower, upper, (count, len(lower)))
    ends = np.where(rng.random((count, len(lower))) < 0.5, lower, upper)
    rows[::CORNERS] = ends[::CORNERS]
    return rows
