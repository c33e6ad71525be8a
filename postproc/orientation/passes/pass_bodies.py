"""Bodies next to the passes of a choice of orientations: a tool that stands along one axis only moves, it does not turn."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from postproc.collision.bodies import Scene, Touch, scene, touches
from postproc.collision.form import ToolForm, tool_form
from postproc.collision.swept import Swept, along_curves, joined
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.orientation.passes.reasons import Touching
from postproc.reference.holes import Phase
from toolpaths.arrays import Bools, Floats
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves

_SAME = 1e-6
"""rad"""


class PassBodies:
    """What the passes of `work` would touch; implements `orientation.allowed.Bodies`."""

    def __init__(self, work: PassContext, bodies: Scene, forms: dict[int, ToolForm]) -> None:
        self.work, self.bodies, self.forms = work, bodies, forms
        self._travels: dict[int, Swept] = {}

    def touching(self, one: Pass, axis: Floats) -> Touching | None:
        """Which pair comes nearest to being through each other where a pass is run with its tool along `axis` (3,)."""
        found = self.touches(one, axis)
        if not found:
            return None
        worst = min(found, key=lambda touch: touch.distance - touch.limit)
        return Touching(worst.tool, worst.part, worst.body.name, worst.distance, worst.limit,
                        int(self.work.moves.line[worst.place]))

    def touches(self, one: Pass, axis: Floats) -> list[Touch]:
        """All pairs that come too near.

        A pass whose axis is another than the file's is come to and left along that axis, down from the safe
        plane and back up; with the file's own axis it is come to as the file does.
        """
        form = self.forms[one.tool]
        if one.fixed or angle_between(axis, one.axis) < _SAME:
            rows = np.arange(*one.rows)
            travel = along_curves(self._curves.take(rows), rows)
        else:
            travel = joined([self._travel(one).turned(one.shift(axis), axis), self._legs(one, axis)])
        drilling = self._drilling[travel.row]
        return touches(self.bodies, form, travel, travel.take(np.flatnonzero(~drilling)) if drilling.any() else None)

    def _travel(self, one: Pass) -> Swept:
        """From the first pose of a pass to its last, with the axis of the file."""
        if one.number not in self._travels:
            rows = np.arange(one.rows[0] + 1, one.rows[1])
            self._travels[one.number] = along_curves(self._curves.take(rows), rows)
        return self._travels[one.number]

    def _legs(self, one: Pass, axis: Floats) -> Swept:
        """Down to the first pose and up from the last."""
        space, ends = self.work.space, one.tip[[0, -1]] + one.shift(axis)
        lift = np.maximum(space.plane(axis, True, 1.0) - (ends - space.centre) @ axis, 0.0)
        tip = np.stack((ends, ends + lift[:, None] * axis), axis=1)
        return Swept(tip, np.tile(axis, (2, 2, 1)), np.array(one.rows) - [0, 1])

    @cached_property
    def _curves(self) -> Curves:
        return self.work.moves.curves()

    @cached_property
    def _drilling(self) -> Bools:
        """(M,) moves in a hole: a tap is larger than its core, a drill's tip deeper than a flat bottom. The
        rapid down to the hole is none of them."""
        moves = self.work.moves
        return np.asarray((moves.hole >= 0) & (moves.phase > Phase.APPROACH))


def pass_bodies(work: PassContext, file: str) -> tuple[PassBodies | None, list[Diagnostic]]:
    """The bodies of a set-up next to the passes of `work`; None where it (`file`) names none, or a mesh is no good."""
    bodies, found = scene(work.setup, [("", work.placement)], file)
    if bodies is None:
        return None, found
    forms, more = forms_of(work, file)
    found += more
    return (None if has_errors(found) else PassBodies(work, bodies, forms)), found


def forms_of(work: PassContext, file: str) -> tuple[dict[int, ToolForm], list[Diagnostic]]:
    """The forms of all tools that passes use, by index."""
    forms, found = {}, []
    for index in sorted({one.tool for one in work.passes}):
        tool = work.toolpath.tools[index] if index >= 0 else None
        number = tool.number if tool else 0
        forms[index], more = tool_form(number, tool, work.setup.tools.get(str(number)), file)
        found += more
    return forms, found
