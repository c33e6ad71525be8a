"""The closed loops of a platform with hinged bars (nacelles): as many rods as the platform has motions and bars have hinges.

The platform has its six motions (C, R), each bar turns by an angle t about its hinge, a line a of the platform through h:

    B = C + R (h + Q Rot(a, t) j),     |B - A(q)| = l(q)

j: joint of the rod on its bar, from the hinge, as it points while the bar keeps its direction; Q: turn of the hinge's line
by its errors. A rod that ends on the platform itself has B = C + R j. With s = R Q a, p from the hinge to B, u = t' + w.s
the turn of a bar about its hinge in the machine frame (0 while it keeps its direction), a bar turns by w - (w.s) s + u s:
rows (r, (B - C) x r - s (s.(p x r)), s.(p x r)). Two pairs to each of two bars are the eight rods of a symmetric H4
(Company 2000, V.5, V-10).

How fast the errors of such a platform change as its drives move is bounded as in `rod_rates.py`, with one more motion for
each bar: the end of a rod moves by v + w x R h + o x p, o = w - (w.s) s + u s the turn of its bar. s turns as the platform
does across it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.apart_rates import BarEnds
from machines.geometric_error.actual.rod_rates import HeldLoops, PlatformMotion
from machines.geometric_error.actual.rods import RodErrors, inverted
from machines.geometric_error.actual.transforms import turns
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops, turned
from machines.kinematics.sliders import solved
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths
from toolpaths.shapes import arrays

STEPS, CLOSED = 20, 1e-13


@dataclass(frozen=True, eq=False)
@arrays(joints="R 3", bar="R", hinges="M 3", frames="M 3 3", about="3")
class BarLoops:
    """R rods, M bars, R = 6 + M.

    Attributes:
        joints: (R, 3) mm, j
        bar: (R,) bar that each rod holds, -1 of none
        hinges, frames: (M, 3) mm, h; (M, 3, 3) Q
        about: (3,) unit vector, a
        lever: mm per rad
    """

    drives: Drives
    joints: Floats
    bar: Ints
    hinges: Floats
    frames: Floats
    about: Floats
    lever: float

    @property
    def on(self) -> Floats:
        """(R, M) 1 where a rod holds a bar."""
        return np.asarray(np.equal.outer(self.bar, np.arange(len(self.hinges))), dtype=np.float64)

    def arms(self, turn: Floats, swing: Floats) -> tuple[Floats, Floats, Floats]:
        """(B - C (N, R, 3), its motion per rad of the rod's bar (N, R, 3) mm, turn of what the rod ends on (N, R, 3, 3))."""
        bodies = [turn] + [turn @ frame @ turned(swing[:, [m]] * self.about) for m, frame in enumerate(self.frames)]
        body = np.stack(bodies, axis=1)[:, self.bar + 1]
        own = (body @ self.joints[:, :, None])[..., 0]
        at: Floats = np.vstack([np.zeros(3), self.hinges])[self.bar + 1]
        return np.asarray(own + at @ np.swapaxes(turn, 1, 2)), cross(self.lines(turn), own), np.asarray(body)

    @property
    def in_platform(self) -> Floats:
        """(R, 3) the same in directions of the platform."""
        return np.asarray(self.lines(np.eye(3)[None])[0])

    def lines(self, turn: Floats) -> Floats:
        """(N, R, 3) s, unit vectors along the hinges of the bars that rods hold; 0 of others."""
        lines = np.stack([np.zeros((len(turn), 3)), *(turn @ (frame @ self.about) for frame in self.frames)], axis=1)
        return np.asarray(lines[:, self.bar + 1])

    def matrix_at(self, place: Floats, turn: Floats, swing: Floats, q: Floats) -> tuple[Floats, Floats]:
        """(W (N, R, 6 + M), rods (N, R, 3)) mm, turns and swings by the lever; q (N, R) of the rods."""
        arms, swung, _ = self.arms(turn, swing)
        rods = place[:, None] + arms - self.drives.feet(q)
        own = dot(swung, rods)[:, :, None]
        around = (cross(arms, rods) - own * self.lines(turn)) / self.lever
        return np.concatenate([rods, around, own / self.lever * self.on], axis=2), rods

    def gaps(self, place: Floats, turn: Floats, swing: Floats, q: Floats) -> Floats:
        """(N, R) mm2: half of what the squares of the rods' lengths miss."""
        rods = place[:, None] + self.arms(turn, swing)[0] - self.drives.feet(q)
        return np.asarray(0.5 * (dot(rods, rods) - self.drives.spans(q) ** 2))

    def swing_at(self, turn: Floats) -> Floats:
        """(N, M) rad at which bars keep their direction as the platform turns (N, 3, 3) about `about` alone."""
        k = int(np.abs(self.about).argmax())
        i, j = (k + 1) % 3, (k + 2) % 3
        angle = np.arctan2(turn[:, j, i], turn[:, i, i]) * np.sign(self.about[k])
        return np.repeat(-angle[:, None], len(self.hinges), axis=1)

    def solve(self, q: Floats, place: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """(C (N, 3), R (N, 3, 3), swings (N, M)) by Newton from a nominal platform; NaN where it does not close."""
        place, turn, swing = place.copy(), np.array(turn), self.swing_at(turn)
        closed = np.zeros(len(q), dtype=np.bool_)
        live = np.flatnonzero(np.isfinite(np.hstack([q, place, turn.reshape(-1, 9)])).all(axis=1))
        for _ in range(STEPS):
            if not len(live):
                break
            own = q[live]
            rows, rods = self.matrix_at(place[live], turn[live], swing[live], own)
            square = self.drives.spans(own) ** 2
            gap = 0.5 * (dot(rods, rods) - square)
            step = solved(rows, -gap)
            place[live] += step[:, :3]
            about = np.stack([turn[live] @ (frame @ self.about) for frame in self.frames], axis=1)
            swing[live] += (step[:, 6:] - (about @ step[:, 3:6, None])[:, :, 0]) / self.lever
            turn[live] = turned(step[:, 3:6] / self.lever) @ turn[live]
            done = (np.abs(gap) < CLOSED * square).all(axis=1)
            closed[live[done]] = True
            live = live[~done & np.isfinite(step).all(axis=1)]
        bad = ~(closed & np.isfinite(place).all(axis=1))
        return (np.where(bad[:, None], np.nan, place), np.where(bad[:, None, None], np.nan, turn),
                np.where(bad[:, None], np.nan, swing))

    def rates(self, rows: Floats, right: Floats) -> tuple[Floats, Floats, Floats]:
        """(v (N, 3, P), w (N, 3, P), u (N, M, P)) of right sides (N, R, P) mm2."""
        x = inverted(rows) @ right
        return x[:, :3], x[:, 3:6] / self.lever, x[:, 6:] / self.lever


def bar_loops(loops: Loops, joints: Floats, rods: Drives, errors: RodErrors, leg: Ints) -> BarLoops:
    """The loops of a machine with bars; `rods` with their errors, `joints` (R, 3) where they end, `leg` (R,) of each."""
    about = loops.basis[3:].sum(axis=1)
    bar = np.array(loops.bars)[leg]
    hinges = np.array([loops.joints[loops.bars.index(m)] for m in range(len(loops.bar_names))])
    more = np.array([errors.bearing(f"bars.{name}.hinge") for name in loops.bar_names])
    frames = turns(np.array([errors.bearing(f"bars.{name}.hinge_turn") for name in loops.bar_names]))
    lever = max(float(lengths(loops.joints).max()), float(lengths(joints).max()), 1.0)
    return BarLoops(rods, joints, bar, hinges + more, frames, about, lever)


@dataclass(frozen=True, eq=False, kw_only=True)
@arrays(on="R", far="R", own="R", bars="N R K", aside="N R K", about="N R K")
class BarsHeld(HeldLoops):
    """`HeldLoops` with bars.

    Attributes:
        on: (R,) 1 of rods that hold a bar
        far, own: (R,) mm, |h| and |p|; of rods on the platform itself |j| and 0
        bars: (N, R, K) rad, |o| per mm or rad of each drive
        aside: (N, R, K) rad, |w x s|
        about: (N, R, K) rad, by which o changes per rad that s turns
    """

    on: Floats
    far: Floats
    own: Floats
    bars: Floats
    aside: Floats
    about: Floats

    def lines(self, assumed: Floats) -> Floats:
        """(N, R) rad by which s turns at most."""
        go, more = self.reach[:, None], (assumed / self.lever)[:, None]
        first = ((self.aside + more) * go).sum(axis=2)
        turn = ((self.turn[:, None] + more) * go).sum(axis=2)
        return np.asarray(np.where(turn < 0.5, first / (1.0 - 2.0 * np.minimum(turn, 0.499)), np.nan) * self.on)

    def turns(self, assumed: Floats) -> Floats:
        """(N, R, K) |o| at most."""
        more, line = (2.0 * assumed / self.lever)[:, None], self.lines(assumed)[:, :, None]
        return np.asarray((self.bars + more + (self.about + 2.0 * more) * line) * self.on[:, None])

    def rows_change(self, assumed: Floats) -> tuple[Floats, Floats, Floats]:
        """See the base class."""
        swing = ((self.turn + assumed / self.lever) * self.reach).sum(axis=1)
        line, turns = self.lines(assumed), self.turns(assumed)
        arm, end = self.far * swing[:, None], self.own * (turns * self.reach[:, None]).sum(axis=2)
        other = self.about * line[:, :, None] * self.own[:, None]
        spins = self.turn[:, None] * arm[:, :, None] + self.bars * end[:, :, None] + other
        size = 1.0 + (self.far + 2.0 * self.own) / self.lever
        rod = ((self.rates + spins) * self.reach[:, None]).sum(axis=2) + (assumed * self.reach).sum(axis=1)[:, None] * size
        rod = rod + self.bend
        turned = (self.far + self.own) * rod + (arm + end + 2.0 * line * self.own) * self.length
        swung = self.own * rod + (line * self.own + end) * self.length
        wrong = rod[:, :, None] * self.rates + self.gain + self.length[:, :, None] * spins
        return np.sqrt(rod**2 + (turned / self.lever) ** 2 + (swung / self.lever) ** 2), wrong, swing

    def end_rates(self, change: Floats) -> Floats:
        """(N, R, K) mm by which the ends of rods may move faster."""
        swing = ((self.turn + change / self.lever) * self.reach).sum(axis=1)
        end = self.own * (self.turns(change) * self.reach[:, None]).sum(axis=2)
        spins = self.turn[:, None] * (self.far * swing[:, None])[:, :, None] + self.bars * end[:, :, None]
        spins = spins + self.about * (self.lines(change) * self.own)[:, :, None]
        return np.asarray(spins + (1.0 + (self.far + 2.0 * self.own) / self.lever)[:, None] * change[:, None])


def bars_motion(loops: BarLoops, leg: Ints, q: Floats, pose: tuple[Floats, Floats, Floats], reach: Floats) -> PlatformMotion:
    """The motion of platforms at `pose` (C (N, 3), R (N, 3, 3), swings (N, M)) by drives q (N, K) that go up to `reach`."""
    (place, turned, swing), own, most = pose, leg[:, None] == np.arange(q.shape[1]), reach[:, leg]
    drives, rod_q = loops.drives, q[:, leg]
    rows, rods = loops.matrix_at(place, turned, swing, rod_q)
    arms, _, bodies = loops.arms(turned, swing)
    shift, turn, about = loops.rates(rows, drives.gains(rods, rod_q)[:, :, None] * own)
    lines, on = loops.lines(turned)[:, :, :, None], (loops.bar >= 0).astype(np.float64)
    along = (lines * turn[:, None]).sum(axis=2, keepdims=True)
    mine = np.concatenate([0.0 * about[:, :1], about], axis=1)[:, loops.bar + 1, None]
    bars = (turn[:, None] - along * lines + mine * lines) * on[:, None, None]
    ends = (bodies @ loops.joints[:, :, None]) * on[:, None, None]
    rates = shift[:, None] + np.cross(turn[:, None], arms[:, :, :, None] - ends, axis=2) + np.cross(bars, ends, axis=2)
    rates = rates - drives.moved(rod_q)[:, :, :, None] * own[:, None]
    length, bend = drives.spans(rod_q) + drives.stretch * most, np.where(drives.arm, drives.size, 0.0) * most
    joint, hinge = (np.linalg.norm(v, axis=1) for v in (loops.joints, np.vstack([np.zeros(3), loops.hinges])[loops.bar + 1]))
    sizes = np.linalg.norm(turn, axis=1)
    held = BarsHeld(np.linalg.svd(np.nan_to_num(rows), compute_uv=False)[:, -1], np.linalg.norm(rates, axis=2), sizes,
                    hinge + joint, length, loops.lever, reach, bend * most,
                    (length * bend + drives.stretch * most)[:, :, None] * own, on=on, far=np.where(on > 0.0, hinge, joint),
                    own=joint * on, bars=np.linalg.norm(bars, axis=2),
                    aside=np.linalg.norm(np.cross(turn[:, None], lines, axis=2), axis=2),
                    about=(2.0 * sizes[:, None] + np.abs(mine[:, :, 0])) * on[:, None])
    change, angle = held.held()
    moves = np.stack([np.where(drives.slide[:, None], drives.directions, np.cross(drives.directions, drives.arms)),
                      drives.arms], axis=1) * (1.0 - drives.stretch)[:, None, None]
    closure = held.closure((place, turned, np.concatenate([shift, turn], axis=1)), (rods, arms), (moves, own), change,
                           drives.stretch)
    with np.errstate(over="ignore", invalid="ignore"):
        more = held.about + 3.0 * (change / loops.lever)[:, None] * on[:, None]
        given = BarEnds(on, held.own, np.vstack([np.zeros(3), loops.hinges])[loops.bar + 1], loops.joints, bodies,
                        loops.in_platform, held.turns(change), more)
        closure = replace(closure, bars=given, size=held.far,
                          rates=held.rates + held.end_rates(change) + (bend[:, :, None] * own))
    return PlatformMotion(place, turned, shift, turn, change, change / loops.lever, angle, closure=closure)
