"""Where the seconds of a plan go: cuts, turns of the tool between them, and all other paths."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from machines.machine import Machine
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.passes.allowed import SAME
from postproc.orientation.plans.plans import OrientationPlan
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between


@dataclass(frozen=True)
class PlanShares:
    """Seconds of a plan; inf where the machine cannot run it.

    Attributes:
        cutting: planned cuts
        turning: all paths on which a rotary joint turns: back, unclamp, index, clamp, approach; from home and back home too
        other: rapids inside and between passes, other travel from home and back, tool changes
        turns: how many paths turn
    """

    cutting: float
    turning: float
    other: float
    turns: int


def shares_of(plan: OrientationPlan) -> PlanShares:
    """The parts of a plan's seconds."""
    picked, machine = plan.picked, plan.picked[0].machine
    begins, ends = ([_apart(machine, machine.home, made.q[at]) for made in picked] for at in (0, -1))
    between = [begins[n + 1] or ends[n] if b.one.by_home else turns(a, b) for n, (a, b) in enumerate(pairwise(picked))]
    turned = np.array([begins[0], *between, ends[-1]])
    turning, cutting = float(plan.links[turned].sum()), float(plan.cuts.sum())
    return PlanShares(cutting, turning, plan.seconds - cutting - turning, int(turned.sum()))


def turns(a: Candidate, b: Candidate) -> bool:
    """Whether tool or rotary joints turn from the end of one pass to the beginning of the next."""
    return _apart(a.machine, a.q[-1], b.q[0]) or bool(angle_between(a.axis, b.axis) > SAME)


def _apart(machine: Machine, a: Floats, b: Floats) -> bool:
    """Whether rotary joints differ, whole turns aside."""
    rotary = np.array(machine.rotary)
    return bool(np.abs(np.exp(1j * a[rotary]) - np.exp(1j * b[rotary])).max(initial=0.0) > SAME)
