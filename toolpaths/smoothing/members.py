"""The segments of a smoothed path before they are joined: single lines and arcs, and splines, each beyond its ends too."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.smoothing.bspline import KnotVectors
from toolpaths.smoothing.fit import SplineFit
from toolpaths.smoothing.sweep import WIDTH, Data, evaluate

CHUNK = 65536


@dataclass(frozen=True)
@arrays(ends="E", first="G+1", spline="G")
class Members:
    """G segments over a chain of M moves.

    Attributes:
        curves: the moves
        ends (M + 1,): parameter at their ends
        first (G + 1,): first move of each segment
        spline (G,): True for splines, in the order of the stretches of `fit`
        scale: mm per rad of the axis
    """

    curves: Curves
    ends: Floats
    first: Ints
    spline: Bools
    scale: float
    fit: SplineFit | None

    @cached_property
    def s(self) -> Floats:
        """(G + 1,) parameter at the ends of the segments."""
        return self.ends[self.first]

    @cached_property
    def stretch(self) -> Ints:
        """(G,) number of the spline; of no meaning for others."""
        return np.cumsum(self.spline) - 1

    @property
    def knots(self) -> KnotVectors | None:
        """of the splines"""
        return None if self.fit is None else self.fit.knots

    def at(self, segment: Ints, s: Floats) -> Floats:
        """(N, 6) tip and scaled axis of these segments (N,) at s (N,), inside or beyond their ends."""
        result = np.empty((len(s), WIDTH))
        for k in range(0, len(s), CHUNK):
            part = slice(k, k + CHUNK)
            splines = self.spline[segment[part]]
            where = np.flatnonzero(splines) + k
            if len(where):
                result[where] = self._on_splines(self.stretch[segment[where]], s[where])
            where = np.flatnonzero(~splines) + k
            if len(where):
                result[where] = self._on_curves(self.first[segment[where]], s[where])
        return result

    def _on_splines(self, stretch: Ints, s: Floats) -> Floats:
        assert self.fit is not None
        knots = self.fit.knots
        k = knots.span(s, stretch)
        return evaluate(knots.t, self.fit.c, Data(s, np.zeros((0, WIDTH)), k, knots.coefficient[k]))

    def _on_curves(self, move: Ints, s: Floats) -> Floats:
        u = (s - self.ends[move]) / (self.ends[move + 1] - self.ends[move])
        tip, axis = self.curves.take(move).at(u)
        return np.hstack((tip, self.scale * axis))

    def breaks(self) -> Floats:
        """Ends of segments and knots of splines, rising, ends of the chain included."""
        return np.unique(self.s if self.fit is None else np.concatenate((self.s, self.fit.knots.t)))

    def reach(self) -> Floats:
        """(G,) how far a segment may be followed beyond its end: splines by their last span, arcs by half a radian."""
        size = np.diff(self.s)
        move = self.first[:-1]
        arc = self.curves.is_arc[move]
        far = np.where(arc, 0.5 * size / np.where(arc, self.curves.sweep[move], 1.0), size)
        if self.fit is not None:
            t, begin = self.fit.knots.simple()
            far[self.spline] = t[begin[1:] - 1] - t[begin[1:] - 2]
        return np.asarray(far)
