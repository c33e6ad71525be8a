"""Dimensional errors of any platform on legs (`kind = "legs"`), and the exact closure of its rods.

Rod r belongs to leg k, s_r is its place next to the leg's line, A(q) and l(q) are those of `kinematics/legs/drives.py`. With
the errors of annex E (Company 2000, II-52 to II-58, E-1 to E-9), written for every drive:

    slide    A_r = P_k + dP_k + G_k ((q + d_k) u_k + s_r) + R_k dA_r
    arm      A_r = P_k + dP_k + G_k s_r + Rot(G_k u_k, q + d_k) (G_k a_k + R_k dA_r)
    length   A_r = P_k + dP_k + s_r + dA_r                              l_r = L_k + q + d_k + dl_r
             B_r = X + R (b_k + s_r + dB_r),     |B_r - A_r| = l_r,     l_r = L_k + dl_r of slides and arms

G_k: exact turn of the drive's line about x, y, z of the machine frame; d_k: how much farther the drive stands than it
counts; R_k: z along the line of the drive, x from the rail to the joint, of an arm from its axis to the foot at 0.

Six rods hold a platform in space, two pairs more than hold one in its plane (the turn about z is what they have in common):
then the rods share what is too much, by least squares of their stretches. Where the file gives fewer rods, what holds the
platform otherwise is perfect: it keeps its freedoms. Where legs hold bars of the platform, rods that are as many as its
motions and the hinges of the bars are closed with these (`bar_loops.py`); else each pair is one rod in its middle, and a bar
keeps its direction. Hinges of legs, rings and passive legs have errors of their own (`bearings.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.bar_loops import BarLoops, bar_loops
from machines.geometric_error.actual.bearings import bearing_names, held_with, rings_with
from machines.geometric_error.actual.rods import RODS, RodErrors, guide_frame, inverted
from machines.geometric_error.actual.transforms import turns
from machines.kinematics.base import Kinematics
from machines.kinematics.columns import blocks
from machines.kinematics.holds import Holds
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.loops import FREEDOMS, Loops, turned
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import dot, lengths
from toolpaths.shapes import arrays

STEPS = 20
"""of the least squares, at most"""
STILL = 1e-11
"""mm: a last step of them"""
SMALL = 1e-3
"""mm and rad of the differences by which bearings count: what they do is all but linear"""
HELD = 1e-6
"""smallest singular value of the rods' rows, each of length about 1, with which they hold a platform"""


