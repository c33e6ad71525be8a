"""How fast the errors of a machine change as its joints move: bounds that hold everywhere near a pose, not samples.

E(q) is the pose of the machine with errors less that of the machine without. With the chain of
`serial_errors`, a slide k that moves by dq moves the tool by R' (d' + E_k'(p)) dq instead of R d dq, a
turning axis by R' (w' x (p' - o') + E_k'(p)) dq instead of R (w x (p - o)) dq. Rotations differ by no more
than the sum of their angles, points by no more than the errors displace them, so that with arm A from the
axis to the tip, l and g the steepest slopes of its own component errors, and Theta, D the largest turn and
displacement of the axes between it and the workpiece, and of all,

    slide:         |dE/dq| <= Theta + location + l + g (A + D)                                 mm/mm; axis: g
    turning axis:  |dE/dq| <= Theta (A + D + shift) + location A + D + shift + l + g (A + D)   mm/rad; axis: 2 Theta + ...

Arms are those at the pose, and what they may grow to while the joints move (Groenwall: dA <= ds + A dw).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields
from itertools import pairwise

import numpy as np

from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.tables.names import SPINDLE
from machines.kinematics.base import Kinematics
from machines.kinematics.chain import Joint
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation
from toolpaths.shapes import arrays

LARGEST_TURN = 0.1
"""rad: errors that turn the tool by more have no bound here"""
STEEPEST_GAP = 0.1
"""of lost motion, mm per mm: where it changes faster, its taking up is not monotone"""


@dataclass(frozen=True)
@arrays(tip="N J", axis="N J", tip_reversal="N J", axis_reversal="N J")
class ErrorRates:
    """Bounds for N poses and J joints.

    Attributes:
        tip, axis (N, J): mm and rad of the tip and the tool axis per mm or rad of each joint
        tip_reversal, axis_reversal (N, J): the same per unit of the approach direction by which a joint is
            where it is (`lost_motion`)
    """

    tip: Floats
    axis: Floats
    tip_reversal: Floats
    axis_reversal: Floats


@dataclass(frozen=True)
class AxisSizes:
    """Of one axis of the chain: largest turn (rad) and displacement (mm) by its component errors, their
    steepest slopes per mm or rad, how far the two approach directions differ; turn and shift of its line, its
    zero position."""

    turn: float = 0.0
    shift: float = 0.0
    turn_slope: float = 0.0
    shift_slope: float = 0.0
    turn_apart: float = 0.0
    shift_apart: float = 0.0
    line_turn: float = 0.0
    line_shift: float = 0.0
    zero: float = 0.0


def unknown_rates(n: int, joints: int) -> ErrorRates:
    """Of machines whose errors have no bound here: infinity."""
    none = np.full((n, joints), np.inf)
    return ErrorRates(none, none, none, none)


def joined(parts: Iterable[tuple[Ints, ErrorRates]]) -> ErrorRates:
    """Rates of rows (K,) each, which together are all."""
    some = list(parts)
    order = np.argsort(np.concatenate([rows for rows, _ in some]))
    return ErrorRates(*(np.concatenate([getattr(rates, f.name) for _, rates in some])[order] for f in fields(ErrorRates)))


def pivot_rates(kin: Kinematics, held: Kinematics | None, q: Floats) -> ErrorRates:
    """Of machine `kin` against the same one with other points of its turning axes and another length of its
    tool, as its control holds it.

    The tip is linear in the points: E = sum of R (I - R_k) (offset of axis k), which a radian of any axis changes by no more
    than twice the offsets, square to their axes, together.
    """
    if held is None or not kin.chain or not held.chain:
        return unknown_rates(*q.shape)
    off = abs(kin.tool_length - held.tool_length)
    for one, other in zip(kin.chain, held.chain, strict=True):
        apart = other.point - one.point
        off += 2.0 * float(np.linalg.norm(apart - (apart @ one.direction) * one.direction)) if one.rotary else 0.0
    none = np.zeros(q.shape)
    tip = np.broadcast_to(np.where(np.array(kin.rotary), off, 0.0), q.shape)
    return ErrorRates(tip, none, none, none)


def sizes_of(errors: SerialErrors, letter: str) -> AxisSizes:
    """The sizes of an axis or the spindle; turns about x, y and z add up, displacements are square to each other."""
    found = {(angular, what): 0.0 for angular in (True, False) for what in ("most", "steepest", "apart")}
    for component in errors.components:
        if component.name.axis != letter:
            continue
        for what in ("most", "steepest", "apart"):
            value, key = float(getattr(component.curve, what)), (component.name.angular, what)
            found[key] = found[key] + value if component.name.angular else float(np.hypot(found[key], value))
    location = errors.location(letter)
    zero = 0.0 if letter == SPINDLE else abs(errors.zero_position(letter))
    return AxisSizes(found[True, "most"], found[False, "most"], found[True, "steepest"], found[False, "steepest"],
                     found[True, "apart"], found[False, "apart"], float(np.abs(location[3:]).sum()),
                     float(np.linalg.norm(location[:3])), zero)


def gap_slopes_fit(errors: SerialErrors) -> bool:
    """False where lost motion changes so fast along an axis that its taking up need not be monotone."""
    curves = [c.curve for c in errors.components if c.name.positioning and c.curve.apart > 0.0]
    return all(2.0 * curve.steepest < STEEPEST_GAP for curve in curves)


def serial_rates(kin: Kinematics, errors: SerialErrors, q: Floats, reach: Floats) -> ErrorRates | None:
    """Rates near poses q (N, J) while each joint moves by up to `reach` (N, J); None where errors are too large for it."""
    n, chain = len(q), kin.chain
    index = [kin.axis_names.index(joint.name) for joint in chain]
    size = [sizes_of(errors, joint.name) for joint in chain]
    spindle = sizes_of(errors, SPINDLE)
    arms = arms_of(kin, errors, q, reach)
    turns = [s.turn + (2.0 * s.line_turn + s.zero if joint.rotary else 0.0) for s, joint in zip(size, chain, strict=True)]
    whole = sum(turns) + spindle.line_turn
    if whole > LARGEST_TURN or not gap_slopes_fit(errors):
        return None
    moved = np.full(n, spindle.line_shift + spindle.line_turn * abs(kin.tool_length))
    for k, (joint, s, j) in enumerate(zip(chain, size, index, strict=True)):
        own = 2.0 * s.line_shift if joint.rotary else s.line_turn * (np.abs(q[:, j]) + reach[:, j]) + s.zero
        moved = moved + s.shift + turns[k] * arms[k] + own
    moved = moved / (1.0 - whole)
    result = [np.zeros((n, len(kin.axis_names))) for _ in range(4)]
    before = 0.0
    for k, (joint, s, j) in enumerate(zip(chain, size, index, strict=True)):
        arm = arms[k] + moved
        own = s.shift_slope + s.turn_slope * arm
        if joint.rotary:
            result[0][:, j] = ((before + s.turn) * (arm + s.line_shift) + s.line_turn * arms[k] + moved + s.line_shift + own)
            result[1][:, j] = before + s.turn + s.line_turn + whole + s.turn_slope
        else:
            result[0][:, j] = before + s.line_turn + own
            result[1][:, j] = s.turn_slope
        result[2][:, j], result[3][:, j] = 0.5 * (s.shift_apart + s.turn_apart * arm), 0.5 * s.turn_apart
        before += turns[k]
    return ErrorRates(*result)


def standing_arm(kin: Kinematics, q: Floats) -> Floats:
    """(N,) mm that the tip is away from any turning axis at q (N, J), and wherever it goes while it stands on the part.

    Where all slides are together the turning axes on either side of them keep their distances from each
    other, from the part or from the tool; infinite elsewhere.
    """
    if not kin.chain or not kin.slides_square:
        return np.full(len(q), np.inf)
    turning = [joint for joint in kin.chain if joint.rotary]
    if not turning:
        return np.zeros(len(q))
    apart = sum(float(np.linalg.norm(one.point - other.point)) for one, other in pairwise(turning))
    arms = arms_of(kin, SerialErrors(), q, np.zeros(q.shape))
    return np.asarray(np.max([arm for arm, joint in zip(arms, kin.chain, strict=True) if joint.rotary], axis=0) + apart)


def arms_of(kin: Kinematics, errors: SerialErrors, q: Floats, reach: Floats) -> list[Floats]:
    """By axis of the chain the largest distance (N,) of the tip from its point and its reference point, with
    what it may grow by while the joints move by `reach` (N, J)."""
    point = np.broadcast_to(-kin.tool_length * kin.tool_axis, (len(q), 3))
    arms = list[Floats]()
    for joint in reversed(kin.chain):
        j = kin.axis_names.index(joint.name)
        there = _driven(joint, q[:, j], point)
        centres = [np.asarray(errors.reference.get(joint.name, joint.point), dtype=np.float64)]
        ends = (point, there) if joint.rotary else (point,)  # the reference point of a slide travels with it
        centres += [joint.point] if joint.rotary else []
        arms.append(np.max([np.linalg.norm(end - centre, axis=1) for end in ends for centre in centres], axis=0))
        point = there
    arms.reverse()
    rotary = np.array(kin.rotary)
    slid, turned = reach[:, ~rotary].sum(axis=1), reach[:, rotary].sum(axis=1)
    farthest = np.max(arms, axis=0)
    growth = (farthest + slid) * np.exp(turned) - farthest
    return [arm + growth for arm in arms]


def _driven(joint: Joint, x: Floats, point: Floats) -> Floats:
    if not joint.rotary:
        return np.asarray(point + x[:, None] * joint.direction)
    turned = np.einsum("nij,nj->ni", rotation(joint.direction, x), point - joint.point)
    return np.asarray(joint.point + turned)
