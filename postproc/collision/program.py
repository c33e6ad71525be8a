"""The whole program next to the bodies of the set-up: every block that is run, linking moves too, as the control runs it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from postproc.collision.bodies import Scene, Touch, scene, touches
from postproc.collision.executed_path import path_of
from postproc.collision.form import PARTS, ToolForm, lever_of, tool_form
from postproc.collision.swept import Swept
from postproc.job.places import at_place
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, begins
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors, info
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from postproc.job.job import Job


def check_bodies(motion: Motion, executed: BlockPoses, job: Job, owner: Ints,
                 faults: Faults) -> list[Diagnostic]:
    """Errors where a tool comes nearer to part, table or fixture than the set-up allows; nothing without [bodies].

    Args:
        owner: (E,) the move that each block serves
    """
    travels, found = _travels(motion, executed, job, owner)
    for one in travels:
        lost = one.unbounded
        found += [] if not len(lost) else [_unbounded(motion, one.moves, owner, lost, faults)]
        found += _noted(one, motion, owner, faults, at_place(job.places, job.repeats, one.moves))
    return found


def touching_parts(motion: Motion, executed: BlockPoses, job: Job, owner: Ints,
                   part: Ints) -> dict[int, Touch]:
    """What tools come nearest to being through in each part of a program; parts where they keep clear are not in it.

    Args:
        part: (E,) the part of the program that each block belongs to
    """
    result: dict[int, Touch] = {}
    for one in _travels(motion, executed, job, owner)[0]:
        of = part[one.travel.row]
        order = np.argsort(of, kind="stable")
        for pieces in np.split(order, np.flatnonzero(np.diff(of[order])) + 1):
            for touch in one.touches(pieces):
                k = int(of[pieces[0]])
                result[k] = min(touch, result.get(k, touch), key=lambda each: each.distance - each.limit)
    return result


@dataclass(frozen=True)
@arrays(drilling="E", unbounded="U")
class _ToolMotion:
    """All that one tool does in a program: its path next to the bodies.

    Attributes:
        moves: the reference, a hole without pecks
        drilling (E,): blocks in a hole
        unbounded: blocks for which the pieces of the path are no proof
    """

    bodies: Scene
    form: ToolForm
    travel: Swept
    moves: Moves
    drilling: Bools
    unbounded: Ints

    def touches(self, pieces: Ints) -> list[Touch]:
        """What comes too near on some pieces of the path."""
        travel, drilling = self.travel.take(pieces), self.drilling[self.travel.row[pieces]]
        return touches(self.bodies, self.form, travel, travel.take(np.flatnonzero(~drilling)) if drilling.any() else None)


def _travels(motion: Motion, executed: BlockPoses, job: Job,
             owner: Ints) -> tuple[list[_ToolMotion], list[Diagnostic]]:
    """The path of each tool whose form is known; none without [bodies]."""
    if job.setup.bodies is None:
        return [], []
    file = job.options.setup
    bodies, found = scene(job.setup, [(place.name, place.placement) for place in job.places], file)
    if bodies is None:
        return [], found
    moves, result = job.moves.without_pecks(), []
    drilling = _drilling(moves)[np.minimum(owner, len(moves) - 1)] & (owner < len(moves))
    moving = _moving(motion)
    index = _tools(motion, job, moves, owner)
    for one in np.unique(index[moving]).tolist():
        tool = job.toolpath.tools[one] if one >= 0 else None
        number = tool.number if tool else 0
        form, more = tool_form(number, tool, job.setup.tools.get(str(number)), file)
        found += [d for d in more if d not in found]
        if len(form.pieces) and not has_errors(more):
            rows = np.flatnonzero(index == one)
            travel, lost = path_of(motion, executed, job.kinematics_of(number), rows, lever_of(form))
            result.append(_ToolMotion(bodies, form, travel, moves, drilling, lost))
    return result, found


def _tools(motion: Motion, job: Job, moves: Moves, owner: Ints) -> Ints:
    """(E,) index of the tool in the spindle among those of the CL file: that of the move, else the last one of its number.

    A file may describe several tools under one number; a program that calls none has the same one from its beginning.
    """
    numbers = np.array([tool.number for tool in job.toolpath.tools] + [0])
    result = moves.tool[np.minimum(owner, len(moves) - 1)].astype(np.int64)
    if not job.setup.output.tool_call:
        return result
    for number in np.unique(motion.tool).tolist():
        rows = np.flatnonzero(motion.tool == number)
        known = np.flatnonzero(numbers[:-1] == max(number, 0))
        own = (result[rows] >= 0) & (numbers[result[rows]] == number)
        last = np.maximum.accumulate(np.where(own, np.arange(len(rows)), -1))
        first = int(known[0]) if len(known) else -1
        result[rows] = np.where(last >= 0, result[rows[np.maximum(last, 0)]], first)
    return result


def _moving(motion: Motion) -> Bools:
    """(E,) blocks that move something."""
    return np.asarray((motion.end != begins(motion, np.arange(len(motion)))).any(axis=1) | (motion.code == 2))


def _drilling(moves: Moves) -> Bools:
    """(M,) moves in a hole: a tap is larger than its core, a drill's tip deeper than a flat bottom. The rapid
    down to the hole is none of them."""
    return np.asarray((moves.hole >= 0) & (moves.phase > Phase.APPROACH))


def _noted(one: _ToolMotion, motion: Motion, owner: Ints, faults: Faults,
           where: Callable[[Ints], str]) -> list[Diagnostic]:
    """One error per pair, at its worst place; else what was compared. `where`: the part's place at which moves are made."""
    result: list[Diagnostic] = []
    found = one.touches(np.arange(len(one.travel)))
    if not found and len(one.travel):
        return [_clear(one.bodies, one.form, faults)]
    for touch in found:
        code = "collision.gouge" if touch.limit < 0.0 else "collision.near" if touch.distance > 0.0 else "collision.touch"
        lines = _lines(touch.place, motion, (one.moves, owner))
        result.append(faults.error(code, f"{touch}{where(owner[[touch.place]])}", *lines, hint=_hint(touch, motion)))
    return result


