"""The parameters of a control's model from measured runs, and how sure they are.

Least squares on the times of sections of the runs, over the logarithms of the parameters, with a normal prior about the
model
that the fit begins with, so that what the runs do not show stays where it was and keeps its uncertainty (maximum a
posteriori; the covariance is the inverse of J'J/s^2 + prior, J the derivatives of the sections' times; e.g. A.
Tarantola, Inverse Problem Theory, 2005, section 3.2). What the model cannot say of a kind of motion is found by leaving the
sections
of that kind out (`left_out.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from postproc.cycle_time.blocks import Cause
from postproc.cycle_time.estimate import timed
from postproc.cycle_time.kinds import KINDS
from postproc.cycle_time.model import ASSUMED, PARAMETERS, CalibrationRecord, CycleTimeModel
from postproc.time_fit.executed_fit import own_slopes, refined
from postproc.time_fit.left_out import structure
from postproc.time_fit.runs import CLOCK, OTHERS, MeasuredRun
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors, info, warning
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from machines.machine import Machine

PRIOR = {"corner_tolerance": 1.2, "block_time": 1.5, "rapid": 0.4, "override": 0.2, "stop_time": 1.5,
         "acceleration_share": ASSUMED["acceleration"], "jerk_share": ASSUMED["jerk"], "spindle_time": 1.5}
"""standard deviation of each logarithm before a run is looked at"""
STATED = 0.05
"""the same of the share of accelerations and jerks that the machine file states"""
FREE = {"lookahead": PARAMETERS, "control": PARAMETERS, "formulas": PARAMETERS,
        "ideal": tuple(name for name in PARAMETERS if name != "block_time"),
        "linuxcnc": ("rapid", "override", "acceleration_share", "spindle_time")}
CREDIBLE = 1.5
"""prior deviations up to which a moved parameter is taken as that of the control"""
MOST = 3.0
"""prior deviations that a fit may move a parameter"""
Modelled = Callable[[Floats], Floats]
"""from parameters, in prior deviations about the begin, to the times of the sections"""
STARTS = {"block_time": 1e-4, "stop_time": 1e-3, "spindle_time": 0.05}
"""where a fit begins with a value that is 0"""
ENOUGH = 20
"""sections that decide whether a control has jerk limits"""
CLEAR = 0.7
"""share of the misfit that decides for a model without jerk"""
NEAR, FAR = 0.02, 0.35
"""steps in prior deviations at which derivatives are taken"""
SEEN = 0.5
"""share of its prior uncertainty below which a parameter counts as found"""
MOVED = 0.02
"""share of a run's ramps that an axis must hold for the run to show its acceleration"""
UNLIKE = 0.5
"""share by which the fitted model may be off in parts of a run: beyond it, the run is of something else"""
WORSE = 0.005
"""share of the time that the fitted model's total may be farther off than that of the model before"""


@dataclass(frozen=True)
@arrays(measured="K", modelled="K")
class CalibratedModel:
    """A calibrated model and how well it fits.

    Attributes:
        measured, modelled (K,): s of the sections; values: parameter to (value, standard deviation of its logarithm)
        before: value of each parameter before the fit; total_before: s of all sections before
    """

    model: CycleTimeModel
    calibration: CalibrationRecord
    measured: Floats
    modelled: Floats
    values: dict[str, tuple[float, float]]
    before: dict[str, float]
    total_before: float


@dataclass(frozen=True)
@arrays(measured="K", other="K", clock="K")
class Runs:
    """All runs that a model is fitted to, their sections one after the other; clock (K,): s of uncertainty by the
    readings."""

    runs: tuple[MeasuredRun, ...]
    measured: Floats
    other: Floats
    clock: Floats

    @staticmethod
    def of(runs: Sequence[MeasuredRun]) -> Runs:
        """Sections of runs as one."""
        return Runs(tuple(runs), np.concatenate([run.measured for run in runs]),
                    np.concatenate([run.other for run in runs]),
                    np.concatenate([np.full(len(run.measured), run.clock) for run in runs]))

    def modelled(self, model: CycleTimeModel) -> Floats:
        """(K,) s of the sections under a model."""
        return np.concatenate([run.modelled(model) for run in self.runs])

    def uncertainty(self, scale: float) -> Floats:
        """(K,) s of each section: readings, times that are not fitted, and what sections scatter."""
        scatter = scale * np.sqrt(np.maximum(self.measured, 0.0) * self.measured.mean())
        return np.asarray(np.sqrt(self.clock**2 + (OTHERS * self.other) ** 2 + scatter**2))


