"""Every target takes its seeds and a few changes of them: what `make fuzz` runs for hours."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.fuzz.mutate import mutated
from tests.fuzz.targets import Broken, seeds, targets

CHEAP = ("siemens", "klartext", "linuxcnc", "setup", "log", "stl", "off")


def broken(target: Callable[[bytes], None], data: bytes) -> str:
    """Which law of a target the bytes break; "" for none."""
    try:
        target(data)
    except Broken as fault:
        return str(fault)
    return ""


@pytest.mark.parametrize("name", CHEAP)
def test_changes_of_a_seed_are_read_or_refused(name: str) -> None:
    target, seed = targets()[name], min(seeds(name), key=len)
    assert [why for number in range(6) if (why := broken(target, mutated(seed, 2000, number)))] == []


def test_changes_are_the_same_again_and_differ() -> None:
    seed = seeds("iso")[1]
    made = [mutated(seed, 2000, number) for number in range(40)]
    assert made == [mutated(seed, 2000, number) for number in range(40)] and len(set(made)) > 30
    assert max(map(len, (mutated(seed * 99, 2000, number) for number in range(20)))) <= 2000


def test_a_reader_that_refuses_without_a_word_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.setup.model.load_setup", lambda path: (None, []))
    with pytest.raises(Broken, match="refused without an error"):
        targets()["setup"](b"")
