"""One ball touched with the rotary axes turned: by the right pivots and signs it stays one point of the table."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from machines.kinematics.chain import Joint
from machines.machine import Machine
from machines.sheet.model import DataSheet, PivotSheet, TouchedSheet
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


def strange_turns(sheet: DataSheet, touched: TouchedSheet) -> tuple[list[str], list[str]]:
    """Rotary axes that no reading turns, whole turns aside, and letters of readings that are no axis of the sheet."""
    turns = {letter: {getattr(one, letter) % 360.0 for one in touched.readings} for letter in "ABC"}
    return ([letter for letter in sheet.rotary if len(turns[letter]) == 1],
            [letter for letter in "ABC" if letter not in sheet.rotary and turns[letter] != {0.0}])


def wrong_sign(sheet: DataSheet, touched: TouchedSheet, made: Callable[[DataSheet], Machine | None]) -> str:
    """Which one sign of the sheet, changed, makes the readings agree."""
    found = [what for what, other in _changed(sheet) if (machine := made(other)) is not None
             and apart_by(machine, touched) <= AGREE]
    return f"they agree with {' or '.join(found)}" if found else (
        "see to the pivots, the angles and the probe's length: no one sign puts it right")


def untold(sheet: DataSheet, touched: TouchedSheet, machine: Machine,
           made: Callable[[DataSheet], Machine | None]) -> list[str]:
    """Other machines that readings which agree would be of one point by too: one sign other, an axis 1 mm elsewhere."""
    apart = apart_by(machine, touched)
    return [*(what for what, sheet_so in _changed(sheet) if (other := made(sheet_so)) is not None
              and not _same_lines(machine, other) and apart_by(other, touched) <= AGREE),
            *(what for what, sheet_so in _moved(sheet, machine) if (other := made(sheet_so)) is not None
              and abs(apart_by(other, touched) - apart) <= AGREE)]


def _same_lines(one: Machine, other: Machine) -> bool:
    """True where rotary axes turn about the same lines in the same sense: a point moved along its line changes nothing."""
    pairs = zip(_turning(one), _turning(other), strict=True)
    return all(np.array_equal(a.direction, b.direction)
               and float(np.linalg.norm(np.cross(a.direction, b.point - a.point))) <= AGREE for a, b in pairs)


def _turning(machine: Machine) -> list[Joint]:
    return [joint for joint in machine.kinematics.chain if joint.rotary]


def _moved(sheet: DataSheet, machine: Machine) -> Iterator[tuple[str, DataSheet]]:
    """The sheet with one rotary axis 1 mm off its line, and which."""
    points = {joint.name: joint.point for joint in _turning(machine)}
    for joint in _turning(machine):
        for k in np.flatnonzero(joint.direction == 0.0):
            moved = points | {joint.name: joint.point + np.eye(3)[k]}
            pivots = PivotSheet(form="machine", points={name: (float(p[0]), float(p[1]), float(p[2]))
                                                        for name, p in moved.items()})
            yield f"{joint.name} 1 mm further in {'XYZ'[k]}", sheet.model_copy(update={"pivots": pivots})


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
