"""The parameters of a control's model from a measured run, and how sure they are.

Least squares on the times of sections of the run, over the logarithms of the parameters, with a wide normal
prior about the model that the fit begins with, so that what the run does not show stays where it was and
keeps its uncertainty (maximum a posteriori; the covariance is the inverse of J'J/s^2 + prior, J the
derivatives of the sections' times; e.g. A. Tarantola, Inverse Problem Theory, 2005, section 3.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import timed
from postproc.cycle_time.log import RunLog, matched
from postproc.cycle_time.model import PARAMETERS, CalibrationRecord, CycleTimeModel
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from machines.machine import Machine

PRIOR = {"corner_tolerance": 2.0, "block_time": 2.0, "rapid": 0.5, "override": 0.3, "stop_time": 2.0}
"""standard deviation of each logarithm before the run is looked at"""
FREE = {"lookahead": PARAMETERS, "ideal": ("corner_tolerance", "rapid", "override", "stop_time"),
        "linuxcnc": ("rapid", "override")}
Modelled = Callable[[Floats], Floats]
"""from parameters, in prior deviations about the begin, to the times of the sections"""
SECTIONS = 300
"""stretches of the run whose times are compared, at most"""
STARTS = {"block_time": 1e-4, "stop_time": 1e-3}
"""where a fit begins with a value that is 0"""
CLOCK = 1e-3
"""s of uncertainty in any section: the clock of the log"""
CLEAR = 0.7
"""share of the misfit that decides for a model without jerk"""
NEAR, FAR = 0.02, 0.35
"""steps in prior deviations at which derivatives are taken"""
SEEN = 0.5
"""share of its prior uncertainty below which a parameter counts as found"""


@dataclass(frozen=True)
@arrays(measured="K", modelled="K")
class CalibratedModel:
    """A calibrated model and how well it fits.

    Attributes:
        measured, modelled (K,): s of the sections; values: parameter to (value, standard deviation of its logarithm)
    """

    model: CycleTimeModel
    calibration: CalibrationRecord
    measured: Floats
    modelled: Floats
    values: dict[str, tuple[float, float]]


def calibrate(blocks: MotionBlocks, log: RunLog, model: CycleTimeModel, file: str = "",
              machine: Machine | None = None) -> tuple[CalibratedModel | None, list[Diagnostic]]:
    """The model fitted to a log; None and why where the log does not fit the program.

    A model with jerk is also tried without, and left so where that is clearly better.
    """
    samples, rows, found = matched(log, blocks, file)
    if found:
        return None, found
    cuts = np.unique(np.linspace(0, len(rows) - 1, min(SECTIONS, len(rows) - 1) + 1).astype(int))
    rows, measured = rows[cuts], np.diff(log.time[samples[cuts]])
    before = np.diff(timed(blocks, model).begin[rows])
    kinds = [True, False] if model.jerk and model.kind != "linuxcnc" else [model.jerk]
    fits = [_fitted(blocks, rows, measured, before, model.model_copy(update={"jerk": jerk}), file, machine)
            for jerk in kinds]
    off = [float(np.abs(fit.modelled - fit.measured).sum()) for fit in fits]
    fit = fits[-1] if off[-1] < CLEAR * off[0] else fits[0]
    return fit, _warnings(fit, file)


def _fitted(blocks: MotionBlocks, rows: Ints, measured: Floats, before: Floats, model: CycleTimeModel, file: str,
            machine: Machine | None) -> CalibratedModel:
    """The fit of the parameters that the kind of model has."""
    from scipy.optimize import least_squares

    begin = model.model_copy(update={k: max(getattr(model, k), v) for k, v in STARTS.items()})
    free = [k for k, name in enumerate(PARAMETERS) if name in FREE[model.kind]]
    start, prior = begin.values(), np.array([PRIOR[name] for name in PARAMETERS])

    def modelled(x: Floats) -> Floats:
        values = start.copy()
        values[free] += x * prior[free]
        return np.diff(timed(blocks, begin.with_values(values)).begin[rows])
    x = _start(modelled, measured, free)
    scale = _scatter(measured - modelled(x), measured)
    for _ in range(3):
        uncertainty = np.hypot(CLOCK, scale * np.sqrt(np.maximum(measured, 0.0) * measured.mean()))

        def residual(x: Floats, uncertainty: Floats = uncertainty) -> Floats:
            return np.concatenate([(modelled(x) - measured) / uncertainty, x])
        result = least_squares(residual, x, loss="soft_l1", diff_step=[1e-3] * len(x), max_nfev=60,
                               f_scale=3.0)
        x = result.x
        scale = max(_scatter(measured - modelled(x), measured), 1e-5)
    values = start.copy()
    values[free] += x * prior[free]
    uncertainty = np.hypot(CLOCK, scale * np.sqrt(np.maximum(measured, 0.0) * measured.mean()))
    covariance = _covariance(_slopes(modelled, x) / uncertainty[:, None], free, prior)
    return _fit(model, begin.with_values(values), covariance, free, prior, measured, before, modelled(x),
                file, machine)


def _scatter(residual: Floats, measured: Floats) -> float:
    """Standard deviation of a section's time as a share, for sections of the mean length, by the median."""
    weight = np.sqrt(np.maximum(measured, CLOCK) * measured.mean())
    return float(1.4826 * np.median(np.abs(residual) / weight))


