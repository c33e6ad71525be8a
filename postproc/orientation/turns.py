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
from postproc.orientation.held import free_value
from postproc.orientation.passes import Pass, Work
from postproc.orientation.timed import Turned
from postproc.planned import joint_limits
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_RISE = 10.0
"""mm above the safe plane while indexing, as the links do"""
_SHARES = (1.0, 0.4, 0.2, 0.1)
"""of the clearance margin, tried where travel is short"""


@dataclass(frozen=True)
class Ends:
    """A turned pass as its neighbours see it: joints (J,) where it begins, ends and stands above both, and the seconds of
    its own rapids, of coming down and drawing back; inf where no height above is inside travel. `held` is where the rotary
    joint stands that the axis leaves free, NaN where none is."""

    axis: Floats
    held: float
    first: Floats
    last: Floats
    above_first: Floats
    above_last: Floats
    down: float
    up: float
    rapids: float


def ends(made: Turned, work: Work) -> Ends:
    """The ends of a turned pass; its seconds are infinite where the machine cannot run it."""
    return all_ends([made], work)[0]


def all_ends(row: list[Turned], work: Work) -> list[Ends]:
    """The ends of one pass turned to several axes."""
    one = row[0].one
    axis = np.stack([one.axes[[0, -1]] if one.fixed else np.tile(made.axis, (2, 1)) for made in row])
    tip = np.stack([(one.tip + one.shift(made.axis))[[0, -1]] for made in row])
    q = np.stack([made.q[[0, -1]] for made in row])
    above, way = _above(work, one, tip.reshape(-1, 3), axis.reshape(-1, 3), q.reshape(-1, q.shape[2]))
    above, way = above.reshape(q.shape), way.reshape(-1, 2)
    result = []
    for k, made in enumerate(row):
        if made.refused:
            none = np.full(q.shape[2], np.nan)
            result.append(Ends(made.axis, made.held, none, none, none, none, np.inf, np.inf, np.inf))
            continue
        (first, last), (above_first, above_last), (down, up) = q[k], above[k], way[k].tolist()
        result.append(Ends(made.axis, free_value(made), first, last, above_first, above_last, down, up, made.rapids))
    return result


def _above(work: Work, one: Pass, tip: Floats, axis: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Joints (N, J) above poses on the safe plane, and the seconds (N,) to there; NaN and inf where travel ends."""
    limits = work.machine.limits
    above, way = np.full(q.shape, np.nan), np.full(len(q), np.inf)
    for share in _SHARES if work.space.distance is None else (1.0,):
        left = np.flatnonzero(np.isinf(way) & np.isfinite(q).all(axis=1))
        if not len(left):
            break
        lift = np.array([work.space.plane(a, True, share) + _RISE - float(a @ (t - work.space.centre))
                         for a, t in zip(axis[left], tip[left], strict=True)])
        at = tip[left] + np.maximum(lift, 0.0)[:, None] * axis[left]
        found = nearest_solution(one.kin, at, one.kin.nearest_axis(axis[left]), q[left])
        inside = ((found >= limits.lower - TRAVEL_SLACK) & (found <= limits.upper + TRAVEL_SLACK)).all(axis=1)
        above[left[inside]] = found[inside]
        way[left[inside]] = rest_seconds(q[left[inside]], found[inside], joint_limits(limits), Law.STRAIGHT)
    return above, way


def ways_between(work: Work, edge: list[list[Ends]]) -> list[Floats]:
    """Seconds between the states of neighbouring passes, from home and back."""
    passes = work.passes
    ways = [between(None, edge[0], work, True, False)]
    for n in range(1, len(edge)):
        ways.append(between(edge[n - 1], edge[n], work, passes[n].by_home, passes[n].tool != passes[n - 1].tool))
    return [*ways, between(edge[-1], None, work, True, False)]


def between(before: list[Ends] | None, after: list[Ends] | None, work: Work, by_home: bool, changes_tool: bool) -> Floats:
    """Seconds (K0, K1) from each end to each beginning; None stands for home."""
    home = work.machine.home
    if before is None:
        return _from_home(home[None], np.stack([e.above_first for e in after or []]), work.machine) + _downs(after)[None]
    ups = np.array([e.up for e in before])[:, None]
    above = np.stack([e.above_last for e in before])
    if after is None:
        return np.asarray(ups + _lifted(above, work.machine)[1] + _level(above, work.machine))
    if by_home:
        lifted, lift = _lifted(above, work.machine)
        way = lift + _from_home(lifted, np.stack([e.above_first for e in after]), work.machine)
        return np.asarray(ups + way + _downs(after)[None] + (work.machine.timing.tool_change if changes_tool else 0.0))
    linked = ups + _indexed(above, np.stack([e.above_first for e in after]), work.machine) + _downs(after)[None]
    straight = _indexed(np.stack([e.last for e in before]), np.stack([e.first for e in after]), work.machine)
    turn = angle_between(np.stack([e.axis for e in before])[:, None], np.stack([e.axis for e in after])[None])
    spun = _differ(np.array([e.held for e in before])[:, None], np.array([e.held for e in after])[None])
    return np.asarray(np.where((turn > work.setup.clearance.link_angle * DEG) | spun, linked, straight))


def _lifted(q: Floats, machine: Machine) -> tuple[Floats, Floats]:
    """Joints (K, J) with the retract axis at home, and the seconds (K, 1) to there; all joints at home without such an
    axis."""
    k = machine.retract_axis
    lifted = np.tile(machine.home, (len(q), 1)) if k < 0 else q.copy()
    lifted[:, k] = machine.home[k]
    return lifted, np.diag(_indexed(q, lifted, machine))[:, None]


def _level(q: Floats, machine: Machine) -> Floats:
    """Seconds (K, 1) of all joints home once the retract axis is there."""
    return _indexed(_lifted(q, machine)[0], machine.home[None], machine)


def _from_home(q0: Floats, q1: Floats, machine: Machine) -> Floats:
    """Seconds (K0, K1): rotary axes, then the slides but the retract axis, then that one, as the links go."""
    rotary, last = np.array(machine.rotary), np.arange(q0.shape[1]) == machine.retract_axis
    groups = [rotary, ~rotary & ~last, last] if last.any() else [np.ones(len(rotary), dtype=bool)]
    return np.asarray(sum(_indexed(np.where(one, q0, 0.0), np.where(one, q1, 0.0), machine) for one in groups))


def _differ(a: Floats, b: Floats) -> Bools:
    """Where held angles differ; none held is another than any."""
    return np.asarray((np.isnan(a) != np.isnan(b)) | (np.abs(np.nan_to_num(a - b)) > SAME))


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
