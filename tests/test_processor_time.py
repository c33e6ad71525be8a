"""What a file or a test of the suite may take of its processor time."""

from __future__ import annotations

from tests.processor_time import COLLECTION, OF_A_FILE, OF_A_TEST, by_file, too_dear, yardstick

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


def test_the_yardstick_takes_some_time_and_not_much() -> None:
    assert 0.01 < yardstick() < 5.0