def calibrate(runs: Sequence[MeasuredRun], model: CycleTimeModel, file: str = "",
              machine: Machine | None = None) -> tuple[CalibratedModel | None, list[Diagnostic]]:
    """The model fitted to runs; None and why where it fits them worse than the model before.

    Of kind "lookahead" a model with jerk is also tried without, and left so where that is clearly better. Of kind "control"
    the fit of the formulas is refined on the executed control.
    """
    data = Runs.of(runs)
    before = data.modelled(model)
    both = model.jerk and model.kind in ("lookahead", "ideal") and len(data.measured) >= ENOUGH
    kinds = [True, False] if both else [model.jerk]
    fits = [_fitted(data, before, model.model_copy(update={"jerk": jerk}), file, machine) for jerk in kinds]
    off = [float(np.abs(fit.modelled - fit.measured).sum()) for fit in fits]
    fit = fits[-1] if off[-1] < CLEAR * off[0] else fits[0]
    found = _findings(fit, before, float(np.median(data.clock)), file)
    return (None if has_errors(found) else fit), found


def begin_of(model: CycleTimeModel) -> CycleTimeModel:
    """The model where a fit begins: parameters that are 0 hold something."""
    return model.model_copy(update={k: max(getattr(model, k), v) for k, v in STARTS.items()})


def expected(run: MeasuredRun, model: CycleTimeModel, scatter: float, machine: Machine | None = None) -> CalibratedModel:
    """What a fit to a run would leave uncertain that goes as the model has it: the same parameters, their covariance.

    Args:
        run: with the model's own times; scatter: share of a section's time that a run scatters, of sections of the mean
            length
    """
    begin, data, prior = begin_of(model), Runs.of([run]), prior_of(machine)
    free, start = free_parameters(data, model), begin.values()

    def modelled(x: Floats) -> Floats:
        values = start.copy()
        values[free] += x * prior[free]
        return data.modelled(begin.with_values(values))
    weighted = slopes(modelled, np.zeros(len(free))) / data.uncertainty(scatter)[:, None]
    return _record(data, model, begin, weighted, free, prior, data.modelled(model), scatter, "expected", machine)


def _fitted(data: Runs, before: Floats, model: CycleTimeModel, file: str, machine: Machine | None) -> CalibratedModel:
    """The fit of the parameters that the kind of model has."""
    from scipy.optimize import least_squares

    begin = begin_of(model)
    free, prior = free_parameters(data, model), prior_of(machine)
    start, measured = begin.values(), data.measured

    def moved(x: Floats) -> CycleTimeModel:
        values = start.copy()
        values[free] += x * prior[free]
        return begin.with_values(values)

    def modelled(x: Floats) -> Floats:
        return data.modelled(moved(x).quick())
    x = _start(modelled, measured, free)
    scale = _scatter(modelled(x), measured, len(free))
    for _ in range(3):
        uncertainty = data.uncertainty(scale)

        def residual(x: Floats, uncertainty: Floats = uncertainty) -> Floats:
            return np.concatenate([(modelled(x) - measured) / uncertainty, x])
        result = least_squares(residual, np.clip(x, -0.99 * MOST, 0.99 * MOST), loss="soft_l1", diff_step=[1e-3] * len(x),
                               max_nfev=60, f_scale=3.0, bounds=(-MOST, MOST))
        x = result.x
        scale = _scatter(modelled(x), measured, len(free))
    if model.kind == "control":
        def executed(x: Floats) -> Floats:
            return data.modelled(moved(x))
        x = refined([x, np.zeros(len(x))], executed, lambda x: slopes(modelled, x), measured, data.uncertainty(scale), MOST)
        own, scale = own_slopes(executed, x), _scatter(executed(x), measured, len(free))
        x = refined([x], executed, lambda _: own, measured, data.uncertainty(scale), MOST)
        scale = _scatter(executed(x), measured, len(free))
        own = own / data.uncertainty(scale)[:, None]
        return _record(data, model, moved(x), own, free, prior, before, scale, file, machine)
    weighted = slopes(modelled, x) / data.uncertainty(scale)[:, None]
    return _record(data, model, moved(x), weighted, free, prior, before, scale, file, machine)


