"""The choice of tool axes: per pass what was tried, and the plans side by side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from postproc.base.options import Orientation
from postproc.base.program_time import ProgramTime
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.plans import OrientationPlan, StateTable
from postproc.orientation.plans.reoriented import reoriented
from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Toolpath


@dataclass(frozen=True)
class PlanProof:
    """That the program of a plan was made for a controller: written (`ok`) or refused; `bounded`: every block of it."""

    plan: Orientation
    controller: str
    ok: bool
    bounded: bool = True


@dataclass(frozen=True)
class OrientationChoice:
    """What was found: per pass what was tried, and the plans side by side.

    Attributes:
        table: the states out of which the plans are made
        paper: the paper's choice in each pass (a vertex along the mean direction, smallest angles), elsewhere the own axis
        programs: times on the control of the programs of "keep" and "auto", where a clock was given
        proof: what became of the program of the plan that was asked for; None where none was made
        turned: the path of "auto" with axes that turn along its cuts; None where none do
    """

    work: PassContext
    tried: tuple[PassSearch, ...]
    table: StateTable
    plans: dict[Orientation, OrientationPlan]
    paper: OrientationPlan
    proof: PlanProof | None = None
    programs: Mapping[Orientation, ProgramTime] = field(default_factory=dict)
    turned: Toolpath | None = None

    @property
    def gain(self) -> float | None:
        """Percent of the time of "keep" on the control that "auto" saves; None where one of them is not known."""
        before, now = self.programs.get("keep"), self.programs.get("auto")
        return 100.0 * (1.0 - now.seconds / before.seconds) if before and now and before.seconds > 0.0 else None

    def toolpath(self, name: Orientation) -> Toolpath:
        """The CL path with the axes of a plan."""
        if name == "auto" and self.turned is not None:
            return self.turned
        return reoriented(self.work, self.plans[name].picked)
