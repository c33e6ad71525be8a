"""What becomes of a fit: a model, or none where what was found cannot be; what is uncertain is reported."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from machines.calibration.noise import CHANCE, Noise
from machines.calibration.remedies import TableFault
from machines.calibration.result_figures import CalibrationFigures, parameters
from machines.calibration.run import CalibrationRun
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.files.implausible_errors import too_large
from toolpaths.dataclass import dataclass

UNFIT = 5.0
"""the same, where the errors found do not help: no model"""
LITTLE = 0.5
"""of what is left with nothing found but ball, zero, mounting and indexer: where more stays, little is explained"""
SILENT, MUTE = 0.5, 0.02
"""times the stated standard deviation: less is left than that leaves; so little that no model is written"""
ACCEPT = "accept_residual = true at the top of the file, or --accept-residual, takes the fit and scales its covariance"
DIFFERENCES = "reversal", "poses", "laser"
"""kinds whose readings are actual less nominal"""
MEANT = "write large = true at the top of the file where it is so"
MOST = 6
"""errors above what machines have, that are reported"""
FEW = 8
"""readings more than unknowns, below which what is left shows no unit is wrong by 5 or more"""


@dataclass(frozen=True)
class CalibrationOutcome:
    """What was found: the model (None where the data do not support it) and the figures of `calibrate --json`."""

    model: ErrorModel | None
    figures: CalibrationFigures

    def description(self, source: str) -> str:
        """One line for the model's file: what it is from, and what its covariance was scaled by."""
        scale, left = self.figures["covariance_scale"], self.figures["reduced"]
        if left is None or scale == 1.0:
            return f"from {source}"
        return (f"from {source}; covariance scaled by {scale:.4g}: {left:.4g} times the stated noise is left of the "
                f"readings, {self.figures['spare']} degrees of freedom")


def done(run: CalibrationRun, model: ErrorModel, figures: CalibrationFigures, noise: Noise | None,
         sigma: Mapping[str, float], fault: Callable[[], TableFault | None], start: ErrorModel | None = None,
         wanted: Sequence[str] = ()) -> CalibrationOutcome:
    """The calibration, its parameters in the figures.

    Args:
        noise: what is left of the readings
        sigma: their noise by the keys with which the file states it
        fault: looks for a wrong unit, sign or order in the table that would explain the readings, None where there is none
        start, wanted: model that was begun from, and beginnings of names that were asked for
    """
    model = replace(model, machine=run.machine.name, large=bool(too_large(model)))
    _large(run, model, start)
    _residual(run, figures, noise, sigma, fault)
    found = parameters(model, wanted)
    figures["parameters"], figures["kept"] = found, len(model.names) - len(found)
    return CalibrationOutcome(model, figures)


def _large(run: CalibrationRun, model: ErrorModel, start: ErrorModel | None) -> None:
    """Found errors beyond what machines have; those of the start model are its own matter."""
    before = {one.path: one.size for one in too_large(start)} if start is not None else {}
    large = run.checked.large or (start is not None and start.large)
    units = "look at those of the table" + (", whose readings are actual less nominal" if run.kind in DIFFERENCES else "")
    for one in [one for one in too_large(model) if before.get(one.path) != one.size][:MOST]:
        message, hint = one.message(large), one.hint(large, units, "large = true at the top of the file")
        if one.refused(large):
            run.problem("error-model.large", message, hint)
        else:
            run.warn("error-model.large", message, hint)


def uncertain(run: CalibrationRun, code: str, message: str, hint: str, key: str = "table") -> None:
    """An error, a warning where the file says `large = true`."""
    if run.checked.large:
        run.warn(code, message)
    else:
        run.problem(code, message, hint, key)


def _residual(run: CalibrationRun, figures: CalibrationFigures, noise: Noise | None, sigma: Mapping[str, float],
              fault: Callable[[], TableFault | None]) -> None:
    """What is left of the readings against what the file says of their noise."""
    if noise is None:
        run.note("calibrate.unchecked", f"{figures['readings']} readings for as many unknowns: nothing is left over that "
                 "could show a mistake", "measure more than is asked for")
        return
    message = (f"what is left is {noise.left:.3g} times the stated standard deviation of the readings "
               f"({figures['spare']} more readings than unknowns)")
    found = None if noise.meets else fault()
    stated = f"where the noise of the readings is so, write {_stated(sigma, noise.left)}"
    if noise.less <= CHANCE:
        _silent(run, noise, message, found, stated)
    elif noise.more <= CHANCE:
        _loud(run, figures, noise, message, found, stated)
    elif figures["spare"] < FEW:
        run.note("calibrate.few", f"{figures['spare']} more readings than unknowns: a wrong unit could not be seen in what "
                 "is left of them", "measure more than is asked for")


def _silent(run: CalibrationRun, noise: Noise, message: str, found: TableFault | None, stated: str) -> None:
    """Less is left than the stated noise leaves."""
    if found is not None:
        run.problem("calibrate.slip", f"{message}, less than such noise leaves", f"{found}; {stated}")
    elif noise.left < MUTE:
        run.problem("calibrate.silent", f"{message}, less than any noise leaves",
                    f"look at the unit of the readings; {stated}")
    elif noise.left < SILENT:
        run.warn("calibrate.silent", f"{message}: it is stated too large", stated)


def _loud(run: CalibrationRun, figures: CalibrationFigures, noise: Noise, message: str, found: TableFault | None,
          stated: str) -> None:
    """More is left than the stated noise leaves: refused, unless it is asked for."""
    accepted = run.checked.accept_residual
    if found is not None and not (found.size and accepted):
        run.problem("calibrate.slip", message, f"{found}; {stated}" if found.size else str(found))
        return
    without = figures["rms_instrument"]
    explains = "" if figures["rms_after"] <= LITTLE * without else (
        f", and {without:.3g} times without the errors found: they explain little")
    if accepted:
        run.warn("calibrate.residual", f"{message}{explains}: the covariance is scaled by {figures['covariance_scale']:.4g}",
                 "nothing is to be done: accept_residual is set")
        return
    run.problem("calibrate.unexplained" if explains and noise.left > UNFIT else "calibrate.residual", message + explains,
                f"look for wrong signs, units, outliers (robust = true); {stated}; {ACCEPT}")


def _stated(sigma: Mapping[str, float], left: float) -> str:
    """The keys that state the noise, as they would be for what is left."""
    return " or ".join(f"{name} = {left * value:.3g}" for name, value in sigma.items())
