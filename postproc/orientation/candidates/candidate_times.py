"""One pass under one tool axis: joints, travel, a lower bound on its time, and the planned time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import isnan, sin

import numpy as np

from machines.machine import Machine
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import plan, plan_second_order
from postproc.feedrate.rest_to_rest import PointToPointMode, rest_seconds
from postproc.feedrate.shares import LimitShares
from postproc.orientation.passes.allowed import SAME
from postproc.orientation.passes.passes import CuttingStretch, Pass
from postproc.orientation.passes.poses import held_poses, poses
from postproc.orientation.passes.reasons import Refusal, Touching
from postproc.planning.geometry import MachinePath
from postproc.planning.planned import ORDERS, joint_limits, limits_at_feed
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

_ROUND = 1.002
"""for the slope of a joint between sites, which is taken from its differences"""


def no_bodies(one: Pass, axis: Floats) -> Touching | None:
    """Where nothing is known that could be touched, nothing touches."""
    return None


@dataclass(frozen=True)
@arrays(axis="3", q="n J", sites="* _ _")
class Candidate:
    """A pass turned to `axis` (3,) (the CL's own where it is fixed): joints of its rows `q` (n, J) and of the
    sites of each stretch; `refused` says why the machine cannot run it, else None; `held` is the angle, rad,
    asked for of the rotary joint that the axis leaves free, NaN where none is; `noted`: see `slim`."""

    one: Pass
    axis: Floats
    machine: Machine
    q: Floats
    sites: tuple[Floats, ...]
    refused: Refusal | None = None
    collides: Callable[[Pass, Floats], Touching | None] = no_bodies
    held: float = np.nan
    noted: float | None = None

    def same(self, axis: Floats, held: float = np.nan, apart: float = SAME) -> bool:
        """True where axis (3,) and held angle are within `apart` of those of this one."""
        if isnan(held) != isnan(self.held) or abs(held - self.held) > apart:
            return False
        gap = self.axis - axis
        return float(gap @ gap) < (2.0 * sin(0.5 * apart)) ** 2

    @cached_property
    def touching(self) -> Touching | None:
        """Which bodies touch and by how much, None where none do; looked at once, when first asked for."""
        return self.collides(self.one, self.axis)

    @cached_property
    def limits(self) -> JointLimits:
        """of the machine's joints and motors at feed"""
        return limits_at_feed(self.machine, self.one.kin, cutting_force=self.one.cutting_force)

    @cached_property
    def bound(self) -> float:
        """Least seconds that the cuts can take, whatever the plan: inf where the machine cannot run them.

        From rest to rest no joint is faster than over its own path under its own limits and the velocity that
        the feed gives it (along a straight pass that is the reach of the polytopes in its direction), and no
        interval than its velocities and the feed allow.
        """
        if self.refused:
            return np.inf
        return self.drilling + float(sum(self._least(stretch, q) for stretch, q in
                                         zip(self.one.stretches, self.sites, strict=True)))

    def _least(self, stretch: CuttingStretch, q: Floats) -> float:
        travel, length = np.abs(np.diff(q, axis=0)), np.diff(stretch.s)
        most = _largest_feed(stretch)
        fed = _ROUND * np.max(travel / length[:, None], axis=0) * most
        limits = replace(self.limits, velocity=np.minimum(self.limits.velocity, np.maximum(fed, 1e-9)))
        rest = float(rest_seconds(q[:1], q[-1:], limits, PointToPointMode.DOG_LEG)[0])
        return max(rest, float(np.maximum(np.max(travel / self.limits.velocity, axis=1), length / most).sum()))

    @cached_property
    def rapids(self) -> float:
        """Seconds of the rapids of the pass, straight in the joints from rest to rest; inf where it cannot be run."""
        if self.refused:
            return np.inf
        rows = np.flatnonzero(self.one.rapid[1:])
        limits = joint_limits(self.machine.limits)
        return float(rest_seconds(self.q[rows], self.q[rows + 1], limits, PointToPointMode.STRAIGHT).sum())

    @cached_property
    def drilling(self) -> float:
        """Seconds at feed in holes, dwells with them; inf where the pass cannot be run."""
        return np.inf if self.refused else self.one.drilled.seconds(self.q, self.limits)

    def plans(self) -> tuple[Plan, ...]:
        """The motion of each stretch, curvature included; planned again at each call."""
        own = self.one.shift(self.axis)
        result = []
        for stretch, q in zip(self.one.stretches, self.sites, strict=True):
            axis = stretch.axis if self.one.fixed else np.tile(self.axis, (len(q), 1))
            path = MachinePath.through(stretch.s, np.hstack((q, stretch.tip + own, axis)),
                                       np.zeros(len(q), dtype=bool))
            run = plan if self.jerky else plan_second_order
            result.append(run(path, self.limits, stretch.feed))
        return tuple(result)

    @property
    def seconds(self) -> float:
        """Planned time of the cuts, those of holes too; inf where the machine cannot run them."""
        return self._planned[0]

    @property
    def solved(self) -> bool:
        """False where a plan was not solved: its time is longer than need be."""
        return self._planned[3]

    @property
    def knots(self) -> tuple[Floats, ...]:
        """Of the plan of each stretch, along its eased parameter."""
        return self._planned[2]

    @property
    def seconds_allowed(self) -> float:
        """As `seconds`; inf where the tool touches what it must not."""
        return np.inf if self.touching else self.seconds

    @property
    def limiting(self) -> tuple[str, str]:
        """The axis and the order that cost most of the planned time, ("feed", "") where that does; empty
        where nothing is cut or the machine states no jerk."""
        return self._planned[1]

    @cached_property
    def _planned(self) -> tuple[float, tuple[str, str], tuple[Floats, ...], bool]:
        """Seconds, what limits, the knots of the plans, and whether all were solved."""
        if self.noted is not None:
            return self.noted, ("", ""), (), True
        if self.refused:
            return np.inf, ("", ""), (), True
        plans = self.plans()
        seconds = self.drilling + float(sum(made.seconds for made in plans))
        knots = tuple(made.pieces[0].profile.sigma for made in plans)
        binding = self._binding([made.shares for made in plans] if self.jerky else [])
        return seconds, binding, knots, all(made.solved for made in plans)

    @property
    def jerky(self) -> bool:
        """Whether every joint has a limit of its jerk."""
        return bool(np.isfinite(self.limits.jerk).all())

    def _binding(self, shares: list[LimitShares]) -> tuple[str, str]:
        """See `limiting`."""
        if not shares:
            return "", ""
        limits = np.sum([one.limits for one in shares], axis=0)[:, :len(self.machine.axis_names)]
        order, joint = np.unravel_index(int(limits.argmax()), limits.shape)
        if sum(one.feed for one in shares) >= float(limits.max()):
            return "feed", ""
        return self.machine.axis_names[int(joint)], ORDERS[int(order)]

    def slim(self, seconds: float) -> Candidate:
        """Without joints along the pass, but where its cuts begin: to be reported about, not to be planned;
        with the `seconds` known of it, NaN where it was not timed."""
        first = int(np.argmin(self.one.rapid))
        return replace(self, q=self.q[first:first + 1], sites=(), noted=seconds)

    def rotary(self) -> dict[str, float]:
        """Rotary positions at the start of the cuts, degrees; of machines without rotary joints the axis as I, J, K."""
        row = self.q[int(np.argmin(self.one.rapid)) if len(self.q) > 1 else 0]
        angles = {name: float(row[j]) / DEG for j, name in enumerate(self.machine.axis_names) if self.machine.rotary[j]}
        return angles or dict(zip("IJK", self.axis.tolist(), strict=True))


def _largest_feed(stretch: CuttingStretch) -> float:
    """mm/s, over the stretch"""
    first, last = np.searchsorted(stretch.feed.edges, [stretch.s[0], stretch.s[-1]], side="right") - 1
    return float(stretch.feed.values[first:max(last, first + 1)].max())


def turned(one: Pass, axis: Floats, machine: Machine, collides: Callable[[Pass, Floats], Touching | None] = no_bodies,
           held: float = np.nan) -> Candidate:
    """The pass with its tool along `axis` (3,), on the branch inside travel whose rotary joints are least turned."""
    return turned_all(one, axis[None], machine, collides, held)[0]


def turned_all(one: Pass, axes: Floats, machine: Machine, collides: Callable[[Pass, Floats], Touching | None] = no_bodies,
               held: float = np.nan) -> list[Candidate]:
    """`turned` along each of `axes` (S, 3); a pass whose axis is fixed stays as it is."""
    if one.fixed:
        solved = [poses(one, machine, np.concatenate([one.tip, *(s.tip for s in one.stretches)]),
                        np.concatenate([one.axes, *(s.axis for s in one.stretches)]), held)] * len(axes)
    else:
        solved = held_poses(one, machine, axes, held)
    cuts = np.cumsum([len(one.tip), *(len(stretch.s) for stretch in one.stretches)])[:-1]
    result = []
    for axis, (q, refused) in zip(axes, solved, strict=True):
        rows, *sites = np.split(q, cuts)
        result.append(Candidate(one, axis, machine, rows, tuple(sites), refused, collides, held))
    return result
