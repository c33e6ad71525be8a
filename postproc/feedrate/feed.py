"""The programmed feed as the planner sees it: the largest ds/dt along the path."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(edges="M+1", values="M")
class StepFeed:
    """Feeds of blocks: `values` (M,), each between two of the rising `edges` (M + 1,) of s."""

    edges: Floats
    values: Floats

    def __post_init__(self) -> None:
        if not np.all(np.diff(self.edges) > 0.0):
            raise ValueError("edges of feeds must rise strictly")
        if not np.all(np.asarray(self.values) > 0.0):
            raise ValueError(f"feeds must be positive, found {np.min(self.values)}")

    @property
    def breaks(self) -> Floats:
        """Where the feed changes."""
        return np.asarray(self.edges[1:-1][np.diff(self.values) != 0.0])

    def __call__(self, s: Floats) -> Floats:
        """Feed (N,) at s (N,)."""
        return np.asarray(self.values[np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.values) - 1)])


FeedLimit = float | Callable[[Floats], Floats]
"""Largest ds/dt: one number, or a function of s (N,) that returns (N,): the tip's feed, if s is the length of its path.

A function that changes suddenly has the places in an attribute `breaks` (M,), as `StepFeed`: knots are put
there, and between them it is taken to be nearly constant.
"""
TOUCH = 1e-9
"""Within this, as a share of the path between the first break and the last, a place counts to both sides of a break."""


@dataclass(frozen=True)
class AllowedFeed:
    """A feed under an override; at its breaks the lesser of both sides."""

    feed: FeedLimit
    override: float = 1.0

    def __post_init__(self) -> None:
        if not self.override > 0.0:
            raise ValueError(f"an override must be positive, found {self.override}")

    def __call__(self, s: Floats) -> Floats:
        """Largest ds/dt (N,) at s (N,)."""
        if not callable(self.feed):
            return np.full(len(s), self.override * self.feed)
        if not len(self.breaks):
            return np.asarray(self.override * self.feed(s))
        near = TOUCH * max(float(np.ptp(self.breaks)), abs(float(self.breaks[0])))
        return np.asarray(self.override * np.minimum(self.feed(s - near), self.feed(s + near)))

    @property
    def steady(self) -> bool:
        """Whether it is known to be nearly constant between its `breaks`."""
        return not callable(self.feed) or hasattr(self.feed, "breaks")

    @cached_property
    def breaks(self) -> Floats:
        """Where it changes, as far as is known."""
        return np.asarray(getattr(self.feed, "breaks", ()), dtype=np.float64)
