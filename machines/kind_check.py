"""A kind of machine that is not built in, held against its promises where its machine file says that it works.

Not a proof: what it gives near home must fit together before anything is computed with it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from machines.key_problem import KeyProblem
from machines.kinematics import by_samples
from machines.kinematics.base import Kinematics
from machines.kinematics.chain import LINEAR, ROTARY
from machines.machine import Limits
from machines.models import KinematicsModel
from toolpaths.arrays import Bools, Floats

NEAR, TOOL = 1e-6, 50.0
"""mm or rad that poses and joints may differ by; mm of the tool that is tried"""
RATE = 1e-5
"""of the size of rates"""
SHARES = (0.0, 0.02, -0.02, 0.05)
"""of travel, from home, at which every joint is tried"""
_PATH = ("kind",)


def build_faults(model: KinematicsModel) -> Iterator[KeyProblem]:
    """What keeps the model of a kind from giving a kinematics with letters, whatever its code raises."""
    try:
        made = model.build()
        if isinstance(made, Kinematics):
            yield from _letters(made)
        else:
            yield _problem(f"build gives a {type(made).__name__}, expected a Kinematics (machines/kinematics/base.py)")
    except Exception as fault:  # code of others: whatever it raises
        yield _problem(f"its model builds no kinematics: {type(fault).__name__}: {fault}")


def contract_faults(kinematics: Kinematics, limits: Limits, home: Floats) -> Iterator[KeyProblem]:
    """What a kind breaks of `Kinematics`, as faults of its machine file; whatever its code raises is one."""
    try:
        yield from _poses(kinematics, _places(kinematics, limits, home))
    except Exception as fault:  # code of others: whatever it raises
        yield _problem(f"its code fails near home: {type(fault).__name__}: {fault}")


def _problem(what: str) -> KeyProblem:
    return KeyProblem("machine.contract", _PATH, what,
                      "correct the kind: machines/kinematics/base.py says what it promises")


def _letters(kin: Kinematics) -> Iterator[KeyProblem]:
    if len(kin.axis_names) != len(kin.rotary) or len(set(kin.axis_names)) != len(kin.axis_names) or not kin.axis_names:
        yield _problem(f"axis_names {kin.axis_names} and rotary {kin.rotary} do not go together, one letter a joint")
        return
    for letter, rotary, drive in zip(kin.axis_names, kin.rotary, kin.drives_tip, strict=True):
        allowed = ROTARY + LINEAR if drive else ROTARY  # a crank or slide that moves the tip may have any letter
        if len(letter) != 1 or letter not in allowed:
            yield _problem(f"{letter!r} is not a letter of a {'rotary' if rotary else 'linear'} axis, allowed: "
                           f"{' '.join(allowed)}")


def _places(kin: Kinematics, limits: Limits, home: Floats) -> Floats:
    """Joints (N, J) at home and near it, inside travel, where there is a pose."""
    span = np.where(np.isfinite(limits.upper - limits.lower), limits.upper - limits.lower, 1.0)
    q = home + np.array([share * span * travel for share in SHARES for travel in (1.0, (-1.0) ** np.arange(kin.joints))])
    q = np.unique(np.clip(q, limits.lower, limits.upper), axis=0)
    q = np.concatenate([home[None], q])
    tip, axis = kin.forward(q)
    return np.asarray(q[np.isfinite(np.hstack([tip, axis])).all(axis=1) | (np.arange(len(q)) == 0)])


def _poses(kin: Kinematics, q: Floats) -> Iterator[KeyProblem]:
    n = len(q)
    tip, axis = kin.forward(q)
    if tip.shape != (n, 3) or axis.shape != (n, 3):
        yield _problem(f"forward of {n} joints gives {tip.shape} and {axis.shape}, expected ({n}, 3) twice")
        return
    if not np.isfinite(tip[0]).all() or not np.isfinite(axis[0]).all():
        yield _problem("forward gives no pose at home")
        return
    if np.abs(np.linalg.norm(axis, axis=1) - 1.0).max() > NEAR:
        yield _problem("forward gives tool axes that are not unit vectors")
        return
    for length, what in ((0.0, "inverse"), (TOOL, f"inverse with a tool of {TOOL:g} mm")):
        yield from _round_trip(kin.with_tool(length), q, (tip - length * axis, axis), what)
    yield from _rates(kin, q, axis)


def _round_trip(kin: Kinematics, q: Floats, pose: tuple[Floats, Floats], what: str) -> Iterator[KeyProblem]:
    tip, axis = kin.forward(q)
    if max(np.abs(tip - pose[0]).max(), np.abs(axis - pose[1]).max()) > NEAR:
        yield _problem("with_tool does not move the tip along the tool axis: forward has to use tool_length")
        return
    found = kin.inverse(*pose)
    if found.shape != (kin.branches, len(q), kin.joints):
        yield _problem(f"{what} gives {found.shape}, expected (branches, N, J) = {(kin.branches, len(q), kin.joints)}")
        return
    if kin.open_parameters:
        yield from _opened(kin, q, pose)
    good: Bools = np.asarray(np.isfinite(found).all(axis=2))
    if not good[:, 0].any():  # elsewhere the tool may stand beyond what the kind allows
        yield _problem(f"{what} finds no joints for the pose that forward gives at home")
        return
    for branch, rows in zip(found, good, strict=True):
        back = np.hstack(kin.forward(branch[rows], np.hstack(pose)[rows]))
        off = np.abs(back - np.hstack(pose)[rows]).max(initial=0.0)
        if not off <= NEAR:
            yield _problem(f"forward of {what} is {off:.3g} mm or rad off the pose that was asked for")
            return


def _opened(kin: Kinematics, q: Floats, pose: tuple[Floats, Floats]) -> Iterator[KeyProblem]:
    """Of a redundant kind: what joints q (N, J) leave open, and the inverse that takes it."""
    parameters, count = kin.parameters_at(q), len(kin.open_parameters)
    if parameters.shape != (len(q), count) or np.shape(kin.parameters_apart) != (count,):
        yield _problem(f"parameters_at gives {parameters.shape} and parameters_apart {np.shape(kin.parameters_apart)}, "
                       f"expected ({len(q)}, {count}) and ({count},)")
        return
    found = kin.inverse_with(*pose, parameters, q)[0]
    rows = np.isfinite(found).all(axis=1)
    again = np.hstack([*kin.forward(found[rows], np.hstack(pose)[rows]), kin.parameters_at(found[rows])])
    off = np.abs(again - np.hstack([*pose, parameters])[rows]).max(initial=0.0)
    if not off <= NEAR:
        yield _problem(f"joints of inverse_with are {off:.3g} mm or rad off the pose and the parameters that were asked for")


def _rates(kin: Kinematics, q: Floats, axis: Floats) -> Iterator[KeyProblem]:
    rates, pose = kin.jacobian(q), np.hstack(kin.forward(q))
    expected = by_samples.rates(lambda some: kin.forward(some), q, kin.rotary)
    good = np.isfinite(expected).all(axis=(1, 2))
    size = max(1.0, float(np.abs(expected[good]).max(initial=0.0)))
    if not np.abs(rates - expected)[good].max(initial=0.0) <= RATE * size:  # NaN is no rate either
        yield _problem("jacobian is not what forward changes by")
    standing = ~np.array(kin.turns_tool)
    if np.abs(expected[good][:, 3:, standing]).max(initial=0.0) > RATE:
        yield _problem("turns_tool is False of a joint that turns the tool axis")
    linear = ~np.array(kin.rotary)
    if kin.straight_slides:
        slid = np.abs(np.diff(expected[good][:, :, linear], axis=0)[_same_turns(q[good], linear)]).max(initial=0.0)
        if linear.sum() != 3 or slid > RATE * size or np.abs(expected[good][:, 3:, linear]).max(initial=0.0) > RATE:
            yield _problem("straight_slides is True, and there are not three linear joints that move the tip straight")
    if kin.jets_proved:
        yield from _bounds(kin, q, pose)


def _same_turns(q: Floats, linear: Bools) -> Bools:
    """(N - 1,) True where two places in turn differ in linear joints alone."""
    return np.asarray((np.diff(q[:, ~linear], axis=0) == 0.0).all(axis=1))


def _bounds(kin: Kinematics, q: Floats, pose: Floats) -> Iterator[KeyProblem]:
    """Poses between that leave the Taylor bound of a move's jets."""
    found, size, n = kin.jets(q[:-1], q[1:]), max(1.0, float(np.abs(pose).max())), len(q) - 1
    for t in (0.0, 0.2, 0.8, 1.0):
        h, there = t - 0.5, kin.forward(q[:-1] + t * (q[1:] - q[:-1]))
        for jet, seen in zip(found, there, strict=True):
            value, first, second = (np.stack([np.broadcast_to(c, n) for c in v], axis=1) for v in (
                jet.value, jet.first, jet.second))
            off = np.linalg.norm(value + h * first + 0.5 * h * h * second - seen, axis=1)
            if not (off <= jet.third * abs(h) ** 3 / 6.0 + 1e-9 * size).all():
                yield _problem("jets_proved is True, and poses leave the bound that jets gives")
                return
