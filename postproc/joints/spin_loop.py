"""Bellman's recursion over spins, backwards through a row of places."""

from __future__ import annotations

from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import loop


@loop
def cheapest_spins(cost: Floats, edges: Floats, value: Floats, choice: Ints) -> None:
    """Cost of the rest of the path from every spin of a row of N places, the last first.

    Args:
        cost: (N, S) s that each place costs by itself
        edges: (N, S, S) s from each spin to each of the next place
        value: (S,) s of the rest from the place behind the row; that from its first when done
        choice: (N, S) the next place's spin that is taken, filled here
    """
    n, count = cost.shape
    for k in range(n - 1, -1, -1):
        best = value.copy()
        for a in range(count):
            least, at = edges[k, a, 0] + value[0], 0
            for b in range(1, count):
                found = edges[k, a, b] + value[b]
                if found < least:
                    least, at = found, b
            best[a], choice[k, a] = cost[k, a] + least, at
        for a in range(count):
            value[a] = best[a]
