"""The planned time of a file whose tool axes are chosen again at each place of its part."""

from __future__ import annotations

import numpy as np

from postproc.base.options import Options
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.placement.bodies import StationaryBodies
from postproc.placement.place_times import TimedPlace, Timer, extents, limit_of, limiting_times, refused_pass
from postproc.placement.reasons import NoOrientation, NoSafePlane
from postproc.placement.space import Space
from postproc.setup.model import SetupFile
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity

_CHOICES = 400
"""choices of the axis of a pass, all places together"""
_LEAST, _MOST = 8, 40
"""places"""


class OrientedTimer(Timer):
    """As `Timer`, with the plan that `options.orient` names instead of the axes of the file.

    There is no bound on what a choice of axes can reach, and the axes of the file need not be inside travel:
    every place costs a whole choice, so that few are looked at.
    """

    def __init__(self, work: PassContext, space: Space, setup: SetupFile, options: Options,
                 bodies: StationaryBodies | None) -> None:
        super().__init__(work, space, setup.joints.singular_distance, bodies)
        self.setup, self.options = setup, options
        self.most = min(_MOST, max(_LEAST, _CHOICES // len(work.passes)))

    def _tried(self, place: Floats, best: float) -> TimedPlace:
        made = super()._tried(place, best)
        self.planned += 0 if made.refused else len(self.work.passes)
        return made

    def seen(self, place: Floats) -> TimedPlace:
        """See the base class: a whole choice, without a bound."""
        why = self.stands(place)
        if why is not None:
            return self._refused(place, why)
        here = self.setup.model_copy(update={"part": self.space.part(place)})
        choice, found = orient(self.work.toolpath, self.machine, here, self.options)
        if choice is None:
            return self._refused(place, NoOrientation(next(d for d in found if d.severity == Severity.ERROR)))
        return self._of(place, choice)

    def _of(self, place: Floats, choice: OrientationChoice) -> TimedPlace:
        plan = choice.plans[self.options.orient]
        low, high = extents(plan.picked)
        refused = refused_pass(plan.picked)
        if refused is not None or not np.isfinite(plan.seconds):
            return self._refused(place, refused or NoSafePlane(), low, high)
        singular, why = self._singular(plan.picked)
        if why is not None:
            return self._refused(place, why, low, high, singular)
        cutting = float(plan.cuts.sum())
        limiting = limiting_times(zip(plan.cuts.tolist(), map(limit_of, plan.picked), strict=True))
        return TimedPlace(place, plan.seconds, cutting, plan.seconds - cutting, plan.seconds, low, high, singular, None,
                          limiting)
