"""Modulo (roll-over) rotary axes: what their words mean, how long a turn one block may make, words in one turn.

Joints count every turn, in planning and in the read-back alike; only the words of a modulo axis stay inside
one turn. From word to word the control goes the shorter path ("shortest": Fanuc ROA = 1, RAB = 0, B-63534EN
20.2; Heidenhain M126), the path of the word's sign ("sign": RAB = 1; LinuxCNC WRAPPED_ROTARY), or as the word
itself says (Siemens DC, ACP, ACN).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

import numpy as np

from machines.machine import Machine
from postproc.controllers.model import ControllerFile
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import whole_turns

TURN = 360.0
HALF = 179.9
"""degrees that one block may turn where the control takes the shorter path: at 180 it could go either"""
WHOLE = 359.9
"""degrees that one block may turn where its direction is stated"""
LEAST = 1e-7
"""degrees that reckoning may leave of no turn, or of half a turn"""
Rule = Literal["shortest", "sign"]


@dataclass(frozen=True)
class Rollover:
    """A modulo axis: the path that the control takes, where its turn begins (degrees), `stated` where words
    say their path, `whole` where -360 is a word."""

    rule: Rule
    low: float = 0.0
    stated: bool = False
    whole: bool = False

    @property
    def undirected(self) -> bool:
        """True where words do not say which path they turn: the control takes the shorter one."""
        return self.rule == "shortest" and not self.stated

    @property
    def most(self) -> float:
        """Degrees that one block may turn."""
        return HALF if self.undirected else WHOLE

    def words(self, degrees: Floats, before: Floats) -> tuple[Floats, Bools]:
        """(words (N,) in one turn, under "sign" negative where the axis turns that path; (N,) True where it
        does) of positions (N,), degrees, of an axis that stands at `before` (N,)."""
        step = degrees - before
        inside = np.mod(degrees - self.low, TURN) + self.low
        inside = np.where(inside >= self.low + TURN - LEAST, inside - TURN, inside) + 0.0
        back = step < -LEAST
        return np.where(back, -inside, inside) if self.rule == "sign" else inside, back


def rollovers(machine: Machine, controller: ControllerFile) -> tuple[dict[int, Rollover], list[Diagnostic]]:
    """The modulo axes of a machine by joint, as the control turns them; rules that it has not are errors."""
    result, found, rules = dict[int, Rollover](), list[Diagnostic](), controller.rollover
    for j, turns in enumerate(machine.turns):
        rule = turns.rollover or rules.default
        if not turns.modulo or rule == "none":
            continue
        name = machine.axis_names[j]
        if rule not in rules.rules:
            had = ", ".join(f'"{r}"' for r in rules.rules)
            found.append(error("machine.rollover", f'axis {name} of {machine.name} has rollover = "{rule}", which this '
                               "control does not have", file=machine.file,
                               hint=f'allowed are {had} under [axes.{name}]; left out it is "{rules.default}"'))
        elif turns.low and (rule == "sign" or rules.shortest):
            why = "this control takes the sign of a word as its direction, so that words" if rule == "sign" else \
                "words of this control that state their path"
            found.append(error("machine.rollover", f"axis {name} of {machine.name}: {why} are 0 to 360 degrees",
                               file=machine.file, hint=f"modulo_range = [0, 360] under [axes.{name}]"))
        else:
            result[j] = Rollover("sign" if rule == "sign" else "shortest", turns.low, bool(rules.shortest),
                                 rules.zero_negative == "-360")
    return result, found


def parked(machine: Machine, rolls: Collection[int], q: Floats) -> Floats:
    """Home (J,) or (N, J) as axes stand there that come from joints q: at the nearest whole turn, but for
    those that are to unwind all their turns; `rolls`: the modulo axes by joint."""
    home = np.broadcast_to(machine.home, q.shape).copy()
    for j in parking(machine, rolls):
        home[..., j] += whole_turns(q[..., j] - home[..., j])
    return home


def parking(machine: Machine, rolls: Collection[int]) -> list[int]:
    """The joints that park at whole turns."""
    return [j for j in np.flatnonzero(machine.endless).tolist() if j in rolls or machine.turns[j].park == "turn"]


def off_home(machine: Machine, rolls: dict[int, Rollover], place: Floats, home: Floats) -> Floats:
    """mm and degrees by which places (..., J) are off home (J,), whole turns of axes that park at them aside."""
    away = np.abs(place - home)
    for j in parking(machine, rolls):
        away[..., j] = np.abs(away[..., j] - whole_turns(away[..., j], TURN))
    return np.asarray(away)
