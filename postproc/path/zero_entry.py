"""Tool-centre-point mode switched on with the rotary tables at zero, where makers' manuals leave open what its frame is.

FANUC A-79348E p. 19 (and B-63783EN-1 p. 1116; Mitsubishi M700V p. 477): the programming frame is fixed to the
table at switch-on, and "the angle of the table's rotary axis represents the initial state of the programming
coordinate system". Read one direction the frame is that of the part, turned with the table by its scale; read
in the other direction it is the work offset's frame, unturned, at the angle at which the table stands. With
the tables at zero both are one: so the mode is entered there, at the height of home, and the tables turn in it, the slides
standing as nearly as straight paths of the tip let them.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.control.control import Control
from postproc.control.modes import table_axes
from postproc.path.links import Link, SafeSpace, stays_clear
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, info
from toolpaths.rotations import whole_turns
from toolpaths.shapes import arrays
from toolpaths.units import DEG

_CHORD = 10.0 * DEG
"""turn of one block: the slides then leave their place by less than half a percent of the distance to the rotary axis"""
BELOW_HOME = 10.0
"""mm between the end of travel and words of the tip at the height of home: by so much may tools be longer at the machine"""
_ZERO = 1e-9
"""rad"""
_PLACES = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
@arrays(before="K J", state="K J", inside="L J")
class ZeroEntry:
    """Joints (K, J) of the blocks up to the mode, with the axes that they state, and (L, J) of those in the
    mode; `seconds` that the whole takes longer than indexing the tables before it."""

    before: Floats
    state: Bools
    inside: Floats
    clear: bool
    seconds: float


def needed(control: Control, link: Link) -> bool:
    """True where the tables would not stand at zero where a link leads into the mode."""
    tables = table_axes(control)
    if not len(link.index):
        return False
    last = link.index[-1]
    return bool((np.abs(last - _at_zero(control, last))[tables] > _ZERO).any())


def _at_zero(control: Control, q: Floats) -> Floats:
    """Joints (J,) with the rotary tables at zero: modulo axes at the nearest whole turn."""
    result = q.copy()
    for j in table_axes(control).tolist():
        result[j] = whole_turns(q[j]) if j in control.rolls else 0.0
    return result


def zero_entry(base: Control, tcp: Control, kin: Kinematics, space: SafeSpace, link: Link) -> ZeroEntry:
    """The index blocks of a link by home (rotary axes, slides, retract axis) through the tables' zero.

    The retract axis stays as high as its travel lets the straight paths of the tip be.
    """
    machine, tables = base.machine, table_axes(base)
    turned, moved, up = link.index
    zero = np.stack([turned, moved, moved])
    zero[:, tables] = _at_zero(base, moved)[tables]
    turn = moved - zero[1]
    count = max(int(np.ceil(np.abs(turn[tables]).max() / _CHORD - 1e-9)), 1)
    steps = zero[1] + np.arange(1, count + 1)[:, None] / count * turn
    sign = 1.0 if machine.limits.upper[machine.retract_axis] - moved[machine.retract_axis] < \
        moved[machine.retract_axis] - machine.limits.lower[machine.retract_axis] else -1.0
    for _ in range(3):
        over = _beyond(tcp, kin, np.concatenate([zero[-1:], steps]), machine, machine.retract_axis, sign)
        if over <= 0.0:
            break
        zero[-1, machine.retract_axis] -= sign * over
        steps[:, machine.retract_axis] -= sign * over
    inside = np.concatenate([steps, up[None]])
    travel = np.concatenate([zero[-1:], inside])
    clear = stays_clear(base, kin, space, np.concatenate([link.home[-1:], zero]), 0.0) and stays_clear(
        tcp, kin, space, travel, 0.0)
    longer = _seconds(machine, np.concatenate([link.home[-1:], zero, moved[None], up[None]])) - _seconds(
        machine, np.concatenate([link.home[-1:], link.index]))
    return ZeroEntry(zero, link.index_state, inside, clear, max(longer, 0.0))


def _beyond(tcp: Control, kin: Kinematics, q: Floats, machine: Machine, axis: int, sign: float) -> float:
    """mm by which an axis would come nearer to the end of its travel than `BELOW_HOME` between joints q (K, J)."""
    limit = machine.limits.upper[axis] if sign > 0.0 else machine.limits.lower[axis]
    worst = max(float((sign * (at[:, axis] - limit)).max()) for at in tcp.bent(q[:-1], q[1:], _PLACES, kin))
    return worst + BELOW_HOME


def _seconds(machine: Machine, q: Floats) -> float:
    """s of rapids from rest to rest through joints (K, J), by the velocities and accelerations of the axes."""
    travel = np.abs(np.diff(q, axis=0))
    v, a = machine.limits.velocity, machine.limits.acceleration
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(travel >= v**2 / a, travel / v + v / a, 2.0 * np.sqrt(travel / a))
    return float(np.nan_to_num(each).max(axis=1, initial=0.0).sum())


def cost(code: str, seconds: list[float], file: str) -> list[Diagnostic]:
    """What entering at zero costs, once for a program."""
    if not seconds:
        return []
    many = f"{len(seconds)} times" if len(seconds) > 1 else "once"
    return [info("output.tables_at_zero", f"{code} is switched on {many} with the rotary tables at zero, so that both "
                 f"readings of its frame mean the same: {sum(seconds):.1f} s longer than with the tables turned", file=file,
                 hint='frame = "table" in [modes.tcp] of the controller file, where the control is known to turn the frame '
                 "with the table's scale")]
