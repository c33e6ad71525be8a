"""The curve between two points: straight lines with great circles of the axis, arcs and helices."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints, taken, within
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, cross, lengths, slerp, whole_turns
from toolpaths.shapes import arrays

_EPS = 1e-12


def turn_about(vector: Floats, normal: Floats, angle: Floats) -> Floats:
    """`vector` (N, 3) turned by `angle` (N,) rad about unit `normal` (N, 3) (Rodrigues)."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    along = np.einsum("ni,ni->n", vector, normal)[:, None] * normal
    result: Floats = along + c * (vector - along) + s * cross(normal, vector)
    return result


@dataclass(frozen=True)
@arrays(start="N 3", end="N 3", axis0="N 3", axis1="N 3", is_arc="N", center="N 3", normal="N 3", sweep="N")
class Curves:
    """N reference motions (DESIGN: straight tip or arc, axis on the great circle), each over u in [0, 1].

    Attributes:
        start, end (N, 3): tips, mm
        axis0, axis1 (N, 3): unit tool axes at both ends
        is_arc (N,): True where the tip follows an arc; center, normal (N, 3), sweep (N,) then count as in Arcs
    """

    start: Floats
    end: Floats
    axis0: Floats
    axis1: Floats
    is_arc: Bools
    center: Floats
    normal: Floats
    sweep: Floats

    def __len__(self) -> int:
        return len(self.start)

    def take(self, index: Ints | Bools | slice) -> Curves:
        """The curves with these indices, in this order; a slice copies nothing."""
        return Curves(*(taken(getattr(self, name), index) for name in self.__dataclass_fields__))

    @cached_property
    def _arcs(self) -> Ints:
        """Numbers of the curves that are arcs."""
        return np.flatnonzero(self.is_arc)

    def at(self, u: Floats) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) at u (N,). The ends are the given ends to the last bit."""
        return self.tip_at(u), self.axis_at(u)

    def tip_at(self, u: Floats) -> Floats:
        """tip (N, 3) at u (N,)."""
        tip = self.start + u[:, None] * (self.end - self.start)
        arc = self._arcs
        if len(arc):
            tip[arc] = self._arc_tip(arc, u[arc])
        return np.where((u == 1.0)[:, None], self.end, tip)

    def axis_at(self, u: Floats) -> Floats:
        """axis (N, 3) at u (N,)."""
        turning = (self.axis0 != self.axis1).any(axis=1)
        axis = self.axis0.copy()
        where = np.flatnonzero(turning)
        if len(where):
            axis[where] = slerp(self.axis0[where], self.axis1[where], u[where])
        return np.where((u == 1.0)[:, None], self.axis1, axis)

    def _arc_tip(self, arc: Ints, u: Floats) -> Floats:
        """Helix through both ends: radius and height run linearly with the angle (ends may differ by rounding)."""
        normal, center = self.normal[arc], self.center[arc]
        first = self.start[arc] - center
        last = turn_about(self.end[arc] - center, normal, -self.sweep[arc])
        blend = first + u[:, None] * (last - first)
        result: Floats = center + turn_about(blend, normal, u * self.sweep[arc])
        return result

    def length(self) -> Floats:
        """Path length (N,) of the tip, mm; helices by their true length."""
        chord: Floats = lengths(self.end - self.start)
        arc = self._arcs
        if len(arc):
            normal, radial = self.normal[arc], self.start[arc] - self.center[arc]
            radial = radial - np.einsum("ni,ni->n", radial, normal)[:, None] * normal
            rise = np.einsum("ni,ni->n", self.end[arc] - self.start[arc], normal)
            chord[arc] = np.hypot(lengths(radial) * self.sweep[arc], rise)
        return chord

    def project(self, tip: Floats, guess: Floats) -> Floats:
        """u (N,) in [0, 1] of the point of each curve nearest to `tip` (N, 3).

        On arcs the turn nearest `guess` (N,) counts; where a curve has no extent the guess itself is returned.
        """
        span = self.end - self.start
        size = np.einsum("ni,ni->n", span, span)
        along = np.einsum("ni,ni->n", tip - self.start, span)
        u = np.where(size > _EPS, along / np.where(size > _EPS, size, 1.0), guess)
        arc = self._arcs
        if len(arc):
            u[arc] = self._arc_project(arc, tip[arc], guess[arc])
        result: Floats = within(u, 0.0, 1.0)
        return result

    def turned(self, axis: Floats, guess: Floats) -> Floats:
        """u (N,) in [0, 1] where axes (N, 3) stand on their great circles; `guess` (N,) where the axis does not turn."""
        turn = angle_between(self.axis0, self.axis1)
        turns = turn > 1e-6
        across = cross(cross(self.axis0, self.axis1), self.axis0) / np.sin(np.where(turns, turn, 1.0))[:, None]
        angle = np.arctan2((axis * across).sum(axis=1), (axis * self.axis0).sum(axis=1))
        result: Floats = np.where(turns, within(angle / np.where(turns, turn, 1.0), 0.0, 1.0), guess)
        return result

    def _arc_project(self, arc: Ints, tip: Floats, guess: Floats) -> Floats:
        normal, center, sweep = self.normal[arc], self.center[arc], self.sweep[arc]
        radial = self.start[arc] - center
        radial = radial - np.einsum("ni,ni->n", radial, normal)[:, None] * normal
        across = cross(normal, radial)
        offset = tip - center
        angle = np.arctan2(np.einsum("ni,ni->n", offset, across), np.einsum("ni,ni->n", offset, radial))
        angle = angle + whole_turns(guess * sweep - angle)
        result: Floats = angle / sweep
        return result

    def deviation(self, tip: Floats, axis: Floats, guess: Floats,
                  within: float = 0.0) -> tuple[Floats, Floats, Floats]:
        """How far poses are off their curves: (tip (N,) mm, axis (N,) rad, u (N,)).

        The tip is measured to the nearest point of the curve. The axis is measured against the great circle
        at the place where it fits best among those whose tip is within `within` mm: a pose is inside the
        tolerances where one pose of the curve has both near. With 0 that is the nearest point.
        """
        u = self.project(tip, guess)
        off = lengths(tip - self.tip_at(u))
        reach = np.sqrt(np.maximum(within**2 - off**2, 0.0)) / np.maximum(self.length(), 1e-12)
        on_axis = self.axis_at(np.clip(np.clip(self.turned(axis, u), u - reach, u + reach), 0.0, 1.0))
        return off, angle_between(axis, on_axis), u