def _start(modelled: Modelled, measured: Floats, free: list[int]) -> Floats:
    """Where the fit begins: the best of a coarse grid over block time and rapids, which a fit cannot feel
    from where they hold nothing."""
    grid = {"block_time": (0.0, 0.35, 0.55, 0.8, 1.05), "rapid": (0.0, -0.25, -0.6)}
    names = [PARAMETERS[k] for k in free]
    axes = [grid.get(name, (0.0,)) for name in names]
    options = [np.array(x) for x in product(*axes)]
    return min(options, key=lambda x: float(np.abs(modelled(x) - measured).sum()))


def _slopes(modelled: Modelled, x: Floats) -> Floats:
    """(K, F) derivatives by central differences; where a parameter holds nothing here, what moving it far would show."""
    here, columns = modelled(x), []
    for k in range(len(x)):
        move = np.zeros(len(x))
        move[k] = 1.0
        near = (modelled(x + NEAR * move) - modelled(x - NEAR * move)) / (2.0 * NEAR)
        far = max(((modelled(x + step * move) - here) / step for step in (FAR, -FAR)), key=lambda v: float(v @ v))
        columns.append(far if far @ far > 10.0 * (near @ near) else near)
    return np.stack(columns, axis=1)


def _covariance(weighted: Floats, free: list[int], prior: Floats) -> Floats:
    """(5, 5) of the logarithms; parameters that do not take part have none.

    Neighbouring sections share a reading of the clock, so that only half of them count.
    """
    inner = np.linalg.inv(0.5 * weighted.T @ weighted + np.eye(len(free)))
    result = np.zeros((len(PARAMETERS), len(PARAMETERS)))
    result[np.ix_(free, free)] = inner * np.outer(prior[free], prior[free])
    return result


def _fit(model: CycleTimeModel, fitted: CycleTimeModel, covariance: Floats, free: list[int], prior: Floats,
         measured: Floats, before: Floats, after: Floats, file: str, machine: Machine | None) -> CalibratedModel:
    sigma = np.sqrt(np.diag(covariance))
    hidden = tuple(PARAMETERS[k] for k in free if sigma[k] > SEEN * prior[k])
    relative = _relative(measured, after)
    calibration = CalibrationRecord(
        log=file, samples=len(measured), machine=machine.name if machine is not None else "",
        rms_before=_rms(before - measured), rms_after=_rms(after - measured), relative=relative,
        covariance=tuple(tuple(float(v) for v in row) for row in covariance), not_identifiable=hidden)
    others = tuple(name for name in model.assumed if name not in PARAMETERS)
    result = fitted.model_copy(update={"calibration": calibration, "assumed": (*hidden, *others),
                                       "description": f"{model.description}, calibrated"})
    values = {PARAMETERS[k]: (float(getattr(result, PARAMETERS[k])), float(sigma[k])) for k in free}
    return CalibratedModel(result, calibration, measured, after, values)


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


def _warnings(fit: CalibratedModel, file: str) -> list[Diagnostic]:
    relative = fit.calibration.relative
    if relative <= 0.1:
        return []
    return [warning("log.fit", f"the model is {100 * relative:.0f} % off in parts of the run", file=file,
                    hint="is it this program, this machine, without a feed hold?")]


def as_toml(model: CycleTimeModel) -> str:
    """The model as a file that `load_model` reads."""
    lines = []
    for name, value in model.model_dump(exclude={"calibration"}).items():
        lines.append(f"{name} = {_toml(value)}")
    if model.calibration is not None:
        lines += ["", "[calibration]"]
        lines += [f"{name} = {_toml(value)}" for name, value in model.calibration.model_dump().items()]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(value)


def as_dict(fit: CalibratedModel) -> dict[str, object]:
    """The figures of a calibration."""
    c = fit.calibration
    return {"parameters": {name: {"value": value, "relative_sigma": sigma} for name, (value, sigma) in fit.values.items()},
            "sections": len(fit.measured), "rms_before_s": c.rms_before, "rms_after_s": c.rms_after,
            "relative": c.relative, "not_identifiable": list(c.not_identifiable)}
