"""What a file or a test of the suite may take of its processor time."""

from __future__ import annotations

from tests.processor_time import (
    BUDGET,
    COLLECTION,
    OF_A_FILE,
    OF_A_TEST,
    SLACK,
    USUAL,
    by_file,
    too_dear,
    too_long,
    yardstick,
)

EVEN = {COLLECTION: 20.0} | {f"tests/f{k}.py::test_{n}": 0.5 for k in range(100) for n in range(10)}


def test_an_even_suite_is_inside_its_shares() -> None:
    assert too_dear(EVEN) == [] and by_file(EVEN)["tests/f3.py"] == 5.0


def test_a_dear_file_and_a_dear_test_are_named() -> None:
    """Each by its share: a file of many small tests, and one test of a file that is cheap otherwise."""
    total = sum(EVEN.values())
    many = EVEN | {f"tests/many.py::test_{n}": 0.3 for n in range(int(1.2 * OF_A_FILE * total / 0.3))}
    assert [said.split(" takes")[0] for said in too_dear(many)] == ["tests/many.py"]
    one = EVEN | {"tests/f3.py::test_1": 1.2 * OF_A_TEST * total}
    assert [said.split(" takes")[0] for said in too_dear(one)] == ["tests/f3.py::test_1"]


def test_the_start_of_the_workers_is_no_test() -> None:
    assert too_dear(EVEN | {COLLECTION: 500.0}) == []


def test_a_run_that_takes_far_more_than_its_budget_is_named_on_slow_processors_and_on_fast_ones() -> None:
    """As many seconds as a yard takes longer are no fault; a yard that work disturbed is not the one that counts."""
    for times_slower in (0.5, 1.0, 3.0):
        yards = [times_slower * USUAL] * 4 + [9.0 * USUAL]
        assert too_long({"a": times_slower * BUDGET}, yards) == []
        assert "budget is 480 s" in too_long({"a": 1.01 * SLACK * times_slower * BUDGET}, yards)[0]


def test_the_yardstick_takes_some_time_and_not_much() -> None:
    assert 0.01 < yardstick() < 5.0
