"""The time of what a conversion has written."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from postproc.base.program_time import ControlPlan, ProgramTime
from postproc.cycle_time.estimate import Estimate, estimate, executed_by
from postproc.cycle_time.model import CycleTimeModel, load_model, model_name
from postproc.cycle_time.phases import summed
from postproc.cycle_time.report import as_dict, clock
from postproc.cycle_time.sampled import sampled
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.result import PostResult
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import read_value

BAND_UP_TO = 20_000
"""blocks up to which a conversion also gives the band, which takes some ten estimates"""


def model_of(result: PostResult, model: str = "") -> CycleTimeModel:
    """The model of a conversion's controller, or the one of that name or file, as formulas.

    Raises:
        DiagnosticError: where the file is none.
    """
    return _model(result, model).quick()


def _model(result: PostResult, model: str) -> CycleTimeModel:
    return read_value(load_model(model or model_name(result.controller_name, result.controller.writer)))


@dataclass(frozen=True)
class ControlClock:
    """The clock of choices: the time of a written program under the model of its controller, or under `model`."""

    model: str = ""

    def __call__(self, result: PostResult, band: bool = False) -> ProgramTime:
        """By the model's formulas; many programs are compared."""
        return self._time(result, model_of(result, self.model), band)

    def executed(self, result: PostResult) -> ProgramTime:
        """With its band, the control executed where the model says how."""
        return self._time(result, _model(result, self.model), band=True)

    def plan(self, made: PostResult) -> ControlPlan | None:
        """What the control can do of planned passes; None where that is not known."""
        if made.compensation is not None:
            return None
        from postproc.cycle_time.control_plan import control_plan  # SciPy, which other feeds do without

        try:
            return control_plan(made, _model(made, self.model))
        except (ValueError, ArithmeticError):
            return None

    def _time(self, result: PostResult, planner: CycleTimeModel, band: bool) -> ProgramTime:
        blocks = from_conversion(result)
        rows = len(result.comparison.moves) if result.comparison is not None else 0
        if not len(blocks) or blocks.move is None:
            return ProgramTime(0.0, (0.0, 0.0), 0.0, planner.kind, np.zeros(rows))
        found = estimate(blocks, result.machine, planner, with_band=band and len(blocks) <= BAND_UP_TO)
        known = blocks.move >= 0
        moves = summed(found.timed.seconds[known], blocks.move[known], rows)
        return ProgramTime(found.seconds, found.band, found.lower_bound, f"model {planner.kind}", moves)


def program_clock(model: str = "") -> ControlClock:
    """The clock of choices under the model of a program's controller, or under `model`."""
    return ControlClock(model)


def estimate_of(result: PostResult, model: str = "", executed: bool = False) -> Estimate | None:
    """The estimate under the model of the controller, or under `model`; None where nothing is written. With `executed`
    the control is executed where the model says how, as `postproc time` does: about 0.3 ms a block; without it over some
    stretches where axes turn (`sampled.py`)."""
    if not result.ok:
        return None
    planner = _model(result, model)
    blocks = from_conversion(result)
    if not len(blocks):
        return None
    band = len(blocks) <= BAND_UP_TO
    if not executed:
        known = sampled(blocks, planner.of_machine(result.machine))
        return estimate(blocks, result.machine, planner.quick(), with_band=band, times=known.times, off=known.off)
    made = estimate(blocks, result.machine, planner, with_band=band)
    return made if executed_by(made.timed) else replace(made, model=planner.quick())


def figures(e: Estimate | None) -> dict[str, Any]:
    """The keys of `convert --json` that say times; s, null where there are none."""
    if e is None:
        return {"cycle_time_s": None, "lower_bound_s": None, "band_s": None, "time": None}
    d = as_dict(e)
    band = d["band_s"] if e.uncertainties else None
    more = ("model", "assumed", "cutting_s", "rapids_s", "causes", "feed_s", "limiting", "operations",
            "most_expensive")
    return {"cycle_time_s": e.seconds, "lower_bound_s": e.lower_bound, "band_s": band, "time": {key: d[key] for key in more}}


def text(e: Estimate) -> str:
    """One line for people."""
    band = f", 95 % between {clock(e.band[0])} and {clock(e.band[1])}" if e.uncertainties else ""
    about, how = ("about ", "by formulas; `postproc time` runs the control") if e.model.kind == "formulas" else (
        "", f"model {e.model.kind}")
    return f"time: {about}{clock(e.seconds)}{band} ({how}; lower bound {clock(e.lower_bound)})"
