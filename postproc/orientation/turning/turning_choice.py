"""Which runs are turned, by which field: what was tried, and what was chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Literal

import numpy as np

from postproc.base.options import Options
from postproc.base.program_time import ProgramTime
from postproc.base.progress import Progress
from postproc.orientation.candidates.ranking import load_compiler
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.turning.cutting_runs import CuttingRun, runs_of
from postproc.orientation.turning.tilt_limits import TiltLimits, limits_of
from postproc.orientation.turning.tilt_search import TiltField, TiltSearch, TimeMeasure
from postproc.orientation.turning.turned_toolpath import turned_toolpath
from postproc.planning.planned import limits_at_feed
from toolpaths.dataclass import dataclass
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

Programs = Literal["keep", "turned"]


@dataclass(frozen=True)
class RunChoice:
    """One run: the fields that were found, the one that is taken (the first: its own axes), and planned seconds of each.

    Attributes:
        limits: None where the run is fixed
        seconds: planned, of each field; of machines that state no jerk, by blocks
        taken: number of the field; 0: the own axes
        on_control: s that the control takes for its cuts with the own axes and with those taken; None without a clock
    """

    run: CuttingRun
    limits: TiltLimits | None
    fields: tuple[TiltField, ...] = ()
    seconds: tuple[float, ...] = ()
    taken: int = 0
    on_control: tuple[float, float] | None = None

    @property
    def turned(self) -> bool:
        """Whether its axes are not its own."""
        return self.taken > 0

    @property
    def field(self) -> TiltField | None:
        """What is taken; None where its own axes stay."""
        return self.fields[self.taken] if self.taken else None


@dataclass(frozen=True)
class TurningChoice:
    """All runs of a toolpath, with what is taken of each.

    Attributes:
        programs: times on the control of the programs with the runs' own axes and with those taken, where a clock was given
        passed: why programs with other fields were refused
    """

    work: PassContext
    runs: tuple[RunChoice, ...]
    programs: Mapping[Programs, ProgramTime] = field(default_factory=dict)
    passed: tuple[str, ...] = ()

    def taking(self, picked: Sequence[int]) -> TurningChoice:
        """With field `picked` (one number a run)."""
        return replace(self, runs=tuple(replace(one, taken=k) for one, k in zip(self.runs, picked, strict=True)))

    @property
    def picked(self) -> tuple[int, ...]:
        """The field taken of every run."""
        return tuple(one.taken for one in self.runs)

    @property
    def toolpath(self) -> Toolpath:
        """The CL path with the axes taken."""
        return turned_toolpath(self.work, [one.field for one in self.runs if one.field is not None])

    @property
    def most(self) -> int:
        """Largest number of fields of a run."""
        return max((len(one.fields) for one in self.runs), default=0)

    @property
    def gain(self) -> float | None:
        """Percent of the time on the control that is saved; None where it is not known."""
        before, now = self.programs.get("keep"), self.programs.get("turned")
        return 100.0 * (1.0 - now.seconds / before.seconds) if before and now and before.seconds > 0.0 else None


def turning_choice(work: PassContext, options: Options, progress: Progress | None = None) -> TurningChoice:
    """The fields that make each run of `work` fast, within the set-up's limits and `options.max_tilt`; taken is what plans
    least time, if it is less than that of the own axes."""
    load_compiler()
    runs = runs_of(work, Tolerance(options.tolerance, options.axis_tolerance * DEG), options.max_tilt * DEG)
    found = []
    for number, run in enumerate(runs):
        if progress is not None:
            progress("turning axes", number, len(runs))
        found.append(_tried(work, run, options))
    return TurningChoice(work, tuple(found))


def _tried(work: PassContext, run: CuttingRun, options: Options) -> RunChoice:
    if run.fixed:
        return RunChoice(run, None)
    limits = limits_of(run, work.machine, options.tolerance, options.max_tilt * DEG)
    most = limits_at_feed(work.machine, run.whole.kin, cutting_force=run.whole.cutting_force)
    jerky = bool(np.isfinite(most.jerk).all())
    measures: tuple[TimeMeasure, ...] = ("planned", "blocks") if jerky else ("blocks",)
    search = TiltSearch(run, limits, most)
    fields = [search.kept()]
    for measure in measures:
        made = search.found(measure)
        if made.field.any():
            fields += [made, replace(made, field=0.5 * made.field)]
    fields = [fields[0], *(one for one in fields[1:] if not limits.broken(one.axes, search.joints(one)))]
    seconds = tuple(search.seconds(measures[0], one) for one in fields)
    return RunChoice(run, limits, tuple(fields), seconds, int(np.argmin(seconds)))
