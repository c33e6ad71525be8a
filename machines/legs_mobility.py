"""Whether the platform of a machine on legs moves as `freedoms` says, over the whole declared workspace.

Each driven leg is a row (r, b x r) of the platform's constraints, each pair of parallel rods another: it stops the turn
about r x s, with s from one rod to the other (Company 2000, V-1 to V-5). Together they must hold all six motions, or x, y
and the turn about z where the joints are hinges along z (no z among the freedoms); and no pair may stop a turn that the
machine is to have.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from machines.key_problem import KeyProblem
from machines.kinematics.legs.attitudes import direction_of
from machines.kinematics.legs.on_legs import OnLegs
from machines.mobility import LEAST, place_words, sign_fault
from toolpaths.arrays import Floats
from toolpaths.rotations import cross, unit
from toolpaths.units import DEG

GRID, HEADINGS, TILTS = (5, 5, 5), 12, 4
"""places per direction, faces included; where the tool tilts, directions from z"""
STOPPED = 1e-6
"""part of a turn that a pair of rods may stop"""


def examined(kinematics: OnLegs) -> tuple[Floats, Floats, Floats]:
    """(C (N, 3), R (N, 3, 3), tilts (N,)) all over the workspace, its edges included, carriers at 0."""
    place, tilt = kinematics.workspace.grid((*GRID, TILTS + 5))
    heading = np.zeros(len(tilt))
    if kinematics.loops.turns == "abc":
        heading = np.linspace(0.0, 2.0 * np.pi, HEADINGS, endpoint=False)
        place, tilt, heading = (np.repeat(place, HEADINGS, axis=0), np.repeat(tilt, HEADINGS), np.tile(heading, len(place)))
    axis = direction_of(kinematics.loops.turns, tilt, heading)
    turn, held = kinematics.turn_of(axis, np.zeros(len(axis))), kinematics.loops.basis[:3].any(axis=1)
    return np.where(held, place, 0.0), turn, tilt


def leg_faults(kinematics: OnLegs, pairs: Sequence[Floats | None]) -> Iterator[KeyProblem]:
    """Legs out of reach, a singular platform, motions that nothing holds.

    Args:
        pairs: of each leg from one rod to the other (3,) mm, None of a single rod
    """
    place, turn, tilt = examined(kinematics)
    loops, legs = kinematics.loops, kinematics.legs
    ends = loops.ends(place, turn)
    q = legs.solve(ends, legs.roots)
    if len(bad := np.flatnonzero(np.isnan(q[:, 0]))):
        yield KeyProblem("machine.workspace", ("workspace",), f"a leg does not reach "
                                                              f"{place_words(place, tilt, int(bad[0]))} and "
                         f"{len(bad) - 1} of {len(place)} other places examined",
                         "make the workspace smaller or the rods longer")
        return
    jx, rods = loops.matrix_at(place, turn, q)
    yield from sign_fault("machine.singular", "det Jx (rods as unit vectors, moments by the longest arm)",
                          np.linalg.det(jx / legs.spans(q)[:, :, None]), partial(place_words, place, tilt),
                          "the platform is singular there: move the drives or make the workspace smaller")
    yield from _held(kinematics, pairs, unit(rods), loops.arms(turn))


def travel_faults(kinematics: OnLegs, travel: Floats, home: Floats) -> Iterator[KeyProblem]:
    """A home where the platform is nowhere, and travels (J, 2) in which no place of the workspace lies; mm and rad.

    Angles count whole turns apart. Paths are those of the machine file.
    """
    hint = "flip `root` (a star of arms has the elbows outside with -1, inside with 1), or correct travel and home"
    names, legs_at = kinematics.leg_names, kinematics.legs_at
    if not kinematics.stands_at(home):
        yield KeyProblem("machine.home", ("axes", names[0], "home"), "the legs meet at no platform with all axes at "
                         "home", hint)
    place, turn, _ = examined(kinematics)
    q = kinematics.legs.solve(kinematics.loops.ends(place, turn), kinematics.legs.roots)
    (low, high), arms = travel[legs_at].T, np.array(kinematics.rotary)[legs_at]
    first = np.where(np.isfinite(low), low, 0.0)
    turned = np.where(arms, first + np.mod(q - first, 2.0 * np.pi), q)
    inside = (turned >= low) & (turned <= high)
    if not inside.all(axis=1).any():
        k = int(inside.sum(axis=0).argmin())
        size = DEG if arms[k] else 1.0
        yield KeyProblem("machine.travel", ("axes", names[k], "travel"), "no place of the workspace has all legs inside "
                         f"their travel: {names[k]} stands at {q[:, k].min() / size:.4g} to {q[:, k].max() / size:.4g}, "
                         f"travel {low[k] / size:g} to {high[k] / size:g}", hint)


def _held(kinematics: OnLegs, pairs: Sequence[Floats | None], rods: Floats, arms: Floats) -> Iterator[KeyProblem]:
    loops = kinematics.loops
    held = [cross(rods[:, k], np.broadcast_to(s / np.linalg.norm(s), rods[:, k].shape))
            for k, s in enumerate(pairs) if s is not None]
    turns = loops.basis[3:][:, loops.basis[3:].any(axis=0)]
    for k, row in zip([k for k, s in enumerate(pairs) if s is not None], held, strict=True):
        if np.abs(row @ turns).max(initial=0.0) > STOPPED:
            yield KeyProblem("machine.mobility", ("legs", kinematics.leg_names[k], "rods"), "the pair of rods stops a "
                             f"turn that freedoms = {list(loops.freedoms)} has", "let the joints of the pair lie along the "
                             "axis of that turn, or write one rod")
            return
    apart = [float(np.linalg.norm(s)) / loops.lever for s in pairs if s is not None]
    rows = np.concatenate([np.concatenate([rods, cross(arms, rods) / loops.lever], axis=2),
                           *(np.concatenate([0.0 * row, size * row], axis=1)[:, None]
                             for row, size in zip(held, apart, strict=True))], axis=1)
    columns = [0, 1, 2, 3, 4, 5] if "z" in loops.freedoms else [0, 1, 5]
    least = least_singular(rows[:, :, columns]) if rows.shape[1] >= len(columns) else 0.0
    if least < LEAST:
        yield KeyProblem("machine.mobility", ("legs",), f"{rods.shape[1]} legs and {len(held)} pairs of rods do not hold "
                         f"the platform everywhere (least singular value {least:.3g}): it moves otherwise than "
                         f"freedoms = {list(loops.freedoms)}",
                         "give `rods` of the legs that are pairs, or the freedoms that the machine has")


def least_singular(rows: Floats) -> float:
    """The least singular value of any of (N, R, C), R >= C; a lower bound of it where that is above LEAST.

    With p their product and f2 the sum of their squares it is at least p ((C - 1) / f2)^((C - 1) / 2), as the product of
    the others is largest where they are equal.
    """
    square = np.swapaxes(rows, 1, 2) @ rows
    n = square.shape[-1] - 1
    product = np.sqrt(np.maximum(np.linalg.det(square), 0.0))
    bound = product * (n / np.trace(square, axis1=1, axis2=2)) ** (0.5 * n)
    low = rows[bound < LEAST]
    return float(np.linalg.svd(low, compute_uv=False)[:, -1].min() if len(low) else bound.min())
