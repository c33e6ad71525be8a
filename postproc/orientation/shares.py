"""Where the seconds of a plan go: cuts, turns of the tool between them, and all other ways."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from postproc.orientation.allowed import SAME
from postproc.orientation.plans import OrientationPlan
from postproc.orientation.timed import Turned
from toolpaths.rotations import angle_between


@dataclass(frozen=True)
class PlanShares:
    """Seconds of a plan; inf where the machine cannot run it.

    Attributes:
        cutting: planned cuts
        turning: back, unclamp, index, clamp and approach wherever a pass begins as the one before it did not end
        other: rapids inside and between passes, from home and back, tool changes
        turns: how often that is
    """

    cutting: float
    turning: float
    other: float
    turns: int


def shares_of(plan: OrientationPlan) -> PlanShares:
    """The parts of a plan's seconds."""
    turned = np.array([turns(a, b) for a, b in pairwise(plan.picked)], dtype=np.bool_)
    turning = float(plan.ways[1:-1][turned].sum())
    cutting = float(plan.cuts.sum())
    return PlanShares(cutting, turning, plan.seconds - cutting - turning, int(turned.sum()))


def turns(a: Turned, b: Turned) -> bool:
    """Whether tool or rotary joints turn from the end of one pass to the beginning of the next."""
    rotary = np.array(a.machine.rotary)
    apart = np.abs(np.exp(1j * a.q[-1, rotary]) - np.exp(1j * b.q[0, rotary])).max(initial=0.0)
    return bool(apart > SAME or angle_between(a.axis, b.axis) > SAME)
