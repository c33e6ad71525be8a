"""Where the seconds of a plan go: cuts, turns of the tool between them, and all other ways."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from postproc.orientation.allowed import SAME
from postproc.orientation.passes import Work
from postproc.orientation.plans import OrientationPlan
from postproc.orientation.timed import Turned
from postproc.orientation.turns import between, ends
from toolpaths.rotations import angle_between


@dataclass(frozen=True)
class PlanShares:
    """Seconds of a plan; inf where the machine cannot run it.

    Attributes:
        cutting: planned cuts
        turning: back, unclamp, index, clamp and approach wherever neighbouring passes differ in their axis
        other: rapids inside and between passes, from home and back, tool changes
        turns: how often neighbouring passes differ
    """

    cutting: float
    turning: float
    other: float
    turns: int


def shares_of(plan: OrientationPlan, work: Work) -> PlanShares:
    """The parts of a plan's seconds."""
    picked = plan.picked
    cutting = float(sum(made.seconds for made in picked))
    turned = [(a, b) for a, b in pairwise(picked) if turns(a, b)]
    turning = float(sum(_way(a, b, work) for a, b in turned))
    return PlanShares(cutting, turning, plan.seconds - cutting - turning, len(turned))


def turns(a: Turned, b: Turned) -> bool:
    """Whether the tool turns between two passes."""
    return bool(angle_between(a.axis, b.axis) > SAME)


def _way(a: Turned, b: Turned, work: Work) -> float:
    """Seconds from the end of one pass to the beginning of the next."""
    return float(between([ends(a, work)], [ends(b, work)], work, b.one.by_home, b.one.tool != a.one.tool)[0, 0])
