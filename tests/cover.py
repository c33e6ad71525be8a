"""A choice of a test's cases that shows every value of every parameter: `make test` runs that, `make slow` all of them.

    @pytest.mark.covering               # each value of each parameter at least once
    @pytest.mark.covering(together=2)   # each pair of values of two parameters that occurs
    @pytest.mark.covering(of=("machine", "control"))   # each value of these; the others are as they come
    @pytest.mark.covering(count=3)      # three of the cases, evenly, where one parameter holds samples of one kind
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from itertools import combinations

import pytest

Case = dict[str, Hashable]


def mark_slow(items: Sequence[pytest.Item]) -> None:
    """The cases of a test with the marker `covering` that the choice leaves out are slow."""
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("covering") and hasattr(item, "callspec"):
            functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in functions.values():
        marker = cases[0].get_closest_marker("covering")
        assert marker is not None
        kept = chosen([_case(item) for item in cases], **marker.kwargs)
        for n, item in enumerate(cases):
            if n not in kept:
                item.add_marker(pytest.mark.slow)


def chosen(cases: Sequence[Case], together: int = 1, count: int = 0, of: Sequence[str] = ()) -> set[int]:
    """Numbers of the cases to run: `count` evenly, or the greedy choice that shows each combination of
    `together` values; of cases that show as much the one whose values have been shown least."""
    if count:
        return {round(k * (len(cases) - 1) / max(count - 1, 1)) for k in range(count)}
    cases = [{name: case[name] for name in of or case} for case in cases]
    shown = [{tuple((name, case[name]) for name in names) for names in combinations(case, min(together, len(case)))}
             for case in cases]
    left, kept, seen = set().union(*shown), set[int](), Counter[tuple[str, Hashable]]()
    while left:
        best = max(range(len(cases)), key=lambda n: (len(shown[n] & left), -sum(seen[one] for one in cases[n].items()), -n))
        kept.add(best)
        seen.update(cases[best].items())
        left -= shown[best]
    return kept


def _case(item: pytest.Item) -> Case:
    """Values of a case by parameter."""
    return {name: _known(value) for name, value in item.callspec.params.items()}


def _known(value: object) -> Hashable:
    """A value; one that cannot be looked up is known by its place in memory, the same in all cases that share it."""
    try:
        hash(value)
    except TypeError:
        return "at", id(value)
    return value
