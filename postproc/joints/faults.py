"""What is reported about the plan of the joints: rewinds, singular directions, why a branch was taken."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.kinematics.base import SPIN
from machines.machine import Machine
from postproc.joints.plan import RejectedStart, Rewind
from postproc.joints.run_plan import RunPlan
from postproc.joints.states import BAD, CUTS, REWINDS, SECONDS, WRONG
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, info, warning
from toolpaths.units import DEG

_REASONS = ((BAD, "exceed axis travel"), (REWINDS, "need more rewinds"), (CUTS, "need more rewinds in the cut"),
            (WRONG, "stand on the side that the set-up does not prefer"), (SECONDS, "are slower"))


def planned(plan: RunPlan, machine: Machine, moves: Moves, file: str) -> list[Diagnostic]:
    """Everything about a plan; `moves` are those of the CL file."""
    return [*_rewinds(plan, machine, moves, file), *_events(plan, machine, moves, file), *_choices(plan, moves, file)]


def opened(parameters: Sequence[tuple[str, float, float]], seconds: Sequence[float] = ()) -> str:
    """What became of open parameters (name, least, greatest; rad or mm), in words; `seconds` as of `ParameterCurve`."""
    turned = [f"the tool is turned about its own axis by {low / DEG:.3f} to {high / DEG:.3f} degrees"
              for name, low, high in parameters if name == SPIN]
    carried = [f"{name} {low:.3f} to {high:.3f}" for name, low, high in parameters if name != SPIN]
    gain = f" (joints {seconds[0]:.2f} s; by the carriers alone {seconds[1]:.2f} s)" if seconds else ""
    return ", ".join([*turned, *([f"the platform is carried by {', '.join(carried)} mm{gain}"] if carried else [])])


def _rewinds(plan: RunPlan, machine: Machine, moves: Moves, file: str) -> list[Diagnostic]:
    origin = plan.refined.origin[plan.refined.rewind]
    done = [r for s in plan.solutions for r in s.rewinds]
    greedy = sum(s.greedy for s in plan.solutions)
    result = []
    for cuts, write in ((False, info), (True, warning)):
        lines = [int(moves.line[m]) for m, r in zip(origin, done, strict=True) if r.cuts == cuts]
        if lines:
            first = next(r for r in done if r.cuts == cuts)
            where = "in the cut" if cuts else "where the tool does not cut"
            result.append(write("rewind.made", f"travel ends within a run: the tool is drawn back {where}, "
                                f"{_travels(machine, first)} (nearest joints throughout would take {greedy} rewinds)",
                                file=file, lines=lines[:6], count=len(lines)))
    return result


def _travels(machine: Machine, rewind: Rewind) -> str:
    travels = [(k, a / DEG, b / DEG) for k, rotary, a, b in zip(
        machine.axis_names, machine.rotary, rewind.before, rewind.after, strict=True) if rotary and abs(a - b) > 1e-9]
    return ", ".join(f"{k} goes from {a:.3f} to {b:.3f} degrees" for k, a, b in travels)


def _events(plan: RunPlan, machine: Machine, moves: Moves, file: str) -> list[Diagnostic]:
    return [info("singular.led", f"the tool passes the direction of axis {machine.axis_names[e.joint]} at "
                 f"{e.miss / DEG:.4f} degrees: its axis is led past by {e.deviation / DEG:.4f} degrees at most, so that "
                 f"{machine.axis_names[e.joint]} turns at {e.after / DEG:.1f} degrees/s, not {e.before / DEG:.1f}, at the "
                 "programmed feed", file=file, lines=sorted({int(moves.line[first]), int(moves.line[last])}))
            for first, last, e in plan.events]


def _choices(plan: RunPlan, moves: Moves, file: str) -> list[Diagnostic]:
    """Why the runs begin as they do, by the reason that decided against the best of the others."""
    lines: dict[str, list[int]] = {}
    starts = np.flatnonzero(moves.link)
    for start, solution in zip(starts, plan.solutions, strict=True):
        if solution.rejected_starts and _reason(solution.rejected_starts):
            lines.setdefault(_reason(solution.rejected_starts), []).append(int(moves.line[start]))
    return [info("joints.chosen", f"the other rotary solutions {reason}", file=file, lines=found[:6], count=len(found))
            for reason, found in sorted(lines.items())]


def _reason(rejected_starts: tuple[RejectedStart, ...]) -> str:
    """What decides against the rejected candidate that comes nearest; "" where it is as good."""
    best: Floats = min((x.extra_cost for x in rejected_starts), key=lambda cost: tuple(cost.tolist()))
    for column, text in _REASONS:
        if best[column] > 1e-9:
            return text
    return ""
