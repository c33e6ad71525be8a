"""Times of a machine and a control that differ in some values: factors on limits, timing and parameters of the model."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np

from machines.choices import MotionOrder
from machines.machine import Machine
from postproc.cycle_time.model import CycleTimeModel
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error

LIMITS: tuple[MotionOrder, ...] = get_args(MotionOrder)
TIMING = ("tool_change", "clamp", "unclamp")
MODEL = ("spindle_time", "corner_tolerance", "block_time", "stop_time", "rapid", "override")
MOST = 100.0
"""largest factor, and 1 over the smallest"""

FACTOR = f"a factor from {1.0 / MOST:g} to {MOST:g} stands behind ="


@dataclass(frozen=True)
class WhatIf:
    """Factors by value; the text that they were given as."""

    text: str
    factors: tuple[tuple[str, float], ...]


AS_IS = WhatIf("", ())


def parsed(text: str, *machines: Machine) -> WhatIf:
    """The factors of "X.acceleration=1.3,tool_change=0.5"; axes are those of any of the machines.

    Raises:
        DiagnosticError: names the values that there are.
    """
    known = {f"{axis}.{limit}" for m in machines for axis in m.axis_names for limit in LIMITS} | {*LIMITS, *TIMING, *MODEL}
    factors = tuple(factor_of(part) for part in text.split(","))
    for name, factor in factors:
        if name not in known:
            raise _wrong(f"{name!r} is no value of {', '.join(m.name for m in machines)}")
        if math.isnan(factor):
            raise _wrong(f"{text!r}: {FACTOR}")
    return WhatIf(text, factors)


def factor_of(part: str) -> tuple[str, float]:
    """The name and the factor of "X.acceleration=1.3"; NaN where it is none."""
    name, _, number = (word.strip() for word in part.partition("="))
    try:
        factor = float(number)
    except ValueError:
        factor = math.nan
    return name, factor if 1.0 / MOST <= factor <= MOST else math.nan


def _wrong(what: str) -> DiagnosticError:
    hint = ("give a factor, as X.acceleration=1.3, of the velocity, acceleration, jerk of an axis or of all, or of "
            f"{', '.join((*TIMING, *MODEL))}; several with commas, a point in decimals")
    return DiagnosticError([error("time.what_if", f"--what-if: {what}", hint=hint)])


def machine_with(machine: Machine, asked: WhatIf) -> Machine:
    """The machine with other limits and times."""
    limits, timing = machine.limits, machine.timing
    for name, factor in asked.factors:
        axis, _, limit = name.rpartition(".")
        if limit in LIMITS:
            which = np.array([axis in ("", one) for one in machine.axis_names])
            limits = replace(limits, **{limit: getattr(limits, limit) * np.where(which, factor, 1.0)})
        elif name in TIMING:
            timing = replace(timing, **{name: getattr(timing, name) * factor})
    return replace(machine, limits=limits, timing=timing) if asked.factors else machine


def model_with(model: CycleTimeModel, asked: WhatIf) -> CycleTimeModel:
    """The model with other parameters; the share of stated tolerances goes with the corner tolerance."""
    changed = {name: getattr(model, name) * factor for name, factor in asked.factors if name in MODEL}
    if "corner_tolerance" in changed:
        changed["stated_share"] = model.stated_share * changed["corner_tolerance"] / model.corner_tolerance
    return model.model_copy(update=changed)
