"""What becomes of a fit: a model, or none where what was found cannot be; what is doubtful is told."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from machines.calibration.account import parameters
from machines.calibration.run import Run
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.sizes import too_large
from toolpaths.diagnostics import has_errors

SUSPECT = 2.0
"""times the stated standard deviation: what is left of the readings is more than noise"""
UNFIT = 5.0
"""the same, where the errors found do not help: no model"""
LITTLE = 0.5
"""of what is left with nothing found but ball, zero, mounting and indexer: where more stays, little is explained"""
SILENT, MUTE = 0.2, 0.02
"""times the stated standard deviation: less is left than any noise leaves; so little that no model is written"""
DIFFERENCES = "reversal", "poses", "laser"
"""kinds whose readings are actual less nominal"""
MEANT = "write large = true at the top of the file where it is so"
MOST = 6
"""errors above what machines have, that are told"""
ENOUGH = 10
"""readings more than unknowns, from which on SILENT is looked at (chance below 1e-6)"""


@dataclass(frozen=True)
class Calibration:
    """What was found: the model (None where the data do not support it) and the figures of `calibrate --json`."""

    model: ErrorModel | None
    figures: dict[str, Any]


def done(run: Run, model: ErrorModel, figures: dict[str, Any], sigma: str, slip: Callable[[], str],
         start: ErrorModel | None = None, wanted: Sequence[str] = ()) -> Calibration:
    """The calibration, its parameters in the figures.

    Args:
        sigma: how the file states the doubt of its readings
        slip: looks for a wrong sign or order in the table that would explain the readings, "" where there is none
        start, wanted: model that was begun from, and beginnings of names that were asked for
    """
    model = replace(model, machine=run.machine.name, large=bool(too_large(model)))
    _large(run, model, start)
    _residual(run, figures, sigma, slip)
    found = parameters(model, wanted)
    figures |= {"parameters": found, "kept": len(model.names) - len(found)}
    return Calibration(model, figures)


def _large(run: Run, model: ErrorModel, start: ErrorModel | None) -> None:
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


def doubtful(run: Run, code: str, message: str, hint: str, key: str = "table") -> None:
    """An error, a warning where the file says `large = true`."""
    if run.checked.large:
        run.warn(code, message)
    else:
        run.problem(code, message, hint, key)


def _residual(run: Run, figures: dict[str, Any], sigma: str, slip: Callable[[], str]) -> None:
    """What is left of the readings against what the file says of their doubt."""
    left = figures["reduced"]
    if left is None:
        run.tell("calibrate.unchecked", f"{figures['readings']} readings for as many unknowns: nothing is left over that "
                 "could show a mistake", "measure more than is asked for")
        return
    message = f"what is left is {left:.3g} times the stated standard deviation of the readings"
    if left < SILENT and figures["spare"] >= ENOUGH:
        tell = run.problem if left < MUTE else run.warn
        tell("calibrate.silent", f"{message}, less than any noise leaves", "look at the unit of the readings; where they "
             f"are so fine, say so in {sigma}")
    if left <= SUSPECT:
        return
    if suspected := slip():
        run.problem("calibrate.slip", message, suspected)
        return
    hint = f"look for wrong signs, units, outliers (robust = true); where the readings are so rough, say so in {sigma}"
    without = figures["rms_instrument"]
    if left > UNFIT and figures["rms_after"] > LITTLE * without:
        run.problem("calibrate.unexplained", f"{message}, and {without:.3g} times without the errors found: they explain "
                    "little", hint)
    elif not has_errors(run.found):
        run.warn("calibrate.residual", f"{message}: the model's own doubt is too small by as much", hint)