@dataclass(frozen=True, eq=False)
@arrays(leg="R", shift="R 3", offset="K 3", guide="K 3 3")
class LegFrame:
    """Nominal geometry of R rods of K legs, mm, machine frame.

    Attributes:
        machine: without errors
        leg: (R,) leg of each rod
        shift: (R, 3) s, at both ends
        offset: (K, 3) from the line of the foot to the rail, about whose point the guide turns
        guide: (K, 3, 3) R_k, columns x, y, z
    """

    machine: OnLegs
    leg: Ints
    shift: Floats
    offset: Floats
    guide: Floats

    @property
    def letters(self) -> tuple[str, ...]:
        """Of the legs."""
        return self.machine.leg_names

    @cached_property
    def zero(self) -> RodErrors:
        """No errors: the parameters that there are."""
        count = [int(np.sum(self.leg[:r] == k)) + 1 for r, k in enumerate(self.leg)]
        names = tuple(f"{self.letters[k]}{number}" for k, number in zip(self.leg, count, strict=True))
        arms = tuple(name for name, arm in zip(self.letters, self.machine.legs.arm, strict=True) if arm)
        bearings = bearing_names(self.machine.loops, self.letters, self.on_bars)
        return replace(RodErrors.none(self.letters, names), drive=np.zeros(len(self.letters)), arms=arms,
                       bearings=np.zeros(len(bearings)), bearing_names=bearings)

    @property
    def on_bars(self) -> bool:
        """True where the rods of bars are closed exactly."""
        return bool(self.machine.loops.bars) and len(self.leg) == RODS + len(self.machine.loops.bar_names)

    def bars(self, errors: RodErrors) -> BarLoops:
        """The rods with their errors, where `on_bars`."""
        kept, loops = self.machine.loops.kept, self.machine.loops
        held = np.array(loops.bars)[self.leg] >= 0
        joints = np.where(held[:, None], 0.0 if kept is None else kept[self.leg], loops.joints[self.leg])
        return bar_loops(loops, joints + self.shift + errors.platform, self._rods(errors), errors, self.leg)

    def loops(self, errors: RodErrors) -> Loops:
        """Every rod as a leg of its own, with its errors: joints (N, K) of the machine drive them as q[:, leg]."""
        rods, nominal = self._rods(errors), self.machine.loops
        return replace(nominal, drives=rods, joints=self._joints + errors.platform, freedoms=self.freedoms,
                       rings=rings_with(nominal, errors, self.leg), holds=held_with(nominal, errors, rods, self.leg))

    def _rods(self, errors: RodErrors) -> Drives:
        drives, leg, spun = self.machine.legs, self.leg, turns(errors.guide)
        guide = spun[leg]
        along = np.einsum("rij,rj->ri", guide, drives.directions[leg])
        feet = drives.points[leg] + self.offset[leg] + errors.rail[leg] + np.einsum(
            "rij,rj->ri", guide, self.shift - self.offset[leg])
        own = np.einsum("rij,rj->ri", self.guide[leg], errors.carriage)
        more, slide, arm = errors.drive[leg], drives.slide[leg], drives.arm[leg]
        reach = np.where(arm[:, None], np.einsum("rij,rj->ri", guide, drives.arms[leg]) + own, 0.0)
        aside = dot(reach, along)[:, None] * along  # does not turn
        feet = feet + np.where(arm[:, None], aside, own) + (slide * more)[:, None] * along
        reach = np.where(arm[:, None], (turned(more[:, None] * along) @ (reach - aside)[:, :, None])[:, :, 0], 0.0)
        length = drives.lengths[leg] + errors.length + drives.stretch[leg] * more
        return replace(drives, points=feet, directions=along, lengths=length, roots=drives.roots[leg], arms=reach,
                       slide=slide, arm=arm)

    @property
    def _joints(self) -> Floats:
        return np.asarray(self.machine.loops.joints[self.leg] + self.shift)

    @cached_property
    def freedoms(self) -> tuple[str, ...]:
        """Of the platform on its rods alone, where they hold it: all, in the plane x y c; else those of the machine."""
        if self.on_bars:
            return FREEDOMS
        own = self.machine.loops.freedoms
        free = ("x", "y", "c") if "z" not in own else FREEDOMS
        place, turn, q = (part[None] for part in self.machine.home)
        drives, leg = self.machine.legs, self.leg
        rods = replace(drives, points=drives.points[leg] + self.shift, directions=drives.directions[leg],
                       lengths=drives.lengths[leg], roots=drives.roots[leg], arms=drives.arms[leg],
                       slide=drives.slide[leg], arm=drives.arm[leg])
        loops = replace(self.machine.loops, drives=rods, joints=self._joints, freedoms=free,
                        rings=None if self.machine.loops.rings is None else self.machine.loops.rings[leg])
        rows = loops.matrix_at(place, turn, q[:, leg])[0][0] / loops.sizes(q[:, leg])[0][:, None]
        held = len(rows) >= len(free) and np.linalg.svd(rows, compute_uv=False)[-1] > HELD
        return free if held else own

    @property
    def square(self) -> bool:
        """True where rods, and what holds the platform besides, are as many as its freedoms."""
        if self.on_bars:
            return True
        holds = self.machine.loops.holds
        return len(self.leg) + (0 if holds is None else holds.count) == len(self.freedoms)

    def solve(self, q: Floats, place: Floats, turn: Floats, errors: RodErrors) -> tuple[Floats, Floats]:
        """The platform (X (N, 3), R (N, 3, 3)) on its rods with their errors, exactly, at joints q (N, K) of the legs.

        From the nominal platform `place` (N, 3), `turn` (N, 3, 3); NaN where the rods do not close.
        """
        if self.on_bars:
            return self.bars(errors).solve(q[:, self.leg], place, turn)[:2]
        loops, place, turn = self.loops(errors), place.copy(), np.array(turn)
        for part in blocks(len(q)):
            rods = q[part][:, self.leg]
            if not self.square:
                place[part], turn[part] = shared(loops, rods, place[part], turn[part])
                continue
            x, r, closed = loops.newton(rods, place[part], turn[part])
            place[part], turn[part] = (np.where(closed[:, None], x, np.nan), np.where(closed[:, None, None], r, np.nan))
        return place, turn

    def platform_sensitivity(self, q: Floats, place: Floats, turn: Floats) -> Floats:
        """d(X, turn)/dE (N, 6, P): T^-1 S of E-15, in the order of `RodErrors.names`; of least squares T^+ S."""
        if self.on_bars:
            return self._sensitivity_of_bars(q, place, turn)
        loops = self.loops(self.zero)
        rows, rods = loops.matrix_at(place, turn, q[:, self.leg])
        span = loops.sizes(q[:, self.leg])
        s = self._columns(loops.drives, q, rods, np.repeat(turn[:, None], len(self.leg), axis=1))
        if loops.holds is not None:
            s = np.concatenate([s, loops.weight * self._of_holds(loops.holds, q, rods, turn)], axis=1)
        own = q[:, self.leg]
        s = np.concatenate([s, self._of_bearings(lambda errors: _gaps(self.loops(errors), place, turn, own))], axis=2)
        rows, s = rows / span[:, :, None], s / span[:, :, None]
        if rows.shape[1] == rows.shape[2]:
            return loops.twists(inverted(rows) @ s)
        across = np.swapaxes(rows, 1, 2)
        return loops.twists(inverted(across @ rows) @ (across @ s))

    def _sensitivity_of_bars(self, q: Floats, place: Floats, turn: Floats) -> Floats:
        loops, own = self.bars(self.zero), q[:, self.leg]
        swing = loops.swing_at(turn)
        rows, rods = loops.matrix_at(place, turn, swing, own)
        s = self._columns(loops.drives, q, rods, loops.arms(turn, swing)[2])
        more = self._of_bearings(lambda errors: self.bars(errors).gaps(place, turn, swing, own))
        shift, twist, _ = loops.rates(rows, np.concatenate([s, more], axis=2))
        return np.concatenate([shift, twist], axis=1)

    def _of_bearings(self, gaps: Callable[[RodErrors], Floats]) -> Floats:
        """(N, R, B) what loops close by per error of each bearing: minus central differences of their gaps."""
        zero, found = self.zero, list[Floats]()
        first = len(zero.values) - len(zero.bearings)
        for k in range(len(zero.bearings)):
            one = SMALL * np.eye(len(zero.values))[first + k]
            found.append((gaps(zero.with_values(-one)) - gaps(zero.with_values(one))) / (2.0 * SMALL))
        return np.stack(found, axis=2) if found else np.zeros((*gaps(zero).shape, 0))

    def _of_holds(self, holds: Holds, q: Floats, rods: Floats, turn: Floats) -> Floats:
        """(N, H, P) mm of what holds the platform per error of the rods: joint and foot of a leg in the plane of its hinge,
        which turns with the guide."""
        count = len(self.zero.values) - len(self.zero.bearings)
        result = np.zeros((len(q), holds.count, count))
        drives = self._rods(self.zero)
        for row, k in enumerate(self.machine.loops.hinged, len(self.machine.loops.passive)):
            rod, normal = int(np.argmax(self.leg == k)), holds.normals[row]
            along = np.broadcast_to(normal, (len(q), len(self.leg), 3))
            body = np.repeat(turn[:, None], len(self.leg), axis=1)
            result[:, row] = self._columns(drives, q, along, body, 0.0)[:, rod]
            first = 3 * (len(self.letters) + k)
            result[:, row, first:first + 3] += np.cross(rods[:, rod], normal)
        return result

    def _columns(self, drives: Drives, q: Floats, rods: Floats, body: Floats, stretched: float = 1.0) -> Floats:
        """S (N, R, P): r . dA - r . R dB + l dl for every parameter, R (N, R, 3, 3) the turn of what each rod ends on."""
        n, (k, r) = len(q), (len(self.letters), len(self.leg))
        rail, guide, own, ends = (np.zeros((n, r, count, 3)) for count in (k, k, r, r))
        length, more = np.zeros((n, r, r)), np.zeros((n, r, k))
        own_q = q[:, self.leg]
        arm, at = drives.feet(own_q) - (self.machine.legs.points + self.offset)[self.leg], drives.moved(own_q)
        for j, leg in enumerate(self.leg):
            rail[:, j, leg] = rods[:, j]
            guide[:, j, leg] = np.cross(arm[:, j], rods[:, j])
            frame = np.broadcast_to(self.guide[leg], (n, 3, 3))
            if drives.arm[j]:
                frame = turned(own_q[:, j, None] * drives.directions[j]) @ frame
            own[:, j, j] = np.einsum("ni,nij->nj", rods[:, j], frame)
            ends[:, j, j] = -np.einsum("ni,nij->nj", rods[:, j], body[:, j])
            length[:, j, j] = stretched * drives.spans(own_q)[:, j]
            more[:, j, leg] = dot(rods[:, j], at[:, j]) + drives.stretch[j] * length[:, j, j]
        return np.concatenate([part.reshape(n, r, -1) for part in (rail, guide, own, ends, length, more)], axis=2)


