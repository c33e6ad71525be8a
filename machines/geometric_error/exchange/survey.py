"""What an error model holds and does: ranges, largest values, worst tip and axis over the work volume, uncertainty."""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.exchange.volume import ranges, samples
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.files.fingerprint import fingerprint
from machines.geometric_error.tables.csv_table import UNITS
from machines.geometric_error.tables.curves import Curve, Fourier, Polynomial, TableCurve
from machines.geometric_error.tables.lattice import COLUMNS, ErrorMap
from machines.geometric_error.tables.names import DIRECTIONS, SPINDLE, parse
from machines.kinematics.chain import ROTARY
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.units import DEG

UM, ARCSEC = UNITS["um"], UNITS["arcsec"]
PLACES = 20_000
"""of the work volume at which the model is looked at"""
UNCERTAINTY_WORK = 4e8
"""multiplications that looking for the largest uncertainty may take at one place after the other"""
FINE = 4001
"""positions along a curve at which its largest value is looked for"""
FAR = 0.1
"""part of its travel by which an axis may have been measured outside it"""
SHORT = 1e-6
"""mm or rad of travel that counts as none"""


def survey(model: ErrorModel, machine: Machine, tool_length: float) -> dict[str, Any]:
    """Figures of a model, um and arcsec, positions mm and degrees; tool length mm."""
    return {"machine": machine.name, "corrected_by": model.corrected_by, "parameters": len(model.names),
            "fingerprint": fingerprint(model),
            "components": {str(c.name): _curve(c.curve, c.name.angular, c.name.axis, model, machine)
                           for c in model.axes.components},
            "absent": absent(model, machine),
            "location": {name: _value(name, value) for name, value in model.axes.constants.items()},
            "legs": _legs(model.rods), "map": None if model.map is None else _map(model.map),
            "covariance": _covariance(model), "volume": _volume(model, machine, tool_length)}


def absent(model: ErrorModel, machine: Machine) -> list[str]:
    """Component errors of axes that the model has some of, but not these: they count as 0."""
    given = {str(c.name) for c in model.axes.components}
    axes = {c.name.axis for c in model.axes.components}
    return [name for axis in machine.axis_names if axis in axes for d in DIRECTIONS if (name := f"E{d}{axis}") not in given]


def unmeasured(model: ErrorModel, machine: Machine, file: str) -> list[Diagnostic]:
    """Warnings where the model does not reach the ends of travel: positions beyond are refused, or taken as at its end."""
    (lower, upper), (first, last) = ranges(model, machine), ranges(ErrorModel(), machine)
    found = []
    for j, letter in enumerate(machine.axis_names):
        round_about = not np.isfinite(machine.limits.lower[j])
        whole = (lower[j], upper[j]) == (first[j], last[j]) if round_about else \
            lower[j] <= first[j] + SHORT and upper[j] >= last[j] - SHORT
        if whole:
            continue
        unit = DEG if machine.rotary[j] else 1.0
        travel = "goes round" if round_about else f"travels from {first[j] / unit:g} to {last[j] / unit:g}"
        hint = "write repeats = 360 where it closes after a turn; else" if round_about else "beyond,"
        holds = f"from {lower[j] / unit:g} to {upper[j] / unit:g}" if lower[j] <= upper[j] else "nowhere there"
        found.append(warning("error-model.range", f"{letter} {travel}, the model holds {holds}", file=file,
                             hint=f"{hint} conversions stop there unless --error-model-beyond is given"))
    return found


