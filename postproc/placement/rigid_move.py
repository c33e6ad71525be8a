"""A toolpath that has been cut into passes, moved as one body: nothing is smoothed or cut again."""

from __future__ import annotations

from dataclasses import replace

from postproc.orientation.passes.passes import CuttingStretch, Pass, PassContext
from postproc.path.links import safe_space
from postproc.setup.model import Placement


def moved(work: PassContext, placement: Placement) -> PassContext:
    """The passes of `work`, which stands with the part frame on the table frame, at another placement.

    A smoothed cut is one of its points, wherever these stand: the sites along it stay what they are.
    """
    moves = work.moves.placed(placement)
    return replace(work, placement=placement, moves=moves, space=safe_space(moves, work.setup, placement),
                   passes=tuple(_pass(one, placement) for one in work.passes))


def _pass(one: Pass, placement: Placement) -> Pass:
    return replace(one, tip=placement.points(one.tip), axes=placement.directions(one.axes),
                   axis=placement.directions(one.axis[None])[0],
                   contact=one.contact.turned(placement.rotation),
                   stretches=tuple(_stretch(each, placement) for each in one.stretches))


def _stretch(one: CuttingStretch, placement: Placement) -> CuttingStretch:
    return replace(one, tip=placement.points(one.tip), axis=placement.directions(one.axis))