def free_parameters(data: Runs, model: CycleTimeModel) -> list[int]:
    """Rows of PARAMETERS that are fitted: those of the kind of model; jerk where it counts, the spindle where a run starts
    it."""
    starts = any((run.blocks.pauses.cause == Cause.SPINDLE).any() for run in data.runs)
    without = {name for name, fitted in (("jerk_share", model.jerk), ("spindle_time", starts)) if not fitted}
    return [k for k, name in enumerate(PARAMETERS) if name in FREE[model.kind] and name not in without]


def prior_of(machine: Machine | None) -> Floats:
    """(8,) standard deviations of the logarithms; accelerations and jerks that the machine file states vary little."""
    result = dict(PRIOR)
    for limit in ("acceleration", "jerk"):
        if machine is not None and not any(name.endswith(f".{limit}") for name in machine.limits.assumed):
            result[f"{limit}_share"] = STATED
    return np.array([result[name] for name in PARAMETERS])


def _scatter(modelled: Floats, measured: Floats, free: int) -> float:
    """Standard deviation of a section's time as a share, for sections of the mean length: by the median, larger where few
    sections leave little for it after the parameters."""
    weight = np.sqrt(np.maximum(measured, CLOCK) * measured.mean())
    spare = len(measured) / max(len(measured) - free, 1)
    middle = float(1.4826 * np.median(np.abs(measured - modelled) / weight))
    return max(middle * float(np.sqrt(min(spare, len(measured)))), 1e-5)


def _start(modelled: Modelled, measured: Floats, free: list[int]) -> Floats:
    """Where the fit begins: the best of a coarse grid over block time and rapids, which a fit cannot feel
    from where they hold nothing."""
    grid = {"block_time": (0.0, 0.45, 0.75, 1.05, 1.4), "rapid": (0.0, -0.3, -0.75)}
    names = [PARAMETERS[k] for k in free]
    axes = [grid.get(name, (0.0,)) for name in names]
    options = [np.array(x) for x in product(*axes)]
    return min(options, key=lambda x: float(np.abs(modelled(x) - measured).sum()))


def slopes(modelled: Modelled, x: Floats) -> Floats:
    """(K, F) derivatives by central differences; where a parameter holds nothing here, what moving it far would show."""
    here, columns = modelled(x), []
    for k in range(len(x)):
        move = np.zeros(len(x))
        move[k] = 1.0
        near = (modelled(x + NEAR * move) - modelled(x - NEAR * move)) / (2.0 * NEAR)
        far = max(((modelled(x + step * move) - here) / step for step in (FAR, -FAR)), key=lambda v: float(v @ v))
        columns.append(far if far @ far > 10.0 * (near @ near) else near)
    return np.stack(columns, axis=1)


def _covariance(weighted: Floats, free: list[int], prior: Floats, far: Floats) -> Floats:
    """(8, 8) of the logarithms; parameters that do not take part have none.

    Neighbouring sections share a reading of the clock, so that only half of them count. `far` (F,): by how much a parameter
    was moved
    beyond what is credible of it: it stands for something else that the control does, and is another on other motions.
    """
    inner = np.linalg.inv(0.5 * weighted.T @ weighted + np.eye(len(free)))
    result = np.zeros((len(PARAMETERS), len(PARAMETERS)))
    result[np.ix_(free, free)] = inner * np.outer(prior[free], prior[free]) + np.diag(far**2)
    return result


