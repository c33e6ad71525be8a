"""What lies between two cuts, in seconds: rapids, and where the axis changes retract, unclamp, index, clamp, approach.

The legs are those of `postproc.links`, from rest to rest each, straight in the joints.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from machines.machine import Machine
from postproc.feedrate.rest_to_rest import Law, rest_seconds
from postproc.joint_path import nearest_solution
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.orientation.allowed import SAME
from postproc.orientation.passes import Pass, Work
from postproc.orientation.timed import Turned
from postproc.planned import joint_limits
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_RISE = 10.0
"""mm above the safe plane while indexing, as the links do"""
_SHARES = (1.0, 0.4, 0.2, 0.1)
"""of the clearance margin, tried where travel is short"""


@dataclass(frozen=True)
class Ends:
    """A turned pass as its neighbours see it: joints (J,) where it begins, ends and stands above both, and the seconds of
    its own rapids, of coming down and drawing back; inf where no height above is inside travel."""

    axis: Floats
    first: Floats
    last: Floats
    above_first: Floats
    above_last: Floats
    down: float
    up: float
    rapids: float


def ends(made: Turned, work: Work) -> Ends:
    """The ends of a turned pass; its seconds are infinite where the machine cannot run it."""
    limits, one = joint_limits(work.machine.limits), made.one
    if made.refused:
        none = np.full(len(made.q[0]), np.nan)
        return Ends(made.axis, none, none, none, none, np.inf, np.inf, np.inf)
    between = one.rapid[1:]
    rapids = float(rest_seconds(made.q[:-1][between], made.q[1:][between], limits, Law.STRAIGHT).sum())
    tip = one.tip + one.shift(made.axis)
    axis = one.axes if one.fixed else np.tile(made.axis, (len(tip), 1))
    first, down = _above(work, one, tip[0], axis[0], made.q[0])
    last, up = _above(work, one, tip[-1], axis[-1], made.q[-1])
    return Ends(made.axis, made.q[0], made.q[-1], first, last, down, up, rapids)


def _above(work: Work, one: Pass, tip: Floats, axis: Floats, q: Floats) -> tuple[Floats, float]:
    """Joints above a pose on its safe plane, and the seconds to there."""
    limits = work.machine.limits
    for share in _SHARES if work.space.distance is None else (1.0,):
        lift = work.space.plane(axis, True, share) + _RISE - float(axis @ (tip - work.space.centre))
        found = nearest_solution(one.kin, (tip + max(lift, 0.0) * axis)[None], one.kin.nearest_axis(axis[None]), q[None])
        if bool(((found >= limits.lower - TRAVEL_SLACK) & (found <= limits.upper + TRAVEL_SLACK)).all()):
            return found[0], float(rest_seconds(q[None], found, joint_limits(limits), Law.STRAIGHT)[0])
    return np.full(len(q), np.nan), np.inf


def between(before: list[Ends] | None, after: list[Ends] | None, work: Work, by_home: bool, changes_tool: bool) -> Floats:
    """Seconds (K0, K1) from each end to each beginning; None stands for home."""
    home = work.machine.home
    if before is None:
        return _indexed(home[None], np.stack([e.above_first for e in after or []]), work.machine) + _downs(after)[None]
    ups = np.array([e.up for e in before])[:, None]
    above = np.stack([e.above_last for e in before])
    if after is None:
        return ups + _indexed(above, home[None], work.machine)
    if by_home:
        way = _indexed(above, home[None], work.machine) + _indexed(home[None], np.stack([e.above_first for e in after]),
                                                                   work.machine)
        return np.asarray(ups + way + _downs(after)[None] + (work.machine.timing.tool_change if changes_tool else 0.0))
    linked = ups + _indexed(above, np.stack([e.above_first for e in after]), work.machine) + _downs(after)[None]
    straight = _indexed(np.stack([e.last for e in before]), np.stack([e.first for e in after]), work.machine)
    turn = angle_between(np.stack([e.axis for e in before])[:, None], np.stack([e.axis for e in after])[None])
    return np.asarray(np.where(turn > work.setup.clearance.link_angle * DEG, linked, straight))


def _downs(after: list[Ends] | None) -> Floats:
    return np.array([e.down for e in after or []])


def _indexed(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """Seconds (K0, K1) from q0 (K0, J) to q1 (K1, J); unclamping and clamping where rotary joints turn."""
    shape = (len(q0), len(q1))
    start, end = np.broadcast_to(q0[:, None], (*shape, q0.shape[1])), np.broadcast_to(q1[None], (*shape, q0.shape[1]))
    way = end - start
    endless = np.array(machine.rotary) & ~np.isfinite(machine.limits.upper - machine.limits.lower)
    way = np.where(endless, way - 2.0 * np.pi * np.round(way / (2.0 * np.pi)), way).reshape(-1, q0.shape[1])
    good = np.isfinite(way).all(axis=1)
    seconds = np.full(len(way), np.inf)
    if good.any():
        seconds[good] = rest_seconds(np.zeros_like(way[good]), way[good], joint_limits(machine.limits), Law.STRAIGHT)
    turns = good & (np.abs(way[:, np.array(machine.rotary)]) > SAME).any(axis=1)
    return np.asarray(np.where(turns, seconds + machine.timing.clamp + machine.timing.unclamp, seconds).reshape(shape))
