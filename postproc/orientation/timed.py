"""One pass under one tool axis: joints, travel, a lower bound on its time, and the planned time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from machines.machine import Machine
from postproc import reach
from postproc.feedrate.geometry import MachinePath
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import plan, plan_second_order
from postproc.feedrate.rest_to_rest import Law, rest_seconds
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.orientation.passes import Pass, Stretch
from postproc.planned import ORDERS, joint_limits
from toolpaths.arrays import Bools, Floats
from toolpaths.units import DEG

_ROUND = 1.002
"""for the slope of a joint between sites, which is taken from its differences"""


def no_bodies(one: Pass, axis: Floats) -> str:
    """Where nothing is known that could be touched, nothing touches."""
    return ""


@dataclass(frozen=True)
class Turned:
    """A pass turned to `axis` (3,) (the CL's own where it is fixed): joints of its rows `q` (n, J) and of the sites of
    each stretch; `refused` says why the machine cannot run it, else ""."""

    one: Pass
    axis: Floats
    machine: Machine
    q: Floats
    sites: tuple[Floats, ...]
    refused: str = ""
    collides: Callable[[Pass, Floats], str] = no_bodies

    @cached_property
    def touching(self) -> str:
        """Which bodies touch and by how much, "" where none do; looked at once, when first asked for."""
        return self.collides(self.one, self.axis)

    @property
    def limits(self) -> JointLimits:
        """of the machine's joints"""
        return joint_limits(self.machine.limits)

    @cached_property
    def bound(self) -> float:
        """Least seconds that the cuts can take, whatever the plan: inf where the machine cannot run them.

        From rest to rest no joint is faster than over its own way under its own limits and the velocity that the feed gives
        it (along a straight pass that is the reach of the polytopes in its direction), and no interval than its velocities
        and the feed allow.
        """
        if self.refused:
            return np.inf
        return float(sum(self._least(stretch, q) for stretch, q in zip(self.one.stretches, self.sites, strict=True)))

    def _least(self, stretch: Stretch, q: Floats) -> float:
        way, length = np.abs(np.diff(q, axis=0)), np.diff(stretch.s)
        most = _largest_feed(stretch)
        fed = _ROUND * np.max(way / length[:, None], axis=0) * most
        limits = replace(self.limits, velocity=np.minimum(self.limits.velocity, np.maximum(fed, 1e-9)))
        rest = float(rest_seconds(q[:1], q[-1:], limits, Law.DOG_LEG)[0])
        return max(rest, float(np.maximum(np.max(way / self.limits.velocity, axis=1), length / most).sum()))

    def plans(self) -> tuple[Plan, ...]:
        """The motion of each stretch, curvature included; planned anew at each call."""
        own = self.one.shift(self.axis)
        result = []
        for stretch, q in zip(self.one.stretches, self.sites, strict=True):
            axis = stretch.axis if self.one.fixed else np.tile(self.axis, (len(q), 1))
            path = MachinePath.through(stretch.s, np.hstack((q, stretch.tip + own, axis)), np.zeros(len(q), dtype=bool))
            run = plan if np.isfinite(self.limits.jerk).all() else plan_second_order
            result.append(run(path, self.limits, stretch.feed))
        return tuple(result)

    @property
    def seconds(self) -> float:
        """Planned time of the cuts; inf where the machine cannot run them."""
        return self._planned[0]

    @property
    def seconds_allowed(self) -> float:
        """As `seconds`; inf where the tool touches what it must not."""
        return np.inf if self.touching else self.seconds

    @property
    def limiting(self) -> tuple[str, str]:
        """The axis and the order that cost most of the planned time, ("feed", "") where that does; empty where nothing is
        cut or the machine states no jerk."""
        return self._planned[1]

    @cached_property
    def _planned(self) -> tuple[float, tuple[str, str]]:
        """Seconds, and what limits."""
        if self.refused:
            return np.inf, ("", "")
        plans = self.plans()
        seconds = float(sum(made.seconds for made in plans))
        if not plans or not np.isfinite(self.limits.jerk).all():
            return seconds, ("", "")
        shares = [made.shares for made in plans]
        limits = np.sum([one.limits for one in shares], axis=0)[:, :len(self.machine.axis_names)]
        order, joint = np.unravel_index(int(limits.argmax()), limits.shape)
        if sum(one.feed for one in shares) >= float(limits.max()):
            return seconds, ("feed", "")
        return seconds, (self.machine.axis_names[int(joint)], ORDERS[int(order)])

    def rotary(self) -> dict[str, float]:
        """Rotary positions at the start of the cuts, degrees; of machines without rotary joints the axis as I, J, K."""
        row = self.q[int(np.argmin(self.one.rapid))]
        angles = {name: float(row[j]) / DEG for j, name in enumerate(self.machine.axis_names) if self.machine.rotary[j]}
        return angles or dict(zip("IJK", self.axis.tolist(), strict=True))


def _largest_feed(stretch: Stretch) -> float:
    """mm/s, over the stretch"""
    first, last = np.searchsorted(stretch.feed.edges, [stretch.s[0], stretch.s[-1]], side="right") - 1
    return float(stretch.feed.values[first:max(last, first + 1)].max())


def turned(one: Pass, axis: Floats, machine: Machine, collides: Callable[[Pass, Floats], str] = no_bodies) -> Turned:
    """The pass with its tool along `axis` (3,), on the branch inside travel whose rotary joints are least turned."""
    move = one.shift(axis)
    tips = [one.tip + move, *(stretch.tip + move for stretch in one.stretches)]
    axes = [one.axes, *(s.axis for s in one.stretches)] if one.fixed else [np.tile(axis, (len(tip), 1)) for tip in tips]
    q, refused = _solved(one, machine, np.concatenate(tips), np.concatenate(axes))
    rows, *sites = np.split(q, np.cumsum([len(tip) for tip in tips])[:-1])
    return Turned(one, axis, machine, rows, tuple(sites), refused, collides)


def _solved(one: Pass, machine: Machine, tip: Floats, axis: Floats) -> tuple[Floats, str]:
    """Joints (N, J) of poses that are run through, and what stands against them."""
    found = one.kin.inverse(tip, one.kin.nearest_axis(axis), near=machine.home)
    rotary = np.array(machine.rotary)
    found[:, :, rotary] = np.unwrap(found[:, :, rotary], axis=1)
    found = np.stack([_wound(q, machine, rotary) for q in found])
    over = np.maximum(machine.limits.lower - found, found - machine.limits.upper).max(axis=1)
    size = np.abs(found[:, :, rotary]).sum(axis=(1, 2)) + 1e6 * np.maximum(over, 0.0).max(axis=1)
    best = int(np.argmin(np.where(np.isfinite(size), size, np.inf)))
    if not np.isfinite(size[best]):
        return found[best], "out of reach"
    if over[best].max() > TRAVEL_SLACK:
        return found[best], _outside(found[best], over[best], machine)
    if reach.is_checked(one.kin) and not reach.inside(one.kin, found[best]):
        return found[best], "out of the reach of the parallel machine"
    return found[best], ""


def _wound(q: Floats, machine: Machine, rotary: Bools) -> Floats:
    """Joints (N, J) of one branch, each rotary joint by whole turns to where its travel is kept best."""
    turns = 2.0 * np.pi * np.array([0.0, -1.0, 1.0])
    result = q.copy()
    for j in np.flatnonzero(rotary):
        low, high = machine.limits.lower[j] - q[:, j].min(), q[:, j].max() - machine.limits.upper[j]
        over = [max(float(low - t), float(high + t), 0.0) for t in turns]
        result[:, j] += turns[int(np.argmin(over))]
    return result


def _outside(q: Floats, over: Floats, machine: Machine) -> str:
    j = int(over.argmax())
    limits, unit, name = machine.limits, (1.0 / DEG if machine.rotary[j] else 1.0), "degrees" if machine.rotary[j] else "mm"
    low, high = float(q[:, j].min()), float(q[:, j].max())
    value = high if high > limits.upper[j] else low
    return (f"travel: axis {machine.axis_names[j]} at {value * unit:.3f} {name}, allowed {limits.lower[j] * unit:.3f} to "
            f"{limits.upper[j] * unit:.3f}")