def _record(data: Runs, model: CycleTimeModel, fitted: CycleTimeModel, weighted: Floats, free: list[int], prior: Floats,
            before: Floats, scale: float, file: str, machine: Machine | None) -> CalibratedModel:
    measured, after = data.measured, data.modelled(fitted)
    shift = (fitted.values() - begin_of(model).values())[free] / prior[free]
    far = np.maximum(np.abs((fitted.values() - model.values())[free]) / prior[free] - CREDIBLE, 0.0) * prior[free]
    covariance = _covariance(weighted, free, prior, far)
    sigma = np.sqrt(np.diag(covariance))
    hidden = tuple(PARAMETERS[k] for k in free if sigma[k] > SEEN * prior[k])
    by_kind = np.concatenate([run.by_kind(timed(run.blocks, fitted)) for run in data.runs])
    spent = by_kind.sum(axis=0)
    calibration = CalibrationRecord(
        log=file, samples=len(measured), machine=machine.name if machine is not None else "",
        rms_before=_rms(before - measured), rms_after=_rms(after - measured), relative=_relative(measured, after),
        covariance=tuple(tuple(float(v) for v in row) for row in covariance), parameters=PARAMETERS,
        kinds={name: float(s / max(spent.sum(), CLOCK)) for name, s in zip(KINDS, spent, strict=True) if s > 0.0},
        structure=structure(measured, after, by_kind, weighted, data.uncertainty(scale), shift),
        axes=_accelerated(data, fitted), period=max(run.period for run in data.runs), not_identifiable=hidden)
    fits = {PARAMETERS[k] for k in free}
    fits |= {"stated_share"} if "corner_tolerance" in fits else set()
    others = tuple(name for name in model.assumed if name not in fits)
    assumed = tuple(name for name in hidden if not name.endswith("_share"))
    result = fitted.model_copy(update={"calibration": calibration, "assumed": (*assumed, *others),
                                       "description": f"{model.description}, calibrated"})
    result = result.model_copy(update={name: getattr(model, name) for k, name in enumerate(PARAMETERS) if k not in free})
    names = [PARAMETERS[k] for k in free]
    values = {PARAMETERS[k]: (float(getattr(result, PARAMETERS[k])), float(sigma[k])) for k in free}
    return CalibratedModel(result, calibration, measured, after, values,
                           {name: float(getattr(model, name)) for name in names}, float(before.sum()))


def _accelerated(data: Runs, model: CycleTimeModel) -> tuple[str, ...]:
    """Axes that hold a share of the ramps of the runs."""
    held: dict[str, float] = {}
    for run in data.runs:
        times, axes = timed(run.blocks, model), run.blocks.axes
        moved = np.abs(run.blocks.end - run.blocks.start) / np.maximum(axes.acceleration, 1e-12)
        axis = moved.argmax(axis=1)
        seconds = np.bincount(axis, weights=times.ramp + times.jerk, minlength=len(axes.letters))
        for letter, value in zip(axes.letters, seconds.tolist(), strict=True):
            held[letter] = held.get(letter, 0.0) + value
    least = MOVED * max(sum(held.values()), CLOCK)
    return tuple(letter for letter, value in held.items() if value > least)


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _relative(measured: Floats, modelled: Floats) -> float:
    """Standard deviation of a whole program's time as a share, from how blocks of sections scatter.

    Neighbouring sections err alike (the same cutter path, the same kind of corner), so the run is cut into
    ten parts, and what those scatter counts in full for another program; half a per cent is left to what no log shows.
    """
    parts = np.array_split(np.arange(len(measured)), min(10, len(measured)))
    errors = np.array([(modelled[p].sum() - measured[p].sum()) / max(measured[p].sum(), CLOCK) for p in parts])
    weight = np.array([measured[p].sum() for p in parts])
    return float(np.hypot(0.005, np.sqrt(np.average(errors**2, weights=np.maximum(weight, CLOCK)))))


def _findings(fit: CalibratedModel, before: Floats, clock: float, file: str) -> list[Diagnostic]:
    """An error where the fit is worse than what it began with, else what is to be known of it."""
    record, measured = fit.calibration, fit.measured
    off, was = (abs(float((values - measured).sum())) for values in (fit.modelled, before))
    found: list[Diagnostic] = []
    if record.rms_after > max(1.02 * record.rms_before, 2.0 * clock) or off > max(was, WORSE * measured.sum(), 2.0 * clock):
        return [error("log.fit", f"the fitted model is farther off than the one before: sections {record.rms_after:.3g} s, "
                      f"before {record.rms_before:.3g} s; all {off:.3g} s of {measured.sum():.4g} s, before {was:.3g} s",
                      file=file, hint="log a run of this program on this machine, without a feed hold")]
    if record.relative > UNLIKE:
        return [error("log.fit", f"no values of the model explain the run: {fit.modelled.sum():.4g} s fitted, "
                      f"{measured.sum():.4g} s measured, {100 * record.relative:.0f} % off in parts of it", file=file,
                      hint="log a run of this program on this machine, without a feed hold")]
    if record.period > 0.0:
        found.append(info("log.polled", f"the log was polled, one sample every {record.period:.3g} s: a line is seen up to "
                          f"that much late, which is allowed for; {record.samples} sections", file=file))
    if record.relative > 0.1:
        found.append(warning("log.fit", f"the model is {100 * record.relative:.0f} % off in parts of the run", file=file,
                             hint="log a run of this program on this machine, without a feed hold"))
    return found