def _clear(bodies: Scene, form: ToolForm, faults: Faults) -> Diagnostic:
    """What was compared with what."""
    said: dict[str, list[str]] = {}
    for part, body, limit in bodies.pairs(form):
        kept = f"keeps {limit:g} mm from" if limit >= 0.0 else f"is at most {-limit:g} mm in"
        said.setdefault(f"{PARTS[part]} {kept}", []).append(body.name)
    text = "; ".join(f"{kept} {', '.join(names)}" for kept, names in said.items())
    return info("collision.clear", f"T{form.number}, everywhere on its path: {text}",
                file=faults.gcode or faults.cl)


def _hint(touch: Touch, motion: Motion) -> str:
    if touch.limit < 0.0:
        return "another tool axis or path; [bodies] gouge is what the tolerances of path and mesh may add up to"
    if motion.code[touch.place] == 0:
        return "a higher clearance.distance, or move the fixture; --orient auto avoids paths that touch, where it can"
    return "another tool axis (postproc orient), a longer or slimmer tool, a higher clearance.distance, or move the fixture"


def _lines(row: int, motion: Motion, served: tuple[Moves, Ints]) -> tuple[int, int]:
    """(line of the CL file, line of the program); behind the last move the last one counts."""
    moves, owner = served
    return int(moves.line[min(int(owner[row]), len(moves) - 1)]), int(motion.line[row])


def _unbounded(motion: Motion, moves: Moves, owner: Ints, rows: Ints, faults: Faults) -> Diagnostic:
    return faults.warning("collision.bound", "between its ends a block is looked at in places only: the path of the tool "
                          "has no bound there", *_lines(int(rows[0]), motion, (moves, owner)), count=len(rows),
                          hint="move the part in the set-up (part.origin), away from where the machine is singular, or take "
                          "a smaller --tolerance (shorter blocks)")