def beyond_travel(model: ErrorModel, machine: Machine, file: str) -> list[Diagnostic]:
    """Warnings where an error was measured far outside travel, where its machine cannot have been: a wrong
    unit, most likely."""
    spans = {(c.name.axis, c.curve.range) for c in model.axes.components}
    if model.map is not None:
        spans |= {(x, (float(n[0]), float(n[-1]))) for x, n in zip(model.map.letters, model.map.nodes, strict=True)}
    found = []
    for letter, (least, most) in sorted(spans):
        if letter not in machine.axis_names or not np.isfinite([least, most]).all():
            continue
        j = machine.axis_names.index(letter)
        lower, upper, turns = machine.limits.lower[j], machine.limits.upper[j], machine.rotary[j]
        if max(lower - least, most - upper) <= FAR * (upper - lower):
            continue
        unit = DEG if turns else 1.0
        found.append(warning("error-model.travel", f"{letter} was measured from {least / unit:g} to {most / unit:g}, it "
                             f"travels from {lower / unit:g} to {upper / unit:g} {'degrees' if turns else 'mm'}", file=file,
                             hint="are the positions in the unit that their column says, and of this machine?"))
    return found


def _value(name: str, value: float) -> dict[str, Any]:
    turn = angular(name)
    found = parse(name)
    kind = "spindle" if name.endswith(SPINDLE) else "zero position" if found and found.zero_position else "line"
    return {"value": value / (ARCSEC if turn else UM), "unit": "arcsec" if turn else "um", "kind": kind}


def _curve(curve: Curve, turn: bool, axis: str, model: ErrorModel, machine: Machine) -> dict[str, Any]:
    position, unit = DEG if axis in ROTARY else 1.0, ARCSEC if turn else UM
    j = machine.axis_names.index(axis)
    lower, upper = (float(x[j]) for x in ranges(model, machine))
    x = np.linspace(lower, upper, FINE)
    if isinstance(curve, TableCurve):
        x = np.concatenate([x, curve.x])
    approaches = (1.0, -1.0) if isinstance(curve, TableCurve) and curve.both else (0.0,)
    values = np.array([curve.at(x, approach) for approach in approaches])
    at = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    span = [v / position if np.isfinite(v) else None for v in curve.range]
    kind = "series" if isinstance(curve, Fourier) else "polynomial" if isinstance(curve, Polynomial) else \
        f"{curve.rule} table" if isinstance(curve, TableCurve) else ""
    apart = float(np.abs(np.diff(values, axis=0)).max(initial=0.0)) / unit
    return {"kind": kind, "values": len(curve.values), "range": span, "both_ways": len(approaches) == 2,
            "unit": "arcsec" if turn else "um", "largest": float(values[at]) / unit, "at": float(x[at[1]]) / position,
            "lost_motion": apart}


def _legs(rods: RodErrors | None) -> dict[str, Any]:
    if rods is None or not rods.values.any():
        return {}
    found: dict[str, Any] = {}
    for name, value in zip(rods.names, rods.values, strict=True):
        turn = angular(name, rods)
        kind = name.split(".")[-2 if name[-2:] in (".x", ".y", ".z") else -1]
        size = abs(float(value)) / (ARCSEC if turn else UM)
        if size > found.get(kind, {"largest": -1.0})["largest"]:
            found[kind] = {"largest": size, "unit": "arcsec" if turn else "um", "parameter": name}
    return found


def _map(error_map: ErrorMap) -> dict[str, Any]:
    worst, coordinates = np.abs(error_map.table.reshape(-1, 6)).max(axis=0), {}
    for letter, nodes, period in zip(error_map.letters, error_map.nodes, error_map.periods, strict=True):
        unit = DEG if letter in ROTARY else 1.0
        coordinates[letter] = {"nodes": len(nodes), "range": [float(nodes[0]) / unit, float(nodes[-1]) / unit],
                               "repeats": period / unit or None}
    return {"coordinates": coordinates, "nodes": error_map.table.size // 6, "tool_length_mm": error_map.length,
            "directions": "machine" if error_map.bed else "table",
            "largest": {name: float(worst[k]) / (ARCSEC if k >= 3 else UM) for k, name in enumerate(COLUMNS)}}


