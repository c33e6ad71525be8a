"""The time of what a conversion has written, by formulas held against the control: what they are off depends on how points
stand along curves and how short lines are (0.84 to 1.42 of their time on one path); a few hundred executed blocks say it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from postproc.base.program_time import ControlPlan, ProgramTime
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate, estimate, executed_by, slowed, timed
from postproc.cycle_time.kinds import BY_FORMULAS, KINDS, kinds, time_by_kind
from postproc.cycle_time.levels import stretch
from postproc.cycle_time.model import CycleTimeModel, load_model, model_name
from postproc.cycle_time.phases import BlockTimes, summed
from postproc.cycle_time.report import as_dict, clock
from postproc.cycle_time.source import from_conversion
from postproc.pipeline.result import PostResult
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import read_value

BAND_UP_TO = 20_000
"""blocks up to which a conversion also gives the band, which takes some ten estimates"""
STRETCHES, LONG, EDGE = 4, 150, 15
"""stretches that are executed, blocks of each, and blocks at both its ends that do not count: it begins and ends at rest"""
FEWEST, MOST_OFF = 400, 0.02
"""blocks, and what formulas may be off as a share of the time (BY_FORMULAS), from which stretches are executed: what the
control's clock loads takes half a second of processor time, which a small program is converted in"""
STUDENT, LEAST_OFF = 1.4, 0.03
"""times the deviation of the mean of STRETCHES (Student's 95 % over the normal's), and its least share: what stretches
that begin and end at rest do not show"""
FEW = 2
"""stretches that hold a kind of motion at least whose times they correct"""
RANKED = 1000
"""blocks up to which the control is executed for each of the programs that a choice is made of"""
SURE = np.array([BY_FORMULAS[name] for name in KINDS])
"""what formulas are off by kind of motion"""


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

    def ranked(self, result: PostResult) -> ProgramTime:
        """Without a band, for dozens of programs: the control executed, of long programs over some stretches (`sampled`)."""
        planner = _model(result, self.model)
        blocks = from_conversion(result)
        if len(blocks) <= RANKED:
            return self._time(result, planner, False, blocks)
        return self._time(result, planner.quick(), False, blocks, sampled(blocks, planner.of_machine(result.machine)).times)

    def least(self, result: PostResult) -> float:
        """s where the control had the whole tolerance for itself, whatever the program's points use of it: no sharing of
        it is faster. 0 where more tolerance need not make a control faster."""
        planner = _model(result, self.model)
        if planner.kind != "linuxcnc":
            return 0.0
        blocks = from_conversion(result)
        stated = blocks.tolerance
        whole = np.where(np.isfinite(stated), np.maximum(stated, result.options.tolerance), stated)
        return self._time(result, planner, False, replace(blocks, tolerance=whole)).seconds

    def plan(self, made: PostResult) -> ControlPlan | None:
        """What the control can do of planned passes; None where that is not known."""
        if made.compensation is not None:
            return None
        from postproc.cycle_time.control_plan import control_plan  # SciPy, which other feeds do without

        try:
            return control_plan(made, _model(made, self.model))
        except (ValueError, ArithmeticError):
            return None

    def _time(self, result: PostResult, planner: CycleTimeModel, band: bool, blocks: MotionBlocks | None = None,
              times: BlockTimes | None = None) -> ProgramTime:
        blocks = from_conversion(result) if blocks is None else blocks
        rows = len(result.comparison.moves) if result.comparison is not None else 0
        if not len(blocks) or blocks.move is None:
            return ProgramTime(0.0, (0.0, 0.0), 0.0, planner.kind, np.zeros(rows))
        found = estimate(blocks, result.machine, planner, with_band=band and len(blocks) <= BAND_UP_TO, times=times)
        known = blocks.move >= 0
        moves = summed(found.timed.seconds[known], blocks.move[known], rows)
        return ProgramTime(found.seconds, found.band, found.lower_bound, f"model {planner.kind}", moves)


def program_clock(model: str = "") -> ControlClock:
    """The clock of choices under the model of a program's controller, or under `model`."""
    return ControlClock(model)


def estimate_of(result: PostResult, model: str = "", executed: bool = False) -> Estimate | None:
    """The estimate under the model of the controller, or under `model`; None where nothing is written. With `executed`
    the control is executed where the model says how, as `postproc time` does: about 0.3 ms a block; without it over some
    stretches (`sampled`)."""
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


@dataclass(frozen=True)
class FormulaTimes:
    """Times by formulas, corrected by kind of motion with what the executed control takes of stretches.

    Attributes:
        off: standard deviation of the program's time over the executed control's, as a share; None where no stretch was
            executed
    """

    times: BlockTimes
    off: float | None


def sampled(blocks: MotionBlocks, model: CycleTimeModel) -> FormulaTimes:
    """The times of a program by formulas, held against the control over stretches; most of these lie where formulas are
    least sure. Not where the program is short, where formulas are sure, and where no motion is found.

    Args:
        model: of a control that is executed, with what the machine says of it (`of_machine`); of others the times are theirs
    """
    made = timed(blocks, model.quick())
    if model.kind != "control" or len(blocks) < FEWEST:
        return FormulaTimes(made, None)
    kind = kinds(blocks, made)
    along = np.cumsum(made.seconds * SURE[kind])
    if along[-1] < MOST_OFF * float(made.seconds.sum()):
        return FormulaTimes(made, None)
    middle = np.searchsorted(along, (np.arange(STRETCHES) + 0.5) / STRETCHES * along[-1])
    pairs = [_pair(blocks, kind, model, max(int(k) - LONG // 2, 0)) for k in middle]
    if any(pair is None for pair in pairs):
        return FormulaTimes(made, None)
    executed, about = np.array(pairs, dtype=np.float64).transpose(1, 0, 2)
    held = (about > 0.0).sum(axis=0)
    known = held >= FEW
    whole = np.where(known, about.sum(axis=0), 1.0)
    factor = np.where(known, executed.sum(axis=0) / whole, 1.0)
    scatter = np.linalg.norm(executed - factor * about, axis=0) * np.sqrt(held / np.maximum(held - 1.0, 1.0)) / whole
    share = time_by_kind(blocks, made) / max(float(made.seconds.sum()), 1e-9)
    off = np.where(known, np.maximum(STUDENT * scatter / factor, LEAST_OFF), SURE)
    return FormulaTimes(slowed(made, blocks, factor[kind]), float(share @ off))


def _pair(blocks: MotionBlocks, kind: Ints, model: CycleTimeModel, low: int) -> tuple[Floats, Floats] | None:
    """((KINDS,) s executed, (KINDS,) s by formulas) of a stretch; None where the control is not executed there."""
    high = min(low + LONG, len(blocks))
    low = max(high - LONG, 0)
    part = stretch(blocks, low, high)
    moved = timed(part, model)
    if moved.found:
        return None
    inner, about = kind[low:high][EDGE:-EDGE], timed(part, model.quick())
    return (summed(moved.seconds[EDGE:-EDGE], inner, len(KINDS)), summed(about.seconds[EDGE:-EDGE], inner, len(KINDS)))


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
