"""One ball touched with the rotary axes turned: by the right pivots and signs it stays one point of the table."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from machines.machine import Machine
from machines.sheet.model import DataSheet, TouchedSheet
from toolpaths.units import DEG

AGREE = 0.05
"""mm that readings of one point may be apart"""
OTHER_JOG = {"right up": "right down", "front up": "front down", "clockwise": "anti-clockwise", "tip back": "tip front",
             "tip left": "tip right"}
"""what is seen where an axis counts in the other direction"""


def apart_by(machine: Machine, touched: TouchedSheet) -> float:
    """mm between the two readings that are farthest apart on the table of the machine."""
    places = {"X": 0, "Y": 1, "Z": 2}
    q = np.array([[one.at[places[name]] if name in places else getattr(one, name) * DEG for name in machine.axis_names]
                  for one in touched.readings])
    tip, _ = machine.kinematics.with_tool(touched.probe_length).forward(q)
    return float(np.linalg.norm(tip[:, None] - tip[None, :], axis=2).max())


def wrong_sign(sheet: DataSheet, made: Callable[[DataSheet], Machine | None]) -> str:
    """Which one sign of the sheet, changed, makes the readings agree."""
    touched = sheet.touched
    found = [what for what, other in _changed(sheet) if touched is not None and (machine := made(other)) is not None
             and apart_by(machine, touched) <= AGREE]
    return f"they agree with {' or '.join(found)}" if found else (
        "see to the pivots, the angles and the probe's length: no one sign puts it right")


def _changed(sheet: DataSheet) -> Iterator[tuple[str, DataSheet]]:
    """The sheet with one sign changed, and which."""
    other = OTHER_JOG | {right: left for left, right in OTHER_JOG.items()}
    for letter in sheet.rotary:
        axis = sheet.axes[letter]
        if axis.jog is not None:
            jog = other[axis.jog]
            yield f"jog = {jog!r} under [{letter}]", sheet.model_copy(update={letter: axis.model_copy(update={"jog": jog})})
    pivots = sheet.pivots
    for name, vector in pivots.points.items() if pivots is not None else ():
        for k in range(3):
            if pivots is not None and vector[k]:
                point = tuple(-v if j == k else v for j, v in enumerate(vector))
                other_one = pivots.model_copy(update={"points": {**pivots.points, name: point}})
                yield f"{'XYZ'[k]} of {name} {-vector[k]:g}", sheet.model_copy(update={"pivots": other_one})
