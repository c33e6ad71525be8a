"""Whether the platform of a machine on legs moves as `freedoms` says, over the whole declared workspace.

Each driven leg is a row (r, b x r) of the platform's constraints, each pair of parallel rods another: it stops the turn
about r x s, with s from one rod to the other (Company 2000, V-1 to V-5). Together they must hold all six motions, or x, y
and the turn about z where the joints are hinges along z (no z among the freedoms); and no pair may stop a turn that the
machine is to have. A bar that is hinged to the platform adds one motion, its turn about the hinge, which the pairs that hold
it must stop. Where there are as many rows as motions their determinant, V-4 and det Jx in one, must keep its sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from machines.key_problem import KeyProblem
from machines.kinematics.legs.attitudes import attitude
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.on_legs import OnLegs
from machines.mobility import LEAST, place_words, sign_fault
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, unit
from toolpaths.shapes import arrays
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
    axis, spin = attitude(kinematics.loops.turns, tilt, heading)
    return *kinematics.posed(place, axis, spin), tilt


def leg_faults(kinematics: OnLegs, pairs: Sequence[Floats | None], bars: Sequence[str | None]) -> Iterator[KeyProblem]:
    """Legs out of reach, a singular platform, motions that nothing holds.

    Args:
        pairs: of each leg from one rod to the other (3,) mm, None of a single rod
        bars: of each leg the bar of the platform that it holds, None of the platform itself
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
                          np.linalg.det(jx / loops.sizes(q)[:, :, None]), partial(place_words, place, tilt),
                          "the platform is singular there: move the drives or make the workspace smaller")
    holds = loops.holds
    if holds is not None and (least := least_singular(_following(loops, place, turn))) < LEAST:
        yield KeyProblem("machine.mobility", ("freedoms",), "what follows from the freedoms "
                         f"{list(loops.free)} does not follow everywhere (least singular value {least:.3g})",
                         "write the freedoms that the hinges, rings or the passive leg leave the platform")
        return
    none = np.zeros((len(place), 0, 6))
    held = Constraints(kinematics, pairs, bars, unit(rods), ends - place[:, None, :],
                       none if holds is None else holds.rows(place, turn, loops.lever))
    yield from held.faults(partial(place_words, place, tilt))


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


@dataclass(frozen=True, eq=False)
@arrays(rods="N K 3", arms="N K 3", held="N H 6")
class Constraints:
    """What legs and pairs hold, at N places.

    Attributes:
        pairs, bars: as of `leg_faults`
        rods: (N, K, 3) unit vectors
        arms: (N, K, 3) mm from the reference point to the joints
        held: (N, H, 6) rows of what holds the platform besides
    """

    kinematics: OnLegs
    pairs: Sequence[Floats | None]
    bars: Sequence[str | None]
    rods: Floats
    arms: Floats
    held: Floats

    def faults(self, at: Callable[[int], str]) -> Iterator[KeyProblem]:
        """Pairs that stop what is to move, motions that nothing holds; `at` gives the words of a place."""
        stopped = list(self._stopped())
        yield from stopped
        if stopped:
            return
        rows, freedoms = self._rows(), list(self.kinematics.loops.free or self.kinematics.loops.freedoms)
        value = np.linalg.det(rows) if rows.shape[1] == rows.shape[2] else np.ones(1)
        least = least_singular(rows) if rows.shape[1] >= rows.shape[2] else 0.0
        pairs = sum(pair is not None for pair in self.pairs)
        if value.min() < 0.0 < value.max():
            yield KeyProblem("machine.mobility", ("legs",), "legs and pairs of rods together hold the platform with one "
                             f"sign at {at(int(value.argmin()))}, with the other at {at(int(value.argmax()))}: between "
                             "them is a place where they do not (V-4)", "make the workspace smaller, or let the pairs "
                             "reach the platform from other sides")
        elif least < LEAST:
            besides = " with hinges, rings or passive legs" if self.held.shape[1] else ""
            yield KeyProblem("machine.mobility", ("legs",), f"{self.rods.shape[1]} legs and {pairs} pairs of rods{besides} "
                             f"do not hold the platform everywhere (least singular value {least:.3g}): it moves otherwise "
                             f"than freedoms = {freedoms}",
                             "give `rods` of the legs that are pairs, or the freedoms that the machine has")

    def _across(self, k: int) -> Floats:
        """(N, 3): the turn that the pair of leg k stops, times the distance of its rods by the lever."""
        pair = self.pairs[k]
        assert pair is not None
        return cross(self.rods[:, k], np.broadcast_to(pair / self.kinematics.loops.lever, self.rods[:, k].shape))

    def _stopped(self) -> Iterator[KeyProblem]:
        loops = self.kinematics.loops
        turns = loops.basis[3:][:, loops.basis[3:].any(axis=0)]
        for k, pair in enumerate(self.pairs):
            if pair is None or self.bars[k] is not None:
                continue
            if np.abs(unit(self._across(k)) @ turns).max(initial=0.0) > STOPPED:
                yield KeyProblem("machine.mobility", ("legs", self.kinematics.leg_names[k], "rods"), "the pair of rods "
                                 f"stops a turn that freedoms = {list(loops.freedoms)} has", "let the joints of the pair "
                                 "lie along the axis of that turn, or write one rod")
                return

    def _rows(self) -> Floats:
        """(N, rows, motions): of the platform, turns by the lever, then of each bar its turn about its hinge."""
        loops, bars = self.kinematics.loops, list(dict.fromkeys(bar for bar in self.bars if bar is not None))
        about = loops.basis[3:][:, loops.basis[3:].any(axis=0)][:, 0] if bars else np.zeros(3)
        rows = []
        for k, (pair, bar) in enumerate(zip(self.pairs, self.bars, strict=True)):
            kept = np.zeros(3) if loops.kept is None else loops.kept[k]
            own = np.array([bar == name for name in bars], dtype=np.float64)
            swing = self.rods[:, k] @ np.cross(about, kept) / loops.lever
            rows.append(np.column_stack([self.rods[:, k], cross(self.arms[:, k], self.rods[:, k]) / loops.lever,
                                         swing[:, None] * own]))
            if pair is not None:
                across = self._across(k)
                rows.append(np.column_stack([0.0 * across, across, (across @ about)[:, None] * own]))
        bare = np.zeros((len(self.held), len(bars)))
        rows += [np.column_stack([one, bare]) for one in np.swapaxes(self.held, 0, 1)]
        columns = [0, 1, 2, 3, 4, 5] if "z" in loops.freedoms else [0, 1, 5]
        return np.stack(rows, axis=1)[:, :, columns + list(range(6, 6 + len(bars)))]


def _following(loops: Loops, place: Floats, turn: Floats) -> Floats:
    """(N, H, H): rows of the holds in the freedoms that follow from the others."""
    assert loops.holds is not None
    return loops.holds.rows(place, turn, loops.lever)[:, :, [name not in loops.free for name in loops.freedoms]]


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
