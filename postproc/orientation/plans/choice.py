"""The choice of tool axes: per pass what was tried, and the plans side by side."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.base.options import Orientation
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.plans import OrientationPlan, StateTable
from postproc.orientation.plans.reoriented import reoriented
from toolpaths.toolpath import Toolpath


@dataclass(frozen=True)
class PlanProof:
    """That the program of a plan was made for a controller: written (`ok`) or refused."""

    plan: Orientation
    controller: str
    ok: bool


@dataclass(frozen=True)
class OrientationChoice:
    """What was found: per pass what was tried, and the plans side by side.

    Attributes:
        table: the states out of which the plans are made
        paper: the paper's choice in each pass (a vertex along the mean direction, smallest angles), elsewhere the own axis
        proof: what became of the program of the plan that was asked for; None where none was made
    """

    work: PassContext
    tried: tuple[PassSearch, ...]
    table: StateTable
    plans: dict[Orientation, OrientationPlan]
    paper: OrientationPlan
    proof: PlanProof | None = None

    def toolpath(self, name: Orientation) -> Toolpath:
        """The CL path with the axes of a plan."""
        return reoriented(self.work, self.plans[name].picked)