def _covariance(model: ErrorModel) -> dict[str, Any] | None:
    if model.covariance is None:
        return None
    sigma = np.sqrt(np.diag(model.covariance))
    turn = np.array([angular(name, model.rods) for name in model.names], dtype=np.bool_)
    correlated = bool(np.count_nonzero(model.covariance - np.diag(np.diag(model.covariance))))
    return {"correlated": correlated, "without": [n for n, s in zip(model.names, sigma, strict=True) if s == 0.0],
            "largest_um": float(sigma[~turn].max(initial=0.0)) / UM,
            "largest_arcsec": float(sigma[turn].max(initial=0.0)) / ARCSEC}


def _volume(model: ErrorModel, machine: Machine, tool_length: float) -> dict[str, Any] | None:
    """Worst and root mean square over the volume; None where the model holds nowhere in it."""
    kinematics = machine.kinematics.with_tool(tool_length)
    actual, nominal = model.on(kinematics), model.zero().on(kinematics)
    w = samples(model, machine, actual, PLACES)
    if not len(w):
        return None
    tip, axis = apart(actual, nominal, w)
    one, other = int(np.argmax(tip)), int(np.argmax(axis))
    found = {"tool_length_mm": tool_length, "places": len(w), "ways_at_mean": both_directions(model),
             "tip_worst_um": float(tip[one]) / UM, "tip_rms_um": float(np.sqrt(np.mean(tip**2))) / UM,
             "tip_worst_at": _joints(machine, actual, w[one]),
             "axis_worst_arcsec": float(axis[other]) / ARCSEC, "axis_rms_arcsec": float(np.sqrt(np.mean(axis**2))) / ARCSEC,
             "axis_worst_at": _joints(machine, actual, w[other])}
    return found | _residual(actual, nominal, w, machine) | _uncertainty(model, actual, w)


def both_directions(model: ErrorModel) -> list[str]:
    """Components with two approach directions: where no motion is given their mean counts."""
    return [str(c.name) for c in model.axes.components if isinstance(c.curve, TableCurve) and c.curve.both]


def _residual(actual: Actual, nominal: Actual, w: Floats, machine: Machine) -> dict[str, Any]:
    """What correction leaves at places w, and how many of them it cannot reach."""
    found = correct(actual, actual.joints(w), *nominal.aim(w))
    lost = np.isnan(found.q).any(axis=1)
    tip, axis = (np.where(lost, 0.0, left) for left in (found.tip_after, found.axis_after))
    figures = {"turns": actual.turns, "residual_lost": int(lost.sum()), "residual_tip_worst_um": float(tip.max()) / UM,
               "residual_axis_worst_arcsec": float(axis.max()) / ARCSEC,
               "residual_axis_rms_arcsec": float(np.sqrt(np.mean(axis[~lost] ** 2))) / ARCSEC if not lost.all() else 0.0}
    at = int(np.argmax(axis))
    return figures | {"residual_axis_worst_at": _joints(machine, actual, w[at]),
                      "residual_near_pole": bool(found.partial[at])}


def apart(one: Actual, other: Actual, w: Floats) -> tuple[Floats, Floats]:
    """Distance of the tips (N,) mm and angle between the axes (N,) rad of two machines commanded alike."""
    (t0, a0), (t1, a1) = other.aim(w), one.aim(w)
    return np.linalg.norm(t1 - t0, axis=1), 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(a1 - a0, axis=1), 1.0))


def _uncertainty(model: ErrorModel, actual: Actual, w: Floats) -> dict[str, Any]:
    if model.covariance is None:
        return {}
    count = int(np.clip(UNCERTAINTY_WORK / (6.0 * len(model.names) ** 2 + 1.0), 4, 2000))
    found = uncertainty(model, actual, w[:count])
    return {"doubt_tip_um": float(found.tip_worst.max()) / UM, "doubt_axis_arcsec": float(found.axis.max()) / ARCSEC}


def _joints(machine: Machine, actual: Actual, w: Floats) -> dict[str, float]:
    q = actual.joints(w[None])[0]
    return {letter: round(float(v) / (DEG if turns else 1.0), 4) for letter, v, turns in
            zip(machine.axis_names, q, machine.rotary, strict=True)}
