"""One orientation per pass, out of tables of seconds: shortest path through the passes by dynamic programming."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpaths.arrays import Floats


def shortest(states: Sequence[Floats], links: Sequence[Floats]) -> tuple[list[int], float]:
    """(state of each pass, seconds in all) of least time.

    Args:
        states: (K_n,) seconds of each state of pass n
        links: seconds between; paths[0] (1, K_0) from home, paths[n] (K_n-1, K_n), the last (K_N-1, 1) back home
    """
    best = links[0][0] + states[0]
    came = []
    for cost, link in zip([*states[1:], np.zeros(1)], links[1:], strict=True):
        through = best[:, None] + link
        came.append(through.argmin(axis=0))
        best = through.min(axis=0) + cost
    at, picked = 0, []
    for back in reversed(came):
        at = int(back[at])
        picked.append(at)
    return picked[::-1], float(best[0])


def seconds(picked: Sequence[int], states: Sequence[Floats], links: Sequence[Floats]) -> float:
    """Seconds in all of given states, added up in the order of `shortest`, so that equal choices give equal numbers."""
    total = links[0][0, picked[0]] + states[0][picked[0]]
    for n in range(1, len(picked)):
        total = total + links[n][picked[n - 1], picked[n]] + states[n][picked[n]]
    return float(total + links[-1][picked[-1], 0])


def groupwise(picked: Sequence[int], groups: Sequence[tuple[Sequence[int], Sequence[Sequence[int]]]],
              states: Sequence[Floats], links: Sequence[Floats]) -> list[int]:
    """`picked` with the states of each group of passes moved together to that of its options which costs least.

    Args:
        groups: numbers of passes, and the options: a state for each of them
        states, links: seconds as of `shortest`
    """
    result = list(picked)
    for members, options in groups:
        adjacent = sorted({n for k in members for n in (k, k + 1)})

        def local(option: Sequence[int], members: Sequence[int] = members,
                  adjacent: Sequence[int] = adjacent) -> float:
            for k, pick in zip(members, option, strict=True):
                result[k] = pick
            at = [0, *result, 0]
            return float(sum(states[k][result[k]] for k in members) + sum(links[n][at[n], at[n + 1]] for n in adjacent))

        local(min(options, key=local))
    return result
