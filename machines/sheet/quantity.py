"""Figures of a data sheet with their units, as brochures print them: "22.9 m/min", "50 rpm", "0.5 g", "30 in"."""

from __future__ import annotations

import re
from typing import Literal

QuantityKind = Literal["length", "angle", "speed", "turning speed", "acceleration", "turning acceleration", "time"]
_G = 9806.65
UNITS: dict[QuantityKind, dict[str, float]] = {
    "length": {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "inch": 25.4, '"': 25.4},
    "angle": {"deg": 1.0, "°": 1.0, "degrees": 1.0},
    "speed": {"m/min": 1000.0 / 60.0, "mm/min": 1.0 / 60.0, "mm/s": 1.0, "m/s": 1000.0, "in/min": 25.4 / 60.0,
              "ipm": 25.4 / 60.0, "in/s": 25.4},
    "turning speed": {"rpm": 6.0, "1/min": 6.0, "min-1": 6.0, "min⁻¹": 6.0, "r/min": 6.0, "rev/min": 6.0, "deg/s": 1.0,
                      "°/s": 1.0, "deg/sec": 1.0, "°/sec": 1.0, "deg/min": 1.0 / 60.0, "°/min": 1.0 / 60.0},
    "acceleration": {"m/s2": 1000.0, "m/s²": 1000.0, "m/s^2": 1000.0, "mm/s2": 1.0, "mm/s²": 1.0, "g": _G, "in/s2": 25.4},
    "turning acceleration": {"deg/s2": 1.0, "°/s²": 1.0, "rev/s2": 360.0, "rad/s2": 57.29577951308232},
    "time": {"s": 1.0, "sec": 1.0, "min": 60.0},
}
"""by measure: what one of each unit is in mm, degrees, s"""
_NUMBER = re.compile(r"\s*([-+]?\d+(?:\.\d+)?|[-+]?\.\d+)\s*(.*?)\s*$")


_ALSO = re.compile(r"\s*\([^()]*\)\s*$")
"""the same figure in other units, as brochures print it behind the first: "762 mm (30 in)\""""
_ANGLES = re.compile(r"([-+]?\d+(?:\.\d+)?|[-+]?\.\d+)(?:\s*(?:degrees|deg|°))?")
_BETWEEN = re.compile(r"\s*(?:\bto\b|\.\.+|…|/|,|;)\s*|\s+")


class WrongFigureError(ValueError):
    """Why a figure of a sheet cannot be taken, and what to write instead."""

    def __init__(self, says: str, hint: str) -> None:
        super().__init__(f"{says}; {hint}")
        self.says, self.hint = says, hint


def read_quantity(text: str, measure: QuantityKind) -> float:
    """A figure in mm, degrees and s.

    Raises:
        WrongFigureError: where it is no number with a unit of the measure.
    """
    units = UNITS[measure]
    known = ", ".join(units)
    found = _NUMBER.match(_ALSO.sub("", text))
    if found is None:
        example = f"12.5 {next(iter(units))}"
        raise WrongFigureError(f"{text!r} is not a number with a unit", f"write {_a(measure)} as in {example!r}")
    number, unit = found[1], found[2].lower()
    if unit.startswith(","):
        raise WrongFigureError(f"{text!r} has a comma in its number", "write it with a point, thousands without a mark")
    if not unit:
        raise WrongFigureError(f"{text!r} has no unit", f"{_a(measure)} is in {known}")
    if unit not in units:
        raise WrongFigureError(f"{unit!r} is no unit of {_a(measure)}", f"known are {known}")
    return float(number) * units[unit]


def angles_of(text: str) -> tuple[float, float] | None:
    """Both ends of the travel of a rotary axis, degrees, the lower one first, as brochures print them: "-35 to 120 deg",
    "+120/-35", "±110°"; None for anything else."""
    plain = text.strip()
    if plain.startswith(("±", "+/-")):
        one = _ANGLES.fullmatch(plain.removeprefix("±").removeprefix("+/-").strip())
        return None if one is None else (-abs(float(one[1])), abs(float(one[1])))
    first = _ANGLES.match(plain)
    gap = _BETWEEN.match(plain, first.end()) if first else None
    last = _ANGLES.fullmatch(plain, gap.end()) if gap else None
    if first is None or last is None:
        return None
    low, high = sorted((float(first[1]), float(last[1])))
    return low, high


def _a(measure: QuantityKind) -> str:
    return f"{'an' if measure[0] in 'aeiou' else 'a'} {measure}"
