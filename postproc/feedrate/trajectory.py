"""The planned motion in time, and what it uses of the limits, measured from its own samples."""

from __future__ import annotations

from dataclasses import field
from typing import NamedTuple, get_args

import numpy as np

from machines.choices import MotionOrder
from postproc.feedrate.limits import JointLimits
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

REST_PAD = 3
"""Samples at rest before and behind, so that differences see the start and the end."""
BINDS = 0.98
"""Ratio to a limit from which it is said to bind."""
ORDERS: tuple[MotionOrder, ...] = get_args(MotionOrder)


@dataclass(frozen=True)
@arrays(velocity="J", acceleration="J", jerk="J", tool="3")
class Usage:
    """Largest ratios to the limits, per joint (J,), of the feed, and of the tool's (3,): tilt rate, acceleration, jerk.

    Each is the larger of two measures: the derivatives at the samples, and the differences of the positions, padded
    with rest.
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    feed: float
    tool: Floats = field(default_factory=lambda: np.zeros(3))

    @property
    def worst(self) -> float:
        """The largest of all."""
        return float(max(self.velocity.max(), self.acceleration.max(), self.jerk.max(), self.feed, self.tool.max()))

    def worse(self, other: Usage) -> Usage:
        """The larger of each two ratios."""
        larger = (np.maximum(getattr(self, name), getattr(other, name)) for name in (*ORDERS, "feed", "tool"))
        velocity, acceleration, jerk, feed, tool = larger
        return Usage(velocity, acceleration, jerk, float(feed), tool)


class Binding(NamedTuple):
    """Per sample (N,): joint (-1 the feed, J the tool), order (1 velocity, 2 acceleration, 3 jerk, 0 where
    nothing binds), ratio; of the tool, velocity is the rate of its axis."""

    axis: Ints
    order: Ints
    ratio: Floats


@dataclass(frozen=True)
@arrays(t="N", s="N", q="N J", qd="N J", qdd="N J", qddd="N J", sd="N", feed="N", tool="N T")
class JointTrajectory:
    """Samples at equal times (by `Plan.at` at given places), by default from rest to rest.

    Attributes:
        t: (N,) s; the last is the first multiple of the step at which all stands still
        s: (N,) path parameter
        q, qd, qdd, qddd: (N, J) joints and time derivatives, from the path's exact derivatives
        sd: (N,) ds/dt
        feed: (N,) largest ds/dt that the program allows, inf where none
        tool: (N, T) what is limited at the tool (`rows.at_tool`); zeros or None where nothing limits it
    """

    t: Floats
    s: Floats
    q: Floats
    qd: Floats
    qdd: Floats
    qddd: Floats
    sd: Floats
    feed: Floats
    tool: Floats | None = None

    @property
    def step(self) -> float:
        """Time between samples; infinite for a single one."""
        return float(self.t[1] - self.t[0]) if len(self.t) > 1 else np.inf

    def usage(self, limits: JointLimits, own: slice = slice(None)) -> Usage:
        """Worst ratios over the samples `own`, joints of `limits` in the order of q.

        Samples outside `own` serve the differences alone: they are neighbours of a part of a motion.
        """
        first, last, _ = own.indices(len(self.t))
        found = []
        measures = zip(self._derived(limits), self._differences(limits), strict=True)
        for order, (derived, differences) in enumerate(measures, start=1):
            seen = differences[first + REST_PAD - order:last + REST_PAD]
            found.append(np.maximum(derived[own].max(axis=0), seen.max(axis=0)))
        velocity, acceleration, jerk = found
        return Usage(velocity, acceleration, jerk, float(np.max(self.sd[own] / self.feed[own])),
                     self._tool(limits)[own].max(axis=0))

    def worst_slowdown(self, limits: JointLimits) -> Floats:
        """Factor on time per sample (N,) that would bring the ratios seen there to 1."""
        velocity, acceleration, jerk = (np.maximum(a.max(axis=1), b) for a, b in
                                        zip(self._derived(limits), self._tool(limits).T, strict=True))
        most = np.maximum(np.maximum(velocity, self.sd / self.feed),
                          np.maximum(acceleration**0.5, jerk ** (1.0 / 3.0)))
        for order, ratio in enumerate(self._differences(limits), start=1):
            worst = ratio.max(axis=1) ** (1.0 / order)
            for shift in range(order + 1):
                start = REST_PAD - shift
                most = np.maximum(most, worst[start:start + len(most)])
        return np.asarray(most)

    def binding(self, limits: JointLimits) -> Binding:
        """Per sample the joint and order nearest to its limit."""
        ratios = np.stack(self._derived(limits))
        ratios = np.concatenate((ratios, self._tool(limits).T[:, :, None]), axis=2)
        joints = ratios.shape[2]
        flat = np.concatenate((ratios.transpose(1, 0, 2).reshape(len(self.t), -1), (self.sd / self.feed)[:, None]), axis=1)
        which = flat.argmax(axis=1)
        ratio = flat[np.arange(len(flat)), which]
        fed = which == 3 * joints
        axis, order = np.where(fed, -1, which % joints), np.where(fed, 1, which // joints + 1)
        order[ratio < BINDS] = 0
        return Binding(axis, order, ratio)

    def _derived(self, limits: JointLimits) -> list[Floats]:
        """(N, J) ratios of velocity, acceleration, jerk from the derivatives; a force counts as acceleration."""
        found = [np.abs(values) / getattr(limits, name)
                 for name, values in zip(ORDERS, (self.qd, self.qdd, self.qddd), strict=True)]
        if limits.forces is not None:
            found[1] = np.maximum(found[1], limits.forces.use(self.q, self.qd, self.qdd))
        return found

    def _tool(self, limits: JointLimits) -> Floats:
        """(N, 3) ratios of the tool, by order."""
        if self.tool is None or limits.tool is None:
            return np.zeros((len(self.q), len(ORDERS)))
        return limits.tool.ratios(self.tool)

    def _differences(self, limits: JointLimits) -> list[Floats]:
        """Ratios of first, second, third differences of q, padded with rest; (N + 2 REST_PAD - order, J)."""
        at = np.pad(self.q, ((REST_PAD, REST_PAD), (0, 0)), mode="edge")
        ratios = []
        for order, name in enumerate(ORDERS, start=1):
            at = np.diff(at, axis=0)
            ratios.append(np.abs(at) / (self.step**order * getattr(limits, name)))
        return ratios