def _gaps(loops: Loops, place: Floats, turn: Floats, q: Floats) -> Floats:
    """(N, R + H) mm2: what rods and holds miss, those by their weight."""
    rods = loops.ends(place, turn) - loops.drives.feet(q)
    gap = 0.5 * (dot(rods, rods) - loops.drives.spans(q) ** 2)
    return gap if loops.holds is None else np.hstack([gap, loops.weight * loops.held_gaps(place, turn, q)])


def shared(loops: Loops, q: Floats, place: Floats, turn: Floats) -> tuple[Floats, Floats]:
    """The platform that more rods than it has freedoms hold with the least squares of their stretches; NaN without one."""
    last = np.full(len(q), np.inf)
    for _ in range(STEPS):
        rows, rods = loops.matrix_at(place, turn, q)
        span, sizes = loops.drives.spans(q), loops.sizes(q)
        rows = rows / sizes[:, :, None]
        across = np.swapaxes(rows, 1, 2)
        stretch = 0.5 * (dot(rods, rods) / span - span)
        if loops.holds is not None:
            stretch = np.hstack([stretch, loops.held_gaps(place, turn, q)])
        step = loops.twists(-(inverted(across @ rows) @ (across @ stretch[:, :, None]))[:, :, 0])
        place, turn = place + step[:, :3], turned(step[:, 3:]) @ turn
        last = np.maximum(lengths(step[:, :3]), loops.lever * lengths(step[:, 3:]))
        if not (last > STILL).any():
            break
    bad = ~(last <= 100.0 * STILL)
    return np.where(bad[:, None], np.nan, place), np.where(bad[:, None, None], np.nan, turn)


