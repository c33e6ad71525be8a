"""The choice of cases that `make test` runs of a product: nothing that the product shows is left out of it."""

from __future__ import annotations

from itertools import combinations, product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.cover import Case, chosen, mark_slow
from tests.tiers import QUICK, mark_quick

CASES: list[Case] = [{"machine": machine, "control": control, "mode": mode}
                     for machine, control, mode in product("abcdefg", range(6), ("axes", "tcp"))]


def shown(cases: list[Case], numbers: set[int], together: int) -> set[tuple[object, ...]]:
    return {tuple((name, cases[n][name]) for name in names) for n in numbers for names in combinations(cases[0], together)}


@pytest.mark.parametrize(("together", "most"), [(1, 7), (2, 48)])
def test_every_value_and_every_pair_is_shown(together: int, most: int) -> None:
    kept = chosen(CASES, together)
    assert shown(CASES, kept, together) == shown(CASES, set(range(len(CASES))), together)
    assert len(kept) <= most


def test_values_are_shown_as_often_as_each_other() -> None:
    kept = chosen(CASES)
    assert sorted(CASES[n]["mode"] for n in kept).count("tcp") == len(kept) // 2


def test_parameters_that_do_not_count_ask_for_no_case() -> None:
    kept = chosen(CASES, of=("control", "mode"))
    assert len(kept) == 6 and {CASES[n]["control"] for n in kept} == set(range(6))


def test_a_number_of_cases_is_spread_evenly() -> None:
    assert chosen(CASES, count=3) == {0, 42, 83} and chosen(CASES[:2], count=5) == {0, 1} and chosen(CASES, count=1) == {0}


class Item:
    """As much of a test as is looked at."""

    def __init__(self, nodeid: str, marker: pytest.MarkDecorator | None, **params: object) -> None:
        self.nodeid, self.marker, self.added = nodeid, marker, list[str]()
        if params:
            self.callspec = SimpleNamespace(params=params)

    def get_closest_marker(self, name: str) -> pytest.Mark | None:
        return self.marker.mark if self.marker and name == self.marker.name else None

    def add_marker(self, marker: pytest.MarkDecorator) -> None:
        self.added.append(marker.name)


def test_the_marker_leaves_the_others_to_the_slow_tests() -> None:
    rows = list(product("ab", (1, 2)))
    one = [Item(f"a.py::one[{a}-{b}]", pytest.mark.covering, letter=a, number=b) for a, b in rows]
    two = [Item(f"a.py::two[{a}-{b}]", pytest.mark.covering(together=2), letter=a, number=b) for a, b in rows]
    plain = [Item(f"a.py::three[{a}]", None, letter=a) for a in "abc"] + [Item("a.py::four", pytest.mark.covering)]
    mark_slow([*one, *two, *plain])
    assert [item.added for item in one] == [[], ["slow"], ["slow"], []]
    assert not any(item.added for item in (*two, *plain))


def test_the_quick_tier_has_no_slow_tests() -> None:
    """Asked for by `-m quick` alone, which is said in place of `-m "not slow"`."""
    file = QUICK[0]
    items = [Item(f"{file}::one[{k}]", pytest.mark.slow if k else None) for k in range(2)]
    mark_quick([*items, Item("tests/other.py::one", None)])
    assert [item.added for item in items] == [["quick"], []]


def test_options_in_dictionaries_and_arrays_are_values_as_others() -> None:
    """Of a real product: pytest numbers such values anew in each case."""
    options: list[Any] = [{}, {"smooth": True}, ["a"], np.zeros(3), ({}, 1)]
    items = [Item(f"a.py::one[{c}-{k}]", pytest.mark.covering, control=c, option=one)
             for c in "abc" for k, one in enumerate(options)]
    mark_slow(items)
    assert len([item for item in items if not item.added]) == len(options)


@pytest.mark.covering
@pytest.mark.parametrize("option", [{}, {"smooth": True}], ids=["plain", "smooth"])
@pytest.mark.parametrize("control", range(6))
def test_pytest_gives_one_object_to_all_cases(control: int, option: dict[str, bool], request: pytest.FixtureRequest) -> None:
    own = [item for item in request.session.items if item.nodeid.partition("[")[0] == request.node.nodeid.partition("[")[0]]
    assert sum(item.get_closest_marker("slow") is None for item in own) <= 6