def leg_frame(machine: OnLegs) -> LegFrame:
    """The rods of a machine; a leg without `rods` has one, on its line, and so have legs of a platform with bars whose rods
    are not as many as its motions and hinges: then a bar keeps its direction whatever the errors."""
    drives, sizes, k = machine.legs, machine.clearance, len(machine.leg_names)
    offset = np.zeros((k, 3)) if sizes is None or sizes.rail_offset is None else sizes.rail_offset
    bars = len(machine.loops.bar_names)
    single = sizes is None or (bars > 0 and len(sizes.leg) != RODS + bars)
    leg, shift = (np.arange(k), np.zeros((k, 3))) if sizes is None or single else (sizes.leg, sizes.shift)
    frames = [guide_frame(u, a) if arm else guide_frame(u, -o, machine.workspace.middle - p - o) if slide else np.eye(3)
              for u, a, o, p, arm, slide in zip(drives.directions, drives.arms, offset, drives.points, drives.arm,
                                                drives.slide, strict=True)]
    return LegFrame(machine, leg, shift, offset, np.stack(frames))


class _Frames:
    """`ErrorForms` that ask for the legs alone."""

    def chain(self, kinematics: Kinematics) -> LegFrame | None:
        """None."""
        return None

    translating_rods = chain

    def tilting_rods(self, kinematics: LegsWithAxis) -> LegFrame | None:
        """The rods, unless all are on slides, which has a form of its own."""
        return leg_frame(kinematics.on_legs) if kinematics.on_rods is None else None

    def legs(self, kinematics: OnLegs) -> LegFrame | None:
        """The rods."""
        return leg_frame(kinematics)

    def in_series(self, kinematics: LegsInSeries) -> LegFrame | None:
        """The rods."""
        return leg_frame(kinematics.on_legs)


def frame_of(kinematics: Kinematics) -> LegFrame | None:
    """The rods of a machine that takes its errors as `legs` of `ErrorForms`; None of any other."""
    try:
        return kinematics.with_errors(_Frames())
    except ValueError:  # a kind without errors
        return None
